//! The directions, attitudes and windows of an adjustment.

use hzn_nav::filter::{LatitudeTerm, RADIUS_KM};
use hzn_nav::frames::{Fixed, Vector};
use hzn_nav::options::{CameraOptions, Mode, Options};
use hzn_nav::vectors::{Direction, davenport};
use nalgebra::{DVector, UnitQuaternion, Vector3};

use super::motion::{Integrals, Reckoning, receiver_at};
use super::state::{Shared, State};
use crate::input::{Body, Inputs, Recording, Seen};
use crate::reference::limb_axis;
use crate::start::AtFirst;

pub(super) use hzn_nav::gravity::EARTH_RATE_RAD_S;

/// Shortest length of a window, s: the gyros' noise in it is smaller than a direction's error.
const WINDOW_S: f64 = 30.0;
/// Windows of a long flight. The time of an adjustment grows with the cube of their number, so that they become longer
/// instead; the gyros' noise in them widens the sigmas.
const MOST_WINDOWS: f64 = 40.0;
/// Most directions of a camera to a body: more would say little new, because their errors are correlated.
const MOST_LOOKS: usize = 150;
/// Sigma of an error that does not exist.
const NONE: f64 = 1e-9;

/// A direction.
#[derive(Debug, Clone)]
pub(super) struct Look {
    pub(super) time_s: f64,
    pub(super) camera: usize,
    pub(super) window: usize,
    pub(super) is_celestial: bool,
    /// In the camera frame.
    pub(super) measured: Vector3<f64>,
    /// Its derivative by the limb height, 1/km.
    pub(super) by_height: Vector3<f64>,
    /// By each coefficient of the latitude: the limb height, and the tilt of the axis from outside in the frame of the
    /// reference, rad/km.
    pub(super) by_latitude: [(f64, Vector3<f64>); 2],
    /// The told mount.
    pub(super) mount: UnitQuaternion<f64>,
    /// Direction from outside, in a frame that does not turn.
    pub(super) reference: Vector3<f64>,
    /// White and slow error, without those of the gyros; rad.
    own_sigma: f64,
    /// 1-sigma with the gyros' errors since the middle of the window, rad.
    pub(super) sigma: f64,
    /// The unit's integrals at its time.
    pub(super) integrals: Integrals,
}

/// An attitude of the star tracker.
#[derive(Debug, Clone)]
pub(super) struct Tracked {
    pub(super) time_s: f64,
    pub(super) window: usize,
    /// From the vehicle to the frame that does not turn.
    pub(super) attitude: UnitQuaternion<f64>,
    own_sigma: f64,
    pub(super) sigma: f64,
    pub(super) integrals: Integrals,
}

/// Everything that an adjustment knows.
#[derive(Debug, Clone)]
pub(super) struct Problem {
    pub(super) shared: Shared,
    pub(super) reckoning: Reckoning,
    pub(super) looks: Vec<Look>,
    pub(super) tracked: Vec<Tracked>,
    /// The integrals in the middle of each window.
    pub(super) windows: Vec<Integrals>,
    /// Times at which the windows begin.
    begins_s: Vec<f64>,
    /// 1-sigma of each shared error.
    pub(super) sigmas: Vec<f64>,
    options: Options,
}

/// Returns the rotation of the Earth in a time.
pub(super) fn about_pole(time_s: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), EARTH_RATE_RAD_S * time_s)
}

impl Problem {
    /// Collects the directions; `None` without any.
    pub(super) fn new(
        inputs: &Inputs,
        cameras: &[CameraOptions],
        options: &Options,
        reckoning: Reckoning,
    ) -> Option<Self> {
        let [from_s, to_s] = reckoning.span_s()?;
        let mut looks = Vec::new();
        for (number, (recording, camera)) in inputs.recordings.iter().zip(cameras).enumerate() {
            for body in recording.bodies() {
                let is_inside = |seen: &&Seen| {
                    (from_s..=to_s).contains(&(seen.time_s + recording.clock_offset_s)) && seen.body == body
                };
                let seen: Vec<&Seen> = recording.seen.iter().filter(is_inside).collect();
                looks.extend(of_body(inputs, recording, number, camera, &seen, &reckoning));
            }
        }
        looks.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        let tracked = inputs.attitudes.iter().filter(|a| (from_s..=to_s).contains(&a.time_s)).filter_map(|a| {
            let attitude = about_pole(a.time_s) * a.fixed_from_vehicle?.into_inner();
            let integrals = reckoning.at(a.time_s)?;
            let sigma = a.sigma_rad.max(NONE);
            Some(Tracked { time_s: a.time_s, window: 0, attitude, own_sigma: sigma, sigma, integrals })
        });
        let tracked: Vec<Tracked> = tracked.collect();
        let tracked = thinned(&tracked.iter().collect::<Vec<_>>()).into_iter().cloned().collect();
        let shared = Shared { cameras: cameras.len() };
        let sigmas = sigmas(shared, cameras, options);
        let mut problem = Self {
            shared,
            reckoning,
            looks,
            tracked,
            windows: Vec::new(),
            begins_s: Vec::new(),
            sigmas,
            options: *options,
        };
        problem.place_windows();
        (!problem.windows.is_empty()).then_some(problem)
    }

