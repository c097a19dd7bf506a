//! Tests with the mouse: the mask, dropped files, clicks in plots and in the time line.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use egui::{Key, Modifiers, PointerButton, Pos2, Rect, pos2};
use egui_kittest::kittest::{NodeT, Queryable};
use hzn_viewer::model::view::{Area, Point};

use crate::window::*;

const SIZE: Point = [WIDTH as f64, HEIGHT as f64];

fn area(window: &Window) -> Area {
    let rect = window.get_by_label(&format!("Picture {}", frame_view(window).name)).rect();
    Area { min: [rect.min.x.into(), rect.min.y.into()], size: [rect.width().into(), rect.height().into()] }
}

/// Returns the screen point of a picture point.
fn at(window: &Window, p: Point) -> Pos2 {
    let [x, y] = window.state().view().to_screen(area(window), SIZE, p);
    pos2(x as f32, y as f32)
}

fn button(window: &mut Window, pos: Pos2, button: PointerButton, pressed: bool) {
    window.hover_at(pos);
    window.event(egui::Event::PointerButton { pos, button, pressed, modifiers: egui::Modifiers::NONE });
    window.step();
}

fn click_with(window: &mut Window, pos: Pos2, which: PointerButton) {
    button(window, pos, which, true);
    button(window, pos, which, false);
    // The pause keeps two clicks from being a double click.
    window.run_steps(30);
}

fn click(window: &mut Window, pos: Pos2) {
    click_with(window, pos, PointerButton::Primary);
}

fn drag(window: &mut Window, from: Pos2, to: Pos2) {
    button(window, from, PointerButton::Primary, true);
    for i in 1..=8 {
        window.hover_at(from + (to - from) * (i as f32 / 8.0));
        window.step();
    }
    button(window, to, PointerButton::Primary, false);
    window.run_steps(2);
}

fn polygons(window: &Window) -> Vec<Vec<Point>> {
    window.state().session().unwrap().polygons()
}

fn near(a: Point, b: Point) -> bool {
    (a[0] - b[0]).hypot(a[1] - b[1]) < 0.8
}

#[test]
fn the_mask_is_drawn_moved_and_removed() {
    let (_dir, mut window) = window_on_flight();
    let before = answer(&window);
    let edge_points = |w: &Window| frame_view(w).answers[0].bodies[0].row.edge_points.unwrap();
    let points = edge_points(&window);
    // The mask covers the right part of the limb.
    let limb = frame_view(&window).answers[0].bodies[0].limb.concat();
    let middle = limb.iter().filter(|p| p[0] > 220.0 && p[0] < 230.0).map(|p| p[1]).next().unwrap();
    let corners = [[200.0, middle - 40.0], [300.0, middle - 40.0], [300.0, middle + 40.0], [200.0, middle + 40.0]];
    window.key_press(Key::M);
    window.run_steps(2);
    for corner in corners {
        let pos = at(&window, corner);
        click(&mut window, pos);
    }
    assert!(polygons(&window).is_empty(), "not closed yet");
    let first = at(&window, corners[0]);
    click(&mut window, first);
    settled(&mut window);
    let drawn = polygons(&window);
    assert_eq!(drawn.len(), 1);
    assert!(drawn[0].iter().zip(corners).all(|(a, b)| near(*a, b)), "{drawn:?}");
    assert!(edge_points(&window) < points, "masked points are left out");
    assert!(window.state().session().unwrap().sheet().text().contains("[mask]\npolygons_px = "));

    // Moving a corner is one step to undo.
    let (from, to) = (at(&window, corners[1]), at(&window, [280.0, middle - 50.0]));
    drag(&mut window, from, to);
    settled(&mut window);
    assert!(near(polygons(&window)[0][1], [280.0, middle - 50.0]), "{:?}", polygons(&window));
    window.get_by_label("Undo").click();
    settled(&mut window);
    assert_eq!(polygons(&window), drawn);

    // A right click on a corner removes it; a right click inside removes the whole polygon.
    let corner = at(&window, corners[2]);
    click_with(&mut window, corner, PointerButton::Secondary);
    assert_eq!(polygons(&window)[0].len(), 3);
    let inside = at(&window, [215.0, middle - 20.0]);
    click_with(&mut window, inside, PointerButton::Secondary);
    settled(&mut window);
    assert!(polygons(&window).is_empty());
    assert_eq!(answer(&window), before);
    // After the tool is closed, a click draws nothing.
    window.key_press(Key::Escape);
    window.run_steps(2);
    for corner in corners {
        let pos = at(&window, corner);
        click(&mut window, pos);
    }
    window.key_press(Key::Enter);
    window.run_steps(2);
    assert!(polygons(&window).is_empty());
}

