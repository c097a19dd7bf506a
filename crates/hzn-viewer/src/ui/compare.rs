//! Two configurations on the same picture: a table of their answers and the differences, above their pictures.

use egui::{RichText, Ui, vec2};
use hzn_files::keys::{self, Key};

use super::viewer::Viewer;
use crate::model::{Session, quantity};
use crate::work::frame_view::BodyResult;

/// Function that returns the text of a column in one line of the table.
type Line = fn(&Column) -> &str;

/// Name of the sensor whose parameters are changed here, next to that of the other one.
pub(super) const OURS: &str = "this sensor.toml";

/// One value of both answers, and the difference.
struct Column {
    name: &'static str,
    session: String,
    other: String,
    difference: String,
}

pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let Some((name, other)) = viewer.other.clone() else { return };
    let (name, other) = (name.as_str(), &other);
    let answers = |frame_view: &crate::work::FrameView| {
        [0, 1].map(|i| frame_view.answers.get(i)?.bodies.get(viewer.body).cloned())
    };
    let columns = match viewer.frame_view.as_ref().map(answers) {
        Some([Some(a), Some(b)]) => columns(&a, &b),
        _ => Vec::new(),
    };
    let (mut stop, mut go) = (false, None);
    let shown = egui::Panel::top("compare").resizable(false).show(ui, |ui| {
        ui.add_space(4.0);
        ui.horizontal(|ui| {
            ui.strong(format!("Compared with {name}"));
            if let Some(problem) = other.problem() {
                ui.colored_label(ui.visuals().error_fg_color, problem.to_string());
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                stop = ui.small_button("Stop").on_hover_text("Stop comparing").clicked();
            });
        });
        egui::ScrollArea::horizontal().show(ui, |ui| table(ui, name, &columns));
        keys_that_differ(viewer, ui, other);
        go = over_sequence(viewer, ui);
        ui.add_space(4.0);
    });
    // A panel has the height that its contents had before. Without another pass, a new line would stay cut until the
    // pointer moves.
    let (id, height) = (egui::Id::unique("height of the comparison"), shown.response.rect.height());
    if ui.data(|data| data.get_temp(id)) != Some(height) {
        ui.data_mut(|data| data.insert_temp(id, height));
        ui.ctx().request_discard("the comparison has another height");
    }
    if stop {
        viewer.other = None;
    }
    if let Some(frame) = go {
        viewer.go(frame);
    }
}

/// Lists the keys in which the sensors differ, with both values.
fn keys_that_differ(viewer: &Viewer, ui: &mut Ui, other: &Session) {
    let Some(session) = &viewer.session else { return };
    let text = |s: &Session, key: &Key| {
        s.value(key.section(), key.name(), viewer.body).map_or_else(|| "not set".to_owned(), ToString::to_string)
    };
    let both = keys::all().map(|key| (key.path, text(session, key), text(other, key)));
    let differing: Vec<_> = both.filter(|(_, ours, theirs)| ours != theirs).collect();
    let Some((first, _, _)) = differing.first() else {
        ui.weak(RichText::new("All keys are the same.").size(12.5));
        return;
    };
    let title = match differing.len() {
        1 => format!("1 key differs: {first}"),
        n => format!("{n} keys differ: {first} and others"),
    };
    egui::CollapsingHeader::new(RichText::new(title).size(12.5)).id_salt("keys that differ").show(ui, |ui| {
        egui::ScrollArea::vertical().id_salt("keys").max_height(110.0).show(ui, |ui| {
            for (path, ours, theirs) in &differing {
                ui.label(RichText::new(format!("{path}: {ours} → {theirs}")).monospace().size(11.5));
            }
        });
    });
}

