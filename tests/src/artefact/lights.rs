//! Lights at night: cities, roads, lightning.

use hzn_sim::detector::Plane;

use super::dice::Dice;
use super::shape::{Canvas, Shape, Spot};

/// A set of spots of light.
#[derive(Debug, Clone)]
pub(super) struct Lights {
    /// Position, standard deviation in pixels, light.
    spots: Vec<([f32; 2], f32, f32)>,
}

impl Lights {
    /// Draws 1 to 12 cities with 10 to 120 lamps each, up to 3 roads with lamps every 2 to 15 px along a bent line, and
    /// up to 3 clouds lit by lightning, of 10 to 150 px. Lamps are 0.5 to 2.5 px large, with a light of 0.05 to 2.
    pub(super) fn draw(dice: &mut Dice, canvas: &Canvas) -> Self {
        let mut spots = Vec::new();
        let position = |dice: &mut Dice| [dice.between(0.0, canvas.width), dice.between(0.0, canvas.height)];
        let lamp = |dice: &mut Dice, x: f64, y: f64| {
            ([x as f32, y as f32], dice.between_log(0.5, 2.5) as f32, dice.between_log(0.05, 2.0) as f32)
        };
        for _ in 0..dice.count(1, 12) {
            let [x, y] = position(dice);
            let size = dice.between_log(0.005, 0.12) * canvas.diagonal;
            for _ in 0..dice.count(10, 120) {
                let (dx, dy) = (size * dice.normal(), size * dice.normal());
                spots.push(lamp(dice, x + dx, y + dy));
            }
        }
        for _ in 0..dice.count(0, 3) {
            let [x, y] = position(dice);
            let (turn, bend) = (dice.turn(), dice.between(-2.0, 2.0) / canvas.diagonal);
            let (spacing, length) = (dice.between(2.0, 15.0), dice.between(0.2, 1.2) * canvas.diagonal);
            let (mut position, mut heading, mut travelled) = ([x, y], turn, 0.0);
            while travelled < length {
                let (sin, cos) = libm::sincos(heading);
                position = [position[0] + spacing * cos, position[1] + spacing * sin];
                heading += bend * spacing;
                travelled += spacing;
                spots.push(lamp(dice, position[0], position[1]));
            }
        }
        for _ in 0..dice.count(0, 3) {
            let [x, y] = position(dice);
            spots.push((
                [x as f32, y as f32],
                dice.between_log(10.0, 150.0) as f32,
                dice.between_log(0.05, 1.5) as f32,
            ));
        }
        Self { spots }
    }

    /// Draws up to 60 stars, 0.5 to 0.9 px large, with a light of 0.02 to 1.
    pub(super) fn stars(dice: &mut Dice, canvas: &Canvas) -> Self {
        let star = |dice: &mut Dice| {
            let (x, y) = (dice.between(0.0, canvas.width), dice.between(0.0, canvas.height));
            ([x as f32, y as f32], dice.between(0.5, 0.9) as f32, dice.between_log(0.02, 1.0) as f32)
        };
        Self { spots: (0..dice.count(0, 60)).map(|_| star(dice)).collect() }
    }
}

impl Shape for Lights {
    fn sample(&self, x: f32, y: f32) -> Spot {
        let light = |(p, size, light): &([f32; 2], f32, f32)| {
            let (dx, dy) = ((x - p[0]) / size, (y - p[1]) / size);
            light * libm::expf(-0.5 * (dx * dx + dy * dy))
        };
        Spot { light: self.spots.iter().map(light).sum(), cover: 0.0 }
    }

    fn paint(&self, plane: &mut Plane) {
        let (w, h) = (plane.width as i32, plane.height() as i32);
        for &(p, size, light) in &self.spots {
            // The light beyond four sigma is left out.
            let range = |c: f32, end: i32| {
                let (low, high) = ((c - 4.0 * size).floor() as i32, (c + 4.0 * size).ceil() as i32);
                low.clamp(0, end)..(high + 1).clamp(0, end)
            };
            for y in range(p[1], h) {
                for x in range(p[0], w) {
                    let (dx, dy) = ((x as f32 - p[0]) / size, (y as f32 - p[1]) / size);
                    if let Some(pixel) = plane.data.get_mut((y * w + x) as usize) {
                        *pixel += light * libm::expf(-0.5 * (dx * dx + dy * dy));
                    }
                }
            }
        }
    }
}
