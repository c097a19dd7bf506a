//! Tests of what is painted: the candidate under the pointer, and the ring around the focus.

use egui::epaint::Shape;
use egui::{Key, Stroke};
use egui_kittest::kittest::Queryable;
use hzn_core::status::Status;

use crate::window::*;

/// Returns the strokes of all lines and frames that are painted.
fn strokes(window: &Window) -> Vec<(bool, Stroke)> {
    fn collect(shape: &Shape, out: &mut Vec<(bool, Stroke)>) {
        match shape {
            Shape::Vec(all) => all.iter().for_each(|one| collect(one, out)),
            Shape::LineSegment { stroke, .. } => out.push((true, *stroke)),
            Shape::Rect(rect) => out.push((false, rect.stroke)),
            _ => {}
        }
    }
    let mut out = Vec::new();
    window.output().shapes.iter().for_each(|clipped| collect(&clipped.shape, &mut out));
    out
}

#[test]
fn the_candidate_under_the_pointer_is_drawn_besides_the_longest() {
    let (_dir, pictures) = folder();
    let discs = image::GrayImage::from_fn(WIDTH.into(), HEIGHT.into(), |x, y| {
        let (dx, dy) = (f64::from(x % 80) - 40.0, f64::from(y % 80) - 40.0);
        let radius = 20.0 + f64::from(x / 80) * 4.0;
        image::Luma([(8.0 + 190.0 / (1.0 + ((dx.hypot(dy) - radius) / 0.6).exp())) as u8])
    });
    discs.save(pictures.join("0.png")).unwrap();
    let mut window = sized_window(1400.0, 2600.0);
    open(&mut window, &pictures);
    settled(&mut window);
    until(&mut window, "not processed", |v| v.processed() == 4 && !v.is_working());
    let body = &frame_view(&window).answers[0].bodies[0];
    assert_ne!(body.row.status, Status::Ok);
    let longest = body.longest_candidates();
    let listed = &body.report.as_ref().unwrap().candidates;
    let has_limb = |number: u32| body.candidate_limbs.iter().any(|(c, _)| *c == number);
    let row = listed.iter().position(|c| has_limb(c.number) && !longest.contains(&c.number)).unwrap();
    // The limb of the pointed candidate is the only dashed line of this width.
    let strong = |window: &Window| strokes(window).iter().filter(|(is_line, s)| *is_line && s.width == 3.0).count();
    assert_eq!(strong(&window), 0);
    let column = window.get_by_label("length px").rect().left() + 3.0;
    let button = window.query_all_by_label("residuals").nth(row).unwrap().rect();
    window.hover_at(egui::pos2(column, button.center().y));
    window.run_steps(4);
    assert!(strong(&window) > 5, "{} dashes", strong(&window));
    window.hover_at(egui::pos2(5.0, 5.0));
    window.run_steps(4);
    assert_eq!(strong(&window), 0);
}

#[test]
fn the_key_tab_shows_a_ring_around_the_focus_until_the_next_click() {
    let (_dir, mut window) = window_on_flight();
    let colour = window.ctx.global_style().visuals.hyperlink_color;
    let has_ring = |window: &Window| strokes(window).contains(&(false, Stroke::new(2.0, colour)));
    assert!(!has_ring(&window));
    for _ in 0..2 {
        window.key_press(Key::Tab);
        window.run_steps(2);
        assert!(has_ring(&window));
    }
    let at = window.get_by_label("Picture 0.png").rect().center();
    for pressed in [true, false] {
        window.hover_at(at);
        let (button, modifiers) = (egui::PointerButton::Primary, egui::Modifiers::NONE);
        window.event(egui::Event::PointerButton { pos: at, button, pressed, modifiers });
        window.run_steps(2);
    }
    assert!(!has_ring(&window));
}
