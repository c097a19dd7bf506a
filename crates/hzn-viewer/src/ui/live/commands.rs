//! The box for telecommands, and the messages of the flight computer.

use egui::{Key, RichText, Ui};
use hzn_mcap::LogLevel;

use crate::model::Live;
use crate::model::live::SentState;
use crate::ui::live_view::Typed;
use crate::ui::theme;
use crate::work::Line;

/// Part of the column that the telecommands take; the messages have the rest.
const PART: f32 = 0.5;

pub(super) fn show(typed: &mut Typed, line: &Line, ui: &mut Ui) {
    let dark = ui.visuals().dark_mode;
    let label = ui.strong("Telecommand");
    ui.horizontal(|ui| {
        let width = ui.available_width() - 60.0;
        let edit = egui::TextEdit::singleline(&mut typed.text).desired_width(width).hint_text("ping");
        let edit = ui.add(edit).labelled_by(label.id);
        if edit.changed() {
            // A file that `load` names is read, so this is not done in every frame of the window.
            typed.preview = (!typed.text.trim().is_empty()).then(|| line.preview(&typed.text));
        }
        let is_entered = edit.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
        let is_valid = matches!(typed.preview, Some(Ok(_)));
        let button = ui.add_enabled(is_valid, egui::Button::new("Send"));
        if (button.clicked() || is_entered) && is_valid {
            line.send(&std::mem::take(&mut typed.text));
            typed.preview = None;
            edit.request_focus();
        }
    });
    let below = match &typed.preview {
        Some(Ok(packets)) => RichText::new(packets).monospace(),
        Some(Err(why)) => RichText::new(why).color(theme::warning(dark)),
        None => RichText::new("the words of hzn telecommand; the packet is shown before it is sent").weak(),
    };
    small(ui, below);
    let live = line.live();
    ui.add_space(6.0);
    let height = (ui.available_height() * PART).max(60.0);
    egui::ScrollArea::vertical().id_salt("sent").max_height(height).min_scrolled_height(height).show(ui, |ui| {
        ui.set_min_size(egui::vec2(ui.available_width(), height - 8.0));
        sent(ui, &live);
    });
    ui.separator();
    ui.strong("Messages");
    let area = egui::ScrollArea::vertical().id_salt("messages").auto_shrink([false, false]).stick_to_bottom(true);
    area.show(ui, |ui| {
        let bad = ui.visuals().error_fg_color;
        for (level, text) in &live.messages {
            let text = RichText::new(text);
            let text = match level {
                LogLevel::Info => text,
                LogLevel::Warning => text.color(theme::warning(dark)),
                LogLevel::Error => text.color(bad),
            };
            small(ui, text);
        }
        if live.messages.is_empty() {
            ui.weak("none yet");
        }
    });
}

/// Draws the telecommands, the newest first.
fn sent(ui: &mut Ui, live: &Live) {
    let (dark, bad) = (ui.visuals().dark_mode, ui.visuals().error_fg_color);
    for sent in live.sent.iter().rev() {
        let (text, colour) = match &sent.state {
            SentState::Waits => (format!("{}: waits for the acknowledgement", sent.text), theme::warning(dark)),
            SentState::Done(what) => (what.clone(), theme::diff(true, dark)),
            SentState::Failed(why) => (why.clone(), bad),
        };
        small(ui, RichText::new(text).color(colour));
    }
}

fn small(ui: &mut Ui, text: RichText) {
    ui.add(egui::Label::new(text.size(12.0)).wrap());
}
