//! Where the camera looks.

use std::fmt::Write as _;
use std::path::Path;

use egui::{Key, Role};
use egui_kittest::kittest::Queryable;
use hzn_sim::flight::rocket;
use hzn_viewer::model::settings::Layer;

use super::window::{flight, folder, painted, settled, window_on};

/// Writes a rendered flight with positions, and with attitudes if they are wanted.
fn write(folder: &Path, has_attitude: bool) {
    let flight = rocket(320, 180, 3, 7706);
    let mut table = "file,time_s,x_km,y_km,z_km".to_owned();
    table += if has_attitude { ",qw,qx,qy,qz\n" } else { "\n" };
    for frame in &flight.frames {
        let picture = frame.render().unwrap();
        let path = folder.join(&frame.file);
        std::fs::write(&path, picture.encode(&path).unwrap()).unwrap();
        let [x, y, z] = frame.scene.pose.position_m.map(|m| m / 1e3);
        write!(table, "{},{},{x},{y},{z}", frame.file, frame.time_s).unwrap();
        if has_attitude {
            let [w, x, y, z] = frame.scene.pose.q_fixed_from_camera_wxyz;
            write!(table, ",{w},{x},{y},{z}").unwrap();
        }
        table.push('\n');
    }
    std::fs::write(folder.join("frames.csv"), table).unwrap();
    std::fs::write(folder.join("sensor.toml"), hzn_files::sensor::to_text(&flight.sensor).unwrap()).unwrap();
}

#[test]
fn latitudes_and_longitudes_need_a_position_and_an_attitude() {
    for has_attitude in [true, false] {
        let dir = tempfile::tempdir().unwrap();
        write(dir.path(), has_attitude);
        let mut window = window_on(dir.path());
        window.state_mut().settings_mut().show(Layer::Grid, true);
        window.state_mut().settings_mut().show(Layer::Vertical, true);
        settled(&mut window);
        window.run_steps(3);
        assert_eq!(window.query_by_label("Latitude, longitude").is_some(), has_attitude);
        assert!(window.query_by_label("Local vertical").is_some());
        let grid = window.state().frame_view().unwrap().grid().map(|grid| grid.parallels.len());
        assert_eq!(grid.is_some_and(|n| n > 0), has_attitude, "{grid:?}");
    }
}

#[test]
fn the_local_vertical_of_a_comparison_lies_below_the_names() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), true);
    let mut window = window_on(dir.path());
    window.state_mut().settings_mut().show(Layer::Vertical, true);
    window.key_press(Key::X);
    settled(&mut window);
    window.run_steps(3);
    let texts = painted(&window);
    for (pane, title) in window.query_all_by_label_contains("Picture rocket").zip(["this sensor.toml", "preset "]) {
        let within = |is_it: &dyn Fn(&str) -> bool| {
            let place = texts.iter().find(|(text, place)| is_it(text) && pane.rect().contains_rect(*place));
            place.unwrap_or_else(|| panic!("{title}: {texts:?}")).1
        };
        let (name, vertical) =
            (within(&|text| text.starts_with(title)), within(&|text| text.starts_with("elevation ")));
        assert!(name.bottom() < vertical.top(), "{name:?} {vertical:?}");
    }
    assert_eq!(window.query_all_by_label_contains("Picture rocket").count(), 2);
}

#[test]
fn pictures_without_positions_have_no_grid() {
    let (_dir, pictures) = folder();
    flight(&pictures);
    let window = window_on(&pictures);
    assert!(window.query_by_label("Latitude, longitude").is_none());
    assert!(window.state().frame_view().unwrap().grid().is_none());
}

#[test]
fn the_view_from_space_opens_and_says_what_it_lacks() {
    for (has_attitude, words) in [(true, "Cone: half-angle; narrow cone: 3σ"), (false, "There is no attitude (qw")] {
        let dir = tempfile::tempdir().unwrap();
        write(dir.path(), has_attitude);
        let mut window = window_on(dir.path());
        window.get_by_label("Pictures").click();
        window.run_steps(3);
        window.get_by_label_contains("View from space").click();
        window.run_steps(8);
        let scene = window.get_by_label("Scene in space").rect();
        let picture = window.query_all_by_label_contains("Picture ").next().unwrap().rect();
        assert!(picture.contains_rect(scene) && scene.width() > 200.0, "{scene:?} {picture:?}");
        assert!(window.query_by_label_contains(words).is_some(), "{words}");
        window.key_press(Key::V);
        window.run_steps(3);
        assert!(window.query_by_label("Scene in space").is_none(), "the key closes it");
    }
    let (_dir, pictures) = folder();
    let mut window = window_on(&pictures);
    window.key_press(Key::V);
    window.run_steps(6);
    assert!(window.query_by_label_contains("There is no position (x_km").is_some());
    window.key_press(Key::Escape);
    window.run_steps(3);
    assert!(window.query_by_role_and_label(Role::Window, "View from space").is_none());
}
