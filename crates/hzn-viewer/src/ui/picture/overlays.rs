//! The overlays of the picture.

use egui::{Align2, Color32, FontId, Mesh, Painter, Pos2, Rect, Shape, Stroke, Vec2, pos2, vec2};
use hzn_core::pixel::ImagePoint;

use super::arrow::Arrow;
use super::ground;
use super::strokes::{cross, lines};
use crate::model::Plane;
use crate::model::settings::Layer;
use crate::model::view::Point;
use crate::ui::placement::Placement;
use crate::ui::theme;
use crate::ui::viewer::Viewer;
use crate::work::frame_view::{BodyResult, Outcome};
use crate::work::{FrameView, sky, stars};

/// Draws all layers that are switched on, and adds the places of arrows to what is taken. Returns what the local
/// vertical says about the camera.
pub(super) fn draw(
    viewer: &Viewer,
    painter: &Painter,
    frame_view: &FrameView,
    outcome: &Outcome,
    placement: &Placement<'_>,
    taken: &mut Vec<Rect>,
) -> Option<String> {
    let on = |layer| viewer.settings.shows(layer);
    if on(Layer::Mask) {
        for polygon in &outcome.config.mask.polygons_px {
            let outline: Vec<Pos2> = polygon.iter().filter_map(|p| placement.to_screen(*p)).collect();
            hatch(painter, &outline);
        }
    }
    if let Some(area) = &viewer.steady.area {
        let closed: Vec<Point> = area.polygon.iter().chain(area.polygon.first()).copied().collect();
        dashed_lines(painter, placement, &[closed], theme::TRUTH, 1.8);
    }
    if on(Layer::Circle)
        && let Some(camera) = placement.camera
        && placement.plane == Plane::Camera
    {
        for ellipse in [camera.image_circle_px(), camera.blind_centre_px()] {
            dashed_ellipse(painter, ellipse, placement);
        }
    }
    taken.extend(outcome.bodies.iter().filter_map(|b| arrow(viewer, painter, b, placement)).map(|arrow| arrow.area()));
    let vertical = ground::draw(viewer, painter, frame_view, outcome, placement, taken);
    for answer in &outcome.bodies {
        body(viewer, painter, answer, placement);
    }
    if on(Layer::Truth) {
        for truth in viewer.truth.get(&frame_view.name).into_iter().flatten() {
            let (Some(camera), Some(axis)) = (placement.camera, truth.axis()) else { continue };
            let limb = hzn_run::overlay::limb::lines(axis.xyz(), truth.half_angle_deg.to_radians(), camera);
            lines(painter, placement, &limb, Stroke::new(1.5, theme::TRUTH));
            if let Some(p) = camera.project(&axis).and_then(|p| placement.to_screen([p.u, p.v])) {
                cross(painter, p, 8.0, Stroke::new(1.5, theme::TRUTH));
            }
        }
    }
    if on(Layer::Sky) {
        draw_sky(viewer, painter, frame_view, outcome, placement);
    }
    vertical
}

/// Draws Sun, Moon and stars with their names.
fn draw_sky(viewer: &Viewer, painter: &Painter, frame_view: &FrameView, outcome: &Outcome, placement: &Placement<'_>) {
    let Some(camera) = placement.camera else { return };
    let truth = viewer.truth.get(&frame_view.name).and_then(|t| t.first());
    for place in sky::places(frame_view.data.as_ref(), truth, &outcome.bodies, camera) {
        let Some(at) = placement.to_screen(place.at) else { continue };
        let colour = theme::SKY.gamma_multiply(if place.is_hidden { 0.5 } else { 1.0 });
        painter.circle_stroke(at, 11.0, Stroke::new(1.5, colour));
        painter.text(at + vec2(14.0, 0.0), Align2::LEFT_CENTER, place.name, FontId::proportional(12.0), colour);
    }
    for star in stars::places(frame_view.data.as_ref(), &outcome.bodies, camera) {
        let Some(at) = placement.to_screen(star.at) else { continue };
        // A bright star has a larger circle.
        let radius = (7.0 - 1.3 * star.magnitude as f32).clamp(3.0, 9.0);
        painter.circle_stroke(at, radius, Stroke::new(1.0, theme::SKY));
        let (font, colour) = (FontId::proportional(11.0), theme::SKY.gamma_multiply(0.85));
        painter.text(at + vec2(radius + 3.0, 0.0), Align2::LEFT_CENTER, star.name, font, colour);
    }
}

