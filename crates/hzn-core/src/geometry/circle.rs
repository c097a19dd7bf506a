//! A circle through points of a plane, in closed form (Barf 2014, (2.17) to (2.22); Kåsa 1976).
//!
//! The fit is a least-squares solution of x² + y² = 2 x_c x + 2 y_c y + (r² − x_c² − y_c²), which is linear in the
//! three unknowns. First the centre of the points is subtracted and the coordinates are divided by the spread. The sums
//! of x and y are then zero, and two equations remain. Without this step the closed form loses nearly all precision in
//! f32.
//!
//! The paper's closed form has one denominator for all three unknowns. For the unknown B, the paper prints this
//! denominator with Q, a sum of the right-hand side, in the place of P. The solution here has no denominator of that
//! kind.

use crate::base::linalg::invert_spd2;
use crate::base::real::Real;

/// A circle in the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Circle<T> {
    pub(crate) centre: [T; 2],
    pub(crate) radius: T,
}

impl<T: Real> Circle<T> {
    /// Fits a circle to the points. `None` with fewer than three points, or when they lie on a line.
    pub(crate) fn fit(points: impl Iterator<Item = [T; 2]> + Clone) -> Option<Self> {
        // The points come as an iterator that is run three times, because a list of them would need memory.
        let (mut n, mut x, mut y) = (T::ZERO, T::ZERO, T::ZERO);
        for p in points.clone() {
            n += T::one();
            x += p[0];
            y += p[1];
        }
        if n < T::from_f64(3.0) {
            return None;
        }
        let middle = [x / n, y / n];
        let mut spread = T::ZERO;
        for p in points.clone() {
            let (u, v) = (p[0] - middle[0], p[1] - middle[1]);
            spread += u * u + v * v;
        }
        let scale = (spread / n).sqrt();
        // Equal points have no spread, and the coordinates are divided by it.
        if !(scale > T::ZERO && scale.is_finite()) {
            return None;
        }
        let per = T::one() / scale;
        let (mut uu, mut uv, mut vv, mut u3, mut v3) = (T::ZERO, T::ZERO, T::ZERO, T::ZERO, T::ZERO);
        for p in points {
            let (u, v) = ((p[0] - middle[0]) * per, (p[1] - middle[1]) * per);
            let r2 = u * u + v * v;
            uu += u * u;
            uv += u * v;
            vv += v * v;
            u3 += u * r2;
            v3 += v * r2;
        }
        // For points on a line, the smaller spread is only rounding of the coordinates. The smaller spread is the
        // determinant over the trace, and the trace is n.
        let rounding = T::EPSILON * T::from_f64(16.0) * (T::one() + (middle[0].abs() + middle[1].abs()) * per);
        if !((uu * vv - uv * uv) / n > n * rounding * rounding) {
            return None;
        }
        let [a, b, d] = invert_spd2([uu, uv, vv])?;
        let half = T::from_f64(0.5);
        let (u, v) = ((a * u3 + b * v3) * half, (b * u3 + d * v3) * half);
        let radius = (u * u + v * v + (uu + vv) / n).sqrt() * scale;
        let centre = [middle[0] + u * scale, middle[1] + v * scale];
        (radius.is_finite() && centre.iter().all(|c| c.is_finite())).then_some(Self { centre, radius })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    /// Returns points on an arc of a circle, `from` to `to` in radians.
    fn arc(centre: [f64; 2], radius: f64, from: f64, to: f64, count: i32) -> Vec<[f64; 2]> {
        (0..count)
            .map(|i| {
                let (s, c) = libm::sincos(from + (to - from) * f64::from(i) / f64::from(count - 1));
                [centre[0] + radius * c, centre[1] + radius * s]
            })
            .collect()
    }

    proptest! {
        #[test]
        fn exact_arcs_are_found(x in -3000.0..3000.0f64, y in -3000.0..3000.0f64, r in 5.0..5000.0f64,
                                from in 0.0..6.0f64, span in 0.3..6.2f64) {
            let points = arc([x, y], r, from, from + span, 60);
            let found = Circle::fit(points.iter().copied()).unwrap();
            prop_assert!((found.radius - r).abs() < 1e-7 * r.max(x.abs()));
            let off = (found.centre[0] - x).abs() + (found.centre[1] - y).abs();
            prop_assert!(off < 1e-6 * r.max(x.abs()).max(y.abs()));
            // The fit also works in single precision, because the centre is subtracted first.
            let found = Circle::fit(points.iter().map(|p| [p[0] as f32, p[1] as f32])).unwrap();
            let limit = 0.02 * r + 0.05 * x.abs().max(y.abs()) / span;
            prop_assert!((f64::from(found.radius) - r).abs() < limit, "{}", found.radius);
        }
    }

    /// (2.20) to (2.22) with the sums K to U of the paper: the denominator of B has Q where P belongs.
    #[test]
    fn the_printed_denominator_gives_another_circle() {
        let points = arc([40.0, -30.0], 100.0, 0.3, 2.0, 50);
        let sum = |f: &dyn Fn(f64, f64) -> f64| points.iter().map(|p| f(p[0], p[1])).sum::<f64>();
        let (k, l, m, n) = (sum(&|x, _| x * x), sum(&|x, y| x * y), sum(&|x, _| x), points.len() as f64);
        let (o, p) = (sum(&|_, y| y), sum(&|_, y| y * y));
        let (q, r) = (sum(&|x, y| x * (x * x + y * y)), sum(&|x, y| y * (x * x + y * y)));
        let s = sum(&|x, y| x * x + y * y);
        let denominator = |p: f64| l * l * n - 2.0 * l * m * o + k * o * o + m * m * p - k * n * p;
        // Cramer's rule for y_c, which is the paper's B up to the sign, with the middle column replaced.
        let numerator = -(k * (r * n - s * o) - q * (l * n - o * m) + m * (l * s - r * m)) / 2.0;
        let ours = Circle::fit(points.iter().copied()).unwrap();
        assert!((ours.centre[1] + 30.0).abs() < 1e-9 && (numerator / denominator(p) + 30.0).abs() < 1e-6);
        assert!((numerator / denominator(q) + 30.0).abs() > 1.0);
    }

    #[test]
    fn what_is_no_circle_is_none() {
        let through = |points: &[[f64; 2]]| Circle::fit(points.iter().copied());
        assert!(through(&[]).is_none());
        assert!(through(&[[1.0, 2.0], [3.0, 4.0]]).is_none());
        assert!(through(&[[5.0, 5.0]; 20]).is_none());
        assert!(through(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [3.0, 3.0]]).is_none());
        assert!(through(&[[f64::NAN, 0.0], [1.0, 1.0], [2.0, 0.0]]).is_none());
    }
}
