//! Ground from above: clouds, fronts, coasts.

use hzn_sim::counter::{Counter, Stream};

use super::dice::Dice;
use super::shape::{Canvas, Shape, Spot, step};

/// Clouds over a dark or bright ground, with or without a smooth front.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clouds {
    hash: Counter,
    /// Size of the largest clouds, pixels.
    scale: f32,
    /// Stretch of the clouds along one direction.
    stretch: f32,
    along: [f32; 2],
    /// Threshold of the noise; noise above it is cloud.
    level: f32,
    /// Width of a cloud's edge in units of the noise.
    edge: f32,
    ground: f32,
    cloud: f32,
    octaves: u32,
    /// A front: the clouds end beyond a circle in the picture. Middle, radius, shift by the noise, blur; all in pixels.
    front: Option<([f32; 2], f32, f32, f32)>,
}

impl Clouds {
    /// Draws clouds of 0.05 to 1.5 diagonals in 3 to 6 octaves, stretched up to four times. They cover 10 to 90 % of a
    /// ground of 0.01 to 0.25, with a brightness of 0.25 to 1. Every third has a front: beyond a curve with a radius of
    /// 0.3 to 10 diagonals, ragged by 3 to 60 px and blurred by 0.7 to 20 px, there are no clouds.
    pub(super) fn draw(dice: &mut Dice, canvas: &Canvas, seed: u64) -> Self {
        let (sin, cos) = libm::sincos(dice.turn());
        let front = dice.chance(0.33).then(|| {
            let radius = dice.between_log(0.3, 10.0) * canvas.diagonal;
            let (x, y) = (dice.between(0.1, 0.9) * canvas.width, dice.between(0.1, 0.9) * canvas.height);
            let (s, c) = libm::sincos(dice.turn());
            let ragged = dice.between_log(3.0, 60.0);
            let middle = [(x + radius * c) as f32, (y + radius * s) as f32];
            (middle, radius as f32, ragged as f32, dice.between_log(0.7, 20.0) as f32)
        });
        Self {
            hash: Counter::new(seed.rotate_left(17) ^ 0xC10D, Stream::Artefact),
            scale: (dice.between_log(0.05, 1.5) * canvas.diagonal) as f32,
            stretch: dice.between_log(1.0, 4.0) as f32,
            along: [cos as f32, sin as f32],
            level: if front.is_some() { dice.between(0.2, 0.5) } else { dice.between(0.35, 0.65) } as f32,
            edge: dice.between_log(0.01, 0.2) as f32,
            ground: dice.between_log(0.01, 0.25) as f32,
            cloud: dice.between(0.25, 1.0) as f32,
            octaves: dice.count(3, 6),
            front,
        }
    }

    /// Returns value noise, 0 to 1.
    fn noise(&self, x: f32, y: f32) -> f32 {
        let (mut sum, mut weight, mut total, mut scale) = (0.0, 1.0, 0.0, 1.0 / self.scale);
        for octave in 0..self.octaves {
            sum += weight * self.lattice(x * scale, y * scale, octave);
            total += weight;
            (weight, scale) = (weight * 0.55, scale * 2.1);
        }
        sum / total
    }

    fn lattice(&self, x: f32, y: f32, octave: u32) -> f32 {
        let (fx, fy) = (x.floor(), y.floor());
        let corner = |dx: f32, dy: f32| {
            let [i, j] = [fx + dx, fy + dy].map(|v| (v as i32).wrapping_add(1 << 20) as u64);
            (self.hash.bits((i << 32) ^ (j << 4) ^ u64::from(octave)) >> 40) as f32 * (1.0 / 16_777_216.0)
        };
        let ease = |t: f32| t * t * (3.0 - 2.0 * t);
        let (u, v) = (ease(x - fx), ease(y - fy));
        let row = |dy: f32| corner(0.0, dy) * (1.0 - u) + corner(1.0, dy) * u;
        row(0.0) * (1.0 - v) + row(1.0) * v
    }
}

impl Shape for Clouds {
    fn sample(&self, x: f32, y: f32) -> Spot {
        let (s, t) = (x * self.along[0] + y * self.along[1], (y * self.along[0] - x * self.along[1]) * self.stretch);
        let noise = self.noise(s, t);
        let mut thick = step(noise - self.level, self.edge);
        if let Some((middle, radius, ragged, soft)) = self.front {
            let (dx, dy) = (x - middle[0], y - middle[1]);
            thick *= step(radius - (dx * dx + dy * dy).sqrt() + ragged * (noise - 0.5) * 4.0, soft);
        }
        // Thick clouds are brighter and not uniform.
        let bright = self.cloud * (0.7 + 0.6 * (noise - self.level).max(0.0)).min(1.0);
        Spot { light: self.ground + thick * (bright - self.ground).max(0.0), cover: 1.0 }
    }
}
