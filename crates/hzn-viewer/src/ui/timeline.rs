//! The time line: the status of every picture as a colour, the position in the sequence, and the player.

use std::time::Duration;

use egui::{Align2, Color32, FontId, Rangef, Rect, RichText, Sense, Shape, Stroke, Ui, pos2, vec2};
use hzn_core::status::Status;

use super::follow::OLD;
use super::panels::Panel;
use super::plots::{MARGIN, TimeAxis};
use super::viewer::Viewer;
use super::{Command, chips, theme};
use crate::model::playback::SPEEDS;

/// Time between two drawings of the age of the newest picture.
const AGE_EVERY: Duration = Duration::from_millis(200);
/// Width that is kept free for the progress of work on the whole sequence.
const WORK_WIDTH: f32 = 260.0;

pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    egui::Panel::bottom("timeline").resizable(false).show(ui, |ui| {
        ui.add_space(5.0);
        controls(viewer, ui);
        chips::show(viewer, ui);
        strip(viewer, ui);
        ui.add_space(5.0);
    });
}

fn controls(viewer: &mut Viewer, ui: &mut Ui) {
    let mut command = None;
    ui.horizontal(|ui| {
        let hint = |ui: &Ui, c: Command| format!("{} ({})", c.name(), c.key(ui.ctx()));
        let play = if viewer.playback.is_playing() { (Icon::Pause, "Pause") } else { (Icon::Play, "Play") };
        for (c, icon, name) in [
            (Command::First, Icon::First, "First picture"),
            (Command::Back, Icon::Back, "Previous picture"),
            (Command::Play, play.0, play.1),
            (Command::Next, Icon::Next, "Next picture"),
            (Command::Last, Icon::Last, "Last picture"),
        ] {
            if icon_button(ui, icon, name).on_hover_text(hint(ui, c)).clicked() {
                command = Some(c);
            }
        }
        ui.separator();
        let speed = viewer.playback.speed();
        // A narrow window has no room for words.
        let narrow = ui.available_width() < 560.0;
        let label = if narrow { ui.weak("") } else { ui.weak("speed") };
        egui::ComboBox::from_id_salt("speed")
            .selected_text(format!("{speed}×"))
            .width(58.0)
            .show_ui(ui, |ui| {
                for s in SPEEDS {
                    if ui.selectable_label(s == speed, format!("{s}×")).clicked() {
                        viewer.playback.set_speed(s);
                    }
                }
            })
            .response
            .labelled_by(label.id)
            .on_hover_text("1× is real time where the times of the pictures are known; else one picture per second");
        ui.separator();
        for (c, text) in [(Command::NextRefused, "Next refused"), (Command::Worst, "Worst")] {
            if ui.button(text).on_hover_text(hint(ui, c)).clicked() {
                command = Some(c);
            }
        }
        ui.separator();
        place(viewer, ui);
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| work(viewer, ui));
    });
    if let Some(command) = command {
        viewer.run(command, &ui.ctx().clone());
    }
}

/// Symbol on a button of the player.
#[derive(Clone, Copy)]
enum Icon {
    First,
    Back,
    Play,
    Pause,
    Next,
    Last,
}

