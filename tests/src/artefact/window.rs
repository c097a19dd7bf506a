//! Frames of windows.

use super::dice::Dice;
use super::shape::{Canvas, Spot, step};
use super::solid::Solid;

/// A frame that covers the picture outside a rectangle with round corners, or that covers only the rectangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Window {
    middle: [f32; 2],
    half: [f32; 2],
    corner: f32,
    along: [f32; 2],
    soft: f32,
    light: f32,
    /// Change of the light per pixel.
    slope: [f32; 2],
    /// Depth of the frame in pixels; infinite if it fills the picture.
    depth: f32,
    /// If true, light comes through the opening instead of from the frame: a lit room, or another window behind.
    through: bool,
}

impl Window {
    /// Draws a window with half sides of 0.15 to 0.9 diagonals and corners from sharp to a full porthole. It has any
    /// tilt, and its edge passes through the picture. The blur is 0.5 to 12 px and the light 0.05 to 0.8. In one of
    /// three the frame is 5 to 60 px deep; in one of four the opening is lit and not the frame.
    pub(super) fn draw(dice: &mut Dice, canvas: &Canvas) -> Self {
        let half = [dice.between_log(0.15, 0.9), dice.between_log(0.15, 0.9)].map(|h| h * canvas.diagonal);
        let porthole = dice.chance(0.3);
        let half = if porthole { [half[0]; 2] } else { half };
        let shorter = half[0].min(half[1]);
        let (sin, cos) = libm::sincos(dice.turn());
        let (a, b) = libm::sincos(dice.turn());
        let slope = dice.between(0.0, 0.3) / canvas.diagonal;
        let corner = if porthole { shorter } else { shorter * dice.between(0.0, 1.0) };
        // (s, t) is a point on the frame's edge, in the frame's axes: on a side or, in one of four, on the arc of a
        // corner.
        let straight = [half[0] - corner, half[1] - corner];
        let (mut s, mut t) = (half[0], dice.between(-1.0, 1.0) * straight[1]);
        if dice.chance(0.5) {
            (s, t) = (dice.between(-1.0, 1.0) * straight[0], half[1]);
        }
        if porthole || dice.chance(0.25) {
            let (down, right) = libm::sincos(dice.between(0.0, core::f64::consts::FRAC_PI_2));
            (s, t) = (straight[0] + corner * right, straight[1] + corner * down);
        }
        let (x, y) = (dice.between(0.1, 0.9) * canvas.width, dice.between(0.1, 0.9) * canvas.height);
        Self {
            middle: [(x - s * cos + t * sin) as f32, (y - s * sin - t * cos) as f32],
            half: half.map(|h| h as f32),
            corner: corner as f32,
            along: [cos as f32, sin as f32],
            soft: dice.between_log(0.5, 12.0) as f32,
            light: dice.between_log(0.05, 0.8) as f32,
            slope: [(slope * a) as f32, (slope * b) as f32],
            depth: if dice.chance(0.33) { dice.between_log(5.0, 60.0) as f32 } else { f32::INFINITY },
            through: dice.chance(0.25),
        }
    }
}

impl Solid for Window {
    fn sample(&self, x: f32, y: f32, scale: f32) -> Spot {
        let soft = self.soft * scale;
        let (dx, dy) = (x - self.middle[0], y - self.middle[1]);
        let s = (dx * self.along[0] + dy * self.along[1]).abs() - self.half[0] + self.corner;
        let t = (dy * self.along[0] - dx * self.along[1]).abs() - self.half[1] + self.corner;
        let (out_s, out_t) = (s.max(0.0), t.max(0.0));
        let outside = (out_s * out_s + out_t * out_t).sqrt() + s.max(t).min(0.0) - self.corner;
        let mut cover = if self.through { step(-outside, soft) } else { step(outside, soft) };
        if self.depth.is_finite() {
            cover *= step(if self.through { outside + self.depth } else { self.depth - outside }, soft);
        }
        let light = (self.light + dx * self.slope[0] + dy * self.slope[1]).max(0.0);
        Spot { light: light * cover, cover }
    }
}
