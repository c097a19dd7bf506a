//! Plots over time in rows, and the residuals along the limb of the shown picture.

mod axis;
mod frame;
mod navigation;
mod offered;
mod over_time;
mod residuals;
mod sheet;
mod sigma_parts;

use egui::{RichText, ScrollArea, Ui};

use super::viewer::Viewer;
use crate::model::navigation::{INNOVATIONS, NAV_QUANTITIES};
use crate::model::quantity::QUANTITIES;
pub(super) use frame::{set_label, shared_plot};
pub(super) use over_time::{MARGIN, TimeAxis};
pub(super) use residuals::RESIDUALS;
pub(super) use sheet::sheet;
use sigma_parts::SIGMA_PARTS;

/// Height of the row of names above the plots, with the space around it.
const CHOICE: f32 = 44.0;
/// Height of the row of labels below the plots.
const RULER: f32 = 24.0;
/// Lowest height of a plot without its heading; more plots scroll. Three labels of 15 points lie below each other.
const LEAST_PLOT: f32 = 46.0;
/// Height of a heading.
const HEADING: f32 = 24.0;
/// Largest part of the window's height that the panel takes by itself, and that the user can give it by a drag of its
/// border. The picture is what the window is for.
const BY_ITSELF: f32 = 0.25;
const BY_HAND: f32 = 0.5;
/// Lowest height of the panel, in points. It counts where a part of a low window has no room for the choice and the
/// time axis.
const LEAST_PANEL: f32 = 120.0;
/// Distance from the upper border of the panel in points within which the border is dragged.
const GRIP: f32 = 6.0;

/// What the numbers at the time axis are, if the first picture has another time than zero.
const SINCE: &str = "time since the first picture";
/// Room that these words take.
const LEAST_WORDS: f32 = 180.0;

/// Returns true if the time axis has other numbers than the player.
fn is_relative(viewer: &Viewer) -> bool {
    viewer.sequence.entries.iter().find_map(|e| e.time_s).is_some_and(|start| start != 0.0)
}

pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let part = if viewer.panels.plots_dragged { BY_HAND } else { BY_ITSELF };
    let most = (ui.ctx().content_rect().height() * part).max(LEAST_PANEL);
    let height = viewer.settings.plots_height.min(most);
    let panel = egui::Panel::bottom(("plots", viewer.panels.grown)).resizable(true);
    let panel = panel.default_size(height).size_range(110.0..=most);
    let shown = panel.show(ui, |ui| {
        // The contents fill the whole panel. Otherwise the panel would shrink a little with every frame of the window.
        ui.expand_to_include_rect(ui.max_rect());
        ui.add_space(4.0);
        // A single picture has no plot over time.
        let single = viewer.sequence.complete && viewer.sequence.len() == 1;
        let chosen = if single {
            vec![RESIDUALS.to_owned()]
        } else {
            let offered = offered::names(viewer);
            quantity_choice(viewer, ui, &offered);
            // A plot that this sequence does not have stays chosen for others.
            viewer.settings.plotted.iter().filter(|name| offered.contains(&name.as_str())).cloned().collect()
        };
        let new = viewer.new_plot.clone();
        rows(viewer, ui, &chosen);
        new.map(|name| (name, chosen.len()))
    });
    let panel = shown.response.rect;
    let pressed = ui.input(|i| i.pointer.press_origin().filter(|_| i.pointer.primary_pressed()));
    let grip = egui::Rect::from_x_y_ranges(panel.x_range(), panel.top() - GRIP..=panel.top() + GRIP);
    viewer.panels.plots_dragged |= pressed.is_some_and(|at| grip.contains(at));
    viewer.settings.plots_height = panel.height();
    if let Some((name, count)) = shown.inner {
        // A panel of another name takes the size that it is given; this one would keep its own.
        let needed = (CHOICE + count as f32 * (LEAST_PLOT + HEADING + 6.0) + RULER + 6.0).min(most);
        if needed > viewer.settings.plots_height {
            viewer.settings.plots_height = needed;
            viewer.panels.grown += 1;
            // The higher panel begins at its top.
            viewer.new_plot = Some(name);
        }
    }
}

/// Draws the plots below each other. They share their time axis, whose labels are in the last row.
fn rows(viewer: &mut Viewer, ui: &mut Ui, chosen: &[String]) {
    if chosen.is_empty() {
        ui.weak("Choose the plots above.");
        return;
    }
    let over_time = chosen.iter().any(|name| name != RESIDUALS);
    let ruler = if over_time { RULER + 6.0 } else { 0.0 };
    let room = (ui.available_height() - ruler).max(40.0);
    let each = (room / chosen.len() as f32 - HEADING - 6.0).max(LEAST_PLOT);
    let axis = TimeAxis::new(viewer);
    viewer.panels.cursor.notice(ui);
    let (mut pointed, mut look) = (None, None);
    ScrollArea::vertical().max_height(room).auto_shrink([false, false]).show(ui, |ui| {
        for name in chosen {
            let top = ui.cursor().top();
            if name == RESIDUALS {
                look = residuals::show(viewer, ui, each).or(look);
            } else if let Some(quantity) = QUANTITIES.iter().find(|q| q.name == name) {
                pointed = over_time::show(viewer, ui, quantity, &axis, each).or(pointed);
            } else if let Some(quantity) = NAV_QUANTITIES.iter().find(|q| q.name == name) {
                pointed = navigation::show(viewer, ui, quantity, &axis, each).or(pointed);
            } else if name == SIGMA_PARTS {
                pointed = sigma_parts::show(viewer, ui, &axis, each).or(pointed);
            } else if name == INNOVATIONS {
                pointed = navigation::innovations(viewer, ui, &axis, each).or(pointed);
            }
            if viewer.new_plot.take_if(|new| new == name).is_some() {
                let plot = egui::Rect::from_x_y_ranges(ui.max_rect().x_range(), top..=ui.cursor().top());
                ui.scroll_to_rect(plot, None);
            }
        }
    });
    // The other plots show the values of this picture with the next frame of the window.
    viewer.hovered_frame = pointed.map(|(frame, _)| frame);
    viewer.plot_span = over_time.then(|| {
        let hint = is_relative(viewer).then_some(SINCE);
        let (span, cursor_x) = over_time::ruler(ui, &axis, viewer.playback.frame(), RULER, hint);
        viewer.panels.cursor.x = cursor_x;
        span
    });
    if let Some((frame, true)) = pointed {
        viewer.playback.go(frame, viewer.sequence.len());
    }
    if let Some(point) = look {
        viewer.look_at(point);
    }
}

fn quantity_choice(viewer: &mut Viewer, ui: &mut Ui, offered: &[&str]) {
    ui.horizontal_wrapped(|ui| {
        for name in offered.iter().copied() {
            let on = viewer.settings.plotted.iter().any(|p| p == name);
            if ui.selectable_label(on, RichText::new(name).size(12.5)).clicked() {
                if on {
                    viewer.settings.plotted.retain(|p| p != name);
                } else {
                    viewer.settings.plotted.push(name.to_owned());
                    viewer.new_plot = Some(name.to_owned());
                }
            }
        }
        let hint = "Logarithmic scale, of quantities whose values are all above zero";
        ui.separator();
        ui.toggle_value(&mut viewer.settings.log_plots, RichText::new("log").size(12.5)).on_hover_text(hint);
        // Where there is no room, the words are in the tooltip of the axis: a row of its own would hide a plot.
        if is_relative(viewer) && ui.available_size_before_wrap().x >= LEAST_WORDS {
            ui.weak(RichText::new(format!("· {SINCE}")).size(12.0));
        }
    });
}