/// Draws a button with a symbol. It is painted, because not all fonts have these symbols.
fn icon_button(ui: &mut Ui, icon: Icon, name: &str) -> egui::Response {
    let (rect, response) = ui.allocate_exact_size(vec2(28.0, 20.0), Sense::click());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, name));
    let visuals = ui.style().interact(&response);
    ui.painter().rect_filled(rect, visuals.corner_radius, visuals.weak_bg_fill);
    let (c, ink) = (rect.center(), visuals.fg_stroke.color);
    let triangle = |x: f32, direction: f32| {
        let tip = [
            pos2(c.x + x + 4.5 * direction, c.y),
            pos2(c.x + x - 3.5 * direction, c.y - 5.0),
            pos2(c.x + x - 3.5 * direction, c.y + 5.0),
        ];
        ui.painter().add(Shape::convex_polygon(tip.to_vec(), ink, Stroke::NONE));
    };
    let bar = |x: f32| {
        let bar = Rect::from_center_size(pos2(c.x + x, c.y), vec2(2.5, 10.0));
        ui.painter().rect_filled(bar, 0, ink);
    };
    match icon {
        Icon::First => [bar(-6.0), triangle(2.0, -1.0)],
        Icon::Back => [triangle(-3.0, -1.0), bar(4.0)],
        Icon::Play => [triangle(0.0, 1.0), ()],
        Icon::Pause => [bar(-3.0), bar(3.0)],
        Icon::Next => [bar(-4.0), triangle(3.0, 1.0)],
        Icon::Last => [triangle(-2.0, 1.0), bar(6.0)],
    };
    response
}

/// Shows number, time and name of the picture.
fn place(viewer: &mut Viewer, ui: &mut Ui) {
    let count = viewer.sequence.len();
    if count == 0 {
        return;
    }
    let frame = viewer.playback.frame();
    let more = if viewer.sequence.complete { "" } else { "…" };
    follow(viewer, ui);
    let before = viewer.follow.forgotten;
    ui.label(format!("{} of {}{more}", before + frame + 1, before + count));
    if let Some(entry) = viewer.sequence.entries.get(frame) {
        let time = viewer.sequence.time_text(frame).unwrap_or_else(|| "time unknown".to_owned());
        ui.label(RichText::new(time).monospace().size(12.0));
        // A long name leaves room for the progress on the right.
        let room = vec2((ui.available_width() - WORK_WIDTH).max(0.0), 18.0);
        let layout = egui::Layout::left_to_right(egui::Align::Center);
        ui.allocate_ui_with_layout(room, layout, |ui| {
            ui.add(egui::Label::new(RichText::new(&entry.name).weak()).truncate());
        });
    }
}

/// Shows whether the newest picture is followed, and its age.
fn follow(viewer: &mut Viewer, ui: &mut Ui) {
    if !viewer.follow.is_open {
        return;
    }
    let hint = format!("{} ({})", Command::Follow.name(), Command::Follow.key(ui.ctx()));
    if ui.selectable_label(viewer.follow.jumps, "Follow").on_hover_text(hint).clicked() {
        viewer.toggle_follow();
    }
    if let Some(age) = viewer.follow.age() {
        let (is_old, s) = (age >= OLD, age.as_secs_f64());
        let text = if s < 10.0 { format!("newest {s:.1} s ago") } else { format!("newest {s:.0} s ago") };
        let colour = if is_old { theme::warning(ui.visuals().dark_mode) } else { ui.visuals().weak_text_color() };
        ui.colored_label(colour, text).on_hover_text("Time since the newest picture was found");
        ui.ctx().request_repaint_after(AGE_EVERY);
    }
}

/// Shows the progress of work on the whole sequence.
fn work(viewer: &mut Viewer, ui: &mut Ui) {
    if let Some(sweep) = &viewer.sweep {
        if ui.add_enabled(!sweep.is_stopping(), egui::Button::new("Cancel")).clicked() {
            sweep.stop();
        }
        let part = sweep.done as f32 / sweep.total.max(1) as f32;
        let what = if sweep.writes { "writing" } else { "processing" };
        ui.add(
            egui::ProgressBar::new(part).desired_width(170.0).text(format!("{what} {} of {}", sweep.done, sweep.total)),
        );
    } else if let Some(running) = &viewer.work.running {
        let (done, total) = (running.done, running.total);
        if ui.small_button("Stop").on_hover_text("Stop processing until the next change").clicked() {
            viewer.stop_background();
        }
        ui.weak(format!("processing {done} of {total}"));
    } else if viewer.work.stopped && ui.button("Process all").clicked() {
        viewer.process_again();
    }
}

