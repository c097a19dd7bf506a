//! The filter over the samples and measurements of a flight.

use hzn_nav::filter::{DirectionMeasurement, Filter, Unusable};
use hzn_nav::frames::{Covariance, Fixed, Rotation, Vector, Vehicle};
use hzn_nav::gravity::gravity;
use hzn_nav::options::{CameraOptions, StartSigmas};
use hzn_nav::strapdown::Imu;
use hzn_nav::vectors::{Direction, triad};
use nalgebra::SMatrix;

use super::first::{first_attitude, sight_sigma};
use super::lost::{Lost, refused_in_a_row};
use super::unaided::{UNAIDED, unaided};
use crate::data::Flight;
use crate::error::Error;
use crate::events::{Event, Source, mix};
use crate::input::{Body, Recording, Sample, Seen};
use crate::reference::limb_axis;
use crate::results::{Begin, Epoch, Fused, Innovation, Kind, Triad, Unaided};
use crate::settings::{Limb, Settings};
use crate::smooth::Recorded;
use crate::start::{DeadReckoning, Sight, Sighted, attitude};
use crate::track::Track;

/// Longest time between limb and Sun for a pair without the filter, s.
const PAIR_S: f64 = 0.6;

/// Whether the filter could use a measurement, or why not.
type Used = Result<(), &'static str>;

/// What a run leaves.
pub(super) struct Ran<const N: usize> {
    pub(super) fused: Fused,
    pub(super) recorded: Vec<Recorded<N>>,
    pub(super) track: Track,
}

/// A filter on its way through a flight.
pub(super) struct Runner<'a, const N: usize> {
    flight: Flight<'a>,
    settings: &'a Settings,
    cameras: Vec<CameraOptions>,
    /// The bodies of each camera, in the order of their slow errors.
    bodies: Vec<Vec<Body>>,
    filter: Filter<N>,
    begin: Begin,
    reckoning: DeadReckoning,
    /// The strapdown solution without any aid: a filter that takes no measurement.
    unaided: Filter<UNAIDED>,
    last: Option<Imu>,
    /// The last sights, for a new start.
    sights: Vec<Sight>,
    /// Directions since the last (new) start: their body, and whether the gate took them.
    verdicts: Vec<(Body, bool)>,
    /// The same for the attitudes of a star tracker.
    attitude_verdicts: Vec<bool>,
    lost: Lost,
    record: bool,
    recorded: Vec<Recorded<N>>,
    track: Track,
    transition: SMatrix<f64, N, N>,
    begins: bool,
    max_step_s: f64,
    out: Fused,
}

impl<'a, const N: usize> Runner<'a, N> {
    /// Finds the first attitude and makes a filter there.
    pub(super) fn new(flight: &Flight<'a>, settings: &'a Settings, record: bool) -> Result<Self, Error> {
        let bodies: Vec<Vec<Body>> = flight.inputs.recordings.iter().map(Recording::bodies).collect();
        let cameras = flight.cameras(settings);
        let reckoning = DeadReckoning::new(flight.samples);
        let found = first_attitude(flight, settings, &cameras, &reckoning)?;
        let sigmas = StartSigmas {
            attitude_rad: settings.start.attitude_deg.to_radians(),
            velocity_m_s: found.velocity_sigma_m_s,
            position_m: found.position_sigma_m,
        };
        let mut filter =
            Filter::<N>::new(found.state, &flight.options(settings, sigmas), &cameras).map_err(Error::unusable)?;
        let least = Covariance::isotropic(sigmas.attitude_rad.powi(2));
        let covariance_rad2 = found.covariance_rad2 + least;
        filter.set_attitude(&found.state.attitude, &covariance_rad2);
        let unaided = unaided(&found.state, &flight.options(settings, sigmas), &covariance_rad2)?;
        Ok(Self {
            flight: *flight,
            settings,
            cameras,
            bodies,
            unaided,
            filter,
            begin: found.begin,
            reckoning,
            last: None,
            sights: Vec::new(),
            verdicts: Vec::new(),
            attitude_verdicts: Vec::new(),
            lost: Lost::default(),
            record,
            recorded: Vec::new(),
            track: Track::default(),
            transition: SMatrix::identity(),
            begins: true,
            max_step_s: settings.imu.max_step_s,
            out: Fused::default(),
        })
    }

