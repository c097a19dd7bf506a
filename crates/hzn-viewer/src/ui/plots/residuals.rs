//! The residuals along the limb of the shown picture.

use egui::{Ui, vec2};
use egui_plot::{HLine, MarkerShape, PlotPoints, Points};

use super::axis::axis_labels;
use super::frame::{heading, set_label, shared_plot};
use crate::ui::theme;
use crate::ui::viewer::Viewer;
use crate::work::residuals::{Residual, residuals};

/// Name of the plot of residuals.
pub(in crate::ui) const RESIDUALS: &str = "Residuals";

/// Outliers farther away than this many thresholds are arrows at the border of the plot.
const OUTLIER_THRESHOLDS: f64 = 4.0;

/// Returns the residuals of the candidate that the user chose, or else those of the answer, with a title.
fn chosen(viewer: &Viewer) -> (String, Vec<Residual>) {
    let Some(answer) = viewer.answer() else { return (String::new(), Vec::new()) };
    let candidate = viewer.chosen_candidate.filter(|c| answer.solution().is_none_or(|s| s.candidate != *c));
    let edge = candidate.and_then(|c| answer.edges.iter().find(|e| e.candidate == c));
    let camera = viewer.frame_view.as_ref().and_then(|f| f.camera.as_deref());
    if let (Some(edge), Some(camera)) = (edge, camera) {
        // A refused candidate is shown against its own fit, with its own half-angle.
        let all = edge.fitted.map(|fitted| {
            let mut solution = fitted.solution;
            solution.fused_half_angle_rad = solution.half_angle_rad;
            residuals(&solution, edge, camera)
        });
        let title = format!("Residual of candidate {} [px] by azimuth about its axis", edge.candidate + 1);
        return (title, all.unwrap_or_default());
    }
    ("Residual [px] by azimuth about the axis".to_owned(), answer.residuals.clone())
}

/// Returns the largest distance of these points from the limb, at least one pixel.
fn largest_px<'a>(residuals: impl Iterator<Item = &'a Residual>) -> f64 {
    residuals.map(|r| r.distance_px.abs()).fold(1.0, f64::max)
}

/// Returns the end of the axis. Outliers may be hundreds of pixels away, so the inliers and the threshold decide it.
fn scale_px(all: &[Residual], threshold_px: Option<f64>) -> f64 {
    let inliers = largest_px(all.iter().filter(|r| r.weight > 0.0));
    largest_px(all.iter()).min(inliers.max(OUTLIER_THRESHOLDS * threshold_px.unwrap_or(0.0)))
}

/// Plots the residuals of the edge points along the fitted limb; returns the picture point that was clicked.
pub(super) fn show(viewer: &Viewer, ui: &mut Ui, height: f32) -> Option<[f64; 2]> {
    let threshold = viewer.frame_view.as_ref().and_then(|s| s.answers.first()).map(|o| o.config.consensus.threshold_px);
    let (title, all) = chosen(viewer);
    let end = scale_px(&all, threshold);
    let points = |kept: bool| -> PlotPoints<'_> {
        let inside = all.iter().filter(|r| (r.weight > 0.0) == kept && r.distance_px.abs() <= end);
        inside.map(|r| [r.azimuth_deg, r.distance_px]).collect()
    };
    let beyond = |sign: f64| -> PlotPoints<'_> {
        let beyond = all.iter().filter(|r| sign * r.distance_px > end);
        beyond.map(|r| [r.azimuth_deg, sign * end]).collect()
    };
    if all.is_empty() {
        heading(ui, RESIDUALS, &[], "");
        ui.weak("There are no residuals: no limb is fitted. A click on a candidate with a fit shows its residuals.");
        return None;
    }
    let farthest = largest_px(all.iter());
    let text = if farthest > end { format!("▲▼ outliers up to {farthest:.0} px") } else { String::new() };
    heading(ui, &title, &[("inliers", theme::INLIER), ("outliers", theme::REJECTED)], &text);
    let plot = shared_plot("residuals", height)
        .set_margin_fraction(vec2(0.01, 0.1))
        .x_axis_formatter(axis_labels("°"))
        .include_y(-end)
        .include_y(end);
    let shown = plot.show(ui, |ui| {
        if let Some(px) = threshold {
            for y in [px, -px] {
                ui.hline(HLine::new("threshold", y).color(theme::REJECTED.gamma_multiply(0.5)).allow_hover(false));
            }
        }
        ui.points(Points::new("outliers", points(false)).color(theme::REJECTED).radius(1.8));
        for (sign, shape) in [(1.0, MarkerShape::Up), (-1.0, MarkerShape::Down)] {
            ui.points(Points::new("outliers", beyond(sign)).color(theme::REJECTED).shape(shape).radius(3.0));
        }
        ui.points(Points::new("inliers", points(true)).color(theme::INLIER).radius(1.5));
    });
    set_label(&shown.response, RESIDUALS);
    let pointer = shown.response.interact_pointer_pos().filter(|_| shown.response.clicked())?;
    // The point that is nearest on the screen is returned.
    let distance = |r: &Residual| {
        let p = shown.transform.position_from_point(&[r.azimuth_deg, r.distance_px.clamp(-end, end)].into());
        p.distance_sq(pointer)
    };
    all.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).map(|r| r.point)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outliers_of_hundreds_of_pixels_do_not_make_the_inliers_flat() {
        let residual =
            |distance_px: f64, weight: f64| Residual { azimuth_deg: 0.0, distance_px, weight, point: [0.0; 2] };
        let mut all: Vec<Residual> = (0..40).map(|i| residual(0.1 * f64::from(i % 21) - 1.0, 1.0)).collect();
        assert_eq!(scale_px(&all, Some(1.5)), 1.0, "without outliers, the inliers decide");
        all.push(residual(3.0, 0.0));
        assert_eq!(scale_px(&all, Some(1.5)), 3.0, "an outlier near the inliers is seen at its place");
        all.push(residual(-600.0, 0.0));
        assert_eq!(scale_px(&all, Some(1.5)), 6.0, "four thresholds");
        assert_eq!(scale_px(&all, None), 1.0);
        all.push(residual(-9.0, 0.4));
        assert_eq!(scale_px(&all, Some(1.5)), 9.0, "every inlier is inside");
        assert_eq!(scale_px(&[], Some(1.5)), 1.0);
    }
}