/// Returns the status that most needs attention among some pictures.
fn worst(statuses: impl Iterator<Item = Status>) -> Option<Status> {
    let weight = |s: &Status| match s {
        Status::Ok => 0,
        Status::NoLimb => 1,
        Status::TooDark | Status::TooBright | Status::TooFewPoints => 2,
        Status::Ambiguous | Status::Truncated => 3,
        Status::Rejected => 4,
        Status::Unreadable | Status::NoAltitude => 5,
    };
    statuses.max_by_key(weight)
}

/// Draws the status of every picture as a colour.
fn strip(viewer: &mut Viewer, ui: &mut Ui) {
    let (response, painter) = ui.allocate_painter(vec2(ui.available_width(), 24.0), Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, "Time line"));
    let rect = response.rect.shrink2(vec2(2.0, 0.0));
    let band = Rect::from_min_max(rect.min + vec2(0.0, 7.0), rect.max);
    painter.rect_filled(band, 3, ui.visuals().extreme_bg_color);
    let count = viewer.sequence.len();
    if count == 0 {
        return;
    }
    let places = Places::new(viewer, band);
    let columns = (band.width().floor() as usize).clamp(1, count);
    // A column of a crowded band is a pixel wide; otherwise it is a picture.
    let crowded = columns < count;
    let width = places.width / columns as f32;
    let part = |column: usize| column as f32 / columns as f32;
    let x = |column: usize| if crowded { places.left + column as f32 * width } else { places.x(column) };
    // A picture outside of the chosen group, and a result of earlier parameters, are faint.
    let strength = |i: usize| match (viewer.group, viewer.rows.cause(i, viewer.body)) {
        (Some(group), Some(cause)) if !cause.is_in(&group) => 1,
        _ if viewer.rows.current(i, viewer.body).is_none() => 2,
        _ => 3,
    };
    let status = |i: usize| viewer.rows.newest(i, viewer.body).map(|r| r.status);
    let shade = |(status, strength): (Status, u8)| {
        theme::status(status).gamma_multiply(match strength {
            1 => 0.15,
            2 => 0.45,
            _ => 1.0,
        })
    };
    let mut first: Option<(usize, (Status, u8))> = None;
    // Neighbours with the same colour are drawn as one rectangle.
    let flush = |first: &mut Option<(usize, (Status, u8))>, end: usize| {
        if let Some((from, look)) = first.take() {
            let gap = if width > 4.0 && end == from + 1 { 1.0 } else { 0.0 };
            let cell = Rect::from_min_max(pos2(x(from), band.top()), pos2(x(end) - gap, band.bottom()));
            painter.rect_filled(cell, 1, shade(look));
        }
    };
    for column in 0..columns {
        let (from, to) = if crowded { places.between(part(column), part(column + 1)) } else { (column, column + 1) };
        let strongest = (from..to).map(strength).max().unwrap_or(3);
        let here = worst((from..to).filter(|i| strength(*i) == strongest).filter_map(status)).map(|s| (s, strongest));
        if width > 4.0 || here != first.map(|(_, s)| s) {
            flush(&mut first, column);
            first = here.map(|s| (column, s));
        }
    }
    flush(&mut first, columns);
    for index in &viewer.damaged {
        places.mark(&painter, band, *index, theme::status(Status::Unreadable));
    }
    for index in viewer.missed.update(&viewer.rows, &viewer.truth, viewer.session.as_ref(), viewer.body) {
        places.mark(&painter, band, *index, theme::MISSED);
    }
    cursor(viewer, ui, &painter, &response, band, &places);
}

/// Where the pictures lie in the band: below the same pictures of the plots.
struct Places {
    left: f32,
    width: f32,
    /// Where each picture begins and the last one ends, from 0 to 1.
    borders: Vec<f64>,
}

