//! Rings and discs: circles in the picture.

use super::dice::Dice;
use super::shape::{Canvas, Shape, Spot, step};

/// A circle in the picture, filled or as a ring.
#[derive(Debug, Clone, Copy)]
pub(super) struct Circle {
    middle: [f32; 2],
    radius: f32,
    /// Width of a ring in pixels; `None` for a disc.
    width: Option<f32>,
    /// Blur of the outer edge, and of the inner edge of a ring, pixels.
    soft: [f32; 2],
    light: f32,
    /// Ratio of a disc's light at the edge to its light in the middle, minus one.
    rim: f32,
    /// Share of the light that varies with direction.
    uneven: f32,
    /// Direction in which the light is least, a unit vector.
    faint: [f32; 2],
}

/// Returns the middle of a circle with this radius in pixels whose edge passes through a point inside the picture.
fn middle_of_circle_in_view(dice: &mut Dice, canvas: &Canvas, radius: f64) -> [f32; 2] {
    let (x, y) = (dice.between(0.08, 0.92) * canvas.width, dice.between(0.08, 0.92) * canvas.height);
    let (sin, cos) = libm::sincos(dice.turn());
    [(x + radius * cos) as f32, (y + radius * sin) as f32]
}

impl Circle {
    /// Draws a ring with a radius of 0.15 to 3 diagonals and a width of 4 to 60 px. Each side is blurred by 0.5 to 6 px
    /// separately. The light is 0.1 to 1 and fades by up to 90 % towards one side.
    pub(super) fn ring(dice: &mut Dice, canvas: &Canvas) -> Self {
        let radius = dice.between_log(0.15, 3.0) * canvas.diagonal;
        let middle = middle_of_circle_in_view(dice, canvas, radius);
        let (sin, cos) = libm::sincos(dice.turn());
        Self {
            middle,
            radius: radius as f32,
            width: Some(dice.between_log(4.0, 60.0) as f32),
            soft: [dice.between_log(0.5, 6.0) as f32, dice.between_log(0.5, 6.0) as f32],
            light: dice.between_log(0.1, 1.0) as f32,
            rim: 0.0,
            uneven: if dice.chance(0.5) { dice.between(0.0, 0.9) as f32 } else { 0.0 },
            faint: [cos as f32, sin as f32],
        }
    }

    /// Draws a ghost disc with a radius of 0.1 to 3 diagonals, blurred by 0.5 to 6 px, with a light of 0.1 to 1. Its
    /// rim has half to twice the brightness of its middle. The light fades by up to 70 % towards one side.
    pub(super) fn disc(dice: &mut Dice, canvas: &Canvas) -> Self {
        Self::ghost(dice, canvas, 0.1, 3.0)
    }

    /// Draws a disc like [`Circle::disc`], with a radius of 1 to 12 diagonals.
    pub(super) fn far_disc(dice: &mut Dice, canvas: &Canvas) -> Self {
        Self::ghost(dice, canvas, 1.0, 12.0)
    }

    fn ghost(dice: &mut Dice, canvas: &Canvas, low: f64, high: f64) -> Self {
        let radius = dice.between_log(low, high) * canvas.diagonal;
        let middle = middle_of_circle_in_view(dice, canvas, radius);
        Self::disc_around(dice, middle, radius, (0.1, 1.0))
    }

    /// Draws a disc around `middle`.
    pub(super) fn disc_around(dice: &mut Dice, middle: [f32; 2], radius_px: f64, light: (f64, f64)) -> Self {
        let (sin, cos) = libm::sincos(dice.turn());
        Self {
            middle,
            radius: radius_px as f32,
            width: None,
            soft: [dice.between_log(0.5, 6.0) as f32, 1.0],
            light: dice.between_log(light.0, light.1) as f32,
            rim: if dice.chance(0.5) { dice.between(-0.5, 1.0) as f32 } else { 0.0 },
            uneven: if dice.chance(0.4) { dice.between(0.0, 0.7) as f32 } else { 0.0 },
            faint: [cos as f32, sin as f32],
        }
    }

    /// Draws a ring around `middle`.
    pub(super) fn ring_around(dice: &mut Dice, middle: [f32; 2], radius_px: f64, light: (f64, f64)) -> Self {
        Self {
            width: Some(dice.between_log(3.0, 30.0) as f32),
            rim: 0.0,
            ..Self::disc_around(dice, middle, radius_px, light)
        }
    }

    /// Returns the middle and the radius in pixels.
    pub(super) fn middle_and_radius(&self) -> ([f64; 2], f64) {
        (self.middle.map(f64::from), f64::from(self.radius))
    }
}

impl Shape for Circle {
    fn sample(&self, x: f32, y: f32) -> Spot {
        let (dx, dy) = (x - self.middle[0], y - self.middle[1]);
        // This form keeps the digits of large radii in single precision.
        let radius = self.radius;
        let distance = (dx * dx + dy * dy).sqrt();
        let inside = radius - distance;
        let cover = match self.width {
            Some(width) => step(inside, self.soft[0]) * step(width - inside, self.soft[1]),
            None => step(inside, self.soft[0]),
        };
        if cover <= 0.0 {
            return Spot::default();
        }
        let ratio = distance / radius;
        let ratio4 = (ratio * ratio * ratio * ratio).min(1.0);
        let aside = ((dx * self.faint[0] + dy * self.faint[1]) / radius).clamp(-1.0, 1.0);
        let even = 1.0 - self.uneven * 0.5 * (1.0 + aside);
        Spot { light: self.light * cover * even * (1.0 + self.rim * ratio4), cover: 0.0 }
    }
}
