//! `hzn simulate`, from beginning to end through the binary.

use std::path::Path;

const SCENE: &str = r#"
name = "small"
utc = 2019-06-13T10:30:00Z
[capture]
from_s = 70.0
to_s = 420.0
frames = 5
[camera]
width = 192
height = 128
model = "pinhole"
fx_px = 150.0
fy_px = 150.0
cx_px = 95.5
cy_px = 63.5
[trajectory.rocket]
[attitude.pointing]
off_nadir_deg = [75.0, 80.0]
azimuth_deg = [0.0, 200.0]
[world.visible]
[detector]
read_noise = 0.02
[imu]
rate_hz = 10
[gnss]
"#;

/// Runs hzn in a folder. Returns exit code, stdout, stderr.
fn hzn(folder: &Path, threads: &str, args: &[&str]) -> (i32, String, String) {
    let out = assert_cmd::Command::cargo_bin("hzn")
        .expect("the binary is built")
        .current_dir(folder)
        .env("RAYON_NUM_THREADS", threads)
        .args(args)
        .output()
        .expect("hzn starts");
    let text = |b: &[u8]| String::from_utf8_lossy(b).into_owned();
    (out.status.code().unwrap_or(-1), text(&out.stdout), text(&out.stderr))
}

#[test]
fn a_scene_becomes_pictures_that_the_sensor_answers() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    std::fs::write(at.join("my.toml"), SCENE).unwrap();
    let (code, stdout, stderr) = hzn(at, "2", &["simulate", "my.toml", "-o", "out"]);
    assert_eq!(code, 0, "{stderr}");
    assert!(
        stdout.contains("out: 5 pictures of small") && stdout.contains("limb of the earth in view in 5"),
        "{stdout}"
    );
    let lines = |name: &str| std::fs::read_to_string(at.join("out").join(name)).unwrap().lines().count();
    assert_eq!((lines("frames.csv"), lines("truth.csv")), (6, 6));
    // The tables cover 350 s with both ends, and have a header.
    assert_eq!((lines("imu.csv"), lines("gnss.csv")), (3502, 352));
    let sensor = std::fs::read_to_string(at.join("out/sensor.toml")).unwrap();
    assert!(sensor.contains("measured on 32 other pictures") && sensor.contains("sigma_px"), "{sensor}");

    // `hzn info` describes every file.
    for (file, kind, more) in [
        ("scene.toml", "scene, for `hzn simulate FILE`", "5, at "),
        ("sensor.toml", "sensor.toml", "lens "),
        ("imu.csv", "imu.csv, rates and accelerations", "rows             3501\n"),
        ("gnss.csv", "gnss.csv, fixes", "rows             351\n"),
        ("frames.csv", "frames.csv, the priors of pictures", "pictures         5\n"),
        ("truth.csv", "truth of pictures", "limb in view in 5 of 5"),
        ("small-00000.png", "PNG picture of", "1 channel of 8 bits"),
    ] {
        let (code, told, stderr) = hzn(at, "1", &["info", &format!("out/{file}")]);
        assert_eq!(code, 0, "{file}: {stderr}");
        assert!(told.starts_with(&format!("file             {kind}")) && told.contains(more), "{file}: {told}");
    }
    std::fs::write(at.join("any.csv"), "a,b\n1,2\n").unwrap();
    assert!(hzn(at, "1", &["info", "any.csv"]).1.starts_with("file             table that hzn does not know"));

    // The sensor processes the pictures without changes.
    let (code, stdout, stderr) = hzn(at, "2", &["run", "out"]);
    assert_eq!((code, stdout.lines().count()), (0, 6), "{stderr}");
    assert!(stdout.matches(",ok,").count() >= 4, "{stdout}");

    // One thread gives the same pictures, and so does a continued run.
    let read = |folder: &str, i: usize| std::fs::read(at.join(folder).join(format!("small-{i:05}.png"))).unwrap();
    assert_eq!(hzn(at, "1", &["simulate", "my.toml", "-o", "one", "-q"]).0, 0);
    assert!((0..5).all(|i| read("out", i) == read("one", i)));
    std::fs::remove_file(at.join("one/small-00003.png")).unwrap();
    let (code, _, stderr) = hzn(at, "1", &["simulate", "my.toml", "-o", "one", "--resume"]);
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(read("out", 3), read("one", 3));

    // Existing files are not overwritten, and not mixed with another scene.
    let (code, _, stderr) = hzn(at, "1", &["simulate", "my.toml", "-o", "one"]);
    assert_eq!(code, 2);
    assert!(stderr.contains("one: exists already"), "{stderr}");
    let (code, _, stderr) = hzn(at, "1", &["simulate", "my.toml", "-o", "one", "--resume", "--seed", "9"]);
    assert_eq!(code, 2);
    assert!(stderr.contains("is another scene"), "{stderr}");
}

