//! A ring around the widget with the keyboard focus, for users who go through the window by the key Tab.

use egui::{Context, Key, LayerId, Order, Stroke, StrokeKind};

/// Whether the ring is shown: from the first key Tab to the next click.
#[derive(Debug, Default)]
pub(super) struct FocusRing {
    is_shown: bool,
}

impl FocusRing {
    /// Draws the ring.
    pub(super) fn draw(&mut self, ctx: &Context) {
        let (tab, click) = ctx.input(|i| (i.key_pressed(Key::Tab), i.pointer.any_pressed()));
        self.is_shown = (self.is_shown || tab) && !click;
        if !self.is_shown {
            return;
        }
        let Some(widget) = ctx.memory(egui::Memory::focused).and_then(|id| ctx.read_response(id)) else { return };
        let layer = LayerId::new(Order::Tooltip, egui::Id::unique("focus ring"));
        let painter = ctx.layer_painter(layer).with_clip_rect(ctx.content_rect());
        let stroke = Stroke::new(2.0, ctx.global_style().visuals.hyperlink_color);
        painter.rect_stroke(widget.rect.expand(2.0), 4, stroke, StrokeKind::Outside);
    }
}