    /// Runs to the end.
    pub(super) fn run(mut self, rate_hz: Option<f64>) -> Result<Ran<N>, Error> {
        let (samples, events) = (self.flight.samples, self.flight.events);
        let begin_s = self.begin.time_s;
        let first = samples.partition_point(|s| s.imu.time_s <= begin_s);
        let mut pending = events.iter().skip_while(|e| e.time_s <= begin_s).peekable();
        self.out.counts.before_start = events.iter().filter(|e| e.time_s <= begin_s).count();
        // The sample at the start lies between two samples.
        let around = |i: usize| samples.get(i).copied();
        if let Some(before) = first.checked_sub(1).and_then(around) {
            let at = around(first).map_or(before.imu, |after| mix(&before.imu, &after.imu, begin_s));
            self.predict(&Imu { time_s: begin_s, ..at }, before.saturated);
        }
        self.push_epoch();
        self.track.states.push(*self.filter.nominal());
        let begin = self.filter.clone();
        let mut due_s = begin_s;
        for sample in samples.iter().skip(first) {
            while let Some(event) = pending.next_if(|e| e.time_s <= sample.imu.time_s) {
                self.advance(sample, event.time_s);
                self.measure(event);
                self.track.states.push(*self.filter.nominal());
            }
            self.advance(sample, sample.imu.time_s);
            if rate_hz.is_none_or(|hz| sample.imu.time_s >= due_s + 1.0 / hz - 1e-6) {
                due_s = sample.imu.time_s;
                self.push_epoch();
            }
        }
        self.out.begin = Some(self.begin);
        self.track.finish(&self.filter);
        self.go_back(begin, rate_hz);
        Ok(Ran { fused: self.out, recorded: self.recorded, track: self.track })
    }

    /// Moves the filter to a time up to that of the next sample.
    fn advance(&mut self, next: &Sample, time_s: f64) {
        let imu = match self.last {
            Some(last) if time_s <= last.time_s => return,
            Some(last) if time_s < next.imu.time_s => mix(&last, &next.imu, time_s),
            _ => next.imu,
        };
        self.predict(&imu, next.saturated);
    }

    fn predict(&mut self, imu: &Imu, saturated: bool) {
        let imu = &self.usable(imu, &self.filter);
        let step = if self.record {
            self.filter.predict_recorded(imu, saturated, &mut self.transition)
        } else {
            self.filter.predict(imu, saturated)
        };
        if self.lost.see(step, &self.filter) {
            // How the vehicle has turned since these sights is not known.
            self.sights.clear();
        }
        self.unaided.predict(imu, saturated);
        self.last = Some(*imu);
    }

    /// Goes back from the start, with the instruments' errors as they are known at the end. Their sigmas stay those of
    /// the start, because nobody knows how the errors of the first attitude and of the last estimates are correlated. A
    /// saturated unit and a gap do not say how the vehicle turned, so the way back ends there.
    fn go_back(&mut self, mut filter: Filter<N>, rate_hz: Option<f64>) {
        filter.set_corrections(self.filter.corrections());
        let begin_s = self.begin.time_s;
        let earlier = self.flight.samples.partition_point(|s| s.imu.time_s < begin_s);
        let mut back = vec![Epoch::of(&filter, None)];
        let mut due_s = begin_s;
        for sample in self.flight.samples.iter().take(earlier).rev() {
            let now_s = filter.nominal().time_s;
            let is_gap = now_s - sample.imu.time_s > self.max_step_s;
            if sample.saturated || is_gap {
                let why =
                    if is_gap { "samples of the inertial unit are missing" } else { "the inertial unit is saturated" };
                let what = "the solution before the start ends at";
                self.out.notes.push(format!("{what} {now_s:.1} s: {why} before it"));
                break;
            }
            filter.predict_back(&self.usable(&sample.imu, &filter), false);
            if rate_hz.is_none_or(|hz| sample.imu.time_s <= due_s - 1.0 / hz + 1e-6) {
                due_s = sample.imu.time_s;
                back.push(Epoch::of(&filter, None));
            }
        }
        back.reverse();
        self.out.back = back;
    }

