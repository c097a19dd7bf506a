//! The window on several heads that are one sensor.

use std::path::{Path, PathBuf};

use egui::Key;
use egui_kittest::kittest::Queryable;
use hzn_core::camera::{Camera, Config, Model};
use hzn_core::pixel::ImagePoint;
use hzn_core::status::Status;
use tempfile::TempDir;

use crate::window::*;

/// Angle from the optical axes of the heads to the Earth, rad.
const PITCH_RAD: f64 = 1.15;
/// The epoch in which the second head looks somewhere else, and by how much, rad.
const TURNED: (u32, f64) = (2, 0.05);

/// Writes the pictures of a head, whose Earth is at the angle of the epoch. Noise makes each picture another one.
fn head(folder: &Path, seed: u32, pitch_rad: impl Fn(u32) -> f64) {
    std::fs::create_dir(folder).unwrap();
    let camera = Camera::<f64>::try_new(&Config::ideal(Model::Pinhole, WIDTH, HEIGHT, 260.0)).unwrap();
    let half_angle = (6381.0088f64 / 6611.0088).asin();
    let mut table = String::from("file,time_s\n");
    for epoch in 0..4 {
        let (sin, cos) = pitch_rad(epoch).sin_cos();
        let picture = image::GrayImage::from_fn(WIDTH.into(), HEIGHT.into(), |x, y| {
            let ray = camera.unproject(ImagePoint { u: x.into(), v: y.into() }).unwrap().xyz();
            let inside_px = (half_angle - (ray[1] * sin + ray[2] * cos).clamp(-1.0, 1.0).acos()) * 260.0;
            let light = 190.0 / (1.0 + (-inside_px / 0.6).exp());
            let noise = (x * 31 + y * 57 + epoch * 101 + seed * 13) % 3;
            image::Luma([8 + light as u8 + noise as u8])
        });
        picture.save(folder.join(format!("{epoch}.png"))).unwrap();
        table += &format!("{epoch}.png,{epoch}\n");
    }
    std::fs::write(folder.join("frames.csv"), table).unwrap();
    std::fs::write(folder.join("sensor.toml"), SENSOR).unwrap();
}

/// Writes two heads that look at opposite parts of the limb.
fn rig() -> (TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    head(&dir.path().join("ahead"), 1, |_| PITCH_RAD);
    head(&dir.path().join("behind"), 2, |epoch| PITCH_RAD + if epoch == TURNED.0 { TURNED.1 } else { 0.0 });
    let (s, c) = (PITCH_RAD / 2.0).sin_cos();
    let one = |name: &str, q: [f64; 4]| {
        format!("[[head]]\nname = \"{name}\"\npictures = \"{name}\"\n[head.mount]\nq_rig_from_camera_wxyz = {q:?}\n")
    };
    let text = one("ahead", [c, s, 0.0, 0.0]) + &one("behind", [0.0, 0.0, s, c]);
    let path = dir.path().join("rig.toml");
    std::fs::write(&path, text).unwrap();
    (dir, path)
}

#[test]
fn the_heads_of_a_rig_are_shown_side_by_side_with_their_check() {
    let (_dir, path) = rig();
    let mut window = window();
    open(&mut window, &path);
    until(&mut window, "the epochs are not there", |v| v.is_settled() && v.epochs().is_some_and(|e| e.0.len() == 4));
    let statuses: Vec<Status> = window.state().epochs().unwrap().0.iter().map(|epoch| epoch.joint.status).collect();
    assert_eq!(statuses, [Status::Ok, Status::Ok, Status::Rejected, Status::Ok]);
    assert!(window.query_by_label("epoch 1 of 4, 0.000 s").is_some());
    for name in ["ahead", "behind"] {
        assert!(window.query_by_label(name).is_some(), "{name}");
    }
    // The legend of the plot has these words, too.
    assert_eq!(window.query_all_by_label("used").count(), 1 + 2);
    assert!(window.query_by_label_contains("separation 0.").is_some());
    for part in ["Plot separation of the heads", "Sphere of all heads", "Use of the heads over time"] {
        assert!(window.query_by_label(part).is_some(), "{part}");
    }
    // Both heads have an answer in the third epoch, and they contradict each other.
    window.get_by_label("Next epoch").click();
    window.run_steps(2);
    window.key_press(Key::ArrowRight);
    until(&mut window, "the pictures of the epoch are not there", |v| v.is_settled() && v.epochs().unwrap().1 == 2);
    assert_eq!(window.query_all_by_label("answer, not joined").count(), 1 + 2);
    assert!(window.query_by_label_contains("inconsistent").is_some());
    window.key_press(Key::End);
    window.run_steps(3);
    assert_eq!(window.state().epochs().unwrap().1, 3);
    // Pictures that are opened afterwards replace the rig.
    open(&mut window, &path.with_file_name("ahead"));
    settled(&mut window);
    assert!(window.state().epochs().is_none() && frame_view(&window).name == "0.png");
}

#[test]
fn a_rig_that_cannot_be_opened_says_why() {
    let (_dir, path) = rig();
    std::fs::remove_file(path.with_file_name("behind").join("sensor.toml")).unwrap();
    let mut window = window();
    open(&mut window, &path);
    said(&mut window, "behind");
    assert!(window.state().epochs().unwrap().0.is_empty());
}
