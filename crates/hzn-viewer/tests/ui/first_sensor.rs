//! The form that makes a first sensor.toml.

use std::fmt::Write as _;
use std::path::Path;

use egui::Role;
use egui_kittest::kittest::Queryable;
use hzn_core::camera::Intrinsic;
use hzn_core::status::Status;
use hzn_sim::flight::rocket;

use crate::window::*;

fn click(window: &mut Window, label: &str) {
    window.get_by_label(label).click();
    window.run_steps(3);
}

/// Returns a window with the form for pictures that have no sensor.toml.
fn window_with_form(pictures: &Path) -> Window {
    let mut window = window();
    open(&mut window, pictures);
    until(&mut window, "not shown", |v| v.frame_view().is_some());
    window.run_steps(3);
    click(&mut window, "Make a sensor.toml…");
    click(&mut window, "I do not know the lens");
    window
}

#[test]
fn the_limb_says_a_lens_that_nobody_knows() {
    let dir = tempfile::tempdir().unwrap();
    let flight = rocket(480, 270, 8, 7);
    let mut table = "file,altitude_km\n".to_owned();
    for frame in &flight.frames {
        frame.render().unwrap().save(&dir.path().join(&frame.file)).unwrap();
        writeln!(table, "{},{}", frame.file, frame.row().altitude_km).unwrap();
    }
    std::fs::write(dir.path().join("frames.csv"), table).unwrap();
    let mut window = window_with_form(dir.path());
    assert!(window.query_by_label("pinhole").is_none(), "the kind of lens is not known, either");
    click(&mut window, "Make sensor.toml");
    until(&mut window, "the limb is not measured", |v| v.session().is_some());
    settled(&mut window);
    let session = window.state().session().unwrap();
    let focal_px = session.number("camera", "fx_px", 0).unwrap();
    let rows = session.value("camera", "covariance", 0).unwrap()["rows"].clone();
    let sigma_px = rows[0][0].as_float().unwrap().sqrt();
    let error_px = focal_px - flight.sensor.camera.fx_px;
    assert!(error_px.abs() < 2.0 * sigma_px && sigma_px < 0.1 * focal_px, "{focal_px} px ± {sigma_px} px");
    said(&mut window, "pictures says: ");
    until(&mut window, "not processed", |v| v.processed() == 8 && !v.is_working());
    let answers = (0..8).filter(|i| window.state().results().cause(*i, 0).is_some_and(|c| c.status == Status::Ok));
    assert!(answers.count() >= 4, "the sensor.toml is good enough to begin with");
}

#[test]
fn the_form_says_the_sigmas_that_the_sensor_gets() {
    let (_dir, pictures) = folder();
    std::fs::remove_file(pictures.join("sensor.toml")).unwrap();
    let mut window = window_with_form(&pictures);
    click(&mut window, "from the field of view");
    let words = |window: &Window| {
        let texts = painted(window);
        texts.into_iter().map(|(text, _)| text).find(|text| text.starts_with("Focal length ")).unwrap()
    };
    let first = words(&window);
    assert!(first.starts_with("Focal length 277 px ± ") && first.ends_with("(1 sigma)."), "{first}");
    type_number(&mut window, "field of view over the width", "63,2");
    type_number(&mut window, "altitude above the ground", "240");
    let said = words(&window);
    click(&mut window, "Make sensor.toml");
    settled(&mut window);
    let config = window.state().session().unwrap().config().unwrap().clone();
    let (camera, body) = (&config.camera, &config.body);
    assert!((camera.fx_px - 260.0).abs() < 0.5 && body.altitude_km == Some(240.0), "{camera:?}");
    let sigma = |which: Intrinsic| {
        let at = camera.model.intrinsics().iter().position(|i| *i == which).unwrap();
        camera.covariance.as_ref().unwrap().rows[at][at].sqrt()
    };
    for part in [
        format!("Focal length {:.0} px ± {:.1} %, ", camera.fx_px, 100.0 * sigma(Intrinsic::FxPx) / camera.fx_px),
        format!("principal point ± {:.0} px, ", sigma(Intrinsic::CxPx)),
        format!("the altitude ± {:.1} km (1 sigma).", body.altitude_sigma_km),
    ] {
        assert!(said.contains(&part), "{part} in {said}");
    }
}

#[test]
fn a_limb_that_says_nothing_leaves_the_form_open() {
    let (_dir, pictures) = folder();
    std::fs::remove_file(pictures.join("sensor.toml")).unwrap();
    let mut window = window_with_form(&pictures);
    // From far away, no lens makes this limb so straight.
    type_number(&mut window, "altitude above the ground", "900000");
    click(&mut window, "Make sensor.toml");
    let begin = std::time::Instant::now();
    while window.query_by_label_contains("hoose “from the field of view”").is_none() {
        assert!(begin.elapsed().as_secs() < 60 && window.state().session().is_none());
        std::thread::sleep(std::time::Duration::from_millis(5));
        window.step();
    }
    assert!(window.query_by_role_and_label(Role::SpinButton, "altitude above the ground").is_some());
}
