//! Tests that the window says what is missing, and that nothing lies over what is to be read.

use std::fmt::Write as _;

use egui::epaint::Shape;
use egui::{Key, Modifiers, Rect};
use egui_kittest::kittest::{NodeT, Queryable};
use hzn_core::status::Status;

use crate::window::*;

#[test]
fn a_picture_without_an_altitude_says_what_it_needs() {
    let (_dir, pictures) = folder();
    std::fs::write(pictures.join("sensor.toml"), SENSOR.replace("altitude_km = 240.0", "")).unwrap();
    let mut window = window_on(&pictures);
    until(&mut window, "not processed", |v| v.processed() == 4 && !v.is_working());
    assert_eq!(answer(&window).0, Status::NoAltitude);
    for words in ["no altitude: set body.altitude_km", "write the columns file and altitude_km into frames.csv"] {
        assert!(window.query_all_by_label_contains(words).next().is_some(), "{words}");
    }
    // The key is a link to its card.
    window.get_by_label("body.altitude_km").click();
    window.run_steps(20);
    assert!(window.query_by_label("altitude_km").is_some());
}

#[test]
fn the_form_offers_altitudes_of_a_file_only_if_there_are_some() {
    for has_altitudes in [false, true] {
        let (_dir, pictures) = folder();
        std::fs::remove_file(pictures.join("sensor.toml")).unwrap();
        if has_altitudes {
            std::fs::write(pictures.join("frames.csv"), "file,altitude_km\n0.png,240\n").unwrap();
        }
        let mut window = window();
        open(&mut window, &pictures);
        until(&mut window, "not shown", |v| v.frame_view().is_some());
        window.run_steps(3);
        window.get_by_label("Make a sensor.toml…").click();
        window.run_steps(4);
        assert_eq!(window.get_by_label("from frames.csv").accesskit_node().is_disabled(), !has_altitudes);
    }
}

#[test]
fn every_plot_has_numbers_at_its_axis_at_every_height() {
    let (_dir, pictures) = folder();
    let mut window = sized_window(1440.0, 900.0);
    open(&mut window, &pictures);
    until(&mut window, "not processed", |v| v.processed() == 4 && !v.is_working());
    let names = ["RMS", "3 sigma", "Half-angle", "Points", "Threshold"];
    window.state_mut().settings_mut().plotted = names.map(str::to_owned).to_vec();
    for height in (0..22).map(|n| 720.0 + 20.0 * n as f32) {
        window.set_size(egui::vec2(1440.0, height));
        window.run_steps(6);
        let texts = painted(&window);
        let axis = window.get_by_label("Plot time axis").rect();
        // Other plots are scrolled away.
        for name in ["RMS", "3 sigma"] {
            let plot = window.get_by_label(&format!("Plot {name}")).rect();
            if name != "RMS" && plot.bottom() > axis.top() {
                continue;
            }
            let labels = texts.iter().filter(|(text, place)| {
                let is_left = place.right() < plot.left() + 60.0;
                text.parse::<f64>().is_ok() && is_left && plot.y_range().contains(place.center().y)
            });
            let heights: Vec<f32> = labels.map(|(_, place)| place.height()).collect();
            assert!(!heights.is_empty(), "{name} {height}: {plot:?}");
            assert!(heights.iter().all(|h| *h <= 15.0), "the grid leaves room for 15 points: {heights:?}");
        }
    }
}

#[test]
fn the_text_at_the_foot_of_the_picture_lies_over_nothing() {
    let (_dir, pictures) = folder();
    let header = "file,u_px,v_px,error_u_px,error_v_px,counts\n";
    // A message that stays.
    std::fs::write(pictures.join("residuals.csv"), format!("{header}0.png,100,x,0.3,0.4,1\n")).unwrap();
    for size in [[1024.0, 768.0], [1440.0, 900.0]] {
        let mut window = sized_window(size[0], size[1]);
        open(&mut window, &pictures);
        settled(&mut window);
        said(&mut window, "residuals.csv:2");
        let picture = window.get_by_label("Picture 0.png").rect();
        window.event(egui::Event::PointerMoved(picture.center()));
        window.run_steps(10);
        let foot = place_of(&window, |text| text.contains("ray ("));
        let message = place_of(&window, |text| text.contains("residuals.csv:2"));
        assert!(message.bottom() < foot.top(), "{message:?} {foot:?}");
        let badge = place_of(&window, |text| text.ends_with('%') && text.len() < 8);
        assert!(!badge.expand(4.0).intersects(foot), "{badge:?} {foot:?}");
        assert!(picture.contains_rect(badge) && picture.contains_rect(foot));
    }
}

#[test]
fn an_axis_outside_of_the_picture_has_a_small_map() {
    let is_map = |text: &str| text.ends_with("° around the optical axis");
    let (_dir, window) = window_on_flight();
    let picture = window.get_by_label("Picture 0.png").rect();
    let foot = place_of(&window, is_map);
    assert!(picture.contains_rect(foot) && foot.center().x > picture.center().x, "{foot:?}");
    let dir = tempfile::tempdir().unwrap();
    disc(dir.path());
    let window = window_on(dir.path());
    assert_eq!(answer(&window).0, Status::Ok);
    assert!(!painted(&window).iter().any(|(text, _)| is_map(text)), "its axis is in the picture");
}

