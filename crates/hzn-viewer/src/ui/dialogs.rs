//! Draws the dialog for paths and the differences from the saved file.

use egui::{Key, RichText};
use hzn_run::overlay::caption;

use super::path_dialog::Purpose;
use super::viewer::Viewer;
use super::{placement, theme};

/// Draws the dialogs. The window with the changes opens at the top left of the picture.
pub(super) fn show(viewer: &mut Viewer, ctx: &egui::Context, picture: egui::Rect) {
    diff(viewer, ctx, picture);
    let size = size_of_saved_picture(viewer);
    let Some(path_dialog) = &mut viewer.path_dialog else { return };
    if path_dialog.replaces {
        return;
    }
    if path_dialog.is_hidden() {
        return ctx.request_repaint_after(std::time::Duration::from_millis(100));
    }
    let (mut accepted, mut closed) = (false, false);
    let response = egui::Modal::new(egui::Id::unique("path_dialog")).show(ctx, |ui| {
        ui.set_width(560.0_f32.min(ctx.content_rect().width() - 60.0));
        ui.heading(path_dialog.purpose.title());
        ui.weak(path_dialog.purpose.hint());
        size.iter().filter(|_| path_dialog.purpose == Purpose::Picture).for_each(|text| drop(ui.weak(text)));
        ui.add_space(6.0);
        let label = ui.label("Path");
        let field = ui
            .add(egui::TextEdit::singleline(&mut path_dialog.text).desired_width(f32::INFINITY))
            .labelled_by(label.id);
        if std::mem::take(&mut path_dialog.focus) {
            field.request_focus();
        }
        accepted |= field.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
        if field.changed() {
            path_dialog.refused = None;
        }
        match &path_dialog.refused {
            Some(why) => ui.colored_label(theme::warning(ui.visuals().dark_mode), why),
            None => ui.label(""),
        };
        ui.horizontal(|ui| {
            accepted |= ui.button(if path_dialog.purpose.writes() { "Write" } else { "Open this" }).clicked();
            closed |= ui.button("Cancel").clicked();
            ui.separator();
            let idle = path_dialog.browsing.is_none();
            if ui.add_enabled(idle, egui::Button::new("Browse…")).clicked() {
                path_dialog.browse(path_dialog.purpose == Purpose::Boards);
            }
            if path_dialog.purpose == Purpose::Open
                && ui.add_enabled(idle, egui::Button::new("Browse folders…")).clicked()
            {
                path_dialog.browse(true);
            }
        });
    });
    if path_dialog.browsing.is_some() {
        ctx.request_repaint_after(std::time::Duration::from_millis(50));
    }
    if accepted {
        viewer.accept_path();
    } else if closed || response.should_close() {
        viewer.cancel_path();
    }
}

/// Says how large the saved picture is, because its caption makes it higher than the picture itself.
fn size_of_saved_picture(viewer: &Viewer) -> Option<String> {
    let [w, h] = viewer.frame_view.as_ref()?.size()?.map(|x| x as u32);
    let whole = h + caption::height_px(w, h);
    Some(format!("The file has {w} × {whole} px; its upper {w} × {h} px are those of the picture."))
}

/// Returns true if the key Esc closes a window: no field is being edited, and no menu and no question is open.
pub(super) fn escape(ctx: &egui::Context) -> bool {
    let is_covered = egui::Popup::is_any_open(ctx) || ctx.memory(|m| m.top_modal_layer().is_some());
    !is_covered && !ctx.text_edit_focused() && ctx.input(|i| i.key_pressed(Key::Escape))
}

/// Draws changed lines below the headings of their sections; they scroll if they are higher than `height`.
pub(super) fn changed_lines(ui: &mut egui::Ui, sections: &[(String, Vec<String>)], height: f32) {
    if sections.is_empty() {
        ui.label("Nothing has changed.");
    }
    let dark = ui.visuals().dark_mode;
    egui::ScrollArea::vertical().max_height(height).show(ui, |ui| {
        for (section, lines) in sections {
            ui.strong(if section.is_empty() { "top of the file" } else { section });
            for line in lines {
                let colour = theme::diff(line.starts_with('+'), dark);
                ui.add(egui::Label::new(RichText::new(line).monospace().color(colour)).wrap());
            }
            ui.add_space(4.0);
        }
    });
}

/// Shows the differences from the saved file, below the headings of their sections.
fn diff(viewer: &mut Viewer, ctx: &egui::Context, picture: egui::Rect) {
    if !viewer.showing_diff {
        return;
    }
    let Some(session) = &viewer.session else { return };
    let sections = session.unsaved_lines();
    let is_completed = session.saved() != session.on_file();
    let mut open = true;
    let window = egui::Window::new("Unsaved changes").open(&mut open).default_pos(placement::beside(picture));
    window.default_width(520.0_f32.min(picture.width() - 40.0)).show(ctx, |ui| {
        changed_lines(ui, &sections, 400.0);
        if is_completed {
            ui.weak("The number of bits was found in the pictures. Saving writes it, too.");
        }
    });
    viewer.showing_diff = open && !escape(ctx);
}
