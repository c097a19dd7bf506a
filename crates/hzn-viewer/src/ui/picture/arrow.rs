//! An arrow at the border of the picture, towards an axis that lies outside of it.

use std::sync::Arc;

use egui::{Color32, FontId, Galley, Painter, Pos2, Rect, Shape, Stroke, Vec2, pos2, vec2};

use crate::ui::placement::Placement;
use crate::ui::theme;
use crate::work::frame_view::BodyResult;

/// An arrow and its words.
pub(super) struct Arrow {
    back: Pos2,
    tip: Pos2,
    direction: Vec2,
    words: Arc<Galley>,
    label: Rect,
}

impl Arrow {
    /// Finds the place of the arrow. `None` if the answer has no axis, or if the border cannot be reached.
    pub(super) fn new(painter: &Painter, placement: &Placement<'_>, answer: &BodyResult) -> Option<Self> {
        let (s, camera) = (answer.solution()?, placement.camera?);
        let [x, y, z] = s.axis.xyz();
        let length = x.hypot(y);
        if length < 1e-9 {
            return None;
        }
        let direction = vec2((x / length) as f32, (y / length) as f32);
        let centre = camera.principal_point();
        let from = placement.shown_to_screen([centre.u, centre.v]);
        let frame = painter.clip_rect().shrink(16.0).intersect(Rect::from_min_max(
            placement.shown_to_screen([-0.5, -0.5]),
            placement.shown_to_screen([placement.size[0] - 0.5, placement.size[1] - 0.5]),
        ));
        // The arrow goes to the border.
        let far = |at: f32, direction: f32, low: f32, high: f32| {
            if direction > 0.0 { (high - at) / direction } else { (low - at) / direction }
        };
        let reach = [
            far(from.x, direction.x, frame.left(), frame.right()),
            far(from.y, direction.y, frame.top(), frame.bottom()),
        ];
        let reach = reach.into_iter().filter(|r| r.is_finite()).fold(f32::INFINITY, f32::min);
        if !(reach > 0.0 && reach.is_finite()) {
            return None;
        }
        let tip = from + direction * (reach - 6.0);
        let back = tip - direction * 32.0;
        let degrees = z.clamp(-1.0, 1.0).acos().to_degrees();
        let text = format!("axis, {degrees:.1}° off the optical axis");
        let words = painter.layout_no_wrap(text, FontId::proportional(12.0), theme::AXIS);
        let size = words.size() + vec2(10.0, 4.0);
        let label = place_label(Rect::from_two_pos(back, tip).expand(7.0), direction, size, frame);
        Some(Self { back, tip, direction, words, label })
    }

    /// Returns the area of the arrow and its words.
    pub(super) fn area(&self) -> Rect {
        Rect::from_two_pos(self.back, self.tip).expand(7.0).union(self.label)
    }

    pub(super) fn draw(&self, painter: &Painter) {
        let Self { back, tip, direction, .. } = *self;
        let side = vec2(-direction.y, direction.x) * 7.5;
        let head = vec![tip, tip - direction * 14.0 + side, tip - direction * 14.0 - side];
        painter.line_segment([back, tip - direction * 12.0], Stroke::new(6.5, Color32::from_black_alpha(170)));
        painter.line_segment([back, tip - direction * 12.0], Stroke::new(3.5, theme::AXIS));
        painter.add(Shape::convex_polygon(head, theme::AXIS, Stroke::new(1.0, Color32::from_black_alpha(150))));
        painter.rect_filled(self.label, 4, Color32::from_black_alpha(200));
        painter.galley(self.label.min + vec2(5.0, 2.0), self.words.clone(), theme::AXIS);
    }
}

/// Returns the place of a label next to an arrow. The label is as far back as the frame allows and never covers the
/// arrow.
fn place_label(arrow: Rect, direction: Vec2, size: Vec2, frame: Rect) -> Rect {
    let c = arrow.center();
    // The label may move along the border to stay within the frame.
    let x = (c.x - size.x / 2.0).min(frame.right() - size.x).max(frame.left());
    let y = (c.y - size.y / 2.0).min(frame.bottom() - size.y).max(frame.top());
    let mut places = [
        pos2(arrow.left() - size.x, y),
        pos2(arrow.right(), y),
        pos2(x, arrow.top() - size.y),
        pos2(x, arrow.bottom()),
    ]
    .map(|min| Rect::from_min_size(min, size));
    let ahead = |r: &Rect| (r.center() - c).dot(direction);
    places.sort_by(|a, b| ahead(a).total_cmp(&ahead(b)));
    places.into_iter().find(|r| frame.expand(0.5).contains_rect(*r)).unwrap_or(places[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_covers_neither_its_arrow_nor_the_border() {
        let frame = Rect::from_min_size(pos2(20.0, 30.0), vec2(500.0, 300.0));
        let size = vec2(180.0, 18.0);
        for i in 0..72 {
            let direction = Vec2::angled(i as f32 * std::f32::consts::TAU / 72.0);
            for tip in [pos2(24.0, 34.0), pos2(516.0, 34.0), pos2(516.0, 326.0), pos2(270.0, 326.0), pos2(24.0, 180.0)]
            {
                let arrow = Rect::from_two_pos(tip, tip - direction * 22.0).expand(7.0);
                let label = place_label(arrow, direction, size, frame);
                assert!(frame.expand(0.5).contains_rect(label), "{direction:?} {tip:?} {label:?}");
                assert!(!label.shrink(0.1).intersects(arrow), "{direction:?} {tip:?} {label:?}");
            }
        }
    }
}
