//! Measurements that come late: the filter follows the newest inertial sample at a fixed lag.
//!
//! A camera needs time for its answer, and a bus delivers out of order. Inertial samples wait in a ring, measurements
//! in a list; both have a fixed size. The filter takes everything in the order of time when it is older than the lag.
//! [`Delayed::now`] integrates the waiting samples, so that the solution for control has no lag.

use crate::filter::{DirectionMeasurement, Filter, Step, Unusable};
use crate::frames::{Fixed, Rotation, Vector, Vehicle};
use crate::strapdown::{Imu, Nominal};

/// A measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "there is no heap for the large one")]
pub enum Measurement {
    /// A direction of a camera.
    Direction(DirectionMeasurement),
    /// A position with the 1-sigma of each component, m.
    Position(Vector<Fixed>, f64),
    /// A velocity relative to the Earth with the 1-sigma of each component, m/s.
    Velocity(Vector<Fixed>, f64),
    /// An attitude with the 1-sigma about each axis, rad.
    Attitude(Rotation<Vehicle, Fixed>, f64),
}

/// What became of a measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// It moved the state.
    Taken,
    /// The gate refused it.
    Gated,
    /// The filter cannot use it.
    Unusable(Unusable),
}

/// Why a measurement was not accepted into the list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refused {
    /// It is older than the lag.
    TooLate,
    /// It is newer than the newest inertial sample by more than the lag: its clock is another one.
    FromTheFuture,
    /// The list is full. The new measurement is refused instead of an older one, because the older ones are due first.
    Full,
    /// Its time is not finite.
    NotFinite,
}

/// Counts of what happened to samples and measurements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Inertial samples that moved the state.
    pub samples: u64,
    /// Samples after a gap or with saturation, among them.
    pub gaps: u64,
    /// Samples with the time of another one.
    pub duplicates: u64,
    /// Samples that were older than the newest one.
    pub out_of_order: u64,
    /// Samples with a number that is not finite.
    pub not_finite: u64,
    /// Measurements that moved the state.
    pub taken: u64,
    /// Measurements that the gate refused.
    pub gated: u64,
    /// Measurements that were not usable.
    pub unusable: u64,
    /// Measurements that came too late.
    pub too_late: u64,
    /// Measurements whose time is in the future.
    pub future: u64,
    /// Measurements that found the list full.
    pub full: u64,
}

/// A filter with memory for S waiting samples and M waiting measurements.
///
/// ```
/// use hzn_nav::delayed::{Delayed, Measurement};
/// use hzn_nav::filter::Filter;
/// use hzn_nav::frames::{Rotation, Vector};
/// use hzn_nav::options::Options;
/// use hzn_nav::strapdown::{Imu, Nominal};
///
/// let start = Nominal {
///     time_s: 0.0,
///     attitude: Rotation::identity(),
///     velocity_m_s: Vector::zeros(),
///     position_m: Vector::new(6.9e6, 0.0, 0.0),
/// };
/// let filter = Filter::<28>::new(start, &Options::default(), &[])?;
/// let mut delayed = Delayed::<28, 16, 4>::new(filter, 0.1); // 0.1 s behind the newest sample
/// for k in 0..=20 {
///     let time_s = 0.01 * f64::from(k);
///     if k == 15 {
///         // The receiver needed 0.05 s for this position.
///         let late = Measurement::Position(start.position_m, 5.0);
///         assert!(delayed.push(time_s - 0.05, late).is_ok());
///     }
///     let imu = Imu { time_s, gyro_rad_s: Vector::zeros(), accel_m_s2: Vector::zeros() };
///     delayed.push_sample(&imu, false, |_, _, _| ());
/// }
/// assert_eq!(delayed.counts().taken, 1);
/// assert!(delayed.filter().nominal().time_s <= 0.11 && delayed.now().time_s == 0.2);
/// # Ok::<(), hzn_nav::filter::FilterError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Delayed<const N: usize, const S: usize, const M: usize> {
    filter: Filter<N>,
    lag_s: f64,
    /// The waiting samples, oldest first, with whether they were saturated.
    samples: [Option<(Imu, bool)>; S],
    waiting: usize,
    /// The waiting measurements, oldest first.
    measurements: [Option<(f64, Measurement)>; M],
    listed: usize,
    newest_s: Option<f64>,
    counts: Counts,
}