#[test]
fn a_mask_that_is_not_closed_comes_back_by_undo() {
    let (_dir, mut window) = window_on_flight();
    let corners = [[200.0, 60.0], [300.0, 60.0], [300.0, 140.0]];
    let undo = |window: &mut Window| {
        window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        window.run_steps(3);
    };
    // Each key that ends the tool keeps the corners.
    for key in [Key::Escape, Key::M, Key::I] {
        window.key_press(Key::M);
        window.run_steps(2);
        for corner in corners {
            let pos = at(&window, corner);
            click(&mut window, pos);
        }
        window.key_press(key);
        window.run_steps(3);
        window.key_press(Key::Enter);
        window.run_steps(2);
        assert!(polygons(&window).is_empty(), "{key:?}: there is no open polygon");
        undo(&mut window);
        window.key_press(Key::Enter);
        settled(&mut window);
        let drawn = polygons(&window);
        assert!(drawn.len() == 1 && drawn[0].iter().zip(corners).all(|(a, b)| near(*a, b)), "{key:?}: {drawn:?}");
        undo(&mut window);
        settled(&mut window);
        assert!(polygons(&window).is_empty() && !window.state().session().unwrap().is_changed());
        window.key_press(Key::Escape);
        window.run_steps(3);
    }
    // Undo takes one corner back, and redo adds it again.
    window.key_press(Key::M);
    window.run_steps(2);
    for corner in corners {
        let pos = at(&window, corner);
        click(&mut window, pos);
    }
    undo(&mut window);
    window.key_press(Key::Enter);
    window.run_steps(2);
    assert!(polygons(&window).is_empty(), "two corners are no area");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Y);
    window.run_steps(2);
    window.key_press(Key::Enter);
    settled(&mut window);
    assert_eq!(polygons(&window)[0].len(), 3);
}

#[test]
fn the_image_circle_is_dragged_in_the_picture() {
    let (_dir, mut window) = window_on_flight();
    let number = |w: &Window, name: &str| w.state().session().unwrap().number("camera", name, 0);
    let before = answer(&window);
    window.key_press(Key::I);
    window.run_steps(2);
    // Without a circle, the largest one within the picture is offered.
    let (centre, rim) = ([159.5, 119.5], [39.5, 119.5]);
    let (from, to) = (at(&window, rim), at(&window, [79.5, 119.5]));
    drag(&mut window, from, to);
    settled(&mut window);
    let deg = number(&window, "theta_max_deg").unwrap();
    assert!((deg - (80.0f64 / 260.0).atan().to_degrees()).abs() < 0.15, "{deg}");
    let circle = frame_view(&window).camera.as_ref().unwrap().image_circle_px().unwrap();
    assert!((circle.1 - 80.0).abs() < 0.8, "{circle:?}");
    assert_ne!(answer(&window).2, before.2, "pixels beyond the circle count as masked");

    // A drag of the centre moves the principal point, and is one step.
    let (from, to) = (at(&window, centre), at(&window, [170.0, 110.0]));
    drag(&mut window, from, to);
    settled(&mut window);
    let moved = [number(&window, "cx_px").unwrap(), number(&window, "cy_px").unwrap()];
    assert!(near(moved, [170.0, 110.0]), "{moved:?}");
    window.get_by_label("Undo").click();
    settled(&mut window);
    assert_eq!([number(&window, "cx_px"), number(&window, "cy_px")], [Some(159.5), Some(119.5)]);
    assert_eq!(number(&window, "theta_max_deg"), Some(deg), "the rim is a step of its own");
    window.get_by_label("Undo").click();
    settled(&mut window);
    assert_eq!((number(&window, "theta_max_deg"), answer(&window)), (None, before));

    // A drag elsewhere does not change the camera; a right click on the rim removes the circle.
    window.get_by_label("Redo").click();
    settled(&mut window);
    let text = window.state().session().unwrap().sheet().clone();
    let (from, to) = (at(&window, [40.0, 200.0]), at(&window, [60.0, 180.0]));
    drag(&mut window, from, to);
    assert_eq!(window.state().session().unwrap().sheet(), &text);
    let rim = at(&window, [79.5, 119.5]);
    click_with(&mut window, rim, PointerButton::Secondary);
    settled(&mut window);
    assert_eq!((number(&window, "theta_max_deg"), answer(&window)), (None, before));
}

