//! Several heads around one vehicle, rendered: the joint direction with a limb height that nobody knows.

use hzn_core::camera::{Config as Camera, Model};
use hzn_core::frames::{Rotation, UnitVec3, Vehicle};
use hzn_core::rig::{Config as RigConfig, Head, Joint, Rig};
use hzn_core::{Config, Prior, body};
use hzn_host::Compiled;
use hzn_sim::pose::position_m;
use hzn_sim::{Clouds, Detector, Disc, Look, Pose, Profile, Scene};
use hzn_tests::{Sensors, prior_of_scene};

/// Height of the rendered limb at the equator, km. The sensors are told 15 ± 10 km.
const LIMB_KM: f64 = 25.0;

/// Returns the scene of a head that looks at the limb at an azimuth, 68 degrees off nadir at 500 km.
fn scene(epoch: u64, azimuth_rad: f64, km_to_pole: f64) -> Scene {
    let (lat_deg, lon_deg) = (-60.0 + 11.0 * epoch as f64, 37.0 * epoch as f64);
    let look = Look::off_nadir(68f64.to_radians(), azimuth_rad, 0.1 * (epoch % 5) as f64 - 0.2);
    let pose = Pose::looking(position_m(lat_deg, lon_deg, 500.0), look);
    let mut scene = Scene::new(Camera::ideal(Model::Pinhole, 640, 480, 554.0), pose);
    scene.body.limb_height_km = LIMB_KM;
    scene.limb_height_by_latitude_km =
        vec![[-90.0, LIMB_KM - km_to_pole], [0.0, LIMB_KM], [90.0, LIMB_KM + km_to_pole]];
    scene.profile = Profile::Exponential { scale_km: 7.0 };
    scene.disc = Disc { clouds: Some(Clouds { cover: 0.3, seed: epoch, ..Clouds::default() }), ..scene.disc };
    scene.detector = Detector { psf_sigma_px: 0.9, read_noise: 0.01, ..Detector::default() };
    scene.seed = 100 * epoch + (azimuth_rad * 10.0) as u64;
    scene
}

fn sensor(scene: &Scene) -> Config {
    let mut sensor = Config::new(scene.camera.clone());
    sensor.body = body::Config { limb_height_km: 15.0, limb_height_sigma_km: 10.0, ..scene.body.clone() };
    sensor
}

/// Errors of the single heads and of the joint answers, in degrees, and the joint answers' NEES.
#[derive(Default)]
struct Errors {
    single_deg: Vec<f64>,
    pair_deg: Vec<f64>,
    ring_deg: Vec<f64>,
    nees: Vec<f64>,
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

/// Returns the error of a joint answer in degrees and its NEES. The axes of the vehicle are the fixed ones here.
fn judge(joint: &Joint<f64>, truth: &UnitVec3<Vehicle, f64>) -> (f64, f64) {
    let covariance = nalgebra::Matrix3::from_fn(|i, j| joint.covariance.rows()[i][j]);
    let off = nalgebra::Vector3::from(joint.axis.xyz()) - nalgebra::Vector3::from(truth.xyz());
    let nees = off.dot(&(covariance.pseudo_inverse(1e-14).expect("a pseudo-inverse") * off));
    (joint.axis.angle_rad(truth).to_degrees(), nees)
}

fn fly(km_to_pole: f64, tilt_deg: f64) -> Errors {
    let rig = Rig::<f64>::new(&RigConfig::default()).unwrap();
    let mut errors = Errors::default();
    for epoch in 0..12 {
        let mut heads = [None; 4];
        let mut truth = None;
        for (k, head) in heads.iter_mut().enumerate() {
            let scene = scene(epoch, 0.3 * epoch as f64 + k as f64 * std::f64::consts::FRAC_PI_2, km_to_pole);
            let mut horizon = Sensors::new(&sensor(&scene)).host;
            let prior: Prior<f64> = prior_of_scene(&scene);
            let expected = horizon.expect(&prior).unwrap();
            let report = horizon.find(scene.render().unwrap().view(), &expected);
            let Some(solution) = report.solution else { continue };
            let mount = Rotation::assume_from_quaternion(scene.pose.q_fixed_from_camera_wxyz).unwrap();
            let told = scene.truth("", 0.0).unwrap();
            let axis = UnitVec3::try_new([told.axis_x, told.axis_y, told.axis_z]).unwrap();
            errors.single_deg.push(solution.axis.angle_rad(&axis).to_degrees());
            truth = Some(mount.apply(&axis));
            *head = Head::new(&solution.free.unwrap(), &mount, &[0.0; 6], 0.0);
        }
        let truth = truth.expect("a head answers");
        let mut join = |heads: &[Option<Head<f64>>]| {
            let joint = rig.join(heads, tilt_deg.to_radians()).expect("the heads agree");
            assert_eq!(joint.heads_excluded, 0);
            let (error_deg, nees) = judge(&joint, &truth);
            assert!(error_deg < joint.protection_rad.unwrap().to_degrees());
            errors.nees.push(nees);
            error_deg
        };
        let pair = join(&[heads[0], None, heads[2], None]);
        let ring = join(&heads);
        errors.pair_deg.push(pair);
        errors.ring_deg.push(ring);
    }
    errors
}

#[test]
fn opposite_heads_remove_an_unknown_limb_height() {
    for (km_to_pole, tilt_deg, most_pair_deg, most_ring_deg) in [(0.0, 0.0, 0.02, 0.015), (4.5, 0.025, 0.03, 0.025)] {
        let errors = fly(km_to_pole, tilt_deg);
        let [single, pair, ring] = [&errors.single_deg, &errors.pair_deg, &errors.ring_deg].map(|x| rms(x));
        let nees = errors.nees.iter().sum::<f64>() / errors.nees.len() as f64;
        println!("{km_to_pole} km to the pole: {single:.4} deg, pair {pair:.4}, ring {ring:.4}; NEES {nees:.2}");
        assert!(errors.single_deg.len() >= 44, "{} single answers", errors.single_deg.len());
        assert!(pair < most_pair_deg && ring < most_ring_deg, "pair {pair}, ring {ring}");
        assert!(pair < single / 3.0, "pair {pair}, single {single}");
        assert!(nees < 3.0, "NEES {nees}");
    }
}