    /// Returns the same problem with rates that are multiplied by a matrix.
    pub(super) fn with_reckoning(&self, reckoning: Reckoning) -> Self {
        let mut other = Self { reckoning, ..self.clone() };
        other.place_windows();
        other
    }

    /// Divides the flight into windows. In none the rate is unknown for a time.
    fn place_windows(&mut self) {
        let mut times: Vec<f64> =
            self.looks.iter().map(|l| l.time_s).chain(self.tracked.iter().map(|t| t.time_s)).collect();
        times.sort_by(f64::total_cmp);
        let span_s = times.last().zip(times.first()).map_or(0.0, |(last_s, first_s)| last_s - first_s);
        let window_s = WINDOW_S.max(span_s / MOST_WINDOWS);
        let unknown = |time_s: f64| self.reckoning.at(time_s).map_or(0.0, |i| i.unknown_s);
        let (mut begins_s, mut ends_s): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
        for time_s in times {
            let is_new = begins_s
                .last()
                .zip(ends_s.last())
                .is_none_or(|(begin_s, end_s)| time_s - begin_s > window_s || unknown(time_s) - unknown(*end_s) > 1e-9);
            if is_new {
                begins_s.push(time_s);
                ends_s.push(time_s);
            } else if let Some(end_s) = ends_s.last_mut() {
                *end_s = time_s;
            }
        }
        let middle = |(begin_s, end_s): (&f64, &f64)| self.reckoning.at(0.5 * (begin_s + end_s));
        self.windows = begins_s.iter().zip(&ends_s).filter_map(middle).collect();
        self.begins_s = begins_s;
        let [gyro_white, gyro_rest] = self.options.imu.gyro_noise;
        let misalignment = sigma_of(self.options.imu.gyro_misalignment);
        let place = |time_s: f64| self.begins_s.partition_point(|begin_s| *begin_s <= time_s).saturating_sub(1);
        let drift = |now: &Integrals, middle: Option<&Integrals>| {
            let Some(middle) = middle else { return 0.0 };
            let noise = gyro_white.hypot(gyro_rest) * (now.time_s - middle.time_s).abs().sqrt();
            noise.hypot(misalignment * (now.turned_rad - middle.turned_rad).abs())
        };
        for look in &mut self.looks {
            look.window = place(look.time_s);
            look.integrals = self.reckoning.at(look.time_s).unwrap_or(look.integrals);
            look.sigma = look.own_sigma.hypot(drift(&look.integrals, self.windows.get(look.window)));
        }
        for tracked in &mut self.tracked {
            tracked.window = place(tracked.time_s);
            tracked.integrals = self.reckoning.at(tracked.time_s).unwrap_or(tracked.integrals);
            tracked.sigma = tracked.own_sigma.hypot(drift(&tracked.integrals, self.windows.get(tracked.window)));
        }
    }

    /// Returns the 1-sigma of the rotation between two windows, rad.
    pub(super) fn carried_sigma(&self, a: &Integrals, b: &Integrals) -> f64 {
        let imu = &self.options.imu;
        let [white, rest] = imu.gyro_noise;
        let noise = white.hypot(rest) * (b.time_s - a.time_s).max(0.0).sqrt();
        let turned = sigma_of(imu.gyro_misalignment) * (b.turned_rad - a.turned_rad);
        noise.hypot(turned).hypot(imu.gap_rate_rad_s * (b.unknown_s - a.unknown_s)).max(1e-6)
    }

    /// Returns a state with these shared errors, whose windows have the attitudes of their own directions. A window
    /// that determines none has that of the window before it. `None` if no window determines one.
    pub(super) fn begin(&self, shared: DVector<f64>) -> Option<State> {
        let own: Vec<Option<UnitQuaternion<f64>>> =
            (0..self.windows.len()).map(|w| self.own_attitude(&shared, w)).collect();
        let mut last = *own.iter().flatten().next()?;
        let windows = own
            .into_iter()
            .map(|attitude| {
                last = attitude.unwrap_or(last);
                last
            })
            .collect();
        Some(State { windows, shared })
    }

