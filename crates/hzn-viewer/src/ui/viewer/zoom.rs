//! Zooms the picture by command, and shows a point of it.

use super::Viewer;
use crate::model::View;
use crate::model::view::Point;
use crate::ui::Command;
use crate::ui::placement::area;
use crate::work::FrameView;

impl Viewer {
    /// Shows a point of the camera's picture, large enough to see single pixels.
    pub(in crate::ui) fn look_at(&mut self, p: Point) {
        const SCALE: f64 = 8.0;
        let Some(frame_view) = &self.frame_view else { return };
        let plane = frame_view.image.as_ref().map(|s| &s.key.1.plane);
        let shown = match (plane, frame_view.camera.as_deref()) {
            (Some(plane), Some(camera)) => plane.to_shown(camera, p),
            _ => Some(p),
        };
        if let (Some(size), Some(p)) = (frame_view.size(), shown) {
            self.view.look_at(size, p, SCALE);
        }
    }

    /// Zooms by key or menu, about the middle of the window.
    pub(super) fn zoom(&mut self, command: Command, ctx: &egui::Context) {
        let Some(size) = self.frame_view.as_ref().and_then(FrameView::size) else { return };
        let rect = ctx.content_rect();
        let area = area(rect);
        match command {
            Command::Fit => self.view = View::FIT,
            Command::Actual => self.view.set_scale(area, size, 1.0 / f64::from(ctx.pixels_per_point())),
            _ => {
                let factor = if command == Command::ZoomIn { 1.5 } else { 1.0 / 1.5 };
                let middle = rect.center();
                self.view.zoom(area, size, [middle.x.into(), middle.y.into()], factor);
            }
        }
    }
}
