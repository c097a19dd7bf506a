//! Rival polyline: the iris of a lens and the parts of a vehicle have straight edges.

use super::shape::{Place, Shape};
use crate::base::real::Real;

/// Largest number of straight pieces. A polygon of many corners touches a cone only near a few of its sides.
const PIECES: usize = 4;
/// Number of places where a piece may end, in addition to the end of the shape.
const PLACES: usize = 40;

/// Sums of points in a frame along one direction. On a straight line the second coordinate stays small, so that single
/// precision suffices.
struct Line<T> {
    origin: [T; 2],
    along: [T; 2],
    n: T,
    x: T,
    y: T,
    xx: T,
    xy: T,
    yy: T,
}

impl<T: Real> Line<T> {
    fn new(origin: [T; 2], towards: [T; 2]) -> Self {
        let (dx, dy) = (towards[0] - origin[0], towards[1] - origin[1]);
        let length = (dx * dx + dy * dy).sqrt().max(T::from_f64(1e-6));
        let zero = T::ZERO;
        let along = [dx / length, dy / length];
        Self { origin, along, n: zero, x: zero, y: zero, xx: zero, xy: zero, yy: zero }
    }
    fn add(&mut self, p: &Place<T>) {
        let (dx, dy) = (p.at[0] - self.origin[0], p.at[1] - self.origin[1]);
        let [ax, ay] = self.along;
        let (x, y, w) = (dx * ax + dy * ay, dy * ax - dx * ay, p.w);
        self.n += w;
        self.x += w * x;
        self.y += w * y;
        self.xx += w * x * x;
        self.xy += w * x * y;
        self.yy += w * y * y;
    }
    /// Returns Σ w d² about the best straight line. The slope is small, so that distances along y are also those across
    /// the line.
    fn cost(&self) -> T {
        let n = self.n.max(T::from_f64(1e-20));
        let xx = self.xx - self.x * self.x / n;
        let xy = self.xy - self.x * self.y / n;
        let yy = self.yy - self.y * self.y / n;
        let slope = xy / xx.max(T::from_f64(1e-6));
        ((yy - xy * slope) / (T::one() + slope * slope)).max(T::ZERO)
    }
}

/// Returns the weighted RMS distance of the points from the best polyline of up to four pieces, in pixels. The result
/// is at most `worst_px`.
pub(super) fn rms<T: Real>(shape: &Shape<T>, worst_px: T) -> T {
    let places = PLACES.min(shape.len() / 4).max(1);
    let start = |place: usize| place * shape.len() / places;
    let weight = shape.iter().fold(T::ZERO, |sum, p| sum + p.w).max(T::from_f64(1e-20));
    let most = worst_px * worst_px * weight;
    // Least cost of the points before each place, by the largest number of pieces.
    let mut best = [[most; PLACES + 1]; PIECES + 1];
    for row in &mut best {
        row[0] = T::ZERO;
    }
    for from in 0..places {
        let Some(rest) = shape.get(start(from)..) else { break };
        let (Some(first), Some(next)) = (rest.first(), rest.get(start(from + 1) - start(from))) else {
            // The last stretch ends at the last point.
            let (Some(first), Some(last)) = (rest.first(), rest.last()) else { break };
            let mut line = Line::new(first.at, last.at);
            rest.iter().for_each(|p| line.add(p));
            relax(&mut best, from, from + 1, line.cost());
            break;
        };
        let mut line = Line::new(first.at, next.at);
        let mut added = 0;
        for to in from + 1..=places {
            let upto = start(to) - start(from);
            rest.iter().take(upto).skip(added).for_each(|p| line.add(p));
            added = upto;
            let cost = line.cost();
            if !(cost < most) {
                break;
            }
            relax(&mut best, from, to, cost);
        }
    }
    let end = best.last().and_then(|row| row.get(places)).copied().unwrap_or(most);
    (end / weight).sqrt()
}

/// Number of parameters that a polyline has more than a cone: two for each piece and one for each joint, minus the
/// three of the cone.
pub(super) const PARAMETERS: f64 = (2 * PIECES + PIECES - 1 - 3) as f64;

/// Returns the weighted RMS distance of the points from the best straight line, in pixels.
pub(super) fn straight_rms<T: Real>(shape: &Shape<T>) -> T {
    let (Some(first), Some(last)) = (shape.first(), shape.last()) else { return T::ZERO };
    let mut line = Line::new(first.at, last.at);
    shape.iter().for_each(|p| line.add(p));
    (line.cost() / line.n.max(T::from_f64(1e-20))).sqrt()
}

/// Adds a piece of this cost from one place to another, for every number of pieces before it.
fn relax<T: Real>(best: &mut [[T; PLACES + 1]; PIECES + 1], from: usize, to: usize, cost: T) {
    let before: [Option<T>; PIECES] = core::array::from_fn(|k| best.get(k).and_then(|row| row.get(from)).copied());
    for (row, before) in best.iter_mut().skip(1).zip(before) {
        if let (Some(before), Some(cell)) = (before, row.get_mut(to)) {
            *cell = cell.min(before + cost);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::shape::MOST;
    use super::*;

    fn shape<T: Real>(at: impl Fn(f64) -> [f64; 2]) -> Shape<T> {
        let place = |i: usize| Place { at: at(i as f64 / (MOST - 1) as f64).map(T::from_f64), r: T::ZERO, w: T::one() };
        (0..MOST).map(place).collect()
    }

    /// Returns the point of a polyline at the share `t` of its length.
    fn along(corners: &[[f64; 2]], t: f64) -> [f64; 2] {
        let pieces = corners.len() - 1;
        let k = ((t * pieces as f64) as usize).min(pieces - 1);
        let f = t * pieces as f64 - k as f64;
        [0, 1].map(|i| corners[k][i] + f * (corners[k + 1][i] - corners[k][i]))
    }

    #[test]
    fn up_to_four_straight_pieces_fit_and_a_circle_does_not() {
        let corners = [[100.0, 300.0], [180.0, 120.0], [400.0, 60.0], [620.0, 150.0], [700.0, 340.0]];
        for pieces in 1..=4 {
            let found = rms::<f32>(&shape(|t| along(&corners[..=pieces], t)), 50.0);
            // Corners between the places increase the residual a little.
            assert!(found < 0.6, "{pieces}: {found}");
        }
        let circle = |t: f64| {
            let (s, c) = libm::sincos(t * 3.0);
            [400.0 + 300.0 * c, 400.0 - 300.0 * s]
        };
        let found = rms::<f32>(&shape(circle), 50.0);
        assert!(found > 3.0, "{found}");
        let (one, other) = (rms::<f32>(&shape(circle), 50.0), rms::<f64>(&shape(circle), 50.0));
        assert!((f64::from(one) - other).abs() < 0.01 * other, "{one} {other}");
    }

    #[test]
    fn a_residual_is_no_larger_than_asked_for() {
        let found = rms::<f32>(&shape(|t| [300.0 * t, if t > 0.3 && t < 0.35 { 100.0 } else { 0.0 }]), 2.0);
        assert!(found <= 2.0, "{found}");
    }
}