#[derive(Debug)]
struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }
    fn bytes(&self) -> Result<Vec<u8>, String> {
        Err("the window reads paths".into())
    }
}

fn drop_files(window: &mut Window, paths: &[&Path]) {
    let handle = |p: &&Path| Arc::new(Dropped(p.to_path_buf())) as egui::DroppedFileHandle;
    window.input_mut().dropped_files = paths.iter().map(handle).collect();
    window.step();
    window.input_mut().dropped_files.clear();
    window.run_steps(2);
}

#[test]
fn what_is_dropped_is_opened() {
    let (dir, pictures) = folder();
    let mut window = window();
    drop_files(&mut window, &[&pictures]);
    settled(&mut window);
    assert_eq!(window.state().sequence().len(), 4);
    let before = answer(&window);

    // A sensor.toml applies to the pictures that are open.
    let other = another_sensor(dir.path());
    drop_files(&mut window, &[&other]);
    settled(&mut window);
    assert_eq!(window.state().session().unwrap().path(), Some(&*other));
    assert!(answer(&window).1 > before.1);

    // Several dropped pictures are a new sequence.
    drop_files(&mut window, &[&pictures.join("1.png"), &pictures.join("2.png")]);
    until(&mut window, "two pictures", |v| v.sequence().len() == 2 && v.is_settled());
    assert_eq!(frame_view(&window).name, "1.png");
    // The file does not exist, so the open sequence stays.
    drop_files(&mut window, &[&dir.path().join("none.mcap")]);
    said(&mut window, "no such file");
    assert_eq!(window.state().sequence().len(), 2);
}

fn plot(window: &Window, name: &str) -> Rect {
    window.get_by_label(&format!("Plot {name}")).rect()
}

#[test]
fn a_click_in_a_plot_or_the_time_line_goes_to_the_frame() {
    let (_dir, mut window) = window_on_flight();
    until(&mut window, "not processed", |v| v.processed() == 4);
    let rect = plot(&window, "RMS");
    click(&mut window, pos2(rect.right() - 4.0, rect.center().y - 10.0));
    settled(&mut window);
    assert_eq!(frame_view(&window).index, 3);
    let rect = plot(&window, "3 sigma");
    // This point is to the right of the axis labels.
    click(&mut window, pos2(rect.left() + 60.0, rect.center().y - 10.0));
    settled(&mut window);
    assert_eq!(frame_view(&window).index, 0);

    let strip = window.get_by_label("Time line").rect();
    let place = |part: f32| pos2(strip.left() + part * strip.width(), strip.bottom() - 6.0);
    click(&mut window, place(0.6));
    settled(&mut window);
    assert_eq!(frame_view(&window).index, 2);
    drag(&mut window, place(0.6), place(0.3));
    settled(&mut window);
    assert_eq!(frame_view(&window).index, 1);
}

#[test]
fn a_click_among_the_residuals_shows_the_point() {
    let (_dir, mut window) = window_on_flight();
    window.state_mut().settings_mut().plotted = vec!["Residuals".to_owned()];
    window.run_steps(4);
    let rect = plot(&window, "Residuals");
    click(&mut window, pos2(rect.center().x + 20.0, rect.center().y - 10.0));
    let view = window.state().view();
    assert!(view.scale(area(&window), SIZE) >= 8.0);
    let middle = area(&window);
    let middle = [middle.min[0] + middle.size[0] / 2.0, middle.min[1] + middle.size[1] / 2.0];
    let shown = view.to_picture(area(&window), SIZE, middle);
    let residuals = &frame_view(&window).answers[0].bodies[0].residuals;
    assert!(residuals.iter().any(|r| near(r.point, shown)), "{shown:?}");
}

