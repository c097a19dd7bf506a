//! The palette: finds a command or a key of sensor.toml by a part of its name.

use egui::{Align, Key, Layout, Modifiers, RichText, Ui, vec2};

use super::links;
use super::palette_state::{Entry, Palette};
use super::viewer::Viewer;

/// Largest number of entries that are drawn.
const MOST: usize = 60;

/// Draws the palette while it is open, and does what the user chooses.
pub(super) fn show(viewer: &mut Viewer, ctx: &egui::Context) {
    let Some(mut palette) = viewer.palette.take() else { return };
    // The field would take these keys.
    let pressed = |key| ctx.input_mut(|i| i.consume_key(Modifiers::NONE, key));
    let (up, down, enter) = (pressed(Key::ArrowUp), pressed(Key::ArrowDown), pressed(Key::Enter));
    let has_sensor = viewer.session.is_some() && viewer.live.is_none();
    let mut chosen = None;
    let response = egui::Modal::new(egui::Id::unique("palette")).show(ctx, |ui| {
        let room = ctx.content_rect().size() - vec2(60.0, 160.0);
        ui.set_width(room.x.min(520.0));
        let hint = if has_sensor { "Command or key of sensor.toml" } else { "Command" };
        let field = ui.add(egui::TextEdit::singleline(&mut palette.text).hint_text(hint).desired_width(f32::INFINITY));
        field.widget_info(|| egui::WidgetInfo::labeled(egui::Role::TextInput, true, "Find a command"));
        if !std::mem::replace(&mut palette.is_focused, true) {
            field.request_focus();
        }
        if field.changed() {
            palette.marked = 0;
        }
        let found = palette.found(has_sensor);
        let shown = found.len().min(MOST);
        palette.marked = match (up, down) {
            (true, _) => palette.marked.saturating_sub(1),
            (_, true) => palette.marked + 1,
            _ => palette.marked,
        };
        palette.marked = palette.marked.min(shown.saturating_sub(1));
        chosen = found.get(palette.marked).copied().filter(|_| enter);
        ui.add_space(4.0);
        egui::ScrollArea::vertical().max_height(room.y.min(420.0)).show(ui, |ui| {
            ui.with_layout(Layout::top_down_justified(Align::LEFT), |ui| {
                for (n, entry) in found.iter().take(MOST).enumerate() {
                    let line = line(ui, *entry, n == palette.marked);
                    if n == palette.marked && (up || down) {
                        line.scroll_to_me(None);
                    }
                    if line.clicked() {
                        chosen = Some(*entry);
                    }
                }
            });
        });
        match found.len() {
            0 => ui.weak("Nothing has this name."),
            n if n > MOST => ui.weak(format!("and {} more", n - MOST)),
            _ => ui.weak("Up and down mark, Enter chooses, Esc closes."),
        };
    });
    match chosen {
        Some(Entry::Command(command)) => viewer.run(command, ctx),
        Some(Entry::Key(path)) => links::show_key(viewer, path),
        None if !response.should_close() => viewer.palette = Some(palette),
        None => {}
    }
}

/// Draws an entry with its key of the keyboard.
fn line(ui: &mut Ui, entry: Entry, is_marked: bool) -> egui::Response {
    let button = egui::Button::selectable(is_marked, RichText::new(entry.name())).truncate();
    ui.add(match entry {
        Entry::Command(command) => button.shortcut_text(command.key(ui.ctx())),
        Entry::Key(_) => button,
    })
}

impl Viewer {
    /// Opens or closes the palette.
    pub(in crate::ui) fn toggle_palette(&mut self) {
        self.palette = if self.palette.is_some() { None } else { Some(Palette::default()) };
    }
}
