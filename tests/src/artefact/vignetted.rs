//! Ghosts that are cut off by a rim of the lens.

use super::circle::Circle;
use super::dice::Dice;
use super::shape::{Canvas, Shape, Spot, step};

/// The intersection of two circles in the picture, or an ellipse: a ghost far off the axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vignetted {
    disc: Circle,
    /// Middle, radius and blur of the rim that cuts the disc, pixels.
    rim: ([f32; 2], f32, f32),
    /// Middle of the disc, pixels.
    middle: [f32; 2],
    /// Unit vector of the stretch.
    along: [f32; 2],
    /// Stretch of the disc along this vector.
    stretch: f32,
}

impl Vignetted {
    /// Draws a disc like [`Circle::disc`], stretched by 0.9 to 1.1 for one in two. It is cut by a rim of 0.7 to 1.5
    /// times its radius, whose middle is 0.2 to 1.2 radii away, blurred by 0.5 to 6 px.
    pub(super) fn draw(dice: &mut Dice, canvas: &Canvas) -> Self {
        let disc = Circle::disc(dice, canvas);
        let (middle, radius) = disc.middle_and_radius();
        let (sin, cos) = libm::sincos(dice.turn());
        let away = dice.between(0.2, 1.2) * radius;
        let rim = [(middle[0] + away * cos) as f32, (middle[1] + away * sin) as f32];
        let (b, a) = libm::sincos(dice.turn());
        Self {
            disc,
            rim: (rim, (radius * dice.between(0.7, 1.5)) as f32, dice.between_log(0.5, 6.0) as f32),
            middle: middle.map(|m| m as f32),
            along: [a as f32, b as f32],
            stretch: if dice.chance(0.5) { dice.between(0.9, 1.1) as f32 } else { 1.0 },
        }
    }

    /// Returns the middles and radii of the two circles in pixels.
    pub(super) fn circles(&self) -> [([f64; 2], f64); 2] {
        let (middle, radius, _) = self.rim;
        [self.disc.middle_and_radius(), (middle.map(f64::from), f64::from(radius))]
    }
}

impl Shape for Vignetted {
    fn sample(&self, x: f32, y: f32) -> Spot {
        let (middle, radius, soft) = self.rim;
        let (dx, dy) = (x - middle[0], y - middle[1]);
        let within = step(radius - (dx * dx + dy * dy).sqrt(), soft);
        if within <= 0.0 {
            return Spot::default();
        }
        let (dx, dy) = (x - self.middle[0], y - self.middle[1]);
        let more = (dx * self.along[0] + dy * self.along[1]) * (1.0 / self.stretch - 1.0);
        let spot = self.disc.sample(x + more * self.along[0], y + more * self.along[1]);
        Spot { light: spot.light * within, ..spot }
    }
}
