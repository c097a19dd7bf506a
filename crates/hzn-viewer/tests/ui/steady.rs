//! A part of the vehicle in the picture is offered as a mask.

use std::path::Path;

use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use hzn_core::camera::{Camera, Config, Model};
use hzn_core::pixel::ImagePoint;

use crate::window::*;

/// Writes pictures with a bright panel at the right: seven of a limb that moves by `step_rad` from picture to picture,
/// and seven of the sky.
fn flight_with_a_panel(folder: &Path, step_rad: f64) {
    let camera = Camera::<f64>::try_new(&Config::ideal(Model::Pinhole, WIDTH, HEIGHT, 260.0)).unwrap();
    let half_angle = (6381.0088f64 / 6611.0088).asin();
    for frame in 0..14 {
        let pitch = if frame < 7 { 1.13 + step_rad * f64::from(frame) } else { 2.4 };
        let axis = [0.0, pitch.sin(), pitch.cos()];
        let picture = image::GrayImage::from_fn(WIDTH.into(), HEIGHT.into(), |x, y| {
            let ray = camera.unproject(ImagePoint { u: x.into(), v: y.into() }).unwrap().xyz();
            let cos: f64 = ray.iter().zip(axis).map(|(a, b)| a * b).sum();
            let inside_px = (half_angle - cos.clamp(-1.0, 1.0).acos()) * 260.0;
            let light = 1.0 / (1.0 + (-inside_px / 0.6).exp());
            let is_panel = x >= 270 && (20..60).contains(&y);
            image::Luma([if is_panel { 180 } else { (8.0 + 190.0 * light) as u8 }])
        });
        picture.save(folder.join(format!("{frame:02}.png"))).unwrap();
    }
    std::fs::write(folder.join("sensor.toml"), SENSOR).unwrap();
}

fn processed(window: &mut Window) {
    until(window, "not all are processed", |v| v.processed() == 14 && !v.is_working());
}

#[test]
fn one_click_masks_an_edge_that_does_not_move() {
    let dir = tempfile::tempdir().unwrap();
    flight_with_a_panel(dir.path(), 0.015);
    let mut window = window_on(dir.path());
    processed(&mut window);
    assert!(window.query_by_label_contains("100 % of the 7 pictures with edges and without an answer").is_some());
    window.get_by_label("Mask this").click();
    settled(&mut window);
    let polygons = window.state().session().unwrap().polygons();
    assert_eq!(polygons.len(), 1);
    let contains = |p| hzn_viewer::model::mask::is_inside(&polygons[0], p);
    assert!([[270.0, 20.0], [318.0, 20.0], [270.0, 59.0], [318.0, 59.0]].into_iter().all(contains), "{polygons:?}");
    assert!(![[255.0, 40.0], [295.0, 80.0]].into_iter().any(contains), "{polygons:?}");
    // The masked panel has no edge, so there is nothing more to offer.
    processed(&mut window);
    assert!(window.query_by_label("Mask this").is_none());
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    settled(&mut window);
    assert!(window.state().session().unwrap().polygons().is_empty(), "one step for undo");
}

#[test]
fn nothing_is_offered_while_the_limb_stands_still() {
    let dir = tempfile::tempdir().unwrap();
    flight_with_a_panel(dir.path(), 0.0);
    let mut window = window_on(dir.path());
    processed(&mut window);
    assert!(window.query_by_label("Mask this").is_none());
}
