//! Directions whose covariance has a common part: the filter takes it as the slow error, and the rest as white noise.
//!
//! `HZN_FLIGHTS=60 cargo test --test fuse common_part:: -- --nocapture` prints NEES and RMS over 60 flights.

use crate::common::{Slow, flights, scene};
use hzn_files::vehicle::VehicleRow;
use hzn_fuse::flight::Wanted;
use hzn_fuse::input::Inputs;
use hzn_fuse::simulated::inputs;
use hzn_fuse::{Settings, fuse, truth};

/// First seed of the flights.
const FIRST_SEED: u64 = 83_000;
/// Number of flights from which on two filters are compared: the errors of fewer differ by more than the filters.
const ENOUGH: u64 = 6;
/// 1-sigma of the slow error and of the white noise of a direction, degrees.
const SIGMAS_DEG: [f64; 2] = [0.06, 0.08];

/// Settings whose noise is that of the simulation.
fn settings() -> Settings {
    let mut settings = Settings::default();
    settings.imu.gyro_noise_deg_rth[1] = 0.3;
    settings.imu.accel_noise_mg_rthz[1] = 0.3;
    settings.camera.white_rad = 4e-4;
    settings.limb_height.sigma_km = Some(0.5);
    settings
}

/// The figures of a flight.
#[derive(Default)]
struct Figures {
    /// Mean χ² of the attitude.
    nees: Vec<f64>,
    /// Mean squared error of the attitude, deg².
    squares: Vec<f64>,
    /// Mean NIS of the directions, for each component.
    nis: Vec<f64>,
}

impl Figures {
    fn add(&mut self, inputs: &Inputs, rows: &[VehicleRow]) {
        // A flight without two directions at its beginning has no first attitude.
        let Ok(fused) = fuse(inputs, &settings(), Wanted { rate_hz: Some(1.0), ..Wanted::default() }) else { return };
        let misses = truth::compare(&fused.epochs, rows);
        let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / misses.len() as f64;
        self.nees.push(mean(&mut misses.iter().map(|m| m.nees)));
        self.squares.push(mean(&mut misses.iter().map(|m| m.attitude_rad.norm_squared().to_degrees().to_degrees())));
        let directions = || fused.innovations.iter().filter(|i| i.camera.is_some());
        let nis = directions().map(|i| i.nis / i.value.len() as f64).sum::<f64>();
        self.nis.push(nis / directions().count() as f64);
    }

    /// Returns the mean NEES, the RMS of the attitude in degrees, and the mean NIS of a component.
    fn means(&self) -> [f64; 3] {
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        [mean(&self.nees), mean(&self.squares).sqrt(), mean(&self.nis)]
    }
}

#[test]
fn the_rest_of_the_covariance_is_white_noise() {
    let flights = flights(2, ENOUGH);
    let [mut told, mut untold] = [Figures::default(), Figures::default()];
    for seed in FIRST_SEED..FIRST_SEED + flights {
        let scene = scene(seed);
        let [slow_deg, white_deg] = SIGMAS_DEG;
        let mut errors = Slow::new(seed, slow_deg);
        errors.white_rad = white_deg.to_radians();
        let with_common = inputs(&scene, &mut errors, 0.5).unwrap();
        let mut without = with_common.clone();
        without.recordings.iter_mut().flat_map(|r| &mut r.seen).for_each(|seen| seen.common_rad2 = None);
        let rows: Vec<_> = scene.path().unwrap().vehicle_rows([0.0, 430.0], 10.0).collect();
        told.add(&with_common, &rows);
        untold.add(&without, &rows);
    }
    let [after, before] = [told.means(), untold.means()];
    println!("{} flights; NEES (3), RMS in degrees, NIS (1) of a direction's component", told.nees.len());
    println!("the common part is the slow error: {after:.3?}\nthe whole covariance is the slow error: {before:.3?}");
    // The innovations are those of the noise that was drawn; with all of it in the slow error they are too large.
    assert!((0.8..1.2).contains(&after[2]) && (after[2] - 1.0).abs() < (before[2] - 1.0).abs(), "{after:?} {before:?}");
    assert!((1.0..5.0).contains(&after[0]), "{after:?} {before:?}");
    assert!(flights < ENOUGH || after[1] < before[1] * 1.02, "{after:?} {before:?}");
}
