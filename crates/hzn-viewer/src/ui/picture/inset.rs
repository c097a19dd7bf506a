//! A small map of all directions around the optical axis, for an axis that lies outside the picture.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Shape, Stroke, Vec2, pos2, vec2};
use hzn_core::camera::Camera;
use hzn_core::pixel::ImagePoint;

use crate::model::settings::Layer;
use crate::ui::theme;
use crate::ui::viewer::Viewer;
use crate::work::FrameView;
use crate::work::frame_view::{BodyResult, Outcome};

/// Largest width of the map in points, and its largest part of the picture.
const SIZE: f32 = 170.0;
const PART: f32 = 0.28;
/// Width of a map in points that has room for the long text below it.
const LONG_TEXT: f32 = 150.0;
/// Height in points of the badge of the zoom, with its distance from the map.
const BADGE_HEIGHT: f32 = 30.0;
/// Points on a side of the picture's border, and around the limb.
const SIDE: usize = 24;
const AROUND: usize = 120;

/// Draws the map in a corner, if the axis of the answer lies outside the picture, and adds its place to what is taken.
/// The distance from its centre is the angle from the optical axis.
pub(super) fn draw(
    viewer: &Viewer,
    painter: &Painter,
    frame_view: &FrameView,
    outcome: &Outcome,
    taken: &mut Vec<Rect>,
) {
    let body = outcome.bodies.get(viewer.body).or(outcome.bodies.first());
    let (Some(body), Some(camera), Some(size)) = (body, frame_view.camera.as_deref(), frame_view.size()) else {
        return;
    };
    let inside = |p: [f64; 2]| (0..2).all(|i| (-0.5..size[i] - 0.5).contains(&p[i]));
    if !viewer.settings.shows(Layer::Axis) || body.axis.is_some_and(inside) {
        return;
    }
    let Some(map) = Map::new(body, camera, painter.clip_rect(), taken) else { return };
    taken.push(map.frame);
    painter.rect_filled(map.frame, 6, Color32::from_black_alpha(200));
    let painter = painter.with_clip_rect(map.frame);
    for degrees in [30, 60, 90, 120, 150] {
        let radius = map.radius * (f64::from(degrees) / map.most_deg) as f32;
        if radius < map.radius {
            painter.circle_stroke(map.centre, radius, Stroke::new(0.7, Color32::from_white_alpha(40)));
        }
    }
    painter.add(Shape::closed_line(border(camera, &map), Stroke::new(1.5, Color32::from_gray(220))));
    if let Some(s) = body.solution() {
        let limb = around(s.axis.xyz(), s.fused_half_angle_rad).map(|d| map.at(d));
        painter.add(Shape::closed_line(limb.collect(), Stroke::new(2.0, theme::LIMB)));
        let at = map.at(s.axis.xyz());
        super::strokes::cross(&painter, at, 6.0, Stroke::new(2.0, theme::AXIS));
    }
    let text = |at: Pos2, align: Align2, text: &str, colour: Color32| {
        painter.text(at, align, text, FontId::proportional(10.5), colour);
    };
    let foot = map.frame.center_bottom() - vec2(0.0, 4.0);
    let what = if map.frame.width() < LONG_TEXT { "off axis" } else { "around the optical axis" };
    text(foot, Align2::CENTER_BOTTOM, &format!("{:.0}° {what}", map.most_deg), Color32::from_gray(190));
}

struct Map {
    frame: Rect,
    centre: Pos2,
    radius: f32,
    /// Angle from the optical axis at the border of the map.
    most_deg: f64,
}

impl Map {
    fn new(body: &BodyResult, camera: &Camera<f64>, rect: Rect, taken: &[Rect]) -> Option<Self> {
        let s = body.solution()?;
        let off_deg = s.axis.xyz()[2].clamp(-1.0, 1.0).acos().to_degrees();
        let far_deg = off_deg + s.fused_half_angle_rad.to_degrees();
        let corner = camera.unproject(ImagePoint { u: -0.5, v: -0.5 });
        let corner_deg = corner.map_or(90.0, |ray| ray.xyz()[2].clamp(-1.0, 1.0).acos().to_degrees());
        let most_deg = (far_deg.max(corner_deg) * 1.08).min(180.0);
        let width = SIZE.min(rect.width() * PART).min(rect.height() * PART * 1.4);
        let frame = place(vec2(width, width + 14.0), rect, taken);
        let centre = frame.center() - vec2(0.0, 7.0);
        Some(Self { frame, centre, radius: width / 2.0 - 6.0, most_deg })
    }

