//! A part of the points of an edge, evenly along it.
//!
//! Errors that vary slowly along the limb are summed over this part instead of all points. The part has its own normal
//! equations; a signal that the cone can follow is then fitted completely.

use crate::base::linalg::{V3, basis};
use crate::base::real::Real;
use crate::geometry::block::{Block, LEAST_GRADIENT2, every_weighted};
use crate::stages::fit::Fit;

/// Largest number of points over which the signals are summed, evenly along the edge.
// Even so the signals cost half as much as the double sum over all points (23 and 44 thousand instructions of a clean
// picture in an earlier version), which is why there are no more.
const PART: usize = 64;

/// Returns the distance between the points of the part, counted in inliers.
pub(super) fn step<T: Real>(fit: &Fit<T>) -> usize {
    (fit.inliers as usize).div_ceil(PART).max(1)
}

/// A point of the part, as a row of the normal equations.
pub(super) struct Row<T> {
    /// The ray, and its components on the tangent basis.
    pub(super) s: V3<T>,
    pub(super) x: T,
    pub(super) y: T,
    /// Derivative of s·e by (u, v), and its square.
    pub(super) gradient: [T; 2],
    pub(super) g2: T,
    /// w h.
    pub(super) h: V3<T>,
    /// The first two components of h, and w.
    h12: [T; 2],
    w: T,
    /// Robust weight and number of the point.
    pub(super) weight: T,
    pub(super) place: usize,
}

impl<T: Real> Row<T> {
    /// Returns w h x for the shift of this point by one pixel across the limb.
    pub(super) fn shift(&self) -> V3<T> {
        self.h * self.g2.sqrt()
    }
    /// Returns the residual r = cos α − s·e, and its square in px² times the weight.
    pub(super) fn residual(&self, fit: &Fit<T>) -> (T, T) {
        // 1 − s·e = |s − e|²/2 keeps the digits of a small disc.
        let d = self.s - fit.e;
        let r = d.dot(&d) * T::from_f64(0.5) - fit.k;
        (r, self.w * r * r)
    }
    /// Returns the weight w of the normal equations.
    pub(super) fn w(&self) -> T {
        self.w
    }
    /// Returns how many pixels across the limb one pixel along the axis of its profile is.
    pub(super) fn across_by_axis(&self) -> T {
        let [gu, gv] = self.gradient;
        gu.abs().max(gv.abs()) / self.g2.sqrt()
    }
    /// Returns whether the Sun in the direction `sun` is above the horizon of the point.
    pub(super) fn is_in_sunlight(&self, sun: &V3<T>, fit: &Fit<T>) -> bool {
        // The surface normal is (s cos α − e)/sin α.
        self.s.dot(sun) * fit.c > fit.e.dot(sun)
    }
    /// Returns cos φ and sin φ of the azimuth φ about the axis.
    pub(super) fn azimuth(&self) -> [T; 2] {
        let per = T::one() / (self.x * self.x + self.y * self.y).max(T::from_f64(1e-20)).sqrt();
        [self.x * per, self.y * per]
    }
    /// Returns w h.
    pub(super) fn h(&self) -> V3<T> {
        self.h
    }
    /// Returns cos 2φ and sin 2φ of the azimuth φ about the axis.
    pub(super) fn second_harmonic(&self) -> [T; 2] {
        let (x2, y2) = (self.x * self.x, self.y * self.y);
        let rho2 = (x2 + y2).max(T::from_f64(1e-20));
        [(x2 - y2) / rho2, (self.x + self.x) * self.y / rho2]
    }
    /// Adds w h hᵀ to the upper triangle of the normal matrix.
    pub(super) fn add_to(&self, normal: &mut [T; 6]) {
        let (Self { h, w, .. }, [h1, h2]) = (self, self.h12);
        let terms = [h.x * h1, h.x * h2, -h.x, h.y * h2, -h.y, *w];
        normal.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
    }
}

/// Returns the rows of a part of the points.
pub(super) fn part<'a, T: Real>(blocks: &'a [Block<T>], fit: &'a Fit<T>) -> impl Iterator<Item = Row<T>> + 'a {
    let (b1, b2) = basis(&fit.e);
    let [m1, m2] = fit.mean;
    every_weighted(blocks, step(fit)).map(move |(place, block, l)| {
        let s = block.ray(l);
        let [gu, gv] = block.gradient_at(l, &fit.e);
        let g2 = (gu * gu + gv * gv).max(T::from_f64(LEAST_GRADIENT2));
        let w = block.weight[l & 7] / g2;
        let (x, y) = (s.dot(&b1), s.dot(&b2));
        let (h1, h2) = (x - m1, y - m2);
        let h = V3::new(h1, h2, -T::one()) * w;
        Row { s, x, y, gradient: [gu, gv], g2, h, h12: [h1, h2], w, weight: block.weight[l & 7], place }
    })
}

/// Sums Σ w h g iⁿ over a part of the points for n = 0, 1 and 2, with the number i of the point: from them follows the
/// sum for each signal g y that is a parabola y(i) along the edge.
pub(super) struct ByNumber<T>(pub(super) [V3<T>; 3]);

impl<T: Real> ByNumber<T> {
    /// Returns Σ w h g.
    pub(super) fn shift(&self) -> &V3<T> {
        let [shift, _, _] = &self.0;
        shift
    }

    /// Returns Σ w h g y for the parabola y(i) through three values.
    pub(super) fn of_curve(&self, [i0, i1, i2]: [T; 3], [y0, y1, y2]: [T; 3]) -> V3<T> {
        let per = |from: T, to: T| (to - from).max(T::one());
        let (first, second) = ((y1 - y0) / per(i0, i1), (y2 - y1) / per(i1, i2));
        let curve = (second - first) / per(i0, i2);
        // y = y₀ + first (i − i₀) + curve (i − i₀)(i − i₁)
        let constant = y0 - first * i0 + curve * i0 * i1;
        let slope = first - curve * (i0 + i1);
        let [shift, by_number, by_square] = &self.0;
        shift * constant + by_number * slope + by_square * curve
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parabola_goes_through_its_values() {
        let points = [0.0, 1.0, 2.0, 5.0, 9.0_f64];
        let y = |i: f64| 0.3 - 0.2 * i + 0.07 * i * i;
        let sum = |f: &dyn Fn(f64) -> f64| points.iter().map(|i| V3::new(1.0, *i, 2.0) * f(*i)).sum::<V3<f64>>();
        let sums = ByNumber([sum(&|_| 1.0), sum(&|i| i), sum(&|i| i * i)]);
        let found = sums.of_curve([1.0, 4.0, 8.5], [1.0, 4.0, 8.5].map(y));
        assert!((found - sum(&y)).norm() < 1e-12, "{found} {}", sum(&y));
    }
}
