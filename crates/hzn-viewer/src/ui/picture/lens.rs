//! The residuals of a lens calibration: an arrow from each measured point, all enlarged by the same factor.

use egui::{Painter, Pos2, Stroke};

use crate::model::settings::Layer;
use crate::model::view::Point;
use crate::ui::placement::Placement;
use crate::ui::theme;
use crate::ui::viewer::Viewer;
use crate::work::FrameView;

/// Length of an arrow of the RMS, as a part of the width of the picture.
const LENGTH: f64 = 0.02;

/// Draws the arrows, if there are residuals and their overlay is switched on. Returns what is to be said about them.
pub(super) fn draw(
    viewer: &Viewer,
    painter: &Painter,
    frame_view: &FrameView,
    placement: &Placement<'_>,
) -> Option<String> {
    let residuals = viewer.companions.residuals.as_ref()?;
    if !viewer.settings.shows(Layer::Lens) || viewer.layers_hidden {
        return None;
    }
    let names = viewer.sequence.entries.iter().map(|e| e.name.as_str());
    let arrows = residuals.of_picture(&frame_view.name, names);
    if arrows.is_empty() {
        return None;
    }
    let factor = residuals.enlargement(LENGTH * placement.size[0]);
    let clip = painter.clip_rect().expand(20.0);
    let screen = |p: Point| placement.to_screen(p).filter(|p| clip.contains(*p));
    for arrow in arrows {
        let Some(from) = screen(arrow.at) else { continue };
        if !arrow.counts {
            painter.circle_stroke(from, 3.0, Stroke::new(1.2, theme::REJECTED));
            continue;
        }
        let to = [0, 1].map(|i| arrow.at[i] + factor * arrow.error[i]);
        let to: Option<Pos2> = placement.to_screen(to);
        for (stroke, radius) in
            [(Stroke::new(3.6, egui::Color32::from_black_alpha(150)), 2.6), (Stroke::new(1.6, theme::LENS), 1.8)]
        {
            painter.circle_filled(from, radius, stroke.color);
            if let Some(to) = to {
                painter.line_segment([from, to], stroke);
            }
        }
    }
    Some(format!(
        "{}: {} residuals, enlarged {factor:.0} times; RMS {:.3} px; circles: outliers",
        residuals.file,
        arrows.len(),
        residuals.rms_px
    ))
}
