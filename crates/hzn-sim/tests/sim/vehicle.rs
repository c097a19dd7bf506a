//! Several cameras on one vehicle: one attitude of the vehicle, and the mounts lead from it to every camera.

use hzn_core::body::Kind;
use hzn_core::config::Mount;
use hzn_sim::scenario::CameraOnVehicle;
use hzn_sim::trajectory::{Attitude, Orbit, Path, Pointing, Table, Towards, Trajectory};
use hzn_sim::{Look, Pose, Scenario, World, pose::position_m};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

fn rotation([w, x, y, z]: [f64; 4]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

/// A camera that is mounted with this rotation vector, radians.
fn camera(name: &str, mount: [f64; 3], mount_error_deg: f64) -> CameraOnVehicle {
    let q = UnitQuaternion::from_scaled_axis(Vector3::from(mount));
    CameraOnVehicle {
        name: name.into(),
        mount: Mount { q_vehicle_from_camera_wxyz: [q.w, q.i, q.j, q.k] },
        mount_error_deg,
        clock: hzn_sim::scenario::Clock::default(),
        vehicle: Vec::new(),
    }
}

/// Returns a scene with two cameras. The second one has an error of its mount.
fn scene(name: &str, change: impl Fn(&mut Scenario)) -> Scenario {
    let mut scene = Scenario::builtin(name).unwrap();
    scene.capture.frames = 5;
    scene.cameras = vec![camera("first", [0.3, -0.5, 0.2], 0.0), camera("second", [0.4, -0.45, 1.4], 1.0)];
    change(&mut scene);
    scene
}

/// Asserts that both cameras fly on the same vehicle, and returns its path.
fn check(scene: &Scenario) -> Path {
    let path = scene.path().unwrap();
    let span_s = scene.span_s();
    let vehicle: Vec<_> = path.vehicle_rows(span_s, 0.1).collect();
    let mut compared = 0;
    for one in scene.by_camera() {
        // scene.toml of the camera's folder is a scene of its own.
        let mut alone: Scenario = toml::from_str(&toml::to_string(&one).unwrap()).unwrap();
        if let (Trajectory::Table(alone), Trajectory::Table(one)) = (&mut alone.trajectory, &one.trajectory) {
            alone.text.clone_from(&one.text);
        }
        assert_eq!(alone, one);
        assert!(alone.path().unwrap().vehicle_rows(span_s, 0.1).eq(vehicle.iter().copied()), "{}", one.name);
        for frame in alone.flight().unwrap().frames {
            let truth = frame.scene.truth(&frame.file, frame.time_s).unwrap();
            let row = path.vehicle(frame.time_s);
            let q = rotation([row.qw, row.qx, row.qy, row.qz]) * rotation(one.true_q_vehicle_from_camera_wxyz());
            let error_rad = q.angle_to(&rotation([truth.qw, truth.qx, truth.qy, truth.qz]));
            assert!(error_rad < 1e-7, "{} {}: {error_rad}", one.name, frame.time_s);
            compared += 1;
        }
    }
    assert_eq!(compared, 10);
    path
}

/// Asserts that the first camera has the attitude of the same scene with this camera alone.
fn check_first(scene: &Scenario) {
    let alone = Scenario { mount: Some(scene.cameras[0].mount), cameras: Vec::new(), ..scene.clone() };
    let (alone, first) = (alone.path().unwrap(), scene.by_camera()[0].path().unwrap());
    for time_s in scene.times_s() {
        assert_eq!(alone.camera(time_s), first.camera(time_s));
    }
}

/// A lens of 180 degrees, and the Earth without clouds.
fn simple(scene: &mut Scenario) {
    scene.camera = hzn_core::camera::Config::ideal(hzn_core::camera::Model::Equidistant, 96, 96, 30.0);
    scene.world = World::Plain;
    scene.trajectory = Trajectory::Orbit(Orbit::default());
}

#[test]
fn the_first_camera_points_and_the_second_one_follows() {
    let off_nadir_deg = [20.0, 70.0];
    let scene = scene("tumble", |scene| {
        simple(scene);
        scene.attitude =
            Attitude::Pointing(Pointing { off_nadir_deg, azimuth_deg: [10.0, 300.0], ..Pointing::default() });
    });
    check(&scene);
    check_first(&scene);
    let angles_deg: Vec<f64> = scene.by_camera()[0]
        .flight()
        .unwrap()
        .frames
        .iter()
        .map(|frame| {
            let pose = &frame.scene.pose;
            let axis = rotation(pose.q_fixed_from_camera_wxyz) * Vector3::z();
            // Straight down is the normal of the ellipsoid, up to 0.2 degrees from the centre of the Earth.
            axis.angle(&-Vector3::from(pose.position_m)).to_degrees()
        })
        .collect();
    for (angle_deg, asked_deg) in angles_deg.iter().zip([20.0, 32.5, 45.0, 57.5, 70.0]) {
        assert!((angle_deg - asked_deg).abs() < 0.3, "{angles_deg:?}");
    }
}

#[test]
fn the_first_camera_looks_at_a_body_and_the_second_one_follows() {
    let scene = scene("tumble", |scene| {
        simple(scene);
        scene.attitude = Attitude::Towards(Towards { bodies: vec![Kind::Earth], wander_deg: 2.0 });
    });
    check(&scene);
    check_first(&scene);
}

#[test]
fn a_table_has_the_attitude_of_the_first_camera() {
    let mut text = "time_s,x_km,y_km,z_km,qw,qx,qy,qz\n".to_owned();
    for (time_s, lat_deg) in [(0.0, 0.0), (750.0, 40.0), (1500.0, 80.0)] {
        let look = Look::off_nadir(0.5, 0.01 * lat_deg, 0.02 * lat_deg);
        let pose = Pose::looking(position_m(lat_deg, 10.0, 600.0), look);
        let ([x, y, z], [w, i, j, k]) = (pose.position_m.map(|m| m * 1e-3), pose.q_fixed_from_camera_wxyz);
        text += &format!("{time_s},{x},{y},{z},{w},{i},{j},{k}\n");
    }
    let scene = scene("tumble", |scene| {
        simple(scene);
        scene.trajectory = Trajectory::Table(Table { file: "way.csv".into(), text: Some(text.clone()) });
        scene.attitude = Attitude::Table;
    });
    check(&scene);
    check_first(&scene);
}

#[test]
fn the_first_camera_is_aimed_at_a_planet_and_the_second_one_follows() {
    let scene = scene("jupiter", |scene| {
        // The second camera looks in the same direction, turned about its axis.
        scene.cameras = vec![camera("first", [0.0, 0.5, 0.0], 0.0), camera("second", [0.0, 0.52, 0.0], 0.1)];
    });
    check(&scene);
    check_first(&scene);
}

#[test]
fn a_vehicle_with_an_attitude_of_its_own_carries_both_cameras() {
    let mut tumble = scene("tumble", simple);
    tumble.capture.to_s = 200.0;
    check(&tumble);
    let mut rocket = Scenario::builtin("atek").unwrap();
    rocket.capture.frames = 5;
    check(&rocket);
}
