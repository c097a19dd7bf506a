//! Stray light around a source.

use super::dice::Dice;
use super::shape::{Canvas, Shape, Spot};

/// Light that falls off around a point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Glare {
    middle: [f32; 2],
    /// Distance at which the light falls to half, pixels.
    scale: f32,
    /// Ratio of length to width of the glare.
    stretch: f32,
    /// Unit vector along the length.
    axis: [f32; 2],
    /// Power of the distance with which the light falls.
    power: f32,
    light: f32,
    /// Number of spikes around the point.
    spikes: f32,
    /// Share of the light in the spikes.
    spiky: f32,
    /// Light of a linear slope over the picture, per pixel.
    slope: [f32; 2],
}

impl Glare {
    /// Draws glare around a point up to half a diagonal outside the picture. The light falls to half at 0.01 to 0.5
    /// diagonals, with the power 1 to 4. The glare is up to three times as long as wide, with a light of 0.3 to 4
    /// (above 1 it saturates). Two in five have 4 to 16 spikes. A slope adds up to 0.3 across the picture.
    pub(super) fn draw(dice: &mut Dice, canvas: &Canvas) -> Self {
        let out = 0.5 * canvas.diagonal * dice.between(0.0, 1.0) * f64::from(dice.count(0, 1));
        let middle = [dice.between(-out, canvas.width + out) as f32, dice.between(-out, canvas.height + out) as f32];
        let (sin, cos) = libm::sincos(dice.turn());
        let slope = dice.between(0.0, 0.3) / canvas.diagonal;
        Self {
            middle,
            scale: (dice.between_log(0.01, 0.5) * canvas.diagonal) as f32,
            stretch: dice.between_log(1.0, 3.0) as f32,
            axis: [cos as f32, sin as f32],
            power: dice.between(1.0, 4.0) as f32,
            light: dice.between_log(0.3, 4.0) as f32,
            spikes: dice.count(4, 16) as f32,
            spiky: if dice.chance(0.4) { dice.between(0.1, 0.7) as f32 } else { 0.0 },
            slope: [(slope * sin) as f32, (slope * cos) as f32],
        }
    }

    /// Draws a saturated source of light with a small halo.
    pub(super) fn source(dice: &mut Dice, canvas: &Canvas, middle: [f32; 2]) -> Self {
        let scale = dice.between_log(0.005, 0.06) * canvas.diagonal;
        let light = dice.between_log(1.0, 6.0);
        Self {
            middle,
            scale: scale as f32,
            stretch: 1.0,
            power: dice.between(2.0, 4.0) as f32,
            light: light as f32,
            slope: [0.0; 2],
            ..Self::draw(dice, canvas)
        }
    }
}

impl Shape for Glare {
    fn sample(&self, x: f32, y: f32) -> Spot {
        let (dx, dy) = (x - self.middle[0], y - self.middle[1]);
        let along = dx * self.axis[0] + dy * self.axis[1];
        let across = (dy * self.axis[0] - dx * self.axis[1]) * self.stretch;
        let ratio = (along * along + across * across).sqrt() / self.scale;
        let mut light = self.light / (1.0 + libm::powf(ratio, self.power));
        if self.spiky > 0.0 {
            let wave = libm::cosf(0.5 * self.spikes * libm::atan2f(dy, dx));
            light *= 1.0 - self.spiky * (1.0 - wave * wave);
        }
        let slope = (dx * self.slope[0] + dy * self.slope[1]).max(0.0);
        Spot { light: light + slope, cover: 0.0 }
    }
}