/// Draws the comparison over all pictures. Returns the picture that was clicked.
fn over_sequence(viewer: &Viewer, ui: &mut Ui) -> Option<usize> {
    if viewer.sequence.len() < 2 {
        return None;
    }
    let comparison = viewer.rows.compare(viewer.body);
    let all = viewer.sequence.len();
    let apart = match comparison.largest_deg {
        Some(deg) => format!("answers differ by up to {deg:.4}°"),
        None => "no picture is answered by both".to_owned(),
    };
    let (pictures, better, worse) = (comparison.pictures, comparison.better, comparison.worse);
    let words = format!("{pictures} of {all} pictures compared: {better} more answers, {worse} fewer; {apart}");
    ui.label(RichText::new(words).size(12.5));
    let mut go = None;
    if comparison.changed.is_empty() {
        return None;
    }
    let title = format!("Pictures whose status differs ({})", comparison.changed.len());
    egui::CollapsingHeader::new(RichText::new(title).size(12.5)).show(ui, |ui| {
        egui::ScrollArea::vertical().max_height(110.0).show(ui, |ui| {
            for (index, ours, theirs) in &comparison.changed {
                let name = viewer.sequence.entries.get(*index).map_or("", |e| &e.name);
                if ui.link(RichText::new(format!("{} {name}: {ours} → {theirs}", index + 1)).size(12.0)).clicked() {
                    go = Some(*index);
                }
            }
        });
    });
    go
}

fn table(ui: &mut Ui, name: &str, columns: &[Column]) {
    egui::Grid::new("compared").spacing(vec2(12.0, 1.0)).show(ui, |ui| {
        ui.label("");
        columns.iter().for_each(|c| {
            ui.weak(RichText::new(c.name).size(12.0));
        });
        ui.end_row();
        let lines: [(&str, Line); 3] =
            [(OURS, |c| &c.session), (name, |c| &c.other), ("difference", |c| &c.difference)];
        for (name, text_of) in lines {
            ui.weak(RichText::new(name).size(12.0));
            for column in columns {
                ui.label(RichText::new(text_of(column)).monospace().size(11.5));
            }
            ui.end_row();
        }
    });
}

/// Formats a difference with its sign, or as 0 if it rounds to zero.
fn difference(x: f64, digits: usize) -> String {
    if x.abs() < 0.5 * 0.1f64.powi(digits as i32) { "0".into() } else { format!("{x:+.digits$}") }
}

fn columns(a: &BodyResult, b: &BodyResult) -> Vec<Column> {
    let angle = match (a.row.axis(), b.row.axis()) {
        (Some(x), Some(y)) => format!("{:.4}° apart", quantity::angle_deg(x, y)),
        _ => String::new(),
    };
    let [session, other] = [a, b].map(|answer| answer.row.status.name().to_owned());
    let mut out = vec![Column { name: "status", session, other, difference: angle }];
    let mut add = |name, digits: usize, unit: &str, value_of: fn(&hzn_mcap::Row) -> Option<f64>| {
        let text = |x: Option<f64>| x.map_or_else(|| "–".to_owned(), |x| format!("{x:.digits$}{unit}"));
        let (x, y) = (value_of(&a.row), value_of(&b.row));
        let difference = x.zip(y).map_or_else(String::new, |(x, y)| difference(y - x, digits) + unit);
        out.push(Column { name, session: text(x), other: text(y), difference });
    };
    add("axis x", 5, "", |r| r.axis_x);
    add("axis y", 5, "", |r| r.axis_y);
    add("axis z", 5, "", |r| r.axis_z);
    add("σ", 4, "°", |r| r.sigma_max_deg);
    add("half-angle", 3, "°", |r| r.half_angle_deg);
    add("RMS", 3, " px", |r| r.rms_px);
    add("inliers", 0, "", |r| r.inliers.map(f64::from));
    add("threshold", 0, " counts", |r| r.level.map(f64::from));
    add("processing", 0, " µs", |r| r.elapsed_us);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_difference_has_no_sign() {
        assert_eq!([difference(-4e-4, 3), difference(-6e-4, 3), difference(2.0, 0)], ["0", "-0.001", "+2"]);
    }
}
