//! Measures what the camera adds while a rocket spins: the roll at despin without it, and with limb and Sun.

mod rendered;

use anyhow::{Context, anyhow};
use hzn_fuse::flight::Wanted;
use hzn_fuse::input::{Attitude, Body, Inputs};
use hzn_fuse::settings::{ErrorSetting, Treatment};
use hzn_fuse::simulated::{Errors, Moment, inputs};
use hzn_fuse::truth::compare;
use hzn_fuse::{Settings, fuse};
use hzn_nav::frames::{Cam, Covariance, Rotation, Vector};
use hzn_sim::Scenario;
use hzn_sim::counter::{Counter, Stream};
use hzn_sim::scenario::Clock;
use hzn_sim::trajectory::Attitude as Motion;
use nalgebra::{Quaternion, UnitQuaternion};
use rayon::prelude::*;

use super::setup::Effort;
use crate::fly::deg;
use crate::section::Section;

/// Spin, turns a second.
const SPIN_HZ: f64 = 5.0;
/// Time at which the yo-yo is released; the spin is gone a second later.
const YOYO_S: f64 = 56.0;
/// Time of the table: the spin is gone.
const DESPUN_S: f64 = YOYO_S + 2.0;
/// Times of the first and the last picture, and the number of pictures of each of the two cameras: four a second.
const PICTURES: (f64, f64, u32) = (44.0, 58.0, 57);
/// Number of flights, and the seed of the first.
const FLIGHTS: (usize, u64) = (24, 9300);
/// Errors of the directions (1-sigma about each of two axes), degrees. Both are assumed.
const LIMB_SIGMA_DEG: f64 = 0.14;
const SUN_SIGMA_DEG: f64 = 0.05;
/// Sigma of the attitude at lift-off, which the launcher gives, degrees.
const LAUNCHER_SIGMA_DEG: f64 = 1.0;
/// Random errors of the time stamps, s: at this rate the vehicle turns by 1.8° in a millisecond.
const JITTERS_S: [f64; 3] = [0.0, 1e-4, 1e-3];

/// Directions with white errors.
struct White {
    seed: u64,
    count: u64,
}

impl Errors for White {
    fn draw(&mut self, at: &Moment, axis: &Vector<Cam>) -> (Vector<Cam>, Covariance<Cam>) {
        let sigma = if at.body == Body::Limb { LIMB_SIGMA_DEG } else { SUN_SIGMA_DEG }.to_radians();
        let draws = Counter::new(self.seed, Stream::Clock);
        let mut normal = || {
            self.count += 1;
            draws.normal(self.count)
        };
        let error = Vector::<Cam>::new(normal(), normal(), normal()) * sigma;
        (error - *axis * error.dot(axis), Covariance::across(axis, sigma.powi(2)))
    }
    fn by_limb_height(&mut self, _: &Moment, _: &Vector<Cam>) -> Vector<Cam> {
        Vector::zeros()
    }
}

fn scene(seed: u64, jitter_s: f64) -> anyhow::Result<Scenario> {
    let mut scene = Scenario::builtin("atek").ok_or_else(|| anyhow!("there is no scene atek"))?;
    scene.seed = seed;
    let (from_s, to_s, frames) = PICTURES;
    (scene.capture.from_s, scene.capture.to_s, scene.capture.frames) = (from_s, to_s, frames);
    if let Motion::Spin(spin) = &mut scene.attitude {
        (spin.spin_hz, spin.yoyo_s) = (SPIN_HZ, YOYO_S);
    }
    if let Some(imu) = &mut scene.imu {
        // At 20 samples a second a sample would be a quarter of a turn.
        (imu.rate_hz, imu.gyro_range_deg_s, imu.gyro_scale_ppm) = (200.0, 2000.0, 2000.0);
    }
    for camera in &mut scene.cameras {
        camera.clock = Clock { jitter_s, ..Clock::default() };
    }
    Ok(scene)
}

/// The filter's settings: those of table 3, with the scale factor of the gyros estimated, and the noise of the
/// directions and of their times.
fn settings(jitter_s: f64) -> Settings {
    let mut own = Settings::default();
    own.imu.gyro_scale_ppm.mode = Treatment::Estimated;
    let turned_rad = SPIN_HZ * core::f64::consts::TAU * jitter_s;
    own.camera.white_rad = LIMB_SIGMA_DEG.to_radians().hypot(turned_rad);
    own.camera.clock_s = ErrorSetting { mode: Treatment::Considered, sigma: 0.0 };
    own
}

/// Errors at despin, degrees.
struct Despun {
    /// About the long axis.
    roll_deg: f64,
    /// About the two others.
    across_deg: f64,
    roll_sigma_deg: f64,
}

/// Flies with drawn directions, or without any.
fn fly(seed: u64, jitter_s: f64, with_camera: bool) -> anyhow::Result<Despun> {
    let scene = scene(seed, jitter_s)?;
    let mut errors = White { seed, count: 0 };
    let mut inputs = inputs(&scene, &mut errors, 0.0)?;
    if !with_camera {
        inputs.recordings.clear();
    }
    navigate(&scene, inputs, &settings(jitter_s))
}

