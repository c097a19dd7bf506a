//! The pictures of the heads side by side, each with the limb of its own answer.

use egui::{Align2, Color32, FontId, Rect, Sense, Shape, Stroke, Ui, UiBuilder, pos2, vec2};

use super::colours::{colour, use_colour};
use crate::ui::rig_view::{RigView, Shown, Use};
use crate::ui::theme;

/// Height in points of the line with the name of a head.
const TITLE: f32 = 20.0;

pub(super) fn show(view: &RigView, ui: &mut Ui) {
    let count = view.heads.len();
    if count == 0 {
        return;
    }
    let columns = if count == 1 { 1 } else { 2 };
    let rows = count.div_ceil(columns);
    let room = ui.available_rect_before_wrap();
    let size = vec2(room.width() / columns as f32, room.height() / rows as f32);
    for n in 0..count {
        let corner = room.min + vec2((n % columns) as f32 * size.x, (n / columns) as f32 * size.y);
        let cell = Rect::from_min_size(corner, size).shrink(3.0);
        ui.scope_builder(UiBuilder::new().max_rect(cell), |ui| head(view, n, ui, cell));
    }
    ui.allocate_rect(room, Sense::hover());
}

fn head(view: &RigView, n: usize, ui: &mut Ui, cell: Rect) {
    let dark = ui.visuals().dark_mode;
    let Some(head) = view.heads.get(n) else { return };
    let answer = view.epochs.get(view.epoch).and_then(|epoch| epoch.heads.get(n)?.as_ref());
    let used = view.used(view.epoch, n);
    ui.horizontal(|ui| {
        ui.colored_label(colour(n, dark), egui::RichText::new(&head.name).strong());
        ui.colored_label(use_colour(used, dark), used.name());
        match answer {
            Some(answer) => ui.weak(format!("{}, {}", answer.name, answer.status)),
            None => ui.weak("no picture"),
        };
    });
    let room = Rect::from_min_max(pos2(cell.left(), cell.top() + TITLE), cell.max);
    let painter = ui.painter().with_clip_rect(room);
    painter.rect_filled(room, 2, Color32::from_gray(if dark { 18 } else { 225 }));
    let is_current = view.shown == Some(view.epoch);
    match view.pictures.get(n).and_then(Option::as_ref).filter(|_| is_current) {
        Some(Ok(shown)) => picture(&painter, room, shown),
        Some(Err(why)) => {
            let font = FontId::proportional(13.0);
            let text = painter.layout(why.clone(), font, ui.visuals().warn_fg_color, room.width() - 20.0);
            painter.galley(room.center() - text.size() / 2.0, text, Color32::WHITE);
        }
        None => {
            let (font, text) = (FontId::proportional(13.0), if answer.is_some() { "…" } else { "no picture" });
            painter.text(room.center(), Align2::CENTER_CENTER, text, font, Color32::GRAY);
        }
    }
    if used == Use::Excluded {
        painter.rect_stroke(room.shrink(1.0), 2, Stroke::new(3.0, use_colour(used, dark)), egui::StrokeKind::Inside);
    }
}

fn picture(painter: &egui::Painter, room: Rect, shown: &Shown) {
    let size = shown.texture.size_vec2();
    let scale = (room.width() / size.x).min(room.height() / size.y);
    let at = Rect::from_center_size(room.center(), size * scale);
    painter.image(shown.texture.id(), at, Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0)), Color32::WHITE);
    for line in &shown.limb {
        // Pixel centres are at integers.
        let points = line.iter().map(|[u, v]| at.min + vec2((*u + 0.5) as f32, (*v + 0.5) as f32) * scale);
        let points: Vec<_> = points.collect();
        painter.add(Shape::line(points.clone(), Stroke::new(4.5, Color32::from_black_alpha(120))));
        painter.add(Shape::line(points, Stroke::new(2.5, theme::LIMB)));
    }
}
