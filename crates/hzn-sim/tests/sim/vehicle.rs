//! Several cameras on one vehicle: one attitude of the vehicle, and the mounts lead from it to every camera.

use hzn_core::body::Kind;
use hzn_core::config::Mount;
use hzn_sim::scenario::{CameraOnVehicle, Fault};
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
        fault: Fault::default(),
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
        let mut alone = Scenario::parse(&one.to_text().unwrap(), "scene.toml".as_ref()).unwrap();
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

#[test]
fn a_rig_has_tables_of_its_vehicle_and_faults_of_one_camera() {
    let mut scene = Scenario::builtin("ring").unwrap();
    scene.capture.frames = 4;
    let file = scene.rig_file().unwrap();
    let names: Vec<&str> = file.heads.iter().map(|head| head.name.as_str()).collect();
    assert_eq!(names, ["front", "right", "back", "left"]);
    let flights = |scene: &Scenario| scene.by_camera().iter().map(|one| one.flight().unwrap()).collect::<Vec<_>>();
    let good = flights(&scene);
    let (known, truth) = scene.vehicle_tables(&good).unwrap();
    assert_eq!((known.len(), truth.len()), (4, 4));
    for (row, flight) in truth.iter().zip(&good[0].frames) {
        // The vehicle's z axis points down, but for its tilt of at most 2 and 3 degrees.
        assert!(row.axis_z > 0.995 && row.has_limb(), "{row:?}");
        // A direction in the vehicle is the one in the camera, turned by the mount.
        let seen = flight.scene.truth("", 0.0).unwrap();
        let mount = rotation(file.heads[0].mount.unwrap().q_rig_from_camera_wxyz);
        let turned = mount * Vector3::new(seen.axis_x, seen.axis_y, seen.axis_z);
        assert!((turned - Vector3::new(row.axis_x, row.axis_y, row.axis_z)).norm() < 1e-7);
    }
    scene.cameras[1].fault = Fault { frozen_from_s: Some(2000.0), ..Fault::default() };
    scene.cameras[2].fault = Fault { turn_deg: [0.5, 0.0, 0.0], turn_from_s: 2000.0, ..Fault::default() };
    scene.cameras[3].fault = Fault { late_s: 0.5, ..Fault::default() };
    let wrong = flights(&scene);
    // Pictures are taken at 0, 1890, 3780 and 5670 s.
    assert_eq!(wrong[0], good[0]);
    assert_eq!(wrong[1].frames[1].scene, good[1].frames[1].scene);
    assert!(wrong[1].frames[2..].iter().all(|frame| frame.scene == good[1].frames[1].scene));
    let turn_deg = |n: usize| {
        let q = |flights: &[hzn_sim::Flight]| rotation(flights[2].frames[n].scene.pose.q_fixed_from_camera_wxyz);
        q(&wrong).angle_to(&q(&good)).to_degrees()
    };
    assert!(turn_deg(1) < 1e-9 && (turn_deg(2) - 0.5).abs() < 1e-9);
    assert_eq!(wrong[3].frames[1].time_s, good[3].frames[1].time_s + 0.5);
    scene.cameras.clear();
    assert!(scene.check().unwrap_err().to_string().starts_with("[rig]: [[cameras]]: the file has 0 of them"));
}
