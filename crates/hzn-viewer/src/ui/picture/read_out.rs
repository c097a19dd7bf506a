//! Text over the picture: the data under the pointer, the values of single pixels, and errors.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, vec2};
use hzn_core::pixel::ImagePoint;

use crate::model::{Plane, quantity};
use crate::ui::placement::Placement;
use crate::work::frame_view::{FrameView, Outcome};
use crate::work::paint;
use crate::work::residuals::Residual;

/// Scale from which single pixels show their values, in screen points per picture pixel.
const VALUES_FROM: f64 = 34.0;

/// Distance of the labels from the corners of the picture, and between them, in screen points.
const CORNER: f32 = 10.0;
const GAP: f32 = 4.0;

/// Largest distance of the pointer from a rejected point that is described, in screen points.
const REJECTED_REACH: f64 = 6.0;

/// Writes the values on single pixels, if they are large enough.
pub(super) fn values(painter: &Painter, frame_view: &FrameView, placement: &Placement<'_>, rect: Rect) {
    let (Ok(picture), Plane::Camera) = (&frame_view.picture, &placement.plane) else { return };
    if placement.scale() < VALUES_FROM {
        return;
    }
    let channel = frame_view.answers.first().map_or(Default::default(), |o| o.config.input.channel);
    let (Some(a), Some(b)) = (placement.to_picture(rect.min), placement.to_picture(rect.max)) else { return };
    for y in (a[1].round().max(0.0) as u16)..=(b[1].round().clamp(0.0, placement.size[1] - 1.0) as u16) {
        for x in (a[0].round().max(0.0) as u16)..=(b[0].round().clamp(0.0, placement.size[0] - 1.0) as u16) {
            let Some((value, _)) = paint::read(picture, channel, x, y) else { continue };
            let bright = f64::from(value) > 0.5 * f64::from((1u32 << picture.layout.bits) - 1);
            let colour = if bright { Color32::from_black_alpha(200) } else { Color32::from_white_alpha(170) };
            let at = placement.shown_to_screen([f64::from(x), f64::from(y)]);
            painter.text(at, Align2::CENTER_CENTER, value.to_string(), FontId::monospace(11.0), colour);
        }
    }
}

/// Returns a description of the pixel under the pointer: its value, its ray in the camera frame and its angles.
pub(super) fn under_pointer(
    frame_view: &FrameView,
    outcome: Option<&Outcome>,
    body: usize,
    placement: &Placement<'_>,
    at: Pos2,
) -> Option<String> {
    let p = placement.to_picture(at)?;
    let (x, y) = (p[0].round(), p[1].round());
    if !(0.0..placement.size[0]).contains(&x) || !(0.0..placement.size[1]).contains(&y) {
        return None;
    }
    let picture = frame_view.picture.as_ref().ok()?;
    let channel = outcome.map_or(Default::default(), |o| o.config.input.channel);
    let (value, samples) = paint::read(picture, channel, x as u16, y as u16)?;
    let mut text = format!("({x:.0}, {y:.0})   {value}");
    if samples.len() > 1 {
        let each: Vec<String> = samples.iter().map(u16::to_string).collect();
        text += &format!(" of ({})", each.join(", "));
    }
    let ray = placement.camera.and_then(|c| c.unproject(ImagePoint { u: p[0], v: p[1] }));
    let Some([rx, ry, rz]) = ray.map(|r| r.xyz()) else {
        return Some(text + if placement.camera.is_some() { "   outside of the image circle" } else { "" });
    };
    text += &format!("   ray ({rx:.4}, {ry:.4}, {rz:.4})   {:.3}° off axis", rz.clamp(-1.0, 1.0).acos().to_degrees());
    if let Some(s) = outcome.and_then(|o| o.bodies.get(body)).and_then(|b| b.solution()) {
        let angle = quantity::angle_deg([rx, ry, rz], s.axis.xyz());
        let beyond = angle - s.fused_half_angle_rad.to_degrees();
        let side = if beyond > 0.0 { "outside of" } else { "inside" };
        text += &format!("   {angle:.3}° from the body's axis, {:.3}° {side} the limb", beyond.abs());
    }
    if let Some((outcome, answer)) = outcome.and_then(|o| Some((o, o.bodies.get(body)?)))
        && let Some(r) = Residual::rejected_at(&answer.residuals, p, REJECTED_REACH / placement.scale())
    {
        let limit = outcome.config.consensus.threshold_px;
        text += &format!("   rejected point: {:+.2} px from the fitted limb (threshold_px {limit})", r.distance_px);
    }
    Some(text)
}

/// Draws text on a background that makes it readable on every picture, and returns its place.
pub(super) fn label(painter: &Painter, at: Pos2, align: Align2, text: &str) -> Rect {
    label_beside(painter, at, align, text, &[])
}

/// Draws a text like [`label`] in a corner at the top, below what is in its way, and adds its place to what is taken.
pub(super) fn corner_label(painter: &Painter, align: Align2, text: &str, taken: &mut Vec<Rect>) {
    let at = align.pos_in_rect(&painter.clip_rect().shrink(CORNER));
    let place = label_beside(painter, at, align, text, taken);
    taken.push(place);
}

fn label_beside(painter: &Painter, at: Pos2, align: Align2, text: &str, taken: &[Rect]) -> Rect {
    let width = painter.clip_rect().width() - 30.0;
    let galley = painter.layout(text.to_owned(), FontId::proportional(12.5), Color32::from_rgb(236, 238, 242), width);
    let rect = below(align.anchor_size(at, galley.size() + vec2(14.0, 8.0)), taken);
    painter.rect_filled(rect, 5, Color32::from_black_alpha(190));
    painter.galley(rect.min + vec2(7.0, 4.0), galley, Color32::WHITE);
    rect
}

/// Moves a place down until it meets nothing that is taken.
fn below(mut place: Rect, taken: &[Rect]) -> Rect {
    while let Some(other) = taken.iter().find(|other| other.intersects(place)) {
        place = place.translate(vec2(0.0, other.bottom() + GAP - place.top()));
    }
    place
}

/// Draws an error message across the middle of the picture.
pub(super) fn notice(painter: &Painter, rect: Rect, text: &str, colour: Color32) {
    let galley = painter.layout(text.to_owned(), FontId::proportional(14.0), colour, (rect.width() - 60.0).min(640.0));
    let place = Align2::CENTER_CENTER.anchor_size(rect.center(), galley.size() + vec2(24.0, 16.0));
    painter.rect_filled(place, 6, Color32::from_black_alpha(210));
    painter.galley(place.min + vec2(12.0, 8.0), galley, colour);
}

#[cfg(test)]
mod tests {
    use egui::pos2;

    use super::*;

    #[test]
    fn labels_of_one_corner_stand_below_each_other() {
        let size = vec2(200.0, 24.0);
        let mut taken = vec![Rect::from_min_size(pos2(300.0, 10.0), vec2(170.0, 184.0))];
        for top in [10.0, 38.0, 66.0] {
            let place = below(Rect::from_min_size(pos2(10.0, 10.0), size), &taken);
            assert_eq!((place.top(), place.size()), (top, size));
            taken.push(place);
        }
        // A text that would reach the map goes below it.
        let wide = below(Rect::from_min_size(pos2(220.0, 10.0), size), &taken);
        assert!(wide.top() > 194.0 && taken.iter().all(|other| !other.intersects(wide)), "{wide:?}");
    }
}