/// Returns the area of the small map: the smallest box around its text.
fn map(window: &Window) -> Rect {
    // A small map has room for fewer words.
    let text =
        place_of(window, |text| ["° around the optical axis", "° off axis"].iter().any(|end| text.ends_with(end)));
    let boxes = window.output().shapes.iter().filter_map(|clipped| match &clipped.shape {
        Shape::Rect(shape) => Some(shape.rect).filter(|rect| rect.contains_rect(text)),
        _ => None,
    });
    boxes.min_by(|a, b| a.area().total_cmp(&b.area())).unwrap()
}

/// The arrow towards an axis that is up and right has its words in the corner of the map.
#[test]
fn the_small_map_covers_neither_the_words_of_the_arrow_nor_a_label() {
    let (dir, directions) = (tempfile::tempdir().unwrap(), 8);
    let mut residuals = "file,u_px,v_px,error_u_px,error_v_px,counts\n".to_owned();
    for n in 0..directions {
        let (sin, cos) = (f64::from(n) * std::f64::consts::TAU / f64::from(directions)).sin_cos();
        limb([1.15f64.sin() * cos, 1.15f64.sin() * sin, 1.15f64.cos()])
            .save(dir.path().join(format!("{n}.png")))
            .unwrap();
        writeln!(residuals, "{n}.png,100,100,0.3,0.4,1").unwrap();
    }
    std::fs::write(dir.path().join("sensor.toml"), SENSOR).unwrap();
    std::fs::write(dir.path().join("residuals.csv"), residuals).unwrap();
    for size in [[1024.0, 768.0], [1440.0, 900.0]] {
        let mut window = sized_window(size[0], size[1]);
        open(&mut window, dir.path());
        settled(&mut window);
        let mut moved = 0;
        for n in 0..directions as usize {
            window.state_mut().go(n);
            settled(&mut window);
            window.run_steps(3);
            assert_eq!(answer(&window).0, Status::Ok, "{n}");
            let picture = window.get_by_label(&format!("Picture {n}.png")).rect();
            let (map, words) = (map(&window), place_of(&window, |text| text.starts_with("axis, ")));
            assert!(picture.contains_rect(map) && picture.contains_rect(words), "{n}: {map:?} {words:?}");
            assert!(!map.intersects(words), "{n}: {map:?} {words:?}");
            let label = place_of(&window, |text| text.contains("1 residuals, enlarged"));
            assert!(!label.intersects(map) && !label.intersects(words), "{n}: {label:?} {map:?} {words:?}");
            moved += usize::from(map.center().y > picture.center().y);
        }
        assert!(moved > 0 && moved < directions as usize, "only some arrows are in the way: {moved}");
    }
}

const LAST_LINE: &str = "Pictures whose status differs";

/// Checks that the last line of a comparison is not cut where it is painted.
fn assert_last_line_is_whole(window: &Window) {
    for clipped in &window.output().shapes {
        if let Shape::Text(text) = &clipped.shape
            && text.galley.text().starts_with(LAST_LINE)
        {
            let place = text.visual_bounding_rect();
            assert!(clipped.clip_rect.contains_rect(place), "{:?} {place:?}", clipped.clip_rect);
        }
    }
}

#[test]
fn the_comparison_names_both_sensors_and_shows_its_last_line() {
    let (dir, pictures) = folder();
    let file = dir.path().join("other.toml");
    std::fs::write(&file, SENSOR.replace("altitude_km = 240.0", "altitude_km = 900.0")).unwrap();
    for size in [[1440.0, 900.0], [1024.0, 768.0]] {
        let mut window = sized_window(size[0], size[1]);
        open(&mut window, &pictures);
        settled(&mut window);
        menu(&mut window, "Compare", "with another sensor.toml…");
        path(&mut window, &file, "Open this");
        // A window without input is drawn no more when the comparison is complete, so no drawing may cut the line.
        let begin = std::time::Instant::now();
        let is_complete = |w: &Window| w.state().results().other_len() == 4 && !w.state().is_working();
        let mut drawn = 0;
        while drawn < 4 {
            assert!(begin.elapsed().as_secs() < 60, "not compared");
            window.step();
            drawn += u32::from(is_complete(&window));
            assert_last_line_is_whole(&window);
        }
        assert!(window.query_all_by_label("this sensor.toml").next().is_some());
        let last = window.get_by_label_contains(LAST_LINE).rect();
        let picture = window.query_all_by_label("Picture 0.png").next().unwrap().rect();
        assert!(last.bottom() <= picture.top(), "{last:?} {picture:?}");
    }
    let (_dir, mut window) = window_on_flight();
    window.key_press(Key::X);
    settled(&mut window);
    assert!(window.query_by_label("Compared with preset hzn").is_some());
}

#[test]
fn the_help_lists_the_keys_of_the_size_of_the_text() {
    let (_dir, mut window) = window_on_flight();
    window.key_press(Key::F1);
    window.run_steps(4);
    for name in ["Larger text and buttons", "Smaller text and buttons", "Text and buttons of the usual size"] {
        assert!(window.query_by_label(name).is_some(), "{name}");
    }
    window.key_press(Key::F1);
    window.run_steps(3);
    let before = window.ctx.zoom_factor();
    window.key_press_modifiers(Modifiers::COMMAND, Key::Plus);
    window.run_steps(3);
    assert!(window.ctx.zoom_factor() > before, "the key does what the help says");
}
