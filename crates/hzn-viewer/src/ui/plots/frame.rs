//! The parts that all plots share.

use egui::{Color32, FontId, Rangef, Response, RichText, Ui, vec2};
use egui_plot::{AxisHints, Plot};

use super::axis::{tick_label, ticks};

/// Width of the labels of the y axis, so that the plots in rows lie exactly below each other.
pub(super) const LABELS_WIDTH: f32 = 52.0;

/// Size of the labels of the y axis.
const LABEL_SIZE: f32 = 11.0;
/// Height of such a label. The plot leaves out labels whose lines are closer than this.
const LABEL_HEIGHT: f32 = 15.0;

/// Width of the bar that scrolls the plots, and of an ellipsis.
const SCROLL_BAR: f32 = 10.0;
const ELLIPSIS: f32 = 18.0;
/// Colour of text that is only measured.
const INK: Color32 = Color32::WHITE;

/// Draws title, legend and values of a plot above it, because a legend inside would cover the lines. What has no room
/// in the row is in a tooltip.
pub(super) fn heading(ui: &mut Ui, title: &str, lines: &[(&str, Color32)], values: &str) {
    ui.horizontal(|ui| {
        ui.add(egui::Label::new(RichText::new(title).size(12.5)).truncate());
        let width = |text: &str, font: FontId| ui.painter().layout_no_wrap(text.to_owned(), font, INK).size().x;
        let values_width = if values.is_empty() { 0.0 } else { width(values, FontId::monospace(12.0)) + SCROLL_BAR };
        // The colours of the lines say more than the last of many values.
        let values_width = values_width.min(0.5 * ui.available_width());
        let gap = ui.spacing().item_spacing.x;
        let widths: Vec<f32> =
            lines.iter().map(|(name, _)| 10.0 + 2.0 * gap + width(name, FontId::proportional(12.0))).collect();
        let mut room = ui.available_width() - values_width - 2.0 * gap;
        if widths.iter().sum::<f32>() > room {
            room -= ELLIPSIS;
        }
        for (n, ((name, colour), width)) in lines.iter().zip(widths).enumerate() {
            room -= width;
            if room < 0.0 {
                let hidden: Vec<&str> = lines.iter().skip(n).map(|(name, _)| *name).collect();
                ui.weak(RichText::new("…").size(12.0)).on_hover_text(hidden.join("\n"));
                break;
            }
            let (rect, _) = ui.allocate_exact_size(vec2(10.0, 10.0), egui::Sense::hover());
            ui.painter().rect_filled(rect.shrink(1.0), 2, *colour);
            ui.weak(RichText::new(*name).size(12.0));
        }
        if !values.is_empty() {
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                // The bar that scrolls the plots lies here.
                ui.add_space(SCROLL_BAR);
                ui.add(egui::Label::new(RichText::new(values).monospace().size(12.0)).truncate());
            });
        }
    });
}

/// Names the plot for screen readers.
pub(in crate::ui) fn set_label(response: &Response, name: &str) {
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, format!("Plot {name}")));
}

/// Returns a plot with the properties that all plots share.
pub(in crate::ui) fn shared_plot<'a>(id: impl egui::AsIdSalt, height: f32) -> Plot<'a> {
    Plot::new(id)
        .height(height)
        .allow_scroll(false)
        // There are few grid lines, and all of them are faint, so that the curve stands out.
        .grid_spacing(Rangef::new(8.0, 1500.0))
        .x_grid_spacer(|input| ticks(input, 8.0, 16.0))
        .y_grid_spacer(move |input| {
            ticks(input, if height < 90.0 { 3.0 } else { 4.0 }, f64::from(height / LABEL_HEIGHT))
        })
        .custom_y_axes(vec![value_axis(false)])
}

/// Returns the axis of the values. On a logarithmic one the plot has the logarithms to the base of 10, and the labels
/// have the values.
pub(super) fn value_axis(is_log: bool) -> AxisHints<'static> {
    AxisHints::new_y()
        .formatter(move |mark, _| {
            if !is_log {
                return tick_label(mark.value, mark.step_size);
            }
            let value = 10f64.powf(mark.value);
            tick_label(value, 0.5 * value * mark.step_size)
        })
        .min_thickness(LABELS_WIDTH)
        .tick_label_font(FontId::proportional(LABEL_SIZE))
        // A low plot has labels, too.
        .label_spacing(Rangef::new(7.0, 10.0))
}
