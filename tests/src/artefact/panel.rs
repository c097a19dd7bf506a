//! Straight parts of the vehicle: panels, masts, booms.

use super::dice::Dice;
use super::shape::{Canvas, Spot, step};
use super::solid::Solid;

/// A convex area with one to four straight sides.
#[derive(Debug, Clone)]
pub(super) struct Panel {
    /// Normals (outward, unit) and offsets in pixels.
    sides: Vec<([f32; 2], f32)>,
    soft: f32,
    light: f32,
    /// Change of the light per pixel.
    slope: [f32; 2],
    /// Spacing of a grid of cells in pixels; 0 for none.
    cells: f32,
    /// Share of the light that is lost on the lines of the grid.
    depth: f32,
}

impl Panel {
    /// Draws one to four sides with edges through the picture, blurred by 0.4 to 8 px. The light is 0.1 to 1, with a
    /// slope of up to 0.3 per diagonal. One in three has a grid of cells every 12 to 80 px.
    pub(super) fn draw(dice: &mut Dice, canvas: &Canvas) -> Self {
        let (x, y) = (dice.between(0.1, 0.9) * canvas.width, dice.between(0.1, 0.9) * canvas.height);
        let first = dice.turn();
        let count = dice.count(1, 4);
        let side = |turn: f64, offset: f64| {
            let (sin, cos) = libm::sincos(turn);
            ([cos as f32, sin as f32], (x * cos + y * sin + offset) as f32)
        };
        let mut sides = vec![side(first, 0.0)];
        if count > 1 {
            sides.push(side(first + dice.between(0.4, 2.6), dice.between(0.0, 0.4) * canvas.diagonal));
        }
        if count > 2 {
            let width = dice.between_log(0.02, 0.5) * canvas.diagonal;
            sides.push(side(first + core::f64::consts::PI + dice.between(-0.1, 0.1), width));
        }
        if count > 3 {
            sides.push(side(first - dice.between(0.8, 2.3), dice.between(0.0, 0.5) * canvas.diagonal));
        }
        let (sin, cos) = libm::sincos(dice.turn());
        let slope = dice.between(0.0, 0.3) / canvas.diagonal;
        Self {
            sides,
            soft: dice.between_log(0.4, 8.0) as f32,
            light: dice.between_log(0.1, 1.0) as f32,
            slope: [(slope * cos) as f32, (slope * sin) as f32],
            cells: if dice.chance(0.33) { dice.between(12.0, 80.0) as f32 } else { 0.0 },
            depth: dice.between(0.1, 0.6) as f32,
        }
    }
}

impl Solid for Panel {
    fn sample(&self, x: f32, y: f32, scale: f32) -> Spot {
        let soft = self.soft * scale;
        let inside = |(n, offset): &([f32; 2], f32)| offset - x * n[0] - y * n[1];
        let within = self.sides.iter().map(inside).fold(f32::INFINITY, f32::min);
        let cover = step(within, soft);
        if cover <= 0.0 {
            return Spot::default();
        }
        let mut light = self.light + x * self.slope[0] + y * self.slope[1];
        if self.cells > 0.0
            && let Some((n, offset)) = self.sides.first()
        {
            let (s, t) = (x * n[0] + y * n[1] - offset, y * n[0] - x * n[1]);
            let line = |v: f32| (v / self.cells - (v / self.cells).round()).abs() * self.cells < 1.2 * scale;
            if line(s) || line(t) {
                light *= 1.0 - self.depth;
            }
        }
        Spot { light: light.max(0.0) * cover, cover }
    }
}
