//! `hzn calibrate mount`, through the binary.

use crate::common::Place;

/// A camchain of kalibr_calibrate_imu_camera whose camera is turned by `turn_rad` more about its z axis.
fn camchain(turn_rad: f64, shift_s: f64) -> String {
    let (sin, cos) = turn_rad.sin_cos();
    format!(
        "cam0:\n  T_cam_imu:\n  - [{cos}, {sin}, 0.0, 0.02]\n  - [{}, {cos}, 0.0, -0.05]\n  - [0.0, 0.0, 1.0, \
         0.01]\n  - [0.0, 0.0, 0.0, 1.0]\n  camera_model: pinhole\n  intrinsics: [300, 300, 160, 120]\n  \
         distortion_model: none\n  distortion_coeffs: []\n  resolution: [320, 240]\n  timeshift_cam_imu: {shift_s}\n",
        -sin
    )
}

/// Returns the quaternion of a table [mount].
fn quaternion(text: &str) -> [f64; 4] {
    let table: toml::Table = text.parse().unwrap();
    let list = table["mount"]["q_vehicle_from_camera_wxyz"].as_array().unwrap();
    core::array::from_fn(|i| list[i].as_float().unwrap())
}

#[test]
fn kalibrs_pose_and_clock() {
    let place = Place::new();
    for (name, turn, shift) in [("a", 0.10, 0.004), ("b", 0.102, 0.005), ("c", 0.101, 0.006)] {
        place.write(&format!("{name}.yaml"), camchain(turn, shift).as_bytes());
    }
    let kalibr = |more: &[&str]| place.run(&[&["calibrate", "mount", "kalibr", "a.yaml"], more].concat());
    kalibr(&[]).expect(2).says("Kalibr states no sigma of T_cam_imu");
    kalibr(&["--sigma-deg", "-1"]).expect(2).says("--sigma-deg: must be 0 or more");
    let out = kalibr(&["--sigma-deg", "0.05"]).expect(0).out;
    // The camera is turned against the inertial unit, so the mount turns the other way: q = (cos 0.05, 0, 0, sin 0.05).
    let expected = [0.05f64.cos(), 0.0, 0.0, 0.05f64.sin()];
    let found = quaternion(out.split("\n\n").next().unwrap());
    assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-8), "{found:?}");
    assert!(out.contains("[cameras.camera]") && out.contains("sigma = 0.0500"), "{out}");
    let files = ["b.yaml", "c.yaml", "--name", "left", "-o", "mount.toml", "--fuse", "fuse.toml"];
    kalibr(&files).expect(0).says("hzn fuse --clock left=0.005000");
    let mean = quaternion(&place.read("mount.toml"));
    assert!((mean[3] - (0.101f64 / 2.0).sin()).abs() < 1e-8, "{mean:?}");
    // The scatter is 1 mrad and 1 ms.
    let fuse: toml::Table = place.read("fuse.toml").parse().unwrap();
    let sigma = |key: &str| fuse["cameras"]["left"][key]["sigma"].as_float().unwrap();
    assert!((sigma("misalignment_deg") - 0.0573).abs() < 2e-4 && (sigma("clock_s") - 1e-3).abs() < 1e-5);
    hzn_fuse::Settings::load(&place.path("fuse.toml")).unwrap();
    hzn_fuse::input::mount(&place.path("mount.toml")).unwrap();
    kalibr(&files).expect(2).says("--force replaces it");
    // A conversion of the lens says where the pose is.
    place.run(&["camera", "convert", "a.yaml"]).expect(0).says("hzn calibrate mount kalibr");
}

#[test]
fn an_earlier_flight() {
    let place = Place::new();
    let columns = "time_s,phase,left_misalignment_x_deg,left_misalignment_y_deg,left_misalignment_z_deg,\
                   left_misalignment_sigma_x_deg,left_misalignment_sigma_y_deg,left_misalignment_sigma_z_deg,\
                   left_clock_s,left_clock_sigma_s\n";
    let rows = "1,filter,0.1,0.2,0.3,1,1,1,0,0.2\n2,filter,0,0,2,0.1,0.11,0.2,0.01,0.02\n\
                1,smoothed,0,0,1.8,0.09,0.1,0.15,0.012,0.011\n";
    place.write("nav.csv", (columns.to_owned() + rows).as_bytes());
    place.write("told.toml", b"[mount]\nvehicle_from_camera = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]\n");
    let flight =
        |name: &str| place.run(&["calibrate", "mount", "flight", "nav.csv", "--told", "told.toml", "--name", name]);
    flight("right").expect(2).says("has no mount of a camera \"right\"; its cameras: left");
    let out = flight("left").expect(0).out;
    // A quarter turn about z, then 1.8° more about the camera's z axis.
    let half = 91.8f64.to_radians() / 2.0;
    let found = quaternion(out.split("\n\n").next().unwrap());
    assert!((found[0] - half.cos()).abs() < 1e-8 && (found[3] - half.sin()).abs() < 1e-8, "{found:?}");
    assert!(out.contains("0.0900, 0.1000, 0.1500 deg") && out.contains("sigma = 0.150"), "{out}");
    assert!(out.contains("sigma = 0.0110"), "{out}");
    // What `hzn fuse` also writes: the mount that the flight was told, and the verdict over it.
    let with = |told: &str, verdict: &str| {
        let parts = ["w", "x", "y", "z"].map(|part| format!(",left_told_q_vehicle_from_camera_{part}"));
        let header = columns.replace('\n', &format!("{},verdict\n", parts.concat()));
        let rows = rows.replace('\n', &format!(",{told},{verdict}\n"));
        place.write("nav.csv", (header + &rows).as_bytes());
        flight("left")
    };
    let (quarter, other) = ("0.7071067811865476,0,0,0.7071067811865476", "1,0,0,0");
    assert_eq!(with(quarter, "consistent").expect(0).out, out);
    with(quarter, "doubtful").expect(0).says("the verdict of hzn fuse over this flight is `doubtful`");
    with(quarter, "contradicts").expect(1).says("the verdict of hzn fuse over this flight is `contradicts`");
    with(other, "consistent").expect(2).says("is not the mount that the flight was told for left");
}

#[test]
fn tilts_are_read_with_care() {
    let place = Place::new();
    place.write("s.toml", crate::common::SENSOR.as_bytes());
    let run = |table: &str| {
        place.write("tilt.csv", table.as_bytes());
        let board = ["--board", "9x6", "--lens", "s.toml", "--tilt", "tilt.csv"];
        place.run(&[&["calibrate", "mount", "board", "nowhere.png"][..], &board].concat())
    };
    run("file,accel_x_mps2\na.png,1\n").expect(2).says("the column accel_y_mps2 is missing");
    let columns = "file,accel_x_mps2,accel_y_mps2,accel_z_mps2\n";
    run(&format!("{columns}a.png,0,0,1.0\n")).expect(2).says("tilt.csv:2: the specific force is 1.000 m/s²");
    run(&format!("{columns}a.png,0,x,9.8\n")).expect(2).says("accel_y_mps2: \"x\" is not a number");
}
