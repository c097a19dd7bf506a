//! The histogram of the picture with the threshold, which can be dragged, and Otsu's threshold.

use egui::{Align2, Color32, FontId, Rect, Sense, Stroke, Ui, pos2, vec2};
use hzn_core::threshold::Method;
use toml_edit::Value;

use super::theme;
use super::viewer::Viewer;
use crate::model::{Histogram, Session};

/// Height of the bars, in points.
const HEIGHT: f32 = 64.0;

/// Draws the histogram of the shown picture. A drag moves the threshold.
pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let Some(histogram) = viewer.frame_view.as_ref().and_then(|f| f.histogram.clone()) else { return };
    let answer = viewer.answer();
    let level = answer.and_then(|a| a.row.level).filter(|l| *l > 0);
    let scale = |s: &Session| s.number("threshold", "scale", viewer.body).unwrap_or(1.0);
    let own = viewer.session.as_ref().filter(|s| method(s, viewer.body) == Some(Method::Otsu.name()));
    // Otsu's threshold is known from a trial, or it is the threshold in use without its factor.
    let otsu = answer
        .and_then(|a| a.otsu)
        .map(|o| f64::from(o.level))
        .or_else(|| Some(f64::from(level?) / own.map(scale)?.max(1e-9)));
    ui.weak("drag the line to move the threshold");
    let (response, painter) = ui.allocate_painter(vec2(ui.available_width(), HEIGHT + 14.0), Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, "Histogram: threshold"));
    let rect = Rect::from_min_size(response.rect.min, vec2(response.rect.width(), HEIGHT));
    let [_, top] = histogram.shown();
    let x_of = |value: f64| rect.left() + (histogram.place(value) / top) as f32 * rect.width();
    bars(ui, &painter, rect, &histogram, top);
    let dark = ui.visuals().dark_mode;
    if let Some(otsu) = otsu {
        mark(ui, &painter, rect, x_of(otsu), theme::line(0, dark), "Otsu", true);
    }
    if let Some(level) = level {
        mark(ui, &painter, rect, x_of(level.into()), theme::warning(dark), &format!("{level}"), false);
    }
    let pointer = response.interact_pointer_pos().filter(|_| response.dragged() || response.clicked());
    if let Some(at) = pointer {
        let place = f64::from((at.x - rect.left()) / rect.width()).clamp(0.0, 1.0) * top;
        let value = histogram.value(place).clamp(1.0, f64::from(histogram.full_scale));
        let body = viewer.body;
        if let Some(session) = &mut viewer.session {
            set_threshold(session, body, value, otsu);
        }
    }
    if response.drag_stopped() || response.clicked() {
        viewer.session.iter_mut().for_each(Session::end_step);
    }
}

fn method(session: &Session, body: usize) -> Option<&str> {
    session.value("threshold", "method", body).and_then(|m| m.as_str())
}

/// Moves the threshold. With Otsu's method the factor is changed, so that the threshold still follows each picture.
fn set_threshold(session: &mut Session, body: usize, value: f64, otsu: Option<f64>) {
    let by_factor = method(session, body) == Some(Method::Otsu.name());
    match otsu.filter(|o| by_factor && *o > 0.0) {
        Some(otsu) => {
            let scale = (value / otsu).clamp(0.1, 10.0);
            session.set("threshold", "scale", body, Some(Session::tidy_value(scale)));
        }
        None => {
            if method(session, body) != Some(Method::Fixed.name()) {
                session.set("threshold", "method", body, Some(Method::Fixed.name().into()));
            }
            session.set("threshold", "level", body, Some(Value::from(value.round())));
        }
    }
}

/// Draws the numbers of pixels on a logarithmic scale, because the sky is often most of the picture.
fn bars(ui: &Ui, painter: &egui::Painter, rect: Rect, histogram: &Histogram, top: f64) {
    painter.rect_filled(rect, 3, ui.visuals().extreme_bg_color);
    let shown = ((histogram.bins.len() as f64 * top).ceil() as usize).clamp(1, histogram.bins.len());
    let height = |n: u32| f64::from(n + 1).ln();
    let most = histogram.bins.iter().take(shown).map(|n| height(*n)).fold(1e-9, f64::max);
    let width = rect.width() / shown as f32;
    let colour = ui.visuals().weak_text_color();
    for (i, n) in histogram.bins.iter().take(shown).enumerate().filter(|(_, n)| **n > 0) {
        let x = rect.left() + i as f32 * width;
        let y = rect.bottom() - (height(*n) / most) as f32 * (rect.height() - 2.0);
        painter.rect_filled(Rect::from_min_max(pos2(x, y), pos2(x + width.max(1.0), rect.bottom())), 0, colour);
    }
}

/// Draws a vertical mark with its name below.
fn mark(ui: &Ui, painter: &egui::Painter, rect: Rect, x: f32, colour: Color32, name: &str, dashed: bool) {
    let background = if dashed { ui.visuals().extreme_bg_color } else { Color32::TRANSPARENT };
    let x = x.clamp(rect.left(), rect.right());
    let line = [pos2(x, rect.top()), pos2(x, rect.bottom())];
    match dashed {
        true => painter.add(egui::Shape::Vec(egui::Shape::dashed_line(&line, Stroke::new(1.5, colour), 4.0, 3.0))),
        false => painter.line_segment(line, Stroke::new(2.0, colour)),
    };
    let align = if x > rect.center().x { Align2::RIGHT_TOP } else { Align2::LEFT_TOP };
    // Otsu's name is above its line, the threshold's number below, so that they never cover each other.
    let y = if dashed { rect.top() + 1.0 } else { rect.bottom() };
    let at = pos2(x + if x > rect.center().x { -3.0 } else { 3.0 }, y);
    let text = painter.layout_no_wrap(name.to_owned(), FontId::proportional(11.5), colour);
    let place = align.anchor_size(at, text.size());
    // Bars behind the name would make it hard to read.
    painter.rect_filled(place.expand2(vec2(2.0, 0.0)), 2, background);
    painter.galley(place.min, text, colour);
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn a_dragged_threshold_keeps_the_method_where_it_can() {
        let camera = "[camera]\nwidth = 64\nheight = 48\nmodel = \"pinhole\"\nfx_px = 60.0\nfy_px = 60.0\n\
                      cx_px = 31.5\ncy_px = 23.5\n";
        let session = |threshold: &str| Session::new(&format!("{camera}{threshold}"), Path::new("s.toml"), None);
        let mut otsu = session("");
        set_threshold(&mut otsu, 0, 120.0, Some(80.0));
        assert_eq!((method(&otsu, 0), otsu.number("threshold", "scale", 0)), (Some("otsu"), Some(1.5)));
        let mut fixed = session("[threshold]\nmethod = \"fixed\"\nlevel = 200.0\n");
        set_threshold(&mut fixed, 0, 90.4, Some(80.0));
        assert_eq!((method(&fixed, 0), fixed.number("threshold", "level", 0)), (Some("fixed"), Some(90.0)));
        let mut dynamic = session("[threshold]\nmethod = \"dynamic\"\n");
        set_threshold(&mut dynamic, 0, 90.4, None);
        assert_eq!((method(&dynamic, 0), dynamic.number("threshold", "level", 0)), (Some("fixed"), Some(90.0)));
        assert!(dynamic.problem().is_none(), "{:?}", dynamic.problem());
    }
}