    fn own_attitude(&self, shared: &DVector<f64>, window: usize) -> Option<UnitQuaternion<f64>> {
        if let Some(tracked) = self.tracked.iter().find(|t| t.window == window) {
            return Some(tracked.attitude * tracked.integrals.attitude.into_inner().inverse());
        }
        let looks = self.looks.iter().filter(|look| look.window == window);
        let directions: Vec<Direction<AtFirst, Fixed>> = looks
            .map(|look| Direction {
                vehicle: self.on_unit(shared, look).0.direction.into(),
                reference: self.reference(shared, look).into(),
                sigma_rad: look.sigma,
            })
            .collect();
        Some(davenport(&directions)?.attitude.into_inner())
    }
}

/// Returns the directions of a camera to one body.
fn of_body(
    inputs: &Inputs,
    recording: &Recording,
    number: usize,
    camera: &CameraOptions,
    seen: &[&Seen],
    reckoning: &Reckoning,
) -> Vec<Look> {
    let seen = thinned(seen);
    let (Some(first), Some(last)) = (seen.first(), seen.last()) else { return Vec::new() };
    // Slow errors count once in twice their correlation time.
    let step_s = (last.time_s - first.time_s) / (seen.len().max(2) - 1) as f64;
    let in_common = (2.0 * camera.slow_error_time_s / step_s.max(1e-3)).clamp(1.0, seen.len() as f64);
    let look = |seen: &&Seen| {
        let time_s = seen.time_s + recording.clock_offset_s;
        let receiver = || limb_axis(seen.body, &receiver_at(&inputs.gnss, time_s)?.0);
        let reference = seen.reference.or_else(receiver)?.try_normalize(1e-6)?;
        let measured = seen.axis.try_normalize(1e-6)?;
        let [slow, white] = seen.largest_variances_rad2();
        let own_sigma = (slow * in_common + white + camera.white_rad.powi(2)).sqrt().max(1e-6);
        let is_finite = seen.by_limb_height.is_finite() && own_sigma.is_finite() && time_s.is_finite();
        let integrals = reckoning.at(time_s)?;
        is_finite.then(|| Look {
            time_s,
            camera: number,
            window: 0,
            is_celestial: matches!(seen.body, Body::Sun | Body::Moon),
            measured: measured.into_inner(),
            by_height: seen.by_limb_height.into_inner(),
            by_latitude: by_latitude(inputs, seen, time_s, &reference),
            mount: camera.mount.into_inner(),
            reference: about_pole(time_s) * Vector::<Fixed>::into_inner(reference),
            own_sigma,
            sigma: own_sigma,
            integrals,
        })
    };
    seen.iter().filter_map(look).collect()
}

/// Returns what each coefficient of the latitude does to a direction: nothing to that of Sun or Moon. Without a
/// receiver the position is that of the told altitude against the direction from outside.
fn by_latitude(inputs: &Inputs, seen: &Seen, time_s: f64, reference: &Vector<Fixed>) -> [(f64, Vector3<f64>); 2] {
    let of_altitude = || Some(*reference * -1e3 * (RADIUS_KM + seen.altitude_km?));
    let position_m = receiver_at(&inputs.gnss, time_s).map(|at| at.0).or_else(of_altitude);
    let terms = position_m.filter(|_| seen.body == Body::Limb).and_then(|at| LatitudeTerm::both(&at));
    let turn = about_pole(time_s);
    terms.map_or([(0.0, Vector3::zeros()); 2], |terms| terms.map(|term| (term.height, turn * term.tilt.into_inner())))
}

/// Returns every so many of a list, so that at most [`MOST_LOOKS`] remain.
fn thinned<'a, T>(all: &[&'a T]) -> Vec<&'a T> {
    all.iter().copied().step_by(all.len().div_ceil(MOST_LOOKS).max(1)).collect()
}

fn sigma_of(block: hzn_nav::options::Block) -> f64 {
    if block.mode == Mode::Off { 0.0 } else { block.sigma }
}

/// Returns the sigmas of the shared errors that the settings tell.
fn sigmas(shared: Shared, cameras: &[CameraOptions], options: &Options) -> Vec<f64> {
    let mut sigmas = vec![NONE; shared.len()];
    let mut put = |first: usize, len: usize, sigma: f64| {
        sigmas.iter_mut().skip(first).take(len).for_each(|s| *s = sigma.max(NONE));
    };
    for (number, camera) in cameras.iter().enumerate() {
        put(shared.mount(number), 3, sigma_of(camera.misalignment));
        put(shared.clock(number), 1, sigma_of(camera.clock));
    }
    // Axes of the gyros that are turned against the vehicle look like a turn of all mounts.
    put(shared.unit(), 3, sigma_of(options.imu.gyro_misalignment));
    put(shared.bias(), 3, sigma_of(options.imu.gyro_bias));
    put(shared.scale(), 3, sigma_of(options.imu.gyro_scale));
    put(shared.height(), 1, sigma_of(options.limb_height));
    put(shared.latitude(), 2, sigma_of(options.limb_latitude));
    sigmas
}