    /// Returns a sample as the filter takes it. Without a receiver the position is not known, and a fall from a wrong
    /// place would end in the Earth: a force then holds the vehicle where it is. The attitude does not depend on the
    /// force.
    fn usable(&self, imu: &Imu, filter: &Filter<N>) -> Imu {
        if self.flight.inputs.has_receiver() {
            return *imu;
        }
        let state = filter.nominal();
        Imu { accel_m_s2: state.attitude.inverse() * -gravity(&state.position_m), ..*imu }
    }

    fn push_epoch(&mut self) {
        self.out.epochs.push(Epoch::of(&self.filter, Some(Unaided::of(&self.unaided))));
    }

    /// Takes a measurement at the time of the filter.
    fn measure(&mut self, event: &Event) {
        if let (true, Some((_, measurement))) = (self.record, self.direction(event)) {
            // The covariance before the update already has the slow error of this direction.
            let _ = self.filter.prepare_direction(&measurement, &mut self.transition);
        }
        let before = self.record.then(|| self.filter.clone());
        let used = match event.source {
            Source::Camera(camera, index) => self.measure_camera(event, camera, index),
            Source::Gnss(index) => self.measure_fix(event.time_s, index),
            Source::Attitude(index) => self.measure_attitude(event.time_s, index),
        };
        if let Err(why) = used {
            self.out.counts.add_unusable(self.source_name(event.source), why, 1);
        }
        if let Some(before) = before {
            self.recorded.push(Recorded {
                before,
                after: self.filter.clone(),
                transition: self.transition,
                begins: self.begins,
                unaided: Some(Unaided::of(&self.unaided)),
            });
            self.transition = SMatrix::identity();
            self.begins = false;
        }
    }

    /// Returns the name of a source for the counts.
    fn source_name(&self, source: Source) -> String {
        match source {
            Source::Camera(camera, index) => {
                let recording = self.flight.inputs.recordings.get(camera);
                let body = recording.and_then(|r| r.seen.get(index)).map_or("", |seen| seen.body.name());
                format!("{}, {body}", recording.map_or("", |r| &r.name))
            }
            Source::Gnss(_) => "gnss".to_owned(),
            Source::Attitude(_) => Kind::Attitude.name().to_owned(),
        }
    }

    /// Returns the direction of an event, and how the filter takes it; `None` for a source without a direction.
    fn direction(&self, event: &Event) -> Option<(Seen, DirectionMeasurement)> {
        let Source::Camera(camera, index) = event.source else { return None };
        let recording = self.flight.inputs.recordings.get(camera)?;
        let seen = *recording.seen.get(index)?;
        if seen.centre.is_some() && self.settings.camera(&recording.name).limb == Limb::Position {
            return None;
        }
        let position_m = self.filter.nominal().position_m;
        let by_position = || limb_axis(seen.body, &position_m).filter(|_| self.flight.inputs.has_receiver());
        let measurement = DirectionMeasurement {
            camera,
            body: self.bodies.get(camera)?.iter().position(|body| *body == seen.body)?,
            measured: seen.axis,
            reference: seen.reference.or_else(by_position)?,
            covariance_rad2: seen.covariance_rad2,
            common_rad2: seen.common_rad2,
            by_limb_height: seen.by_limb_height,
            is_limb: seen.body == Body::Limb,
        };
        Some((seen, measurement))
    }