impl<const N: usize, const S: usize, const M: usize> Delayed<N, S, M> {
    /// Makes a filter that follows the newest sample by `lag_s` seconds. If S samples are shorter than the lag, the
    /// lag is that of S samples.
    pub fn new(filter: Filter<N>, lag_s: f64) -> Self {
        Self {
            filter,
            lag_s: lag_s.max(0.0),
            samples: [None; S],
            waiting: 0,
            measurements: [None; M],
            listed: 0,
            newest_s: None,
            counts: Counts::default(),
        }
    }

    /// Returns the filter, whose state is older than the newest sample by the lag.
    pub fn filter(&self) -> &Filter<N> {
        &self.filter
    }

    /// Returns the counts.
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// Returns the state at the newest sample: that of the filter, integrated with the waiting samples.
    pub fn now(&self) -> Nominal {
        // All waiting samples are integrated at each call, because each update also changes the biases that are taken
        // from them.
        let mut state = *self.filter.nominal();
        let mut from = self.filter.last_imu().map(|imu| self.filter.corrections().correct(&imu));
        for (sample, _) in self.samples.iter().take(self.waiting).flatten() {
            let to = self.filter.corrections().correct(sample);
            state = from.map_or(state, |from| state.step(&from, &to));
            from = Some(to);
        }
        state
    }

    /// Takes an inertial sample. `done` is called for each measurement that the filter has processed since.
    pub fn push_sample(&mut self, imu: &Imu, saturated: bool, mut done: impl FnMut(f64, &Measurement, Outcome)) {
        if !imu.is_finite() {
            self.counts.not_finite += 1;
            return;
        }
        // Two samples of one time have no time between them, so nothing could be interpolated there.
        match self.newest_s {
            Some(newest) if imu.time_s == newest => self.counts.duplicates += 1,
            Some(newest) if imu.time_s < newest => self.counts.out_of_order += 1,
            _ => {
                self.newest_s = Some(imu.time_s);
                // A full ring shortens the lag instead of losing a sample, because a turn that is lost is never
                // integrated.
                if self.waiting == S {
                    self.take_oldest(&mut done);
                }
                if let Some(slot) = self.samples.get_mut(self.waiting) {
                    *slot = Some((*imu, saturated));
                    self.waiting += 1;
                } else {
                    // Without a ring, the filter follows at once.
                    self.step_to(imu, saturated, &mut done);
                }
                while self.oldest_is_due(imu.time_s) {
                    self.take_oldest(&mut done);
                }
            }
        }
    }

    /// Takes a measurement at a time of the inertial unit's clock.
    ///
    /// # Errors
    /// The measurement is not processed: see [`Refused`].
    pub fn push(&mut self, time_s: f64, measurement: Measurement) -> Result<(), Refused> {
        // The filter does not go back, so a measurement from before its state is too late. Before the first sample the
        // state has no time yet. A filter without lag gets a measurement before its sample, so a second is allowed.
        let refused = if !time_s.is_finite() {
            Some(Refused::NotFinite)
        } else if self.filter.last_imu().is_some() && time_s < self.filter.nominal().time_s {
            Some(Refused::TooLate)
        } else if self.newest_s.is_some_and(|newest| time_s > newest + self.lag_s.max(1.0)) {
            Some(Refused::FromTheFuture)
        } else if self.listed == M {
            Some(Refused::Full)
        } else {
            None
        };
        if let Some(refused) = refused {
            let counts = &mut self.counts;
            match refused {
                Refused::TooLate => counts.too_late += 1,
                Refused::FromTheFuture => counts.future += 1,
                Refused::Full => counts.full += 1,
                Refused::NotFinite => counts.unusable += 1,
            }
            return Err(refused);
        }
        // Sorted by time; measurements of one time keep their order.
        let place = self.measurements.iter().take(self.listed).flatten().filter(|(t, _)| *t <= time_s).count();
        if let Some(later @ [_, ..]) = self.measurements.get_mut(place..=self.listed) {
            later.rotate_right(1);
            if let Some(slot) = later.first_mut() {
                *slot = Some((time_s, measurement));
                self.listed += 1;
            }
        }
        Ok(())
    }