/// Returns the arrow to an axis that is outside of the picture, if the axis is shown.
fn arrow(viewer: &Viewer, painter: &Painter, answer: &BodyResult, placement: &Placement<'_>) -> Option<Arrow> {
    let is_inside = |p: &Point| (0..2).all(|i| (-0.5..placement.size[i] - 0.5).contains(&p[i]));
    let is_shown = viewer.settings.shows(Layer::Axis) && answer.axis.filter(is_inside).is_none();
    if is_shown { Arrow::new(painter, placement, answer) } else { None }
}

/// Draws the result of a body.
fn body(viewer: &Viewer, painter: &Painter, answer: &BodyResult, placement: &Placement<'_>) {
    let on = |layer| viewer.settings.shows(layer);
    let dot = (placement.scale() as f32 * 0.5).clamp(0.9, 5.0);
    if on(Layer::Edges) {
        for edge in &answer.edges {
            let pointed = viewer.pointed == Some(edge.candidate);
            let colour = theme::edge(edge.candidate);
            let radius = if pointed { dot + 1.6 } else { dot };
            let points = edge.border.iter().map(|p| [f64::from(p.x), f64::from(p.y)]);
            dots(painter, points.filter_map(|p| placement.to_screen(p)), radius, colour);
        }
    }
    if on(Layer::Limb) {
        // Many short edges have a fit. All of them would hide the picture, so only the longest ones are drawn, and the
        // one under the pointer.
        let longest = answer.longest_candidates();
        let pointed = |c: u32| viewer.pointed == Some(c) || viewer.chosen_candidate == Some(c);
        let drawn = answer.candidate_limbs.iter().filter(|(c, _)| pointed(*c) || longest.contains(c));
        for (candidate, limb) in drawn {
            let strong = pointed(*candidate) || longest.first() == Some(candidate);
            let colour = theme::edge(*candidate).gamma_multiply(if strong { 1.0 } else { 0.3 });
            dashed_lines(painter, placement, limb, colour, if pointed(*candidate) { 3.0 } else { 1.6 });
        }
        dashed_lines(painter, placement, &answer.trial_limb, theme::LIMB, 1.8);
        dashed_lines(painter, placement, &answer.expected_limb, theme::EXPECTED, 1.8);
        expected_label(painter, placement, answer);
        // A dark line below keeps the limb visible on clouds.
        lines(painter, placement, &answer.limb, Stroke::new(6.0, Color32::from_black_alpha(120)));
        lines(painter, placement, &answer.limb, Stroke::new(3.4, theme::LIMB));
    }
    let points = |kept: bool| {
        answer.residuals.iter().filter(move |r| (r.weight > 0.0) == kept).filter_map(|r| placement.to_screen(r.point))
    };
    if on(Layer::Rejected) {
        dots(painter, points(false), dot + 0.6, theme::REJECTED);
    }
    if on(Layer::Inliers) {
        // The dots are narrower than the line of the limb, so that both are seen.
        dots(painter, points(true), dot, theme::INLIER);
    }
    if let Some(arrow) = arrow(viewer, painter, answer, placement) {
        arrow.draw(painter);
    } else if on(Layer::Axis)
        && let Some(at) = answer.axis.and_then(|p| placement.to_screen(p))
    {
        cross(painter, at, 13.0, Stroke::new(4.0, Color32::from_black_alpha(140)));
        cross(painter, at, 12.0, Stroke::new(2.0, theme::AXIS));
        let outline: Vec<Pos2> = answer.ellipse.iter().filter_map(|p| placement.to_screen(*p)).collect();
        if outline.len() > 2 {
            painter.add(Shape::closed_line(outline, Stroke::new(1.5, theme::AXIS)));
        }
    }
}