#[test]
fn pictures_of_the_rendering_before_do_not_stay() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    std::fs::write(at.join("my.toml"), SCENE).unwrap();
    let simulate =
        |frames: &str| hzn(at, "2", &["simulate", "my.toml", "-o", "out", "--frames", frames, "--force", "-q"]).0;
    assert_eq!(simulate("3"), 0);
    // A picture without a truth belongs to the user.
    std::fs::write(at.join("out/mine.png"), b"mine").unwrap();
    assert_eq!(simulate("2"), 0);
    let there = |name: &str| at.join("out").join(name).exists();
    assert!(there("small-00001.png") && there("mine.png") && !there("small-00002.png"));
}

#[test]
fn impossible_values_are_refused_before_anything_is_written() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let refused = |text: &str| {
        std::fs::write(at.join("bad.toml"), text).unwrap();
        let (code, _, stderr) = hzn(at, "1", &["simulate", "bad.toml", "-o", "out"]);
        assert!(code == 2 && !at.join("out").exists(), "{code} {stderr}");
        stderr
    };
    assert_eq!(
        refused(&SCENE.replace("frames = 5", "frame = 5")),
        "error: bad.toml:7: [capture] frame: unknown key; did you mean frames?\n"
    );
    assert_eq!(
        refused(&SCENE.replace("frames = 5", "frames = 0")),
        "error: bad.toml:7: [capture] frames: 0 is refused: must be 1 to 100000\n"
    );
    let up = refused(&SCENE.replace("[75.0, 80.0]", "[180.0, 180.0]"));
    assert!(up.contains("[attitude]") && up.contains("no picture shows a lit limb"), "{up}");
    let late = refused(&SCENE.replace("to_s = 420.0", "to_s = 4200.0"));
    assert!(late.contains("[capture] to_s") && late.contains("after the impact"), "{late}");
    let table = SCENE.replace("[trajectory.rocket]", "[trajectory.table]\nfile = \"way.csv\"");
    assert!(refused(&table).contains("way.csv"));
    std::fs::write(at.join("way.csv"), "time_s,x_km,y_km,z_km\n0,6383,0,0\n500,6383,0,1\n").unwrap();
    let inside = refused(&table);
    assert!(
        inside.contains("[trajectory]: at 70.0 s the camera is at 4.9 km, inside the Earth or below its limb"),
        "{inside}"
    );

    let (code, _, stderr) = hzn(at, "1", &["simulate", "rockett", "-o", "out"]);
    assert_eq!((code, stderr.as_str()), (2, "error: rockett: no such scene or file; did you mean rocket?\n"));
}

/// Returns radiances for the whole year: the limb's half level is at 30 km over the north pole and 20 km over the south
/// pole.
fn radiances() -> String {
    let mut text = String::from("tangent_height_km,latitude_deg,radiance\n");
    for latitude in [-90.0, 90.0] {
        for height in [0.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 80.0] {
            let half_level = if latitude > 0.0 { 30.0 } else { 20.0 };
            let radiance = 0.4 * f64::clamp(1.0 - (height - half_level) / 10.0, 0.0, 2.0);
            text.push_str(&format!("{height},{latitude},{radiance:.3}\n"));
        }
    }
    text
}

