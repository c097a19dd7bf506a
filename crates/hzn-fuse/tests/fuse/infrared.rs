//! A satellite with an infrared horizon sensor, an inertial unit and a receiver, solved at once.

use hzn_core::HostHorizon;
use hzn_core::config::Mount;
use hzn_core::ellipsoid::{WGS84_A_M, WGS84_B_M, geodetic};
use hzn_fuse::finding::{Cause, Level};
use hzn_fuse::flight::Wanted;
use hzn_fuse::input::{Attitude, Inputs, Recording};
use hzn_fuse::results::Epoch;
use hzn_fuse::settings::Treatment;
use hzn_fuse::simulated::{Errors, Moment, inputs, instruments};
use hzn_fuse::{Settings, fuse};
use hzn_host::Compiled;
use hzn_mcap::{Row, RowMeta};
use hzn_nav::filter::LatitudeTerm;
use hzn_nav::frames::{Cam, Covariance, Fixed, Rotation, Vector, Vehicle};
use hzn_sim::Scenario;
use hzn_sim::trajectory::instruments::{Gnss, Imu};
use nalgebra::Matrix3;

use crate::common::Slow;

const ORBITS: f64 = 3.0;
const ORBIT_S: f64 = 5800.0;
const PICTURES: f64 = 190.0;

/// The scene of the study `orbit` with fewer orbits. The axes of the vehicle are those of the camera.
fn scene() -> Scenario {
    let mut scene = Scenario::builtin("leo-infrared").unwrap();
    scene.seed = 93_001;
    (scene.capture.to_s, scene.capture.frames) = (ORBIT_S * ORBITS, (PICTURES * ORBITS) as u32);
    if let hzn_sim::trajectory::Attitude::Pointing(pointing) = &mut scene.attitude {
        pointing.azimuth_deg[1] *= ORBITS;
        pointing.roll_deg[1] *= ORBITS;
    }
    scene.mount = Some(Mount { q_vehicle_from_camera_wxyz: [1.0, 0.0, 0.0, 0.0] });
    // The errors of table 3 of Braun & Barf 2022.
    scene.imu = Some(Imu {
        rate_hz: 5.0,
        gyro_bias_deg_s: 6.0 / 3600.0,
        gyro_scale_ppm: 2000.0,
        gyro_misalignment_mrad: 2.0,
        gyro_noise_deg_s: 0.0019,
        gyro_step_deg_s: 0.0005,
        accel_bias_mps2: 0.0196,
        accel_scale_ppm: 300.0,
        accel_misalignment_mrad: 2.0,
        accel_noise_mps2: 0.0011,
        accel_step_mps2: 0.001,
        ..Imu::default()
    });
    scene.gnss = Some(Gnss { rate_hz: 0.1, ..Gnss::default() });
    scene
}

/// Processes the pictures with a sensor that is told 22 km ± 4 km for all latitudes; the limb is at 25 km ± 4.5 km.
fn recording(scene: &Scenario) -> Recording {
    let mut sensor = scene.sensor();
    sensor.body.limb_height_by_latitude_km.clear();
    (sensor.body.limb_height_km, sensor.body.limb_height_sigma_km) = (22.0, 4.0);
    let mut horizon = HostHorizon::boxed(&sensor).unwrap();
    let mut rows = Vec::new();
    for (index, frame) in (0..).zip(&scene.flight().unwrap().frames) {
        let prior = frame.prior();
        let expected = horizon.expect(&prior).unwrap();
        let report = horizon.find(frame.render().unwrap().view(), &expected);
        let (altitude_m, _) = geodetic(prior.position_m.unwrap(), WGS84_A_M, WGS84_B_M);
        let (time_s, altitude_km) = (Some(frame.time_s), Some(altitude_m / 1e3));
        let meta = RowMeta { index, file: frame.file.clone(), time_s, body: "earth".into(), altitude_km };
        rows.push(Row::from_report(&meta, &report, None));
    }
    Recording::new(scene.name.clone(), rows, Some(&sensor)).unwrap()
}

