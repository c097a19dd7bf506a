//! What the plots draw: how much room they take, areas, bands, marks, and the cursor that can be dragged.

use std::fmt::Write as _;
use std::path::Path;

use egui::epaint::Shape;
use egui::{PointerButton, Pos2, Rect, Role, pos2};
use egui_kittest::kittest::Queryable;
use hzn_core::status::Status;

use crate::window::*;

/// Returns all shapes that are painted within a rectangle.
fn shapes_in(window: &Window, rect: Rect) -> Vec<Shape> {
    fn collect(shape: &Shape, out: &mut Vec<Shape>) {
        match shape {
            Shape::Vec(all) => all.iter().for_each(|one| collect(one, out)),
            one => out.push(one.clone()),
        }
    }
    let mut out = Vec::new();
    for clipped in &window.output().shapes {
        if rect.expand(2.0).contains_rect(clipped.clip_rect.intersect(rect)) && clipped.clip_rect.intersects(rect) {
            collect(&clipped.shape, &mut out);
        }
    }
    out.retain(|shape| rect.expand(2.0).intersects(shape.visual_bounding_rect()));
    out
}

fn plot(window: &Window, name: &str) -> Rect {
    window.get_by_label(&format!("Plot {name}")).rect()
}

fn choose(window: &mut Window, names: &[&str]) {
    window.state_mut().settings_mut().plotted = names.iter().map(|name| (*name).to_owned()).collect();
    window.run_steps(4);
}

fn press(window: &mut Window, at: Pos2, pressed: bool) {
    window.hover_at(at);
    let (pos, button, modifiers) = (at, PointerButton::Primary, egui::Modifiers::NONE);
    window.event(egui::Event::PointerButton { pos, button, pressed, modifiers });
    window.step();
}

fn drag(window: &mut Window, from: Pos2, to: Pos2) {
    press(window, from, true);
    for i in 1..=8 {
        window.hover_at(from + (to - from) * (i as f32 / 8.0));
        window.step();
    }
    press(window, to, false);
    window.run_steps(2);
}

/// Writes the true axes of a flight; that of picture `wrong` is `by_deg` away.
fn write_truth(folder: &Path, frames: usize, wrong: usize, by_deg: f64) {
    let mut text = "file,time_s,body,limb,axis_x,axis_y,axis_z,half_angle_deg,altitude_km,qw,qx,qy,qz\n".to_owned();
    for frame in 0..frames {
        // Pictures beyond the fourth are links to the first three.
        let name = if frame < 4 { format!("{frame}.png") } else { format!("{frame:05}.png") };
        let of = if frame < 4 { frame } else { frame % 3 };
        let (pitch, roll) = (1.15 + 0.03 * of as f64, 0.1 * of as f64);
        let pitch = pitch + if frame == wrong { by_deg.to_radians() } else { 0.0 };
        let [x, y, z] = [pitch.sin() * roll.sin(), pitch.sin() * roll.cos(), pitch.cos()];
        writeln!(text, "{name},{frame},earth-sphere,1,{x},{y},{z},74.8,240,1,0,0,0").unwrap();
    }
    std::fs::write(folder.join("truth.csv"), text).unwrap();
}

#[test]
fn plots_take_a_quarter_of_the_height_until_their_border_is_dragged() {
    let (_dir, pictures) = folder();
    for [width, height] in [[1440.0, 900.0], [1024.0, 768.0]] {
        let mut window = sized_window(width, height);
        open(&mut window, &pictures);
        until(&mut window, "not processed", |v| v.processed() == 4 && !v.is_working());
        let panel = |w: &mut Window| w.state_mut().settings_mut().plots_height;
        assert!(panel(&mut window) <= 0.25 * height, "{}", panel(&mut window));
        if height == 900.0 {
            // Both plots of a new window are seen.
            let axis = window.get_by_label("Plot time axis").rect();
            assert!(plot(&window, "3 sigma").height() >= 46.0 && plot(&window, "RMS").bottom() <= axis.top() + 1.0);
        }
        window.state_mut().settings_mut().plotted.clear();
        window.run_steps(3);
        for name in ["Axis", "RMS", "3 sigma", "Points", "Half-angle"] {
            window.get_by_role_and_label(Role::Button, name).click();
            window.run_steps(30);
            assert!(panel(&mut window) <= 0.25 * height, "{name}: {}", panel(&mut window));
        }
        let last = plot(&window, "Half-angle");
        assert!(last.top() > height * 0.7 && last.bottom() < height, "the new plot is in view: {last:?}");
        // The border lies above the first row of names, with the margin of the panel and its first space.
        let name = window.get_by_role_and_label(Role::Button, "Axis").rect();
        let at = pos2(width / 2.0, name.top() - 6.0);
        drag(&mut window, at, at - egui::vec2(0.0, 0.2 * height));
        assert!(panel(&mut window) > 0.3 * height, "the user may give it more: {}", panel(&mut window));
        assert!(panel(&mut window) <= 0.5 * height);
    }
}