/// Draws lines with dashes, above a dark line that keeps them visible on clouds.
fn dashed_lines(painter: &Painter, placement: &Placement<'_>, lines: &[Vec<Point>], colour: Color32, width: f32) {
    for line in lines {
        let points: Vec<Pos2> = line.iter().filter_map(|p| placement.to_screen(*p)).collect();
        let back = Stroke::new(width + 2.0, Color32::from_black_alpha(colour.a() / 2));
        painter.extend(Shape::dashed_line(&points, back, 9.0, 6.0));
        painter.extend(Shape::dashed_line(&points, Stroke::new(width, colour), 9.0, 6.0));
    }
}

/// Names the expected limb with its half-angle, at the middle of its longest line.
fn expected_label(painter: &Painter, placement: &Placement<'_>, answer: &BodyResult) {
    let longest = answer.expected_limb.iter().max_by_key(|line| line.len());
    let middle = longest.and_then(|line| placement.to_screen(*line.get(line.len() / 2)?));
    let (Some(at), Some(rad)) = (middle, answer.expected_rad) else { return };
    let inside = painter.clip_rect().shrink2(vec2(90.0, 20.0));
    let text = format!("expected, {:.2}°", rad.to_degrees());
    super::read_out::label(painter, inside.clamp(at) + vec2(0.0, -14.0), Align2::CENTER_BOTTOM, &text);
}

/// Draws thousands of points as one mesh of squares.
fn dots(painter: &Painter, points: impl Iterator<Item = Pos2>, radius: f32, colour: Color32) {
    let clip = painter.clip_rect().expand(radius);
    let mut mesh = Mesh::default();
    for p in points.filter(|p| clip.contains(*p)) {
        mesh.add_colored_rect(Rect::from_center_size(p, Vec2::splat(2.0 * radius)), colour);
    }
    painter.add(mesh);
}

/// Hatches a masked area with diagonal lines.
fn hatch(painter: &Painter, outline: &[Pos2]) {
    if outline.len() < 3 {
        return;
    }
    let stroke = Stroke::new(1.0, theme::MASK);
    let bounds = Rect::from_points(outline).intersect(painter.clip_rect());
    let polygon: Vec<Point> = outline.iter().map(|p| [p.x.into(), p.y.into()]).collect();
    let mut y = (bounds.top() - bounds.width()).floor() - (bounds.top() - bounds.width()).floor() % 9.0;
    while y < bounds.bottom() {
        // This draws the inner parts of one falling diagonal.
        let steps = (bounds.width() / 2.0).max(1.0) as usize;
        let mut from: Option<Pos2> = None;
        for i in 0..=steps {
            let p = pos2(bounds.left() + 2.0 * i as f32, y + 2.0 * i as f32);
            let inside = bounds.contains(p) && crate::model::mask::is_inside(&polygon, [p.x.into(), p.y.into()]);
            match (inside, from) {
                (true, None) => from = Some(p),
                (false, Some(start)) => {
                    painter.line_segment([start, p], stroke);
                    from = None;
                }
                (true, Some(start)) if i == steps => {
                    painter.line_segment([start, p], stroke);
                }
                _ => {}
            }
        }
        y += 9.0;
    }
    painter.add(Shape::closed_line(outline.to_vec(), Stroke::new(1.5, theme::MASK)));
}

/// Draws an ellipse of the picture, given by its centre and its semi-axes along x and y in pixels.
fn dashed_ellipse(painter: &Painter, ellipse: Option<(ImagePoint<f64>, f64, f64)>, placement: &Placement<'_>) {
    let Some((centre, a, b)) = ellipse else { return };
    let at = |i: usize| {
        let (s, c) = (i as f64 * std::f64::consts::TAU / 256.0).sin_cos();
        placement.to_screen([centre.u + a * c, centre.v + b * s])
    };
    painter.add(Shape::dashed_line(
        &(0..=256).filter_map(at).collect::<Vec<_>>(),
        Stroke::new(1.5, theme::CIRCLE),
        7.0,
        5.0,
    ));
}