#[test]
fn radiances_of_ones_own() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let (_, scene, _) = hzn(at, "1", &["simulate", "leo-infrared", "--show"]);
    let from = scene.find("[world.infrared.clouds]").unwrap();
    let to = scene.find("[detector]").unwrap();
    let scene = format!("{}table = \"radiance.csv\"\n\n{}", &scene[..from], &scene[to..]);
    std::fs::write(at.join("mine.toml"), &scene).unwrap();
    let simulate = |table: &str| {
        std::fs::write(at.join("radiance.csv"), table).unwrap();
        hzn(at, "2", &["simulate", "mine.toml", "-o", "out", "--frames", "24", "-q", "--force"])
    };
    let (code, _, stderr) = simulate(&radiances());
    assert_eq!(code, 0, "{stderr}");
    let sensor: toml::Table = std::fs::read_to_string(at.join("out/sensor.toml")).unwrap().parse().unwrap();
    let body = sensor["body"].as_table().unwrap();
    let height_km = body["limb_height_km"].as_float().unwrap();
    assert!((height_km - 25.0).abs() < 1.0, "{height_km}");
    let rows = body["limb_height_by_latitude_km"].as_array().unwrap();
    let of = |i: usize| rows[i].as_array().unwrap()[1].as_float().unwrap();
    assert!((of(rows.len() - 1) - of(0) - 10.0).abs() < 0.01, "{rows:?}");

    // The limb height agrees with the table.
    let (code, _, stderr) = hzn(at, "2", &["run", "out", "-o", "out.csv"]);
    assert_eq!(code, 0, "{stderr}");
    let (code, _, stderr) = hzn(at, "1", &["evaluate", "out.csv", "--truth", "out/truth.csv", "-o", "e.json"]);
    assert_eq!(code, 0, "{stderr}");
    let known: serde_json::Value = serde_json::from_slice(&std::fs::read(at.join("e.json")).unwrap()).unwrap();
    let rms_deg = known["evaluations"][0]["errors"]["rms_deg"].as_f64().unwrap();
    assert!(rms_deg < 0.05, "{rms_deg}");

    // The folder contains all files of its scene, so it can be moved.
    std::fs::rename(at.join("out"), at.join("moved")).unwrap();
    std::fs::remove_file(at.join("radiance.csv")).unwrap();
    let (code, _, stderr) = hzn(at, "2", &["simulate", "moved/scene.toml", "-o", "again", "-q"]);
    assert_eq!(code, 0, "{stderr}");
    for file in ["leo-infrared-00011.png", "scene.toml", "scene-radiance.csv", "sensor.toml"] {
        let read = |folder: &str| std::fs::read(at.join(folder).join(file)).unwrap();
        assert!(read("moved") == read("again"), "{file}");
    }
    std::fs::write(at.join("moved/scene-radiance.csv"), radiances().replace("0.600", "0.650")).unwrap();
    let (code, _, stderr) = hzn(at, "1", &["simulate", "moved/scene.toml", "-o", "again", "--resume"]);
    assert!(
        code == 2 && stderr.contains("again/scene-radiance.csv: differs from the file that the scene names"),
        "{stderr}"
    );

    let (code, _, stderr) = simulate(&radiances().replacen("0.800", "0.000", 1));
    let what = "line 2: radiance = 0 at 0 km at latitude -90 and season 0 deg: must be above 0 at the lowest";
    assert!(code == 2 && stderr.contains(what), "{stderr}");
    let (code, _, stderr) = simulate(&radiances().replace("25,90,0.600", "25,90,6"));
    assert_eq!(code, 2);
    let what = "line 15: radiance = 6: must be 0 to 1, a fraction of full scale";
    assert!(stderr.contains("mine.toml: [world] infrared.table: ") && stderr.contains(what), "{stderr}");
    std::fs::write(at.join("mine.toml"), scene.replace("table =", "scale_km = 3.0\ntable =")).unwrap();
    let (code, _, stderr) = simulate(&radiances());
    assert!(code == 2 && stderr.contains("scale_km has no effect with a table"), "{stderr}");
}

#[test]
fn built_in_scenes_can_be_listed_and_printed() {
    let at = tempfile::tempdir().unwrap();
    let (code, list, _) = hzn(at.path(), "1", &["simulate", "--list"]);
    assert_eq!((code, list.lines().count()), (0, 16));
    for line in list.lines() {
        let name = line.split_whitespace().next().unwrap();
        let (code, text, _) = hzn(at.path(), "1", &["simulate", name, "--show"]);
        assert!(code == 0 && text.contains(&format!("name = \"{name}\"")), "{text}");
    }
}

#[test]
fn each_camera_of_a_scene_has_a_folder() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let camera = |name: &str, q: &str| {
        format!(
            "[[cameras]]\nname = \"{name}\"\nmount_error_deg = 0.5\nclock.offset_s = \
             0.2\nmount.q_vehicle_from_camera_wxyz = {q}\n"
        )
    };
    let cameras = camera("fore", "[1, 0, 0, 0]") + &camera("aft", "[0, 0, 1, 0]");
    // Camera aft looks the other way, so it looks away from the Earth here and there.
    let scene = SCENE.replace("[trajectory.rocket]", &(cameras + "[trajectory.rocket]"));
    let scene = scene.replace("[75.0, 80.0]", "[85.0, 95.0]");
    std::fs::write(at.join("two.toml"), scene).unwrap();
    let (code, stdout, stderr) = hzn(at, "2", &["simulate", "two.toml", "-o", "out", "-q"]);
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("hzn run out/fore -o out/fore.csv"), "{stdout}");
    for file in
        ["imu.csv", "gnss.csv", "vehicle.csv", "scene.toml", "fore/sensor.toml", "aft/frames.csv", "aft/truth.csv"]
    {
        assert!(at.join("out").join(file).is_file(), "{file}");
    }
    let (code, _, stderr) = hzn(at, "2", &["run", "out/aft", "-o", "aft.csv", "-q"]);
    assert_eq!(code, 0, "{stderr}");
    std::fs::remove_file(at.join("out/aft/aft-00002.png")).unwrap();
    let (code, _, stderr) = hzn(at, "2", &["simulate", "two.toml", "-o", "out", "-q", "--resume"]);
    assert!(code == 0 && at.join("out/aft/aft-00002.png").is_file(), "{stderr}");
}