    fn measure_camera(&mut self, event: &Event, camera: usize, index: usize) -> Used {
        let time_s = event.time_s;
        let Some((seen, measurement)) = self.direction(event) else {
            return self.measure_centre(time_s, camera, index);
        };
        let reference = measurement.reference;
        if !measurement.is_finite() {
            return Err(Unusable::NotFinite.as_str());
        }
        let told = self.cameras.get(camera).map_or_else(Rotation::identity, |c| c.mount);
        let mount = self.filter.camera(camera).map_or(told, |c| c.mount);
        let angle = (self.filter.nominal().attitude * mount * seen.axis).angle_rad(&reference);
        let unaided = (self.unaided.nominal().attitude * told * seen.axis).angle_rad(&reference);
        let sigma_rad = sight_sigma(&seen, self.cameras.get(camera));
        let sight = Sight { time_s, camera, body: seen.body, on_vehicle: mount * seen.axis, reference, sigma_rad };
        self.pair(&sight);
        self.sights.push(sight);
        self.sights.retain(|s| s.time_s > time_s - self.settings.start.window_s);
        if self.lost.is_unknown(&self.filter) {
            // The equations of the update hold for small angles; they would spoil the mounts.
            self.out.counts.waiting += 1;
            self.begin_again(time_s, "the attitude was not known any more", false);
            return Ok(());
        }
        let done = self.filter.update_direction(&measurement).map_err(Unusable::as_str)?;
        self.keep(time_s, Some(camera), Kind::Direction(seen.body), &done);
        if let Some(innovation) = self.out.innovations.last_mut() {
            innovation.angle_rad = Some(angle);
            innovation.unaided_rad = Some(unaided);
            innovation.sensor_sigma_rad =
                Some(seen.covariance_rad2.as_inner().symmetric_eigenvalues().max().max(0.0).sqrt());
        }
        self.verdicts.push((seen.body, done.taken));
        self.restart_if_lost(time_s, seen.body);
        Ok(())
    }

    /// Takes the position of the body's centre.
    fn measure_centre(&mut self, time_s: f64, camera: usize, index: usize) -> Used {
        let seen = self.flight.inputs.recordings.get(camera).and_then(|r| r.seen.get(index));
        let Some(centre) = seen.and_then(|seen| seen.centre) else {
            self.out.counts.without_reference += 1;
            return Ok(());
        };
        let done = self.filter.update_centre(camera, &centre.position_m, &centre.covariance_m2);
        self.keep(time_s, Some(camera), Kind::Centre, &done.map_err(Unusable::as_str)?);
        Ok(())
    }

    /// Makes an attitude of two directions at almost one time, without the filter.
    fn pair(&mut self, sight: &Sight) {
        let other = self.sights.iter().rev().find(|s| s.body != sight.body && sight.time_s - s.time_s < PAIR_S);
        let Some(other) = other else { return };
        let earlier = self.reckoning.at(sight.time_s).inverse() * self.reckoning.at(other.time_s);
        let direction =
            |s: &Sight, vehicle: Vector<Vehicle>| Direction { vehicle, reference: s.reference, sigma_rad: s.sigma_rad };
        let mut both = [direction(sight, sight.on_vehicle), direction(other, earlier * other.on_vehicle)];
        both.sort_by(|a, b| a.sigma_rad.total_cmp(&b.sigma_rad));
        let [first, second] = both;
        if let Some(attitude) = triad(&first, &second) {
            let angle_rad = attitude.angle_to(&self.filter.nominal().attitude);
            let unaided_rad = attitude.angle_to(&self.unaided.nominal().attitude);
            self.out.triads.push(Triad { time_s: sight.time_s, attitude, angle_rad, unaided_rad });
        }
    }

    /// Begins again if the gate refuses almost everything, or every direction to one body. A false first attitude can
    /// agree with all limbs: only the Sun shows then that the third axis is wrong.
    fn restart_if_lost(&mut self, time_s: f64, body: Body) {
        let many = self.settings.restart_after as usize;
        if let Some(recent) = self.verdicts.len().checked_sub(many).and_then(|from| self.verdicts.get(from..)) {
            let refused = recent.iter().filter(|(_, taken)| !*taken).count();
            if refused * 5 >= many * 4 {
                return self.begin_again(time_s, &format!("{refused} of {many} directions were refused"), true);
            }
        }
        let own = self.verdicts.iter().filter(|(b, _)| *b == body).map(|(_, taken)| *taken);
        if let Some(in_a_row) = refused_in_a_row(own, many) {
            let why = format!("{in_a_row} directions in a row to the {} were refused", body.name());
            self.begin_again(time_s, &why, true);
        }
    }

