//! A masked polygon.

use crate::base::parts::packed;
use crate::base::real::Real;

/// Maximum number of corners of one polygon.
// The capacity is fixed because there is no heap. Every corner also costs work at each test of an edge point next to
// it.
pub const MAX_CORNERS: usize = 16;

/// The corners of a polygon and its bounding box, in pixels.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Outline<T> {
    // The bounding box is stored, because it decides most tests: an edge point next to no mask costs four comparisons.
    pub(super) low: [T; 2],
    pub(super) high: [T; 2],
    pub(super) corners: heapless::Vec<[T; 2], MAX_CORNERS>,
}

impl<T: Real> Outline<T> {
    /// Returns the cost to compare a point with all sides, in the unit of [`crate::model::work`].
    pub(super) fn cost(&self) -> u32 {
        1 + self.corners.len() as u32 / 4
    }
    /// Returns whether the bounding box meets the square of `margin` pixels to each side of a point.
    #[inline(always)]
    pub(super) fn is_near(&self, p: [T; 2], margin: T) -> bool {
        (0..2).all(|k| !(p[k] + margin < self.low[k] || p[k] - margin > self.high[k]))
    }
    /// Returns whether the polygon lies outside the square of `margin` pixels to each side of the pixel. The cost of a
    /// test of all sides is added to `cost`.
    pub(super) fn clear(&self, x: u16, y: u16, margin: T, cost: &mut u32) -> bool {
        let p = [T::from_i32(i32::from(x)), T::from_i32(i32::from(y))];
        if !self.is_near(p, margin) {
            return true;
        }
        // Each side is compared with the square, and then with its centre.
        *cost += 2 * self.cost();
        self.clear_within(p, margin)
    }
    /// Does the same as [`Self::clear`] when the bounding box does not decide. The result is true if no side of the
    /// polygon crosses the square and the centre of the square is outside the polygon.
    #[inline(never)]
    fn clear_within(&self, p: [T; 2], margin: T) -> bool {
        let Some(&last) = self.corners.last() else { return true };
        let mut a = last;
        for &b in &self.corners {
            let apart = (0..2).any(|k| {
                let (low, high) = (a[k].min(b[k]), a[k].max(b[k]));
                p[k] + margin < low || p[k] - margin > high
            });
            let d = [b[0] - a[0], b[1] - a[1]];
            let off = (d[0] * (p[1] - a[1]) - d[1] * (p[0] - a[0])).abs();
            // The limit is half a pixel larger, for rounding.
            if !apart && !(off > (d[0].abs() + d[1].abs()) * (margin + T::from_f64(0.5))) {
                return false;
            }
            a = b;
        }
        // A square without a side in it may still lie in the middle of the polygon.
        !self.covers(p)
    }
    /// Returns whether the polygon covers a point, by the even-odd rule.
    pub(super) fn covers(&self, [x, y]: [T; 2]) -> bool {
        if x < self.low[0] || x > self.high[0] || y < self.low[1] || y > self.high[1] {
            return false;
        }
        let Some(&last) = self.corners.last() else { return false };
        let (mut inside, mut a) = (false, last);
        for &b in &self.corners {
            // The half-open comparison counts a corner for one of its two sides only; it also makes the divisor
            // nonzero.
            if (a[1] > y) != (b[1] > y) && x < (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]) + a[0] {
                inside = !inside;
            }
            a = b;
        }
        inside
    }
}

packed!(Outline<T> { low, high, corners });
