//! Placement of a picture on the screen, and the plane it is shown in.

use egui::{Pos2, Rect, pos2};
use hzn_core::camera::Camera;

use crate::model::view::{Area, Point};
use crate::model::{Plane, View};

/// Placement of a picture of this size, and the plane it is shown in.
pub(super) struct Placement<'a> {
    pub(super) view: View,
    pub(super) area: Area,
    pub(super) size: Point,
    pub(super) plane: Plane,
    pub(super) camera: Option<&'a Camera<f64>>,
}

impl Placement<'_> {
    /// Returns the point of the screen at which a point of the camera's picture is shown.
    pub(super) fn to_screen(&self, p: Point) -> Option<Pos2> {
        let p = match (&self.plane, self.camera) {
            (Plane::Camera, _) | (_, None) => p,
            (plane, Some(camera)) => plane.to_shown(camera, p)?,
        };
        Some(self.shown_to_screen(p))
    }
    /// Returns the point of the screen at which a point of the shown picture lies.
    pub(super) fn shown_to_screen(&self, p: Point) -> Pos2 {
        let [x, y] = self.view.to_screen(self.area, self.size, p);
        pos2(x as f32, y as f32)
    }
    /// Returns the point of the camera's picture under a point of the screen.
    pub(super) fn to_picture(&self, at: Pos2) -> Option<Point> {
        let p = self.view.to_picture(self.area, self.size, [at.x.into(), at.y.into()]);
        match (&self.plane, self.camera) {
            (Plane::Camera, _) | (_, None) => Some(p),
            (plane, Some(camera)) => plane.to_camera(camera, p),
        }
    }
    pub(super) fn scale(&self) -> f64 {
        self.view.scale(self.area, self.size)
    }
}

/// Converts a rectangle of the screen.
pub(super) fn area(rect: Rect) -> Area {
    Area {
        min: [rect.min.x.into(), rect.min.y.into()],
        size: [rect.width().max(1.0).into(), rect.height().max(1.0).into()],
    }
}

/// Returns where a window opens that belongs to the picture: over the picture, so that it hides neither the menus nor
/// the answer.
pub(super) fn beside(picture: Rect) -> Pos2 {
    picture.left_top() + egui::Vec2::splat(12.0)
}