    /// Begins again with the attitude of the last directions, if they determine one and agree on it. `was_wrong` says
    /// that the attitude before was refused, and not only unknown.
    fn begin_again(&mut self, time_s: f64, why: &str, was_wrong: bool) {
        let Sighted::Attitude(wahba, _) = attitude(&self.sights, &self.reckoning) else { return };
        let least = Covariance::isotropic(self.settings.start.attitude_deg.to_radians().powi(2));
        self.begin_at(time_s, &wahba.attitude, &(wahba.covariance_rad2 + least), why, was_wrong);
    }

    /// Begins again with an attitude and its covariance.
    fn begin_at(
        &mut self,
        time_s: f64,
        attitude: &Rotation<Vehicle, Fixed>,
        covariance_rad2: &Covariance<Fixed>,
        why: &str,
        was_wrong: bool,
    ) {
        self.filter.set_attitude(attitude, covariance_rad2);
        self.lost = Lost::default();
        self.verdicts.clear();
        self.attitude_verdicts.clear();
        self.begins = true;
        self.track.restarts.push((self.track.states.len(), was_wrong));
        self.out.counts.restarts += 1;
        self.out.counts.restarts_when_wrong += usize::from(was_wrong);
        // While the samples stay saturated, it begins again with each measurement: one note is enough.
        if !self.out.notes.last().is_some_and(|last| last.ends_with(why)) {
            self.out.notes.push(format!("at {time_s:.1} s the filter began again: {why}"));
        }
    }

    fn measure_fix(&mut self, time_s: f64, index: usize) -> Used {
        let Some(fix) = self.flight.inputs.gnss.get(index) else { return Ok(()) };
        self.lost.keep_from_receiver(&mut self.filter);
        let [position_sigma, velocity_sigma] = self.settings.fix_sigmas(fix);
        let done = self.filter.update_position(&fix.position_m, position_sigma).map_err(Unusable::as_str)?;
        self.keep(time_s, None, Kind::Position, &done);
        if fix.velocity_m_s.is_finite() {
            let done = self.filter.update_velocity(&fix.velocity_m_s, velocity_sigma).map_err(Unusable::as_str)?;
            self.keep(time_s, None, Kind::Velocity, &done);
        }
        Ok(())
    }

    fn measure_attitude(&mut self, time_s: f64, index: usize) -> Used {
        let Some(seen) = self.flight.inputs.attitudes.get(index) else { return Ok(()) };
        let attitude = seen.fixed_from_vehicle.ok_or("qw, qx, qy, qz are not a unit quaternion")?;
        let covariance_rad2 = Covariance::isotropic(seen.sigma_rad.powi(2));
        if self.lost.is_unknown(&self.filter) {
            let why = "an attitude of the star tracker came after the attitude was not known any more";
            self.begin_at(time_s, &attitude, &covariance_rad2, why, false);
            return Ok(());
        }
        let done = self.filter.update_attitude(&attitude, seen.sigma_rad).map_err(Unusable::as_str)?;
        self.keep(time_s, None, Kind::Attitude, &done);
        self.attitude_verdicts.push(done.taken);
        let many = self.settings.restart_after as usize;
        if let Some(in_a_row) = refused_in_a_row(self.attitude_verdicts.iter().copied(), many) {
            let why = format!("{in_a_row} attitudes of the star tracker in a row were refused");
            self.begin_at(time_s, &attitude, &covariance_rad2, &why, true);
        }
        Ok(())
    }

    fn keep<const M: usize>(
        &mut self,
        time_s: f64,
        camera: Option<usize>,
        kind: Kind,
        done: &hzn_nav::filter::Innovation<M>,
    ) {
        self.out.innovations.push(Innovation {
            time_s,
            camera,
            kind,
            value: done.value.iter().copied().collect(),
            sigma: done.covariance.diagonal().iter().map(|v| v.max(0.0).sqrt()).collect(),
            nis: done.nis,
            taken: done.taken,
            angle_rad: None,
            unaided_rad: None,
            sensor_sigma_rad: None,
        });
    }
}