#[test]
fn the_panel_grows_for_a_new_plot_and_shows_it() {
    let (_dir, pictures) = folder();
    let mut window = window();
    window.state_mut().settings_mut().plots_height = 120.0;
    window.state_mut().settings_mut().plotted.clear();
    open(&mut window, &pictures);
    settled(&mut window);
    window.run_steps(4);
    let before = window.state_mut().settings_mut().plots_height;
    for (n, name) in ["3 sigma", "Points", "Half-angle", "Processing"].into_iter().enumerate() {
        window.get_by_label(name).click();
        window.run_steps(30);
        let choice = window.get_by_label("3 sigma").rect().bottom();
        let axis = window.get_by_label("Plot time axis").rect();
        let new = window.get_by_label(&format!("Plot {name}")).rect();
        assert!(new.top() > choice && new.bottom() <= axis.top() + 1.0, "{name} is scrolled away: {new:?} {axis:?}");
        let first = window.get_by_label("Plot 3 sigma").rect();
        assert!(n > 1 || first.top() > choice, "two plots have room in a quarter of the window: {first:?}");
    }
    assert!(window.state_mut().settings_mut().plots_height > before + 50.0);
}

#[test]
fn the_sources_of_sigma_are_stacked_areas() {
    let (_dir, mut window) = window_on_flight();
    until(&mut window, "not processed", |v| v.processed() == 4 && !v.is_working());
    window.run_steps(3);
    window.get_by_label("σ budget").click();
    window.run_steps(6);
    choose(&mut window, &["σ budget"]);
    let rows = window.state().results();
    for frame in 0..3 {
        let parts = rows.sigma_parts(frame, 0).unwrap();
        let sigma_deg = rows.newest(frame, 0).unwrap().sigma_max_deg.unwrap();
        assert!((parts.sum_deg() / sigma_deg - 1.0).abs() < 1e-5, "{frame}: {} {sigma_deg}", parts.sum_deg());
    }
    assert!(rows.sigma_parts(3, 0).is_none(), "the dark picture has no answer");
    let areas = shapes_in(&window, plot(&window, "σ budget"));
    let areas = areas.iter().filter(|s| matches!(s, Shape::Mesh(mesh) if mesh.vertices.len() >= 6)).count();
    assert!(areas >= 2, "{areas}");
    assert!(window.query_by_label("edge noise").is_some(), "the legend names the sources");
    assert!(window.query_all_by_label_contains("°: edge noise ").next().is_some(), "the values of the picture");
}

#[test]
fn every_plot_that_diagnoses_is_drawn() {
    let (_dir, pictures) = folder();
    write_truth(&pictures, 4, 1, 8.0);
    let mut window = window_on(&pictures);
    until(&mut window, "not processed", |v| v.processed() == 4 && !v.is_working());
    window.run_steps(3);
    let names = ["Error over σ (truth)", "Fit − expected over σ", "Probability of the limb", "Protection level"];
    for name in names {
        choose(&mut window, &[name]);
        assert!(window.query_by_label(&format!("Plot {name}")).is_some(), "{name}");
        let rect = plot(&window, name);
        let band = |shape: &Shape| {
            matches!(shape, Shape::Rect(r) if r.rect.width() > 0.8 * rect.width()
            && r.fill.a() > 0 && r.fill.a() < 120)
        };
        let has_band = shapes_in(&window, rect).iter().any(band);
        assert_eq!(has_band, name.contains("over σ"), "{name}");
        assert_eq!(window.query_by_label("within 3σ").is_some(), has_band, "{name}");
    }
}

#[test]
fn each_picture_has_a_mark_and_far_values_are_arrows() {
    let (_dir, pictures) = folder();
    lengthen(&pictures, 24);
    write_truth(&pictures, 24, 9, 20.0);
    let mut window = window_on(&pictures);
    until(&mut window, "not processed", |v| v.processed() == 24 && !v.is_working());
    choose(&mut window, &["Error (truth)"]);
    let answered = (0..24).filter(|i| window.state().results().newest(*i, 0).unwrap().status == Status::Ok).count();
    assert_eq!(answered, 23);
    let shapes = shapes_in(&window, plot(&window, "Error (truth)"));
    let circles = shapes.iter().filter(|s| matches!(s, Shape::Circle(c) if (c.radius - 2.2).abs() < 0.01)).count();
    // The plot has two lines: the error and 3 sigma.
    assert_eq!(circles, 2 * answered, "{shapes:?}");
    let arrows = shapes.iter().filter(|s| matches!(s, Shape::Path(path) if path.closed && path.points.len() == 3));
    assert_eq!(arrows.count(), 1, "the error of 20° lies outside");
}

#[test]
fn the_cursor_of_the_plots_is_dragged() {
    let (_dir, mut window) = window_on_flight();
    until(&mut window, "not processed", |v| v.processed() == 4 && !v.is_working());
    window.run_steps(4);
    let rect = plot(&window, "RMS");
    let places = |part: f32| pos2(rect.left() + part * rect.width(), rect.center().y);
    // The first picture lies at the left end of the plot.
    let cursor = places(0.01);
    drag(&mut window, cursor, places(0.66));
    settled(&mut window);
    assert_eq!(frame_view(&window).index, 2);
    // A drag elsewhere moves the plot, and the picture stays.
    drag(&mut window, places(0.3), places(0.2));
    settled(&mut window);
    assert_eq!(frame_view(&window).index, 2);
}
