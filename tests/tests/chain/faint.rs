//! Light that fades slowly has a contour line at each threshold, and it may have the exact form of the limb. Only a
//! step of the brightness is a limb.

use hzn_core::camera::{Config as Camera, Model};
use hzn_core::image::{Channel, ImageView, Layout};
use hzn_core::verdict::Verdict;
use hzn_core::{Config, Report, status::Status, threshold};
use hzn_host::Compiled;
use hzn_sim::pose::position_m;
use hzn_sim::{Look, Pose, Scene};
use hzn_tests::{Sensors, prior_of_scene};

const WIDTH: u16 = 640;
const HEIGHT: u16 = 480;
const FOCAL_PX: f64 = 554.0;
/// Brightness at the limb, and far from it on its dark and bright sides, in counts.
const AT_LIMB: f64 = 40.0;
const LIMITS: [f64; 2] = [2.0, 78.0];

/// Returns a picture whose brightness rises by `counts_per_px` across the limb of the scene, and the sensor's report.
fn process(scene: &Scene, counts_per_px: f64) -> Report<f64> {
    let truth = scene.truth("", 0.0).unwrap();
    let (axis, half_angle_rad) = ([truth.axis_x, truth.axis_y, truth.axis_z], truth.half_angle_deg.to_radians());
    let pixel = |i: usize| {
        let (x, y) = ((i % usize::from(WIDTH)) as f64, (i / usize::from(WIDTH)) as f64);
        let ray = [(x - f64::from(WIDTH - 1) / 2.0) / FOCAL_PX, (y - f64::from(HEIGHT - 1) / 2.0) / FOCAL_PX, 1.0];
        let dot = ray.iter().zip(axis).map(|(r, a)| r * a).sum::<f64>();
        let off_rad = (dot / (ray[0].hypot(ray[1]).hypot(1.0))).acos();
        // A radian is about `FOCAL_PX` pixels near the middle of the picture.
        let inwards_px = (half_angle_rad - off_rad) * FOCAL_PX;
        // The rounding is dithered, so that the contour is no staircase.
        let dither = ((7 * i + 3 * (i / usize::from(WIDTH))) % 16) as f64 / 16.0;
        ((AT_LIMB + inwards_px * counts_per_px).clamp(LIMITS[0], LIMITS[1]) + dither) as u8
    };
    let data: Vec<u8> = (0..usize::from(WIDTH) * usize::from(HEIGHT)).map(pixel).collect();
    let view = ImageView::from_bytes(&data, Layout::packed(WIDTH.into(), HEIGHT.into(), 1, 8), Channel::Mean).unwrap();
    let mut sensor = Config::new(scene.camera.clone());
    sensor.threshold = threshold::Config { method: threshold::Method::Fixed, level: AT_LIMB, ..Default::default() };
    sensor.retry.levels.clear();
    let mut host = Sensors::new(&sensor).host;
    let expected = host.expect(&prior_of_scene(scene)).unwrap();
    host.find(view, &expected).clone()
}

#[test]
fn light_that_fades_slowly_has_no_limb() {
    for seed in 0..4 {
        let look =
            Look { azimuth_rad: 0.9 * f64::from(seed), depression_rad: 0.3, roll_rad: 0.2 * f64::from(seed) - 0.3 };
        let camera = Camera::ideal(Model::Pinhole, WIDTH, HEIGHT, FOCAL_PX);
        let scene = Scene::new(camera, Pose::looking(position_m(50.0, 10.0 * f64::from(seed), 240.0), look));
        let steep = process(&scene, 4.0);
        assert_eq!(steep.status, Status::Ok, "{seed}: a limb over 20 px");
        // Two counts over 20 px are less than a sixty-fourth of full scale.
        let slow = process(&scene, 0.1);
        let verdicts: Vec<_> = slow.candidates.iter().map(|c| c.verdict).collect();
        assert_eq!(slow.status, Status::Rejected, "{seed}: {verdicts:?}");
        assert!(verdicts.contains(&Verdict::Faint), "{seed}: {verdicts:?}");
    }
}