    /// Returns the place of a direction in the camera frame.
    fn at(&self, [x, y, z]: [f64; 3]) -> Pos2 {
        let length = x.hypot(y);
        if length < 1e-12 {
            return self.centre;
        }
        let distance = z.clamp(-1.0, 1.0).acos().to_degrees() / self.most_deg;
        self.centre + vec2((x / length * distance) as f32, (y / length * distance) as f32) * self.radius
    }
}

/// Returns the corner of the map: the upper right one, or the lower right one if an arrow to an axis is in the way.
fn place(size: Vec2, rect: Rect, taken: &[Rect]) -> Rect {
    let upper = Rect::from_min_size(pos2(rect.right() - size.x - 10.0, rect.top() + 10.0), size);
    // The badge of the zoom is below the lower one.
    let lower = upper.translate(vec2(0.0, (rect.height() - size.y - 20.0 - BADGE_HEIGHT).max(0.0)));
    if taken.iter().any(|taken| taken.intersects(upper)) { lower } else { upper }
}

/// Returns the border of the picture. A pixel outside the image circle has no direction.
fn border(camera: &Camera<f64>, map: &Map) -> Vec<Pos2> {
    let (w, h) = (f64::from(camera.width()) - 0.5, f64::from(camera.height()) - 0.5);
    let corners = [[-0.5, -0.5], [w, -0.5], [w, h], [-0.5, h]];
    let side = |k: usize| {
        let (a, b) = (corners[k], corners[(k + 1) % 4]);
        (0..SIDE).map(move |i| {
            let t = i as f64 / SIDE as f64;
            ImagePoint { u: a[0] + (b[0] - a[0]) * t, v: a[1] + (b[1] - a[1]) * t }
        })
    };
    (0..4).flat_map(side).filter_map(|p| camera.unproject(p)).map(|ray| map.at(ray.xyz())).collect()
}

/// Returns directions around a cone.
fn around(axis: [f64; 3], half_angle_rad: f64) -> impl Iterator<Item = [f64; 3]> {
    let [x, y, z] = axis;
    // A vector perpendicular to the axis, and one perpendicular to both.
    let first = if x.abs() < 0.7 { [0.0, z, -y] } else { [-z, 0.0, x] };
    let length = first.iter().map(|v| v * v).sum::<f64>().sqrt();
    let a = first.map(|v| v / length);
    let b = [y * a[2] - z * a[1], z * a[0] - x * a[2], x * a[1] - y * a[0]];
    let (sin, cos) = half_angle_rad.sin_cos();
    (0..AROUND).map(move |i| {
        let (s, c) = (i as f64 / AROUND as f64 * std::f64::consts::TAU).sin_cos();
        std::array::from_fn(|k| cos * axis[k] + sin * (c * a[k] + s * b[k]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_gives_way_to_the_arrow() {
        let (rect, size) = (Rect::from_min_size(pos2(200.0, 40.0), vec2(790.0, 520.0)), vec2(170.0, 184.0));
        let upper = place(size, rect, &[]);
        assert!(rect.contains_rect(upper) && upper.top() == 50.0);
        assert_eq!(place(size, rect, &[Rect::from_min_size(pos2(300.0, 100.0), vec2(40.0, 40.0))]), upper);
        let taken = Rect::from_min_size(pos2(780.0, 160.0), vec2(200.0, 20.0));
        let lower = place(size, rect, &[taken]);
        assert!(rect.contains_rect(lower) && !lower.intersects(taken), "{lower:?}");
    }

    #[test]
    fn directions_around_a_cone_have_its_half_angle() {
        for axis in [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [-0.8, 0.6, 0.0]] {
            for d in around(axis, 1.1) {
                let cos: f64 = d.iter().zip(axis).map(|(a, b)| a * b).sum();
                assert!((cos.acos() - 1.1).abs() < 1e-12);
            }
        }
    }
}