/// Returns RMS and largest error of nadir on the vehicle in the last orbit, the RMS of its sigma, degrees, and the mean
/// of its squared error over its covariance (2 is ideal).
fn nadir(scene: &Scenario, epochs: &[Epoch]) -> [f64; 4] {
    let (path, mut n) = (scene.path().unwrap(), 0.0);
    let last_s = epochs.last().map_or(0.0, |epoch| epoch.state.time_s);
    let (mut square, mut largest, mut variance, mut nees) = (0.0f64, 0.0f64, 0.0, 0.0);
    for epoch in epochs.iter().filter(|e| e.state.time_s > last_s - ORBIT_S) {
        let truth = path.state(epoch.state.time_s);
        let attitude: Rotation<Vehicle, Fixed> = truth.fixed_from_vehicle.into();
        let down: Vector<Fixed> = -Vector::from(truth.position_m).normalize();
        let [seen, is] = [epoch.state.attitude, attitude].map(|q| (q.inverse() * down).into_inner());
        let error = seen.angle(&is).to_degrees();
        let cross = seen.cross_matrix();
        let own: Matrix3<f64> = cross * epoch.attitude_covariance_rad2.as_inner() * cross.transpose();
        let along = own + seen * seen.transpose();
        nees += (is - seen).dot(&(along.try_inverse().unwrap() * (is - seen)));
        (square, largest, n) = (square + error * error, largest.max(error), n + 1.0);
        variance += own.trace();
    }
    [(square / n).sqrt(), largest, (variance / n).sqrt().to_degrees(), nees / n]
}

/// Adds the attitude of a star tracker at the start, 2 degrees off.
fn with_start(scene: &Scenario, inputs: &mut Inputs) {
    let sigma_rad = 2f64.to_radians();
    let attitude: Rotation<Vehicle, Fixed> = scene.path().unwrap().state(1.0).fixed_from_vehicle.into();
    let error = Rotation::from_scaled_axis(Vector::new(1.0, -1.0, 1.0) * sigma_rad);
    inputs.attitudes.push(Attitude { time_s: 1.0, fixed_from_vehicle: Some(attitude * error), sigma_rad });
}

/// Settings for the inertial unit of the scene, a limb height by latitude, and a mount that is told as exact.
fn settings() -> Settings {
    let mut settings = Settings::default();
    for error in
        [&mut settings.imu.gyro_bias_deg_h, &mut settings.imu.gyro_scale_ppm, &mut settings.imu.gyro_misalignment_mrad]
    {
        error.mode = Treatment::Estimated;
    }
    settings.imu.gyro_noise_deg_rth = [0.05, 0.05];
    settings.limb_height.mode = Treatment::Estimated;
    (settings.limb_height.latitude_sigma_km, settings.camera.white_rad) = (4.0, 1e-4);
    settings.camera.misalignment_deg.mode = Treatment::Off;
    settings
}

/// Errors of a camera that sees the whole limb, whose height changes with the latitude: it tilts the axis.
struct ByLatitude {
    slow: Slow,
    /// Height over the north pole less that over the equator, km.
    km: f64,
}

impl Errors for ByLatitude {
    fn draw(&mut self, at: &Moment, axis: &Vector<Cam>) -> (Vector<Cam>, Covariance<Cam>) {
        let (error, covariance) = self.slow.draw(at, axis);
        let [term, _] = LatitudeTerm::both(&at.position_m).unwrap();
        let tilt = at.fixed_from_camera.inverse() * term.tilt;
        let by_height = self.by_limb_height(at, axis) * term.height;
        (error + (tilt + by_height) * self.km, covariance)
    }
    fn common(&mut self, at: &Moment, axis: &Vector<Cam>) -> Option<Covariance<Cam>> {
        self.slow.common(at, axis)
    }
    fn by_limb_height(&mut self, at: &Moment, axis: &Vector<Cam>) -> Vector<Cam> {
        // A tenth of that of an arc: the limb is nearly whole.
        self.slow.by_limb_height(at, axis) * 0.1
    }
}