#[test]
fn a_planet_has_frames_with_attitude_and_truth_with_position() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let (code, stdout, stderr) = hzn(at, "2", &["simulate", "saturn", "-o", "out", "--frames", "2"]);
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("limb of the saturn in view in 2"), "{stdout}");
    let read = |name: &str| std::fs::read_to_string(at.join("out").join(name)).unwrap();
    assert!(read("frames.csv").starts_with("file,time_s,qw,qx,qy,qz,attitude_sigma_deg,sun_x,sun_y,sun_z\n"));
    let truth = read("truth.csv");
    assert!(truth.lines().next().unwrap().ends_with("position_x_km,position_y_km,position_z_km,phase_deg"), "{truth}");
    assert_eq!(truth.matches(",saturn,1,").count(), 2, "{truth}");
    let sensor: toml::Table = read("sensor.toml").parse().unwrap();
    let body = sensor["body"].as_table().unwrap();
    assert_eq!((body["kind"].as_str(), body["limb_height_sigma_km"].as_float()), (Some("saturn"), Some(60.0)));
    assert!(body["limb_height_km"].as_float().unwrap() > 100.0 && !body.contains_key("radii_km"));
    // scene.toml gives the same pictures, another seed other ones.
    let picture = |folder: &str| std::fs::read(at.join(folder).join("saturn-00001.png")).unwrap();
    assert_eq!(hzn(at, "1", &["simulate", "out/scene.toml", "-o", "again", "-q"]).0, 0);
    assert_eq!(picture("again"), picture("out"));
    assert_eq!(hzn(at, "1", &["simulate", "saturn", "-o", "other", "--frames", "2", "--seed", "2", "-q"]).0, 0);
    assert_ne!(picture("other"), picture("out"));
    let (_, info, _) = hzn(at, "1", &["info", "out/scene.toml"]);
    assert!(info.contains("bodies           saturn\n"), "{info}");
}

/// Returns the product of two quaternions, scalar first.
fn product([a, b, c, d]: [f64; 4], [w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    ]
}

#[test]
fn two_cameras_follow_the_vehicle_of_the_first_one() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    // The second camera is turned by 90 degrees about its axis.
    let mounts = [[0.8, 0.6, 0.0, 0.0], [0.565_685_425, 0.424_264_069, -0.424_264_069, 0.565_685_425]];
    let camera =
        |name: &str, q: [f64; 4]| format!("[[cameras]]\nname = {name:?}\nmount.q_vehicle_from_camera_wxyz = {q:?}\n");
    let scene = format!("{SCENE}{}{}", camera("first", mounts[0]), camera("second", mounts[1]));
    std::fs::write(at.join("my.toml"), scene).unwrap();
    let (code, _, stderr) = hzn(at, "2", &["simulate", "my.toml", "-o", "out", "-q"]);
    assert_eq!(code, 0, "{stderr}");
    let mut table = csv::Reader::from_path(at.join("out/vehicle.csv")).unwrap();
    let vehicle: Vec<hzn_files::vehicle::VehicleRow> = table.deserialize().collect::<Result<_, _>>().unwrap();
    for (name, mount) in ["first", "second"].into_iter().zip(mounts) {
        assert!(!at.join("out").join(name).join("vehicle.csv").exists());
        let truth = hzn_files::truth::load(&at.join("out").join(name).join("truth.csv")).unwrap();
        assert_eq!(truth.len(), 5);
        for (i, row) in truth.iter().enumerate() {
            let at_time = vehicle.iter().find(|v| (v.time_s - row.time_s).abs() < 1e-6).unwrap();
            let q = product([at_time.qw, at_time.qx, at_time.qy, at_time.qz], mount);
            let cos: f64 = q.iter().zip([row.qw, row.qx, row.qy, row.qz]).map(|(a, b)| a * b).sum();
            assert!(cos.abs() > 1.0 - 1e-9, "{name} {i}: {cos}");
            // Both look along the same axis, which has the angle that was asked for.
            let off_nadir_deg = row.axis_z.acos().to_degrees();
            assert!((off_nadir_deg - (75.0 + 1.25 * i as f64)).abs() < 0.3, "{name} {i}: {off_nadir_deg}");
        }
    }
    // The scene of the second camera alone gives the same pictures.
    let (code, _, stderr) = hzn(at, "2", &["simulate", "out/second/scene.toml", "-o", "alone", "-q"]);
    assert_eq!(code, 0, "{stderr}");
    for file in ["truth.csv", "second-00003.png"] {
        assert!(
            std::fs::read(at.join("alone").join(file)).unwrap()
                == std::fs::read(at.join("out/second").join(file)).unwrap()
        );
    }
}
