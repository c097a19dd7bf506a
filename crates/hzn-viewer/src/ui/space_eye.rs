//! From where the scene in space is seen.

/// How much of the camera's surroundings is shown at first, in distances of the limb.
const AROUND: f64 = 1.6;

/// The place of the eye. It follows the camera until the user turns the scene.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct SpaceEye {
    /// Longitude and latitude above which the eye is, radians; `None` follows the camera.
    pub(super) at_rad: Option<[f32; 2]>,
    /// How much larger the scene is drawn than it needs for its farthest point; `None` shows the camera's surroundings.
    pub(super) zoom: Option<f32>,
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
    /// Returns how much larger the scene is drawn, for a scene of this reach and a camera that sees this far. In a low
    /// orbit, the cone is a small part of the globe.
    pub(super) fn zoom(&self, reach: f64, sight: f64) -> f32 {
        self.zoom.unwrap_or_else(|| (reach / (AROUND * sight)).clamp(1.0, 12.0) as f32)
    }
    /// Makes the scene larger or smaller.
    pub(super) fn scale(&mut self, from: f32, by: f32) {
        if by != 1.0 {
            self.zoom = Some((from * by).clamp(0.5, 40.0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_low_camera_is_seen_from_near_until_the_user_zooms() {
        let mut eye = SpaceEye::default();
        // 240 km and 40 000 km above the Earth.
        let (low, high) = (eye.zoom(6611.0, 1740.0), eye.zoom(46378.0, 45937.0));
        assert!((2.0..3.0).contains(&low) && high == 1.0, "{low} {high}");
        eye.scale(low, 1.0);
        assert_eq!(eye, SpaceEye::default(), "a wheel that does not move changes nothing");
        eye.scale(low, 2.0);
        assert_eq!(eye.zoom(46378.0, 45937.0), 2.0 * low);
    }

    #[test]
    fn the_eye_follows_the_camera_until_the_user_turns_the_scene() {
        let mut eye = SpaceEye::default();
        let [azimuth, _] = eye.beside(Some([0.0, 7000.0, 0.0]));
        assert!((azimuth - std::f32::consts::FRAC_PI_2 - 1.2).abs() < 1e-6);
        eye.turn([1.0, 0.3], egui::vec2(10.0, 1000.0));
        assert_eq!(eye.beside(Some([7000.0, 0.0, 0.0])), [0.9, 1.5], "it does not turn over the pole");
    }
}
