//! What a rig says of itself: the mounts of its heads, and a coarse direction without a limb.

use std::fs;

use crate::common::{Place, SENSOR, cell, rows};

const HEADS: [&str; 4] = ["front", "right", "back", "left"];

/// Simulates the scene `ring` with small pictures, and a vehicle that turns.
fn turning(frames: &str) -> Place {
    turning_for(frames, "5670.0")
}

/// Renders the same scene until this time in seconds.
fn turning_for(frames: &str, to_s: &str) -> Place {
    let place = Place::new();
    let scene = place.run(&["simulate", "ring", "--show"]).expect(0).out;
    let scene = scene.replace("width = 640\nheight = 480", "width = 320\nheight = 240").replace("554.0", "277.0");
    let scene = scene.replace("319.5", "159.5").replace("239.5", "119.5");
    let scene = scene.replace("to_s = 5670.0", &format!("to_s = {to_s}"));
    let scene = scene.replace("[66.0, 70.0]", "[48.0, 88.0]").replace("[-3.0, 3.0]", "[-20.0, 20.0]");
    place.write("ring.toml", scene.as_bytes());
    place.run(&["simulate", "ring.toml", "-o", "ring", "--frames", frames, "--no-noise", "-q"]).expect(0);
    place
}

/// Returns the mounts of a rig.toml as unit quaternions.
fn mounts(text: &str) -> Vec<[f64; 4]> {
    let table: toml::Table = text.parse().unwrap();
    let heads = table["head"].as_array().unwrap().iter();
    let number = |x: &toml::Value| x.as_float().or(x.as_integer().map(|i| i as f64)).unwrap();
    let quaternion = |head: &toml::Value| -> [f64; 4] {
        let list = head["mount"]["q_rig_from_camera_wxyz"].as_array().unwrap();
        core::array::from_fn(|i| number(&list[i]))
    };
    heads.map(quaternion).collect()
}

/// Returns the product of two quaternions.
fn product([aw, ax, ay, az]: [f64; 4], [bw, bx, by, bz]: [f64; 4]) -> [f64; 4] {
    hzn_files::rig::turn_after([aw, ax, ay, az], [bw, bx, by, bz])
}

