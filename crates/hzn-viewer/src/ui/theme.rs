//! Colours and sizes. The data colours are those of Okabe and Ito, which colour-blind people can tell apart.

use egui::{Color32, CornerRadius, Stroke, Theme, Visuals};
use hzn_core::status::Status;

/// The fitted limb.
pub(super) const LIMB: Color32 = Color32::from_rgb(240, 228, 66);
/// Edge points that the answer is computed from.
pub(super) const INLIER: Color32 = Color32::from_rgb(0, 178, 130);
/// Edge points that do not belong to the limb.
pub(super) const REJECTED: Color32 = Color32::from_rgb(213, 94, 0);
/// The axis.
pub(super) const AXIS: Color32 = Color32::from_rgb(230, 140, 190);
/// The truth.
pub(super) const TRUTH: Color32 = Color32::from_rgb(230, 159, 0);
/// Sun and Moon.
pub(super) const SKY: Color32 = Color32::from_rgb(255, 236, 170);
/// Masked parts.
pub(super) const MASK: Color32 = Color32::from_rgb(120, 120, 132);
/// The image circle.
pub(super) const CIRCLE: Color32 = Color32::from_rgb(140, 170, 200);
/// Pixels that were read.
pub(super) const TOUCHED: Color32 = Color32::from_rgb(204, 121, 167);

/// Candidate edges, in turn.
const EDGES: [Color32; 6] = [
    Color32::from_rgb(86, 180, 233),
    Color32::from_rgb(204, 121, 167),
    Color32::from_rgb(230, 159, 0),
    Color32::from_rgb(0, 158, 115),
    Color32::from_rgb(150, 130, 220),
    Color32::from_rgb(213, 94, 0),
];

/// Returns the colour of a candidate edge, by its number.
pub(super) fn edge(candidate: u32) -> Color32 {
    EDGES.get(candidate as usize % EDGES.len()).copied().unwrap_or(Color32::WHITE)
}

/// Returns the colour of the line number `n` of a plot.
pub(super) fn line(n: usize, dark: bool) -> Color32 {
    let [a, b, c] = if dark {
        [Color32::from_rgb(86, 180, 233), Color32::from_rgb(230, 159, 0), Color32::from_rgb(0, 178, 130)]
    } else {
        [Color32::from_rgb(0, 114, 178), Color32::from_rgb(213, 94, 0), Color32::from_rgb(0, 138, 100)]
    };
    [a, b, c].get(n % 3).copied().unwrap_or(a)
}

/// Returns the colour of a status.
pub(super) fn status(status: Status) -> Color32 {
    match status {
        Status::Ok => Color32::from_rgb(0, 158, 115),
        Status::NoLimb => Color32::from_rgb(128, 132, 140),
        Status::TooDark => Color32::from_rgb(0, 92, 156),
        Status::TooBright => Color32::from_rgb(240, 228, 66),
        Status::TooFewPoints => Color32::from_rgb(86, 180, 233),
        Status::Ambiguous => Color32::from_rgb(230, 159, 0),
        Status::Rejected => Color32::from_rgb(213, 94, 0),
        Status::Truncated => Color32::from_rgb(150, 130, 220),
        Status::Unreadable => Color32::from_rgb(204, 60, 120),
        Status::NoAltitude => Color32::from_rgb(140, 86, 75),
    }
}

/// Returns black or white, whichever can be read better on a colour.
pub(super) fn text_on(colour: Color32) -> Color32 {
    let [r, g, b, _] = colour.to_array().map(f32::from);
    if 0.299 * r + 0.587 * g + 0.114 * b > 140.0 { Color32::BLACK } else { Color32::WHITE }
}

/// Sets up the dark and the light theme; it is called once.
pub(super) fn apply(ctx: &egui::Context) {
    let mut dark = Visuals::dark();
    dark.panel_fill = Color32::from_rgb(24, 26, 31);
    dark.window_fill = Color32::from_rgb(32, 35, 42);
    dark.extreme_bg_color = Color32::from_rgb(15, 16, 20);
    dark.faint_bg_color = Color32::from_rgb(33, 36, 43);
    dark.override_text_color = None;
    dark.widgets.noninteractive.bg_stroke = Stroke::new(1.0, Color32::from_rgb(48, 52, 61));
    dark.widgets.noninteractive.fg_stroke = Stroke::new(1.0, Color32::from_rgb(205, 209, 216));
    dark.widgets.inactive.fg_stroke = Stroke::new(1.0, Color32::from_rgb(214, 218, 224));
    dark.selection.bg_fill = Color32::from_rgb(0, 92, 140);
    let mut light = Visuals::light();
    light.panel_fill = Color32::from_rgb(245, 246, 248);
    light.faint_bg_color = Color32::from_rgb(234, 236, 240);
    light.selection.bg_fill = Color32::from_rgb(165, 210, 238);
    for (theme, mut visuals) in [(Theme::Dark, dark), (Theme::Light, light)] {
        visuals.window_corner_radius = CornerRadius::same(8);
        visuals.menu_corner_radius = CornerRadius::same(6);
        for widget in [
            &mut visuals.widgets.inactive,
            &mut visuals.widgets.hovered,
            &mut visuals.widgets.active,
            &mut visuals.widgets.open,
            &mut visuals.widgets.noninteractive,
        ] {
            widget.corner_radius = CornerRadius::same(5);
        }
        visuals.slider_trailing_fill = true;
        ctx.set_visuals_of(theme, visuals);
    }
    ctx.all_styles_mut(|style| {
        style.spacing.item_spacing = egui::vec2(7.0, 5.0);
        style.spacing.button_padding = egui::vec2(8.0, 3.0);
        style.interaction.tooltip_delay = 0.4;
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_statuses_look_alike() {
        let far = |a: Color32, b: Color32| {
            a.to_array().iter().zip(b.to_array()).map(|(a, b)| i32::from(a.abs_diff(b))).sum::<i32>() > 60
        };
        for (i, a) in Status::ALL.iter().enumerate() {
            for b in &Status::ALL[..i] {
                assert!(far(status(*a), status(*b)), "{a} {b}");
            }
        }
    }
}