/// A flight of one and a half orbits with this inertial unit, and 150 limbs with drawn errors, whose height changes by
/// so many kilometres from the equator to the north pole.
fn drawn(imu: Imu, km: f64) -> (Scenario, Inputs) {
    let mut scene = scene();
    (scene.capture.to_s, scene.capture.frames, scene.imu) = (1.5 * ORBIT_S, 150, Some(imu));
    let mut slow = Slow::new(93_002, 0.01);
    slow.white_rad = 2e-4;
    let mut inputs = inputs(&scene, &mut ByLatitude { slow, km }, 0.0).unwrap();
    with_start(&scene, &mut inputs);
    (scene, inputs)
}

/// The unit of the scene `atek` has steps of 0.03 degrees per second, eight times its noise. A satellite turns so
/// slowly that a number stays for a minute and more.
#[test]
fn coarse_steps_of_the_gyros_are_a_noise() {
    let (scene, inputs) =
        drawn(Imu { from_s: None, rate_hz: 5.0, ..Scenario::builtin("atek").unwrap().imu.unwrap() }, 4.5);
    let fused = fuse(&inputs, &settings(), Wanted { rate_hz: Some(0.1), ..Wanted::default() }).unwrap();
    let refused = fused.innovations.iter().filter(|one| !one.taken).count();
    let nees = nadir(&scene, &fused.epochs)[3];
    println!("{refused} of {} measurements are refused, NEES {nees:.2}", fused.innovations.len());
    assert!(refused * 100 < fused.innovations.len(), "{refused}");
}

/// The verdict knows the limb by latitude and the axes of the gyros as the filter does. With exact axes, a right mount
/// looked wrong. A mount that is wrong is found.
#[test]
fn the_limb_by_latitude_is_no_wrong_mount() {
    let (_, mut inputs) = drawn(scene().imu.unwrap(), 4.5);
    let judged = |inputs: &Inputs| {
        let fused = fuse(inputs, &settings(), Wanted { rate_hz: Some(0.1), ..Wanted::default() }).unwrap();
        let all: Vec<_> = fused.verdict.findings.iter().map(|f| f.what.clone()).collect();
        println!("{:?} {all:#?}", fused.verdict.level());
        (fused.verdict.level(), fused.verdict.likeliest().map(|finding| finding.cause))
    };
    assert_eq!(judged(&inputs).0, Level::Consistent);
    // Nine sigmas of the gyros' axes, whose turn looks like that of a mount.
    let turn = Rotation::from_scaled_axis(Vector::new(1f64.to_radians(), 0.0, 0.0));
    inputs.recordings[0].mount = inputs.recordings[0].mount.map(|mount| mount * turn);
    assert_eq!(judged(&inputs), (Level::Contradicts, Some(Cause::Mount)));
}

#[test]
#[ignore = "renders 570 pictures: minutes"]
fn an_infrared_orbit_is_solved() {
    let scene = scene();
    let mut inputs: Inputs = instruments(&scene).unwrap();
    let rows = recording(&scene);
    inputs.recordings.push(rows);
    with_start(&scene, &mut inputs);
    let settings = settings();
    for points in [false, true] {
        let began = std::time::Instant::now();
        let wanted = Wanted { solved: true, points, rate_hz: Some(0.1), ..Wanted::default() };
        let fused = fuse(&inputs, &settings, wanted).unwrap();
        let [filter, solve] = [&fused.epochs, &fused.smoothed].map(|epochs| nadir(&scene, epochs));
        println!(
            "points {points}: nadir in the last orbit, RMS, largest, sigma (deg), NEES (2): filter {filter:.4?}, solve \
             {solve:.4?}; {:?}, {:.1} s",
            fused.verdict.level(),
            began.elapsed().as_secs_f64()
        );
        for one in fused.solved.iter().flat_map(|s| &s.determined).filter(|one| one.name.starts_with("limb")) {
            println!("    {one:?}");
        }
        for finding in &fused.verdict.findings {
            println!("    {:?}: {}", finding.level, finding.what);
        }
        assert!(solve[0] < filter[0] && solve[3] < 20.0);
        assert_eq!(fused.verdict.level(), Level::Consistent);
    }
}