    /// Takes everything that waits, for the end of a recording: no newer sample would make it due.
    pub fn finish(&mut self, mut done: impl FnMut(f64, &Measurement, Outcome)) {
        while self.waiting > 0 {
            self.take_oldest(&mut done);
        }
    }

    fn oldest_is_due(&self, newest_s: f64) -> bool {
        let oldest = self.samples.first().copied().flatten().filter(|_| self.waiting > 0);
        oldest.is_some_and(|(imu, _)| imu.time_s <= newest_s - self.lag_s)
    }

    fn take_oldest(&mut self, done: &mut impl FnMut(f64, &Measurement, Outcome)) {
        let Some((imu, saturated)) = self.samples.first().copied().flatten() else { return };
        remove_first(&mut self.samples, &mut self.waiting);
        self.step_to(&imu, saturated, done);
    }

    /// Moves the filter to a sample, and to the measurements on the way.
    fn step_to(&mut self, imu: &Imu, saturated: bool, done: &mut impl FnMut(f64, &Measurement, Outcome)) {
        while let Some((time_s, measurement)) = self.measurements.first().copied().flatten() {
            if self.listed == 0 || time_s > imu.time_s {
                break;
            }
            remove_first(&mut self.measurements, &mut self.listed);
            // The filter stops at the time of the measurement, because a vehicle that spins turns by degrees between
            // two samples.
            if let Some(last) = self.filter.last_imu()
                && time_s > last.time_s
                && time_s < imu.time_s
            {
                let part = (time_s - last.time_s) / (imu.time_s - last.time_s);
                self.predict(&mix(&last, imu, part), saturated);
            } else if self.filter.last_imu().is_none() || time_s == imu.time_s {
                self.predict(imu, saturated);
            }
            let outcome = self.update(&measurement);
            done(time_s, &measurement, outcome);
        }
        if self.filter.last_imu().is_none_or(|last| last.time_s < imu.time_s) {
            self.predict(imu, saturated);
        }
        self.counts.samples += 1;
    }

    fn predict(&mut self, imu: &Imu, saturated: bool) {
        if self.filter.predict(imu, saturated) == Step::TakenWithGap {
            self.counts.gaps += 1;
        }
    }

    fn update(&mut self, measurement: &Measurement) -> Outcome {
        let taken = match measurement {
            Measurement::Direction(m) => self.filter.update_direction(m).map(|i| i.taken),
            Measurement::Position(x, sigma) => self.filter.update_position(x, *sigma).map(|i| i.taken),
            Measurement::Velocity(v, sigma) => self.filter.update_velocity(v, *sigma).map(|i| i.taken),
            Measurement::Attitude(q, sigma) => self.filter.update_attitude(q, *sigma).map(|i| i.taken),
        };
        match taken {
            Ok(true) => {
                self.counts.taken += 1;
                Outcome::Taken
            }
            Ok(false) => {
                self.counts.gated += 1;
                Outcome::Gated
            }
            Err(why) => {
                self.counts.unusable += 1;
                Outcome::Unusable(why)
            }
        }
    }
}

/// Removes the first of the entries, whose number this is. The entries move, so that they are in order for
/// [`Delayed::now`] and for the search of a place; there are some tens of them.
fn remove_first<T>(list: &mut [T], entries: &mut usize) {
    if let Some(filled @ [_, ..]) = list.get_mut(..*entries) {
        filled.rotate_left(1);
        *entries -= 1;
    }
}

/// Returns the sample at a part of the way between two.
fn mix(from: &Imu, to: &Imu, part: f64) -> Imu {
    // Linear, because a strapdown step also takes rate and force as linear between two samples.
    let between = |a: Vector<Vehicle>, b: Vector<Vehicle>| a + (b - a) * part;
    Imu {
        time_s: from.time_s + (to.time_s - from.time_s) * part,
        gyro_rad_s: between(from.gyro_rad_s, to.gyro_rad_s),
        accel_m_s2: between(from.accel_m_s2, to.accel_m_s2),
    }
}
