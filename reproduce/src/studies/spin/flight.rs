//! A flight of a rocket that spins at five turns a second, and its navigation.

use anyhow::{Context, anyhow};
use hzn_fuse::flight::Wanted;
use hzn_fuse::input::{Attitude, Inputs};
use hzn_fuse::settings::{ErrorSetting, Treatment};
use hzn_fuse::truth::compare;
use hzn_fuse::{Settings, fuse};
use hzn_nav::frames::{Rotation, Vector};
use hzn_sim::Scenario;
use hzn_sim::counter::{Counter, Stream};
use hzn_sim::scenario::Clock;
use hzn_sim::trajectory::Attitude as Motion;
use nalgebra::{Quaternion, UnitQuaternion};

use crate::fly::deg;

/// Spin, turns a second.
pub(super) const SPIN_HZ: f64 = 5.0;
/// Time at which the yo-yo is released; the spin is gone a second later.
pub(super) const YOYO_S: f64 = 56.0;
/// Time of the table: the spin is gone.
pub(super) const DESPUN_S: f64 = YOYO_S + 2.0;
/// Times of the first and the last picture, and the number of pictures of each of the two cameras: four a second.
pub(super) const PICTURES: (f64, f64, u32) = (44.0, 58.0, 57);
/// 1-sigma of the direction of a limb about each of two axes, degrees, that the filter assumes.
pub(super) const LIMB_SIGMA_DEG: f64 = 0.14;
/// Sigma of the attitude at lift-off, which the launcher gives, degrees.
pub(super) const LAUNCHER_SIGMA_DEG: f64 = 1.0;

/// Returns the flight with a seed.
pub(super) fn scene(seed: u64, jitter_s: f64) -> anyhow::Result<Scenario> {
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
pub(super) fn settings(jitter_s: f64) -> Settings {
    let mut own = Settings::default();
    own.imu.gyro_scale_ppm.mode = Treatment::Estimated;
    let turned_rad = SPIN_HZ * core::f64::consts::TAU * jitter_s;
    own.camera.white_rad = LIMB_SIGMA_DEG.to_radians().hypot(turned_rad);
    own.camera.clock_s = ErrorSetting { mode: Treatment::Considered, sigma: 0.0 };
    own
}

/// Errors at despin, degrees.
pub(super) struct Despun {
    /// About the long axis.
    pub(super) roll_deg: f64,
    /// About the two others.
    pub(super) across_deg: f64,
    pub(super) roll_sigma_deg: f64,
}

/// Returns the errors at despin of a flight with these inputs, to which the launcher's attitude is added.
pub(super) fn navigate(scene: &Scenario, mut inputs: Inputs, settings: &Settings) -> anyhow::Result<Despun> {
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

pub(super) const HEAD: [&str; 6] =
    ["sensors", "roll error", "largest", "error across", "σ of the roll", "roll within 3σ"];

/// Returns the row of several flights.
pub(super) fn row(name: String, all: &[Despun]) -> Vec<String> {
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
