//! Gate: the iris of a lens and the parts of a vehicle have straight edges.

use super::case::refuse_if;
use super::line::Line;
use super::shape::{Residuals, Shape};
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Refuses an edge whose points fit a few straight pieces better than the cone.
pub(super) fn refuse<T: Real>(residuals: &Residuals<'_, T>) -> Result<(), Verdict> {
    // The additional parameters of a polyline reduce its residual for any points. With too few points, the comparison
    // proves nothing.
    let (points, turns) = (T::from_i32(residuals.shape.len() as i32), T::from_f64(PARAMETERS));
    let left = points - T::from_f64(3.0) - turns;
    let prefers = |rms_px: T| residuals.prefer(rms_px * ((left + turns) / left).sqrt(), turns);
    // The bound costs a tenth of the best polyline, and is enough for most limbs.
    let is_polyline = residuals.allow_rival()
        && left > T::ZERO
        && prefers(residuals.rms_px.min(least_rms(residuals.shape) * T::from_f64(1.0 - ROUNDING)))
        && prefers(rms(residuals.shape, residuals.rms_px));
    refuse_if(is_polyline, Verdict::Polyline)
}

/// Allowance for the rounding of two sums of the same points, as a part.
const ROUNDING: f64 = 1e-3;
/// Number of equal parts of the shape for [`least_rms`]. At least three of them contain no end of a piece.
const PARTS: usize = 2 * (PIECES - 1);

/// Returns a lower bound of [`rms`] for any polyline: three ends of pieces lie in at most three parts of the shape, and
/// each of the other parts fits its own best line at least as well as the polyline.
fn least_rms<T: Real>(shape: &Shape<T>) -> T {
    let mut costs = [T::ZERO; PARTS];
    let (mut whole, mut weight) = (T::ZERO, T::ZERO);
    for (part, cost) in costs.iter_mut().enumerate() {
        let [from, to] = [part, part + 1].map(|k| k * shape.len() / PARTS);
        let Some(points) = shape.get(from..to) else { return T::ZERO };
        let (Some(first), Some(last)) = (points.first(), points.last()) else { return T::ZERO };
        let mut line = Line::new(first.at, last.at);
        for p in points {
            line.add(p);
            weight += p.w;
        }
        *cost = line.cost();
        whole += *cost;
    }
    for _ in 1..PIECES {
        let mut most = T::ZERO;
        costs.iter().for_each(|c| most = most.max(*c));
        let Some(largest) = costs.iter_mut().find(|c| **c >= most) else { break };
        whole -= *largest;
        *largest = T::ZERO;
    }
    (whole.max(T::ZERO) / weight.max(T::from_f64(1e-20))).sqrt()
}

/// Largest number of straight pieces. A polygon of many corners touches a cone only near a few of its sides.
const PIECES: usize = 4;
/// Number of places where a piece may end, in addition to the end of the shape.
const PLACES: usize = 40;

/// Returns the weighted RMS distance of the points from the best polyline of up to four pieces, in pixels. The result
/// is at most `worst_px`.
fn rms<T: Real>(shape: &Shape<T>, worst_px: T) -> T {
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
const PARAMETERS: f64 = (2 * PIECES + PIECES - 1 - 3) as f64;

/// Adds a piece of this cost from one place to another, for every number of pieces before it.
// Not inlined: there are two calls, and the loop is unrolled.
#[inline(never)]
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
    use super::super::shape::{MOST, Place};
    use super::*;

    fn shape<T: Real>(at: impl Fn(f64) -> [f64; 2]) -> Shape<T> {
        let place = |i: usize| Place {
            at: at(i as f64 / (MOST - 1) as f64).map(T::from_f64),
            r: T::ZERO,
            w: T::one(),
            number: 0,
        };
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
    fn the_bound_is_below_the_best_polyline() {
        let wave = |t: f64| [400.0 * t, 20.0 * libm::sin(9.0 * t) + 3.0 * libm::sin(61.0 * t)];
        let corners = [[100.0, 300.0], [180.0, 120.0], [400.0, 60.0], [620.0, 150.0], [700.0, 340.0]];
        let circle = |t: f64| {
            let (s, c) = libm::sincos(t * 3.0);
            [400.0 + 300.0 * c, 400.0 - 300.0 * s]
        };
        let shapes = [shape::<f32>(wave), shape(|t| along(&corners, t)), shape(circle), shape(|t| [300.0 * t, 0.0])];
        for shape in &shapes {
            let (least, best) = (least_rms(shape), rms(shape, 1e3));
            assert!(least <= best * 1.001 + 1e-3, "{least} {best}");
        }
        // A bound that is always zero would save nothing.
        assert!(least_rms(&shapes[2]) > 0.25 * rms(&shapes[2], 1e3));
    }

    #[test]
    fn a_residual_is_no_larger_than_asked_for() {
        let found = rms::<f32>(&shape(|t| [300.0 * t, if t > 0.3 && t < 0.35 { 100.0 } else { 0.0 }]), 2.0);
        assert!(found <= 2.0, "{found}");
    }
}