impl Places {
    fn new(viewer: &Viewer, band: Rect) -> Self {
        let span = viewer.plot_span.filter(|_| viewer.panels.shows(Panel::Plots, &viewer.settings));
        let span = span.map_or(band.x_range(), |span| {
            let margin = MARGIN / (1.0 + 2.0 * MARGIN) * span.span();
            Rangef::new(span.min + margin, span.max - margin)
        });
        Self { left: span.min, width: span.span().max(1.0), borders: TimeAxis::new(viewer).borders() }
    }
    /// Returns where a picture begins.
    fn x(&self, index: usize) -> f32 {
        let border = self.borders.get(index).or(self.borders.last()).copied().unwrap_or(0.0);
        self.left + border as f32 * self.width
    }
    /// Returns the picture at a place.
    fn at(&self, x: f32) -> usize {
        let part = f64::from((x - self.left) / self.width);
        self.borders.partition_point(|border| *border <= part).saturating_sub(1)
    }
    /// Returns the pictures between two parts of the band, at least one.
    fn between(&self, from: f32, to: f32) -> (usize, usize) {
        let first = self.borders.partition_point(|border| *border <= f64::from(from)).saturating_sub(1);
        let end = self.borders.partition_point(|border| *border < f64::from(to));
        (first, end.min(self.borders.len() - 1).max(first + 1))
    }
    /// Marks a picture above the band.
    fn mark(&self, painter: &egui::Painter, band: Rect, index: usize, colour: Color32) {
        let right = self.x(index + 1).max(self.x(index) + 2.0);
        let mark = Rect::from_min_max(pos2(self.x(index), band.top() - 3.0), pos2(right, band.top()));
        painter.rect_filled(mark, 0, colour);
    }
}

/// Draws the position in the sequence, and moves it with the pointer.
fn cursor(
    viewer: &mut Viewer,
    ui: &Ui,
    painter: &egui::Painter,
    response: &egui::Response,
    band: Rect,
    places: &Places,
) {
    let (count, rect) = (viewer.sequence.len(), response.rect.shrink2(vec2(2.0, 0.0)));
    let shown = viewer.playback.frame();
    let x = (places.x(shown) + places.x(shown + 1)) / 2.0;
    let ink = if ui.visuals().dark_mode { Color32::WHITE } else { Color32::BLACK };
    painter.line_segment([pos2(x, band.top()), pos2(x, band.bottom())], Stroke::new(2.0, ink));
    let tip = [pos2(x - 5.0, rect.top()), pos2(x + 5.0, rect.top()), pos2(x, rect.top() + 7.0)];
    painter.add(Shape::convex_polygon(tip.to_vec(), ink, Stroke::NONE));
    let frame_at = |x: f32| places.at(x).min(count - 1);
    if let Some(at) = response.interact_pointer_pos() {
        viewer.playback.go(frame_at(at.x), count);
    }
    if let Some(at) = response.hover_pos() {
        let frame = frame_at(at.x);
        let text = format!("{} {}", frame + 1, chips::cause_text(viewer, frame));
        let align = if at.x > rect.center().x { Align2::RIGHT_CENTER } else { Align2::LEFT_CENTER };
        let by = if at.x > rect.center().x { -12.0 } else { 12.0 };
        let place = pos2(at.x + by, band.center().y);
        let galley = painter.layout_no_wrap(text, FontId::proportional(12.0), Color32::WHITE);
        let back = align.anchor_size(place, galley.size()).expand2(vec2(5.0, 1.0));
        painter.rect_filled(back, 3, Color32::from_black_alpha(190));
        painter.galley(back.min + vec2(5.0, 1.0), galley, Color32::WHITE);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_needs_a_look_is_seen_in_a_crowd() {
        assert_eq!(worst([Status::Ok, Status::Rejected, Status::NoLimb].into_iter()), Some(Status::Rejected));
        assert_eq!(worst([Status::Ok, Status::NoLimb].into_iter()), Some(Status::NoLimb));
        assert_eq!(worst(std::iter::empty()), None);
    }
}
