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
/// An answer that misses the truth by more than its 3-sigma, or whose residuals are too large.
pub(super) const MISSED: Color32 = Color32::from_rgb(230, 159, 0);
/// Residuals of a lens calibration.
pub(super) const LENS: Color32 = Color32::from_rgb(86, 180, 233);
/// The expected limb.
pub(super) const EXPECTED: Color32 = Color32::from_rgb(235, 238, 245);
/// Sun and Moon.
pub(super) const SKY: Color32 = Color32::from_rgb(255, 236, 170);
/// Latitudes and longitudes.
pub(super) const GRID: Color32 = Color32::from_rgb(150, 222, 190);
/// Coastlines.
pub(super) const COAST: Color32 = Color32::from_rgb(235, 225, 180);
/// The local vertical.
pub(super) const VERTICAL: Color32 = Color32::from_rgb(255, 150, 130);
/// Masked parts.
pub(super) const MASK: Color32 = Color32::from_rgb(120, 120, 132);
/// The image circle.
pub(super) const CIRCLE: Color32 = Color32::from_rgb(140, 170, 200);
/// Pixels that were read.
pub(super) const TOUCHED: Color32 = Color32::from_rgb(204, 121, 167);

/// Returns the colour of a candidate edge, by its number: that of overlays.
pub(super) fn edge(candidate: u32) -> Color32 {
    let [r, g, b] = hzn_run::overlay::edge_colour(candidate as usize);
    Color32::from_rgb(r, g, b)
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

/// Returns black or white, whichever has more contrast to a colour. One of them always has at least 4.5 to 1.
pub(super) fn text_on(colour: Color32) -> Color32 {
    if contrast(colour, Color32::BLACK) > contrast(colour, Color32::WHITE) { Color32::BLACK } else { Color32::WHITE }
}

/// Returns the contrast of two opaque colours, 1 to 21 (WCAG 2.2: relative luminance, contrast ratio).
pub(super) fn contrast(a: Color32, b: Color32) -> f64 {
    let luminance = |c: Color32| {
        let [r, g, b] = [c.r(), c.g(), c.b()].map(|v| {
            let v = f64::from(v) / 255.0;
            if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
        });
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    let [x, y] = [luminance(a), luminance(b)];
    (x.max(y) + 0.05) / (x.min(y) + 0.05)
}

/// Returns the colour of a warning.
pub(super) fn warning(dark: bool) -> Color32 {
    if dark { Color32::from_rgb(255, 190, 92) } else { Color32::from_rgb(138, 74, 0) }
}

/// Returns the colour of an added or a removed line of text.
pub(super) fn diff(added: bool, dark: bool) -> Color32 {
    match (added, dark) {
        (true, true) => Color32::from_rgb(78, 201, 160),
        (true, false) => Color32::from_rgb(0, 104, 74),
        (false, true) => Color32::from_rgb(255, 148, 112),
        (false, false) => Color32::from_rgb(164, 44, 0),
    }
}

/// Returns the colours of a theme.
fn visuals(dark: bool) -> Visuals {
    let mut visuals = if dark { Visuals::dark() } else { Visuals::light() };
    let grey = Color32::from_gray;
    let rgb = Color32::from_rgb;
    if dark {
        visuals.panel_fill = rgb(24, 26, 31);
        visuals.window_fill = rgb(32, 35, 42);
        visuals.extreme_bg_color = rgb(15, 16, 20);
        visuals.faint_bg_color = rgb(33, 36, 43);
        visuals.weak_text_color = Some(rgb(164, 170, 180));
        visuals.error_fg_color = rgb(255, 128, 116);
        visuals.hyperlink_color = rgb(120, 190, 255);
        visuals.widgets.noninteractive.bg_stroke = Stroke::new(1.0, rgb(48, 52, 61));
        visuals.widgets.noninteractive.fg_stroke = Stroke::new(1.0, rgb(205, 209, 216));
        visuals.widgets.inactive.fg_stroke = Stroke::new(1.0, rgb(214, 218, 224));
        visuals.widgets.inactive.bg_stroke = Stroke::new(1.0, rgb(142, 148, 158));
        visuals.selection.bg_fill = rgb(0, 92, 140);
        visuals.selection.stroke = Stroke::new(1.0, grey(255));
    } else {
        visuals.panel_fill = rgb(245, 246, 248);
        visuals.window_fill = rgb(252, 252, 253);
        visuals.faint_bg_color = rgb(234, 236, 240);
        visuals.weak_text_color = Some(rgb(84, 90, 100));
        visuals.error_fg_color = rgb(170, 20, 20);
        visuals.hyperlink_color = rgb(0, 84, 160);
        visuals.widgets.noninteractive.bg_stroke = Stroke::new(1.0, rgb(196, 200, 207));
        visuals.widgets.noninteractive.fg_stroke = Stroke::new(1.0, rgb(40, 43, 49));
        visuals.widgets.inactive.fg_stroke = Stroke::new(1.0, rgb(34, 37, 43));
        visuals.widgets.inactive.bg_stroke = Stroke::new(1.0, rgb(98, 104, 114));
        visuals.selection.bg_fill = rgb(165, 210, 238);
        visuals.selection.stroke = Stroke::new(1.0, rgb(0, 40, 66));
    }
    visuals.warn_fg_color = warning(dark);
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
    visuals
}

/// Keeps the words of a column off the bar that scrolls it: the bar gets a width of its own.
pub(super) fn keep_scroll_bar_free(ui: &mut egui::Ui) {
    ui.spacing_mut().scroll.floating_allocated_width = 7.0;
}

/// Sets up the dark and the light theme; it is called once.
pub(super) fn apply(ctx: &egui::Context) {
    for (theme, dark) in [(Theme::Dark, true), (Theme::Light, false)] {
        ctx.set_visuals_of(theme, visuals(dark));
    }
    ctx.all_styles_mut(|style| {
        style.spacing.item_spacing = egui::vec2(7.0, 5.0);
        style.spacing.button_padding = egui::vec2(8.0, 3.0);
        style.interaction.tooltip_delay = 0.4;
        // What scrolls shows it, also without the pointer over it.
        style.spacing.scroll.dormant_handle_opacity = 0.5;
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Smallest contrast of text (WCAG 2.2, level AA); it holds here for the outlines of controls, too.
    const READABLE: f64 = 4.5;

    #[test]
    fn every_text_and_control_can_be_seen_in_both_themes() {
        let mut poor = Vec::new();
        for dark in [true, false] {
            let v = visuals(dark);
            let grounds = [("panel", v.panel_fill), ("window", v.window_fill), ("card", v.faint_bg_color)];
            let inks = [
                ("text", v.widgets.noninteractive.fg_stroke.color),
                ("weak text", v.weak_text_color()),
                ("error", v.error_fg_color),
                ("warning", warning(dark)),
                ("link", v.hyperlink_color),
                ("added", diff(true, dark)),
                ("removed", diff(false, dark)),
                ("button text", v.widgets.inactive.fg_stroke.color),
                ("outline of a control", v.widgets.inactive.bg_stroke.color),
            ];
            let mut check = |what: String, a: Color32, b: Color32| {
                if contrast(a, b) < READABLE {
                    poor.push(format!("dark {dark}: {what}: {:.2}", contrast(a, b)));
                }
            };
            for (ground, back) in grounds {
                inks.iter().for_each(|(ink, front)| check(format!("{ink} on {ground}"), *front, back));
            }
            check("selected".into(), v.selection.stroke.color, v.selection.bg_fill);
            check("button".into(), v.widgets.inactive.fg_stroke.color, v.widgets.inactive.weak_bg_fill);
            check("hovered".into(), v.widgets.hovered.fg_stroke.color, v.widgets.hovered.weak_bg_fill);
        }
        for s in Status::ALL.iter().copied() {
            if contrast(text_on(status(s)), status(s)) < READABLE {
                poor.push(format!("badge {s}"));
            }
        }
        assert!(poor.is_empty(), "{poor:#?}");
        assert!((contrast(Color32::BLACK, Color32::WHITE) - 21.0).abs() < 1e-9);
    }

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