/// Returns the errors at despin of a flight with these inputs, to which the launcher's attitude is added.
fn navigate(scene: &Scenario, mut inputs: Inputs, settings: &Settings) -> anyhow::Result<Despun> {
    let seed = scene.seed;
    let path = scene.path()?;
    let truth: Vec<_> = path.vehicle_rows([0.0, DESPUN_S + 1.0], 200.0).collect();
    let first = truth.first().context("no truth")?;
    let draws = Counter::new(seed, Stream::Clock);
    let error = Vector::new(draws.normal(1 << 40), draws.normal((1 << 40) + 1), draws.normal((1 << 40) + 2));
    let exact: Rotation<_, _> =
        UnitQuaternion::from_quaternion(Quaternion::new(first.qw, first.qx, first.qy, first.qz)).into();
    let sigma_rad = LAUNCHER_SIGMA_DEG.to_radians();
    let told = exact * Rotation::from_scaled_axis(error * sigma_rad);
    inputs.attitudes.push(Attitude { time_s: first.time_s, fixed_from_vehicle: Some(told), sigma_rad });
    inputs.imu.retain(|sample| sample.imu.time_s <= DESPUN_S + 0.5);
    let fused =
        fuse(&inputs, settings, Wanted { rate_hz: Some(200.0), ..Wanted::default() }).map_err(|e| anyhow!("{e}"))?;
    let misses = compare(&fused.epochs, &truth);
    let miss = misses.iter().rev().find(|m| m.time_s <= DESPUN_S).context("no solution at despin")?;
    let epoch = fused.epochs.iter().rev().find(|e| e.state.time_s <= DESPUN_S).context("no solution at despin")?;
    let [x, y, z] = miss.attitude_rad.xyz().map(f64::to_degrees);
    Ok(Despun { roll_deg: x, across_deg: y.hypot(z), roll_sigma_deg: epoch.attitude_sigma_rad().x.to_degrees() })
}

pub(super) fn navigation_through_spin(effort: &Effort) -> anyhow::Result<Section> {
    let flights = effort.frames(FLIGHTS.0);
    let mut s = Section::default();
    let (from_s, to_s, frames) = PICTURES;
    s.text(format!(
        "{flights} flights of the vehicle of `hzn simulate atek` (seeds from {}) that spins up to {SPIN_HZ} turns a \
         second from lift-off to T+44 s and is despun from T+{YOYO_S:.0} s. Gyros to ± 2000°/s with a scale factor of \
         2000 ppm (1σ), 200 samples a second. The launcher gives the attitude at lift-off to {LAUNCHER_SIGMA_DEG}°. \
         Two cameras with mounts of 1° take {frames} pictures each from T+{from_s:.0} s to T+{to_s:.0} s, {:.0}\u{a0}a \
         second. No picture is rendered: where limb or Sun are in view, their directions have white errors of \
         {LIMB_SIGMA_DEG}° and {SUN_SIGMA_DEG}°. The filter estimates the scale factor; everything else is table 3. \
         Errors are those at T+{DESPUN_S:.0} s, RMS over the flights; roll is the rotation about the long axis.",
        FLIGHTS.1,
        f64::from(frames - 1) / (to_s - from_s),
    ));
    let turned_deg = 360.0 * SPIN_HZ * (YOYO_S + 0.5 - 0.5 * PICTURES.0);
    s.text(format!(
        "Until despin the vehicle makes {:.0} turns. With the gyros alone the roll would be lost: 2000 ppm of the \
         turns are {:.0}°. *No camera* is the filter with inertial unit and receiver. It does better than the gyros \
         alone; the likely reason, which was not tested, is the acceleration across the long axis, 3° from the \
         direction of flight, that the receiver sees. Both errors of the directions are assumed; \
         rendered pictures follow below.",
        turned_deg / 360.0,
        2e-3 * turned_deg
    ));
    let mut rows = Vec::new();
    let ways = std::iter::once((false, 0.0)).chain(JITTERS_S.map(|jitter_s| (true, jitter_s)));
    for (with_camera, jitter_s) in ways {
        let all: Vec<Despun> = (0..flights as u64)
            .into_par_iter()
            .map(|k| fly(FLIGHTS.1 + k, jitter_s, with_camera))
            .collect::<anyhow::Result<_>>()?;
        let name = match with_camera {
            true => format!("limb and Sun, time stamps to {} ms", 1e3 * jitter_s),
            false => "no camera".into(),
        };
        rows.push(row(name, &all));
    }
    s.table(HEAD, rows);
    rendered::add(&mut s, effort)?;
    Ok(s)
}

const HEAD: [&str; 6] = ["sensors", "roll error", "largest", "error across", "σ of the roll", "roll within 3σ"];

/// Returns the row of several flights.
fn row(name: String, all: &[Despun]) -> Vec<String> {
    let n = all.len().max(1) as f64;
    let rms = |of: &dyn Fn(&Despun) -> f64| (all.iter().map(|d| of(d).powi(2)).sum::<f64>() / n).sqrt();
    let within = all.iter().filter(|d| d.roll_deg.abs() <= 3.0 * d.roll_sigma_deg).count();
    vec![
        name,
        deg(rms(&|d| d.roll_deg)),
        deg(all.iter().map(|d| d.roll_deg.abs()).fold(0.0, f64::max)),
        deg(rms(&|d| d.across_deg)),
        deg(rms(&|d| d.roll_sigma_deg)),
        format!("{within} of {}", all.len()),
    ]
}
