//! Images of an iris.

use core::f64::consts::{PI, TAU};

use super::dice::Dice;
use super::shape::{Canvas, Shape, Spot, step};

/// A regular polygon in the picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct Polygon {
    middle: [f32; 2],
    /// Distance of a side from the middle, pixels.
    apothem: f32,
    /// Angle of a sector, radians.
    sector: f32,
    /// Direction of the first side from the middle, radians.
    first: f32,
    /// Radius of curvature of a side in pixels; infinite for straight sides.
    blade: f32,
    soft: f32,
    light: f32,
    /// Size of a second, fainter copy as a multiple of the apothem; 0 for none.
    echo: f32,
}

impl Polygon {
    /// Draws a polygon with 5 to 9 corners. The apothem is 0.1 to 3 diagonals. Sides are straight or, for one in two,
    /// curved with 2 to 10 times the apothem. They are blurred by 0.5 to 5 px. The light is 0.1 to 1; one in five has
    /// an echo of another size.
    pub(super) fn draw(dice: &mut Dice, canvas: &Canvas) -> Self {
        let apothem = dice.between_log(0.1, 3.0) * canvas.diagonal;
        let (x, y) = (dice.between(0.08, 0.92) * canvas.width, dice.between(0.08, 0.92) * canvas.height);
        let (sin, cos) = libm::sincos(dice.turn());
        Self::draw_around(dice, [(x + apothem * cos) as f32, (y + apothem * sin) as f32], apothem, (0.1, 1.0))
    }

    /// Draws a polygon around `middle`.
    pub(super) fn draw_around(dice: &mut Dice, middle: [f32; 2], apothem_px: f64, light: (f64, f64)) -> Self {
        let corners = f64::from(dice.count(5, 9));
        Self {
            middle,
            apothem: apothem_px as f32,
            sector: (TAU / corners) as f32,
            first: dice.turn() as f32,
            blade: if dice.chance(0.5) { (apothem_px * dice.between_log(2.0, 10.0)) as f32 } else { f32::INFINITY },
            soft: dice.between_log(0.5, 5.0) as f32,
            light: dice.between_log(light.0, light.1) as f32,
            echo: if dice.chance(0.2) { dice.between(0.6, 1.3) as f32 } else { 0.0 },
        }
    }

    /// Returns the distance in pixels inside a side that is `scale` times as far out. Sides curve less than the circle
    /// around them.
    fn inside(&self, along: f32, across: f32, scale: f32) -> f32 {
        let apothem = self.apothem * scale;
        if self.blade.is_finite() {
            let blade = self.blade * scale;
            let out = along - (apothem - blade);
            blade - (out * out + across * across).sqrt()
        } else {
            apothem - along
        }
    }
}

impl Shape for Polygon {
    fn sample(&self, x: f32, y: f32) -> Spot {
        let (dx, dy) = (x - self.middle[0], y - self.middle[1]);
        let angle = libm::atan2f(dy, dx) - self.first;
        let off = angle - self.sector * (angle / self.sector).round();
        let distance = (dx * dx + dy * dy).sqrt();
        let (sin, cos) = libm::sincosf(off);
        let (along, across) = (distance * cos, distance * sin);
        let mut light = step(self.inside(along, across, 1.0), self.soft);
        if self.echo > 0.0 {
            light += 0.4 * step(self.inside(along, across, self.echo), self.soft);
        }
        debug_assert!(f64::from(off.abs()) < PI, "a sector is less than half a turn");
        Spot { light: self.light * light, cover: 0.0 }
    }
}