fn conjugate([w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [w, -x, -y, -z]
}

/// Returns the largest angle between the relative mounts of two rigs, degrees.
fn largest_deg(a: &[[f64; 4]], b: &[[f64; 4]]) -> f64 {
    let relative = |mounts: &[[f64; 4]], k: usize| product(conjugate(mounts[0]), mounts[k]);
    let angle = |k: usize| {
        let [_, x, y, z] = product(conjugate(relative(a, k)), relative(b, k));
        2.0 * (x * x + y * y + z * z).sqrt().min(1.0).asin().to_degrees()
    };
    (1..a.len()).map(angle).fold(0.0, f64::max)
}

#[test]
fn mounts_are_found_from_the_limbs_that_the_heads_see_together() {
    let place = turning("24");
    let good = place.read("ring/rig.toml");
    let truth = mounts(&good);
    let (sin, cos) = 0.4f64.to_radians().sin_cos();
    let wrong = product([cos, 0.6 * sin, 0.0, 0.8 * sin], truth[1]);
    let list = |q: [f64; 4]| q.map(|x| format!("{x:?}")).join(", ");
    let told = good.split("q_rig_from_camera_wxyz = [").nth(2).unwrap().split(']').next().unwrap();
    place.write("ring/wrong.toml", good.replace(told, &list(wrong)).as_bytes());
    let calibrate = |more: &[&str]| place.run(&[&["calibrate", "rig", "ring/wrong.toml", "-q"], more].concat());
    // A wrong lens would look the same, and these mounts would hide it.
    let doubt = "warning: the mount told in rig.toml does not hold: right has turned by 0.";
    let out = calibrate(&["-o", "ring/found.toml"]).expect(0).says(doubt).out;
    assert!(out.contains("epochs") && out.contains("right          turned by"), "{out}");
    let found = mounts(&place.read("ring/found.toml"));
    let (before, after) = (largest_deg(&mounts(&place.read("ring/wrong.toml")), &truth), largest_deg(&found, &truth));
    assert!(before > 0.7 && after < 0.25 * before, "{before} {after}");
    // The file is a rig.toml, with a covariance of each mount; nothing is replaced unasked, or written elsewhere.
    place.run(&["run", "ring/found.toml", "-o", "r.csv", "-q"]).expect(0);
    assert!(place.read("ring/found.toml").contains("covariance_deg2"));
    calibrate(&["-o", "ring/found.toml"]).expect(2).says("--force replaces it");
    calibrate(&["-o", "found.toml"]).expect(2).says("write it next to");
    // The check names the head that has turned, and finds no fault in right mounts.
    let checked = calibrate(&["--check"]).expect(1).out;
    assert!(checked.starts_with("mounts         does not hold: right has turned by 0."), "{checked}");
    let checked = place.run(&["calibrate", "rig", "ring/rig.toml", "-q", "--check"]).expect(0).out;
    assert!(checked.starts_with("mounts         holds"), "{checked}");
    // What would have been noticed is told for each head and axis.
    let axes = checked.lines().filter(|line| line.contains("about x, y, z of its camera: ")).count();
    assert_eq!(axes, 4, "{checked}");
    calibrate(&["--prior-deg", "0"]).expect(2).says("--prior-deg");
    two_heads(&place);
}

/// Two heads whose mounts are right are not doubted.
fn two_heads(place: &Place) {
    let mut rig = hzn_files::rig::load(&place.path("ring/rig.toml")).unwrap();
    rig.heads.retain(|head| head.name == "front" || head.name == "right");
    rig.heads.iter_mut().for_each(|head| head.mount.as_mut().unwrap().sigma_deg = 0.01);
    place.write("ring/two.toml", hzn_files::rig::to_text(&rig).unwrap().as_bytes());
    let right = place.run(&["run", "ring/two.toml", "-o", "two.csv", "-q", "--force"]).expect(0).err;
    assert!(!right.contains("doubtful"), "{right}");
    // Mounts that would be less sure than the told ones are not written.
    let again = ["calibrate", "rig", "ring/two.toml", "-q", "-o", "ring/two-found.toml"];
    place.run(&again).expect(1).says("give --prior-deg 0.01");
    assert!(!place.path("ring/two-found.toml").exists());
}

#[test]
fn a_rig_without_a_limb_says_where_the_body_is() {
    let place = turning("2");
    let answers = |name: &str| {
        place.run(&["run", "ring/rig.toml", "-o", name, "-q"]).expect(0);
        let all = rows(&place.read(name));
        all.into_iter().filter(|row| cell(row, "head") == "rig").collect::<Vec<_>>()
    };
    for row in answers("good.csv") {
        assert!(cell(&row, "status") == "ok" && cell(&row, "coarse_x").is_empty(), "{row:?}");
        // The half-angle gives the altitude at the limb height, and the limb height at the altitude.
        let number = |name: &str| cell(&row, name).parse::<f64>().unwrap();
        assert!((number("limb_height_est_km") - 25.0).abs() < 8.0, "{row:?}");
        let miss = (number("altitude_est_km") - number("altitude_km")).abs();
        assert!(miss < 4.0 * number("altitude_est_sigma_km"), "{row:?}");
    }
    // One head sees only the body, and the others only the sky.
    let picture = |brightness: u8| {
        let mut bytes = Vec::new();
        let image = image::GrayImage::from_pixel(320, 240, image::Luma([brightness]));
        image.write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png).unwrap();
        bytes
    };
    for head in HEADS {
        for i in 0..2 {
            // A picture that repeats the one before it is of a frozen head, and says nothing.
            let bytes = picture(i + if head == "front" { 160 } else { 8 });
            fs::write(place.path(&format!("ring/{head}/{head}-{i:05}.png")), &bytes).unwrap();
        }
    }
    for row in answers("none.csv") {
        assert!(cell(&row, "status") == "no-limb" && cell(&row, "axis_x").is_empty(), "{row:?}");
        let number = |name: &str| cell(&row, name).parse::<f64>().unwrap();
        // The first head looks along the vehicle's x axis, 68 degrees from z, and the Earth is on its side.
        assert!(number("coarse_x") > 0.7 && number("coarse_sigma_deg") < 40.0, "{row:?}");
    }
}

