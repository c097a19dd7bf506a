//! Two configurations on the same frame: what their answers differ in.

use egui::{RichText, vec2};

use super::viewer::Viewer;
use crate::model::rows;
use crate::work::sight::Answer;

pub(super) fn show(viewer: &mut Viewer, ctx: &egui::Context) {
    let Some((name, other)) = &viewer.other else { return };
    let (name, problem) = (name.clone(), other.problem().map(ToString::to_string));
    let Some(sight) = &viewer.sight else { return };
    let [a, b] = [0, 1].map(|i| sight.answers.get(i).and_then(|o| o.bodies.get(viewer.body)));
    let mut open = true;
    egui::Window::new(format!("Compared with {name}"))
        .open(&mut open)
        .resizable(false)
        .anchor(egui::Align2::CENTER_TOP, vec2(0.0, 46.0))
        .show(ctx, |ui| {
            if let Some(problem) = &problem {
                ui.colored_label(ui.visuals().error_fg_color, problem);
            }
            let (Some(a), Some(b)) = (a, b) else { return };
            egui::Grid::new("compared").num_columns(4).spacing(vec2(16.0, 2.0)).show(ui, |ui| {
                for head in ["", "session", &name, "difference"] {
                    ui.weak(head);
                }
                ui.end_row();
                for (what, a, b, difference) in lines(a, b) {
                    ui.weak(what);
                    for text in [a, b, difference] {
                        ui.label(RichText::new(text).monospace().size(12.0));
                    }
                    ui.end_row();
                }
            });
        });
    if !open {
        viewer.other = None;
    }
}

/// Name, both values, their difference.
fn lines(a: &Answer, b: &Answer) -> Vec<(&'static str, String, String, String)> {
    let apart = match (a.row.axis(), b.row.axis()) {
        (Some(x), Some(y)) => format!("{:.4}° apart", rows::angle_deg(x, y)),
        _ => String::new(),
    };
    let mut out = vec![("status", a.row.status.name().to_owned(), b.row.status.name().to_owned(), apart)];
    let mut add = |name, digits: usize, unit: &str, of: fn(&hzn_mcap::Row) -> Option<f64>| {
        let text = |x: Option<f64>| x.map_or_else(|| "–".to_owned(), |x| format!("{x:.digits$}{unit}"));
        let (x, y) = (of(&a.row), of(&b.row));
        let difference = x.zip(y).map_or_else(String::new, |(x, y)| format!("{:+.digits$}{unit}", y - x));
        out.push((name, text(x), text(y), difference));
    };
    add("axis x", 6, "", |r| r.axis_x);
    add("axis y", 6, "", |r| r.axis_y);
    add("axis z", 6, "", |r| r.axis_z);
    add("σ", 4, "°", |r| r.sigma_max_deg);
    add("half-angle", 4, "°", |r| r.half_angle_deg);
    add("RMS", 3, " px", |r| r.rms_px);
    add("inliers", 0, "", |r| r.inliers.map(f64::from));
    add("level", 0, "", |r| r.level.map(f64::from));
    add("time", 0, " µs", |r| r.elapsed_us);
    out
}
