//! The Moon.

use super::dice::Dice;
use super::shape::{Canvas, Shape, Spot, step};

/// Half-angle of the Moon, radians.
const HALF_ANGLE_RAD: f64 = 0.00452;

/// A lit sphere with its halo.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moon {
    middle: [f32; 2],
    radius: f32,
    /// Direction of the light in the picture.
    sun: [f32; 2],
    /// Cosine of the elongation of the light: 1 is full.
    full: f32,
    soft: f32,
    light: f32,
    halo: f32,
    /// Relative darkness of the maria.
    spots: f32,
}

impl Moon {
    /// Draws a Moon anywhere in the picture, or cut by its border, with any phase. Its radius is up to 2.5 times the
    /// true one because of bloom. The blur is 0.5 to 2.5 px, the light 0.3 to 3, the halo up to a fifth.
    pub(super) fn draw(dice: &mut Dice, canvas: &Canvas) -> Self {
        let bloom = if dice.chance(0.5) { dice.between(1.0, 2.5) } else { 1.0 };
        let radius = HALF_ANGLE_RAD * canvas.focal_px * bloom;
        let (sin, cos) = libm::sincos(dice.turn());
        let phase = dice.between(-1.0, 1.0);
        Self {
            middle: [dice.between(0.0, canvas.width) as f32, dice.between(0.0, canvas.height) as f32],
            radius: radius as f32,
            sun: [cos as f32, sin as f32],
            full: phase as f32,
            soft: dice.between_log(0.5, 2.5) as f32,
            light: dice.between_log(0.3, 3.0) as f32,
            halo: if dice.chance(0.5) { dice.between(0.0, 0.2) as f32 } else { 0.0 },
            spots: dice.between(0.0, 0.5) as f32,
        }
    }
}

impl Shape for Moon {
    fn sample(&self, x: f32, y: f32) -> Spot {
        let (dx, dy) = (x - self.middle[0], y - self.middle[1]);
        let distance = (dx * dx + dy * dy).sqrt();
        let ratio = distance / self.radius.max(0.5);
        let halo = self.halo / (1.0 + ratio * ratio);
        let cover = step(self.radius - distance, self.soft);
        if cover <= 0.0 {
            return Spot { light: halo, cover: 0.0 };
        }
        let up = (1.0 - ratio * ratio).max(0.0).sqrt();
        let across = (dx * self.sun[0] + dy * self.sun[1]) / self.radius.max(0.5);
        let side = (1.0 - self.full * self.full).max(0.0).sqrt();
        let lit = (across * side + up * self.full).max(0.0);
        // This is the law of Lommel and Seeliger: a full Moon is uniform.
        let light = self.light * 2.0 * lit / (lit + up).max(1e-3);
        let (a, b) = (dx / self.radius * 4.1, dy / self.radius * 3.7);
        let spots = 1.0 - self.spots * (0.5 + 0.5 * libm::sinf(a + 1.3) * libm::cosf(b - 0.4));
        Spot { light: light.min(self.light) * spots * cover + halo, cover: 0.0 }
    }
}
