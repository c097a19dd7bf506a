//! Tests of a rolling shutter in a camera that turns by some degrees while it reads out a picture.

use hzn_core::camera::{self, Model};
use hzn_core::frames::UnitVec3;
use hzn_core::{Config, HostHorizon, Prior};
use hzn_host::Compiled;
use hzn_sim::pose::position_m;
use hzn_sim::{Look, Motion, Pose, Scene};

const READOUT_S: f64 = 0.03;
/// The camera turns by 5° during the picture.
const RATE_RADPS: f64 = 5.0 * core::f64::consts::PI / 180.0 / READOUT_S;

/// Returns the answer's error in degrees and in sigmas, with or without the rate in the prior.
fn error(scene: &Scene, told: bool) -> Option<[f64; 2]> {
    let mut config = Config::new(scene.camera.clone());
    config.body = scene.body.clone();
    config.body.limb_height_sigma_km = 0.5;
    let frame = Prior {
        position_m: Some(scene.pose.position_m),
        rate_rad_s: scene.motion.filter(|_| told).map(|m| m.rate_radps),
        ..Prior::default()
    };
    let mut horizon = HostHorizon::boxed(&config).unwrap();
    let expected = horizon.expect(&frame).unwrap();
    let picture = scene.render().unwrap();
    let solution = horizon.find(picture.view(), &expected).solution?;
    let truth = scene.truth("", 0.0).unwrap();
    let truth = UnitVec3::try_new([truth.axis_x, truth.axis_y, truth.axis_z]).unwrap();
    let error_rad = solution.axis.angle_rad(&truth);
    Some([error_rad.to_degrees(), error_rad / solution.covariance.sigma_max_rad()])
}

#[test]
fn with_the_rate_given_the_answer_is_that_of_a_camera_that_stands_still_and_without_it_none_is_wrong() {
    let camera = camera::Config { readout_s: READOUT_S, ..camera::Config::ideal(Model::Pinhole, 640, 480, 554.0) };
    let mut refused = 0;
    for (i, axis) in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.6, -0.5, 0.62]].into_iter().enumerate() {
        for roll_rad in [0.2, 1.4] {
            let look = Look { azimuth_rad: 0.7 * i as f64, depression_rad: 0.3, roll_rad };
            let mut scene = Scene::new(camera.clone(), Pose::looking(position_m(30.0, 10.0, 300.0), look));
            let rate_radps = axis.map(|w: f64| w * RATE_RADPS);
            scene.motion = Some(Motion { rate_radps, exposure_s: 0.0, readout_s: READOUT_S });
            let [still_deg, _] = error(&Scene { motion: None, ..scene.clone() }, true).expect("an answer");
            let [deg, sigmas] = error(&scene, true).expect("an answer");
            println!("{axis:?} {roll_rad}: {deg:.4} deg, {sigmas:.2} sigma, still {still_deg:.4}");
            assert!((deg - still_deg).abs() < 0.002 && sigmas < 3.0, "{axis:?} {roll_rad}: {deg} deg, {sigmas} sigma");
            let untold = error(&scene, false);
            println!("  without the rate: {untold:?}");
            assert!(untold.is_none_or(|[_, sigmas]| sigmas < 3.0), "{axis:?} {roll_rad}: {untold:?}");
            refused += usize::from(untold.is_none());
        }
    }
    assert!(refused >= 4, "without the rate it must show: {refused} refused");
}