#[test]
fn a_rig_begins_with_its_folders_and_mounts() {
    let place = Place::new();
    for head in ["left", "right"] {
        fs::create_dir_all(place.path(head)).unwrap();
    }
    let init = |more: &[&str]| place.run(&[&["init", "--rig", "left", "right"], more].concat());
    init(&[]).expect(2).says("`hzn calibrate rig` then finds the mounts");
    init(&["--mount", "1,0,0,0"]).expect(2).says("2 folders and 1 mounts");
    init(&["--mount", "1,0,0", "--mount", "1,0,0,0"]).expect(2).says("expected the four numbers");
    init(&["--mount", "1,0,0,0", "--mount", "1,1,0,0"]).expect(2).says("the quaternion's squared length must be 1");
    let good = ["--mount", "1,0,0,0", "--mount=-0.6,0,0,0.8"];
    // A head without a sensor.toml cannot run, and the next step says so.
    init(&good).expect(0).says("rig.toml written").says("hzn init left --fov DEG").says("hzn init right --fov DEG");
    place.write("left/sensor.toml", SENSOR.as_bytes());
    let ran = init(&[&good[..], &["--force"]].concat()).expect(0).says("hzn init right --fov DEG");
    assert!(!ran.err.contains("hzn init left"), "{}", ran.err);
    assert_eq!(mounts(&place.read("rig.toml")), [[1.0, 0.0, 0.0, 0.0], [-0.6, 0.0, 0.0, 0.8]]);
    let rig = hzn_files::rig::load(&place.path("rig.toml")).unwrap();
    assert_eq!((rig.heads[1].name.as_str(), rig.heads[1].mount.unwrap().sigma_deg), ("right", 1.0));
    init(&good).expect(2).says("--force replaces it");
    init(&[&good[..], &["-o", "left/rig.toml"]].concat()).expect(2).says("give its name alone");
    place.run(&["init", "--rig", "none", "--mount", "1,0,0,0", "-o", "n.toml"]).expect(2).says("none: is no folder");
    // The second camera is turned by 90 degrees about z against the first.
    let pose = "  T_cn_cnm1:\n  - [0.0, -1.0, 0.0, 0.1]\n  - [1.0, 0.0, 0.0, 0.0]\n  - [0.0, 0.0, 1.0, 0.0]\n  - [0.0, \
                0.0, 0.0, 1.0]\n";
    place.write("chain.yaml", format!("cam0:\n  camera_model: pinhole\ncam1:\n{pose}").as_bytes());
    init(&["--camchain", "chain.yaml", "-o", "chain.yaml", "--force"]).expect(2).says("chain.yaml");
    init(&["--camchain", "chain.yaml", "-o", "chain.toml"]).expect(0).says("chain.toml written");
    let half = 0.5f64.sqrt();
    for (found, expected) in
        mounts(&place.read("chain.toml")).iter().zip([[1.0, 0.0, 0.0, 0.0], [half, 0.0, 0.0, -half]])
    {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}");
    }
    place
        .run(&["init", "--rig", "left", "--camchain", "chain.yaml", "-o", "n.toml"])
        .expect(2)
        .says("1 folders and 2 mounts");
}

#[test]
fn mounts_that_the_joint_answer_refuses_do_not_hold() {
    // In twelve seconds, all epochs see one weather of the limb, and no turn of a degree is significant.
    let place = turning_for("24", "12.0");
    let good = place.read("ring/rig.toml");
    let (sin, cos) = 0.5f64.to_radians().sin_cos();
    let wrong = product([cos, 0.6 * sin, 0.0, 0.8 * sin], mounts(&good)[1]);
    let told = good.split("q_rig_from_camera_wxyz = [").nth(2).unwrap().split(']').next().unwrap();
    let wrong = wrong.map(|x| format!("{x:?}")).join(", ");
    place.write("ring/wrong.toml", good.replace(told, &wrong).as_bytes());
    let check = |rig: &str| place.run(&["calibrate", "rig", rig, "-q", "--check"]);
    let out = check("ring/wrong.toml").expect(1).out;
    assert!(out.starts_with("mounts         does not hold: in ") && out.contains("rig.false_alarm"), "{out}");
    // The run says it in the same words, although it is quiet.
    let run = |rig: &str, out: &str| place.run(&["run", rig, "-q", "-o", out]).expect(0);
    run("ring/wrong.toml", "w.csv").says("the answers are doubtful: the heads contradict each other in ");
    assert!(check("ring/rig.toml").expect(0).out.starts_with("mounts         holds"));
    assert!(!run("ring/rig.toml", "r.csv").err.contains("doubtful"));
}