#[test]
fn a_click_on_a_candidate_shows_its_residuals() {
    let dir = tempfile::tempdir().unwrap();
    flight(dir.path());
    // The focal length is wrong, so the fit of the candidate is refused.
    std::fs::write(dir.path().join("sensor.toml"), SENSOR.replace("260.0", "200.0")).unwrap();
    let mut window = window_on(dir.path());
    assert_ne!(answer(&window).0, hzn_core::status::Status::Ok);
    window.state_mut().settings_mut().plotted = vec!["Residuals".to_owned()];
    window.run_steps(4);
    assert!(window.query_by_label("Plot Residuals").is_none(), "nothing is fitted yet");
    // The button of an edge without a fit does nothing.
    window.get_all_by_label("residuals").find(|b| !b.accesskit_node().is_disabled()).unwrap().click_accesskit();
    window.run_steps(4);
    assert!(window.query_by_label_contains("Residual of candidate").is_some());
    assert!(window.query_by_label("Plot Residuals").is_some());
}

#[test]
fn the_threshold_is_dragged_in_the_histogram() {
    let (_dir, mut window) = window_on_flight();
    let (before, sheet) = (answer(&window), window.state().session().unwrap().sheet().clone());
    let bars = window.get_by_label("Histogram: threshold").rect();
    let place = |part: f32| pos2(bars.left() + part * bars.width(), bars.center().y);
    drag(&mut window, place(0.4), place(0.8));
    settled(&mut window);
    let scale = window.state().session().unwrap().number("threshold", "scale", 0).unwrap();
    assert!(scale > 1.0, "Otsu's method is kept, with another factor: {scale}");
    assert!(answer(&window).1 > before.1, "{:?}", answer(&window));
    window.get_by_label("Undo").click();
    settled(&mut window);
    assert_eq!(window.state().session().unwrap().sheet(), &sheet, "the drag is one step");
    assert_eq!(answer(&window), before);
}

#[test]
fn a_parameter_is_swept_and_a_click_takes_a_value() {
    let (_dir, mut window) = window_on_flight();
    let scale = |w: &Window| w.state().session().unwrap().number("threshold", "scale", 0).unwrap();
    let name = window.get_by_role_and_label(egui::accesskit::Role::Label, "scale").rect();
    click_with(&mut window, name.left_center() + egui::vec2(4.0, 0.0), PointerButton::Secondary);
    window.get_by_label("Sweep threshold.scale over the sequence…").click();
    window.run_steps(6);
    let picture = window.get_by_label("Picture 0.png").rect();
    let sweep = window.get_by_role_and_label(egui::Role::Window, "Sweep of threshold.scale").rect();
    assert!(picture.contains(sweep.left_top()), "it opens over no menu and no answer: {sweep:?} {picture:?}");
    window.get_by_label("Start").click();
    for _ in 0..3000 {
        window.step();
        if window.query_by_label("4 of 4 pictures").is_some() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    window.run_steps(3);
    let title = window.get_by_label("answered pictures [%]").rect();
    click(&mut window, title.left_bottom() + egui::vec2(330.0, 60.0));
    settled(&mut window);
    let taken = scale(&window);
    assert!(taken > 1.05, "a value to the right of the one in effect: {taken}");
    window.get_by_label("Undo").click();
    settled(&mut window);
    assert_eq!(scale(&window), 1.0);
}

#[test]
fn the_wheel_zooms_about_the_pointer_and_a_drag_moves() {
    let (_dir, mut window) = window_on_flight();
    let pixel = [80.0, 60.0];
    let pointer = at(&window, pixel);
    window.hover_at(pointer);
    window.step();
    for _ in 0..6 {
        window.event(egui::Event::MouseWheel {
            unit: egui::MouseWheelUnit::Point,
            delta: egui::vec2(0.0, 120.0),
            phase: egui::TouchPhase::Move,
            source: egui::MouseWheelSource::Wheel,
            modifiers: egui::Modifiers::NONE,
        });
        window.run_steps(10);
    }
    let view = window.state().view();
    assert!(view.scale(area(&window), SIZE) > 6.0, "{view:?}");
    assert!(at(&window, pixel).distance(pointer) < 1.0);
    drag(&mut window, pointer, pointer + egui::vec2(40.0, 30.0));
    assert!(at(&window, pixel).distance(pointer + egui::vec2(40.0, 30.0)) < 8.0);
    window.key_press(Key::Num0);
    window.run_steps(2);
    assert!(window.state().view().is_fit());
}
