//! Tests of real lenses that nobody calibrated: their shape has more than one coefficient, and they are decentred. A
//! flight calibrates the sensor that `hzn init` writes, and the answers are honest.

use crate::common::Place;
use crate::start::{Flight, Lens, Score, init};

/// A lens with the seed of its flight.
struct Real {
    name: &'static str,
    seed: u32,
    /// Width of the picture over focal length.
    width: f64,
    /// k1, k2, p1, p2.
    k: [f64; 4],
    centre_px: [f64; 2],
}

const fn real(name: &'static str, seed: u32, width: f64, k: [f64; 4], centre_px: [f64; 2]) -> Real {
    Real { name, seed, width, k, centre_px }
}

/// Calibrations of other people's cameras that the sigmas of `hzn init` do not come from. The first one is ideal; the
/// k2 of the F37 is reduced so that the lens is monotone.
const LENSES: [Real; 10] = [
    real("ideal", 3011, 1.5347, [0.0; 4], [159.5, 119.5]),
    real("webcam, 640 px", 3001, 0.8853, [0.109_696, -0.556_727, -0.001_913, 0.000_226], [158.7, 122.3]),
    real("usb camera, half distorted", 3002, 1.1264, [-0.2565, 0.1019, -0.000_107, 0.001_255], [161.9, 120.9]),
    real("camera, 1600 px", 3004, 1.381, [-0.173_831, 0.107_473, 0.004_231, -0.002_669], [159.5, 118.1]),
    real("camera, 960 px", 3005, 1.6472, [-0.115_097, 0.102_928, 0.001_42, -0.001_838], [162.7, 116.7]),
    real("camera, 1920 px", 3006, 1.7676, [-0.109_203, 0.063_536, -0.003_427, -0.000_629], [157.1, 123.0]),
    real("F37, 1920 px", 3007, 1.1120, [0.169_978, -0.415_493, -0.002_944, -0.004_961], [160.3, 121.6]),
    real("industrial camera", 3008, 1.024, [-0.21, 0.09, -0.002_189, -0.000_758], [163.5, 120.2]),
    real("camera of a robot", 3009, 1.9668, [-0.029_611, 0.019_158, 0.003_538, -0.003_762], [157.9, 118.8]),
    real("stereo camera, 1024 px", 3010, 2.0003, [-0.237_095, 0.050_504, -0.009_065, 0.000_321], [161.1, 117.4]),
];

/// Returns the field of view of a lens, degrees.
fn fov_deg(width: f64, [k1, k2, ..]: [f64; 4]) -> f64 {
    let edge = 0.5 * width;
    let x = (0..200).fold(edge, |x: f64, _| edge / (1.0 + x * x * (k1 + k2 * x * x)));
    2.0 * x.atan().to_degrees()
}

/// Returns the answers with the guess, and after the calibration; `None` if that is refused.
fn calibrate(real: &Real) -> (Score, Option<Score>) {
    let Real { name, seed, width, k, centre_px } = *real;
    let place = Place::new();
    let lens = Lens { name, guess: "pinhole", fov_deg: fov_deg(width, k), k: &k };
    Flight { seed, centre_px, ..Flight::new(&lens) }.render(&place);
    init(&place, &lens, lens.fov_deg);
    let guessed = Score::run(&place, "mine.toml");
    let ran = place.run(&["calibrate", "sky", "flight", "--sensor", "mine.toml", "-o", "new.toml"]);
    (guessed, (ran.code == 0).then(|| Score::run(&place, "new.toml")))
}

/// With k1 alone, the calibration of the first lens is refused with an alarm, and that of the second has a NEES of 23.
#[test]
fn a_flight_calibrates_a_decentred_lens() {
    for real in [&LENSES[3], &LENSES[7]] {
        let (_, after) = calibrate(real);
        let after = after.expect("the flight calibrates the lens");
        assert!(after.answered() >= 0.95 && after.mean_nees() < 3.0, "{}: {after:?}", real.name);
        assert!(after.within as f64 >= 0.97 * after.errors_deg.len() as f64, "{}: {after:?}", real.name);
    }
}

#[test]
#[ignore = "takes minutes; it measures the figures of book/guide/calibrate-sky.md"]
fn flights_calibrate_ten_lenses() {
    for real in &LENSES {
        let (name, (before, after)) = (real.name, calibrate(real));
        let after = after.unwrap_or_else(|| panic!("{name} is not calibrated"));
        println!(
            "{name}, {:.0} deg: RMS {:.2} deg, NEES {:.2}; calibrated {:.2} deg, {:.2}",
            fov_deg(real.width, real.k),
            before.rms_deg(),
            before.mean_nees(),
            after.rms_deg(),
            after.mean_nees()
        );
        assert!(after.mean_nees() < 3.0 && after.within == after.errors_deg.len(), "{name}: {after:?}");
    }
}
