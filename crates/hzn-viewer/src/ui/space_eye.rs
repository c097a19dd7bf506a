//! From where the scene in space is seen.

/// The place of the eye. It follows the camera until the user turns the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SpaceEye {
    /// Longitude and latitude above which the eye is, radians; `None` follows the camera.
    pub(super) at_rad: Option<[f32; 2]>,
    /// How much larger the scene is drawn than it needs for its farthest point.
    pub(super) zoom: f32,
}

impl Default for SpaceEye {
    fn default() -> Self {
        Self { at_rad: None, zoom: 1.0 }
    }
}

impl SpaceEye {
    /// Returns the place of the eye for a camera at a position. Beside the camera, its altitude and its cone are seen
    /// from the side.
    pub(super) fn beside(&self, camera: Option<[f64; 3]>) -> [f32; 2] {
        let above = |[x, y, _]: [f64; 3]| [(y.atan2(x) + 1.2) as f32, 0.35];
        self.at_rad.unwrap_or_else(|| camera.map_or([0.8, 0.35], above))
    }
    /// Turns the scene by a drag in points.
    pub(super) fn turn(&mut self, from: [f32; 2], by: egui::Vec2) {
        if by != egui::Vec2::ZERO {
            self.at_rad = Some([from[0] - 0.01 * by.x, (from[1] + 0.01 * by.y).clamp(-1.5, 1.5)]);
        }
    }
    /// Makes the scene larger or smaller.
    pub(super) fn scale(&mut self, by: f32) {
        self.zoom = (self.zoom * by).clamp(0.5, 40.0);
    }
}
