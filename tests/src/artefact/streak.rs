//! Soft curved streaks and the edges of veils.

use super::dice::Dice;
use super::shape::{Canvas, Shape, Spot, step};

/// Light along a smooth curve.
#[derive(Debug, Clone, Copy)]
pub(super) struct Streak {
    origin: [f32; 2],
    /// Unit vector along the curve at its origin.
    along: [f32; 2],
    /// Second-order coefficient of the curve, per pixel.
    bend: f32,
    /// Third-order coefficient of the curve, per pixel².
    twist: f32,
    /// Blur of the lower and the upper edge, pixels.
    soft: [f32; 2],
    /// Width between the edges, pixels.
    width: f32,
    /// For a veil, the length over which it fades away from its one sharp edge, pixels.
    fade: Option<f32>,
    /// Half of the bright length, pixels.
    reach: f32,
    light: f32,
}

impl Streak {
    /// Draws a curve with a radius of 0.3 to 15 diagonals. One in two has a third-order part that changes the curvature
    /// by up to a half over the picture. A streak is 6 to 120 px wide, and each edge is blurred by 1 to 15 px
    /// separately. Every third is a veil, blurred by 0.7 to 5 px on one side and fading over 20 to 300 px on the other.
    /// The light is 0.1 to 1, over a length of 0.2 to 2 diagonals.
    pub(super) fn draw(dice: &mut Dice, canvas: &Canvas) -> Self {
        let diagonal = canvas.diagonal;
        let (x, y) = (dice.between(0.15, 0.85) * canvas.width, dice.between(0.15, 0.85) * canvas.height);
        let (sin, cos) = libm::sincos(dice.turn());
        let radius = dice.between_log(0.3, 15.0) * diagonal;
        let twist = if dice.chance(0.5) { dice.between(-0.5, 0.5) / (3.0 * radius * diagonal) } else { 0.0 };
        let veil = dice.chance(0.33);
        let edge = |dice: &mut Dice| if veil { dice.between_log(0.7, 5.0) } else { dice.between_log(1.0, 15.0) } as f32;
        let soft = [edge(dice), edge(dice)];
        Self {
            origin: [x as f32, y as f32],
            along: [cos as f32, sin as f32],
            bend: (0.5 / radius) as f32,
            twist: twist as f32,
            soft,
            width: dice.between_log(6.0, 120.0) as f32,
            fade: veil.then(|| dice.between_log(20.0, 300.0) as f32),
            reach: (dice.between_log(0.1, 1.0) * diagonal) as f32,
            light: dice.between_log(0.1, 1.0) as f32,
        }
    }
}

impl Shape for Streak {
    fn sample(&self, x: f32, y: f32) -> Spot {
        let (dx, dy) = (x - self.origin[0], y - self.origin[1]);
        let s = dx * self.along[0] + dy * self.along[1];
        let t = dy * self.along[0] - dx * self.along[1];
        // A strongly bent curve ends where it is steep.
        if (s * self.bend).abs() > 0.35 || s.abs() > 1.6 * self.reach {
            let slope = 2.0 * s * self.bend + 3.0 * s * s * self.twist;
            if slope.abs() > 2.5 || s.abs() > 1.6 * self.reach {
                return Spot::default();
            }
        }
        let slope = 2.0 * s * self.bend + 3.0 * s * s * self.twist;
        let above = (t - s * s * (self.bend + s * self.twist)) / (1.0 + slope * slope).sqrt();
        let lower = step(above, self.soft[0]);
        let across = match self.fade {
            Some(fade) => lower * libm::expf(-above.max(0.0) / fade),
            None => lower * step(self.width - above, self.soft[1]),
        };
        if across <= 0.0 {
            return Spot::default();
        }
        let ends = step(self.reach - s.abs(), 0.25 * self.reach) * step(2.0 - slope.abs(), 0.2);
        Spot { light: self.light * across * ends, cover: 0.0 }
    }
}
