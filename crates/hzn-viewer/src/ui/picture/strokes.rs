//! Crosses and lines over the picture.

use egui::{Painter, Pos2, Shape, Stroke, vec2};

use crate::model::view::Point;
use crate::ui::placement::Placement;

/// Draws a cross.
pub(super) fn cross(painter: &Painter, at: Pos2, arm: f32, stroke: Stroke) {
    painter.line_segment([at - vec2(arm, 0.0), at + vec2(arm, 0.0)], stroke);
    painter.line_segment([at - vec2(0.0, arm), at + vec2(0.0, arm)], stroke);
}

/// Draws lines of the picture.
pub(super) fn lines(painter: &Painter, placement: &Placement<'_>, lines: &[Vec<Point>], stroke: Stroke) {
    for line in lines {
        // A point that the plane cannot show ends the line.
        for part in line.split(|p| placement.to_screen(*p).is_none()) {
            painter.add(Shape::line(part.iter().filter_map(|p| placement.to_screen(*p)).collect(), stroke));
        }
    }
}
