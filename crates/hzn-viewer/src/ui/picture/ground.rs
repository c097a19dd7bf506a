//! Where the camera looks: latitudes and longitudes, and the local vertical.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Stroke, vec2};

use super::strokes::{cross, lines};
use crate::model::settings::Layer;
use crate::ui::placement::Placement;
use crate::ui::theme;
use crate::ui::viewer::Viewer;
use crate::work::FrameView;
use crate::work::frame_view::Outcome;
use crate::work::ground::{NamedLine, Vertical, vertical};

/// Shortest part of a line that has a label, in points.
const LABELLED: f32 = 60.0;

/// Draws the layers that are switched on, with names that avoid what is taken. Returns what the local vertical says
/// about the camera.
pub(super) fn draw(
    viewer: &Viewer,
    painter: &Painter,
    frame_view: &FrameView,
    outcome: &Outcome,
    placement: &Placement<'_>,
    taken: &[Rect],
) -> Option<String> {
    let mut taken = taken.to_vec();
    if viewer.settings.shows(Layer::Grid)
        && let Some(grid) = frame_view.grid()
    {
        lines(painter, placement, &grid.coasts, Stroke::new(3.4, Color32::from_black_alpha(90)));
        lines(painter, placement, &grid.coasts, Stroke::new(1.4, theme::COAST));
        // Parallels have their names at a third of their length and meridians at two thirds, so that names rarely meet.
        for (named, at) in [(&grid.parallels, 0.33), (&grid.meridians, 0.67)] {
            for line in named {
                let width = if line.value_deg == 0.0 { 1.8 } else { 1.0 };
                named_line(
                    painter,
                    placement,
                    line,
                    Stroke::new(width, theme::GRID.gamma_multiply(0.85)),
                    at,
                    &mut taken,
                );
            }
        }
    }
    let camera = placement.camera.filter(|_| viewer.settings.shows(Layer::Vertical))?;
    let axis = viewer.answer().and_then(|a| a.solution()).map(|s| s.axis.xyz());
    let level = vertical(frame_view.data.as_ref(), outcome.config.body.figure_km(), axis, camera)?;
    draw_vertical(painter, placement, &level, &mut taken);
    let source = if level.is_measured { "measured axis" } else { "given attitude" };
    let roll = level.roll_deg.map_or(String::new(), |deg| format!(", roll {deg:+.2}°"));
    Some(format!("elevation {:+.2}°{roll} ({source})", level.elevation_deg))
}

fn draw_vertical(painter: &Painter, placement: &Placement<'_>, level: &Vertical, taken: &mut Vec<Rect>) {
    lines(painter, placement, &level.plane, Stroke::new(1.2, theme::VERTICAL.gamma_multiply(0.8)));
    for rung in &level.rungs {
        let width = if rung.value_deg == 0.0 { 2.2 } else { 1.0 };
        named_line(painter, placement, rung, Stroke::new(width, theme::VERTICAL), 0.5, taken);
    }
    if let Some(at) = level.nadir.and_then(|p| placement.to_screen(p)) {
        cross(painter, at, 11.0, Stroke::new(2.0, theme::VERTICAL));
        name(painter, at + vec2(14.0, 10.0), "nadir", theme::VERTICAL, taken);
    }
}

/// Draws a line with its name at a part of its longest piece.
fn named_line(
    painter: &Painter,
    placement: &Placement<'_>,
    line: &NamedLine,
    stroke: Stroke,
    part: f32,
    taken: &mut Vec<Rect>,
) {
    lines(painter, placement, &line.parts, Stroke::new(stroke.width + 2.0, Color32::from_black_alpha(60)));
    lines(painter, placement, &line.parts, stroke);
    let inside = painter.clip_rect().shrink(24.0);
    let on_screen = |piece: &Vec<[f64; 2]>| -> Vec<Pos2> {
        piece.iter().filter_map(|p| placement.to_screen(*p)).filter(|p| inside.contains(*p)).collect()
    };
    let longest = line.parts.iter().map(on_screen).max_by_key(Vec::len).unwrap_or_default();
    let length: f32 = longest.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    if length > LABELLED
        && let Some(at) = longest.get((longest.len() as f32 * part) as usize)
    {
        name(painter, *at, &line.name, stroke.color.to_opaque(), taken);
    }
}

/// Writes a name, unless it would cover another one.
fn name(painter: &Painter, at: Pos2, text: &str, colour: Color32, taken: &mut Vec<Rect>) {
    let galley = painter.layout_no_wrap(text.to_owned(), FontId::proportional(11.5), colour);
    let rect = Align2::CENTER_CENTER.anchor_size(at, galley.size() + vec2(6.0, 2.0));
    if taken.iter().any(|other| other.intersects(rect)) {
        return;
    }
    painter.rect_filled(rect, 3, Color32::from_black_alpha(150));
    painter.galley(rect.min + vec2(3.0, 1.0), galley, colour);
    taken.push(rect);
}
