//! Gate: a lens flare is a circle in the image, but a limb is a circle only on the sphere.

use super::case::{Case, refuse_if};
use super::residuals::{FULL_RADIUS_PX, radius_px};
use super::shape::{Place, Residuals, Shape};
use crate::base::linalg::{V3, invert_spd3};
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Refuses an edge whose points fit a circle of the image better than the cone. `floor_px` is the floor of the noise.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>, residuals: &Residuals<'_, T>, floor_px: T) -> Result<(), Verdict> {
    // Cone and circle have the same number of parameters.
    let is_circle = || rms(residuals.shape).is_some_and(|rival_px| residuals.prefer(rival_px, T::ZERO));
    refuse_if(residuals.allow_rival() && is_told(case, residuals, floor_px) && is_circle(), Verdict::Circle)
}

/// Returns whether the edge is large enough to be told from a circle.
///
/// A small disc is an ellipse that differs little from a circle: by R θ²/4 pixels at an angle θ off the axis. Blur that
/// is not round, which every lens has away from its axis, makes a circle an ellipse as well, and an ellipse a circle.
/// Below the floor of the residuals, the outline of a small disc therefore says nothing.
fn is_told<T: Real>(case: &Case<'_, T>, residuals: &Residuals<'_, T>, floor_px: T) -> bool {
    !(radius_px(case) < T::from_f64(FULL_RADIUS_PX)) || residuals.exceed(floor_px)
}

/// Number of Gauss-Newton steps. Two are enough from a circle through three of the points.
const STEPS: usize = 2;

/// A circle through `at` with the unit normal `n` towards its centre and the curvature `kappa`; 0 is a straight line.
struct Circle<T> {
    at: [T; 2],
    n: [T; 2],
    kappa: T,
}

impl<T: Real> Circle<T> {
    /// Makes the circle through three points, relative to the first.
    fn through(p: [T; 2], a: [T; 2], b: [T; 2]) -> Option<Self> {
        let (a, b) = ([a[0] - p[0], a[1] - p[1]], [b[0] - p[0], b[1] - p[1]]);
        let (aa, bb) = (a[0] * a[0] + a[1] * a[1], b[0] * b[0] + b[1] * b[1]);
        // 2 n·q = κ |q|² holds for both points, so n is perpendicular to |b|² a − |a|² b.
        let along = [bb * a[0] - aa * b[0], bb * a[1] - aa * b[1]];
        let length = (along[0] * along[0] + along[1] * along[1]).sqrt();
        if !(length > T::from_f64(1e-20)) {
            return None;
        }
        let n = [-along[1] / length, along[0] / length];
        let kappa = (n[0] * (a[0] + b[0]) + n[1] * (a[1] + b[1])) * T::from_f64(2.0) / (aa + bb);
        Some(Self { at: p, n, kappa })
    }

    /// Returns the signed distance of a point and its position relative to `at`. The distance is
    /// (2 n·q − κ|q|²)/(1 + √(1 − 2κ n·q + κ²|q|²)), which is valid for a straight line, too.
    fn distance(&self, p: [T; 2]) -> (T, T, T, T) {
        let q = [p[0] - self.at[0], p[1] - self.at[1]];
        let (along, q2) = (self.n[0] * q[0] + self.n[1] * q[1], q[0] * q[0] + q[1] * q[1]);
        let one = T::one();
        let root = (one - (along + along) * self.kappa + self.kappa * self.kappa * q2).max(T::ZERO).sqrt();
        let d = (along + along - self.kappa * q2) / (one + root);
        (d, along, self.n[0] * q[1] - self.n[1] * q[0], q2)
    }

    /// Does one Gauss-Newton step.
    fn step(&mut self, points: impl Iterator<Item = ([T; 2], T)>) -> Option<()> {
        let (mut n, mut g) = ([T::ZERO; 6], [T::ZERO; 3]);
        for (p, w) in points {
            let (d, along, across, q2) = self.distance(p);
            // Derivatives of d by a shift along n, a rotation, and the curvature.
            let h = [self.kappa * along - T::one(), across, q2 * T::from_f64(-0.5)];
            let mut k = 0;
            for i in 0..3 {
                g[i] += w * h[i] * d;
                for j in i..3 {
                    n[k] += w * h[i] * h[j];
                    k += 1;
                }
            }
        }
        let step = invert_spd3(&n)? * V3::new(-g[0], -g[1], -g[2]);
        let [nx, ny] = self.n;
        self.at = [self.at[0] + nx * step.x, self.at[1] + ny * step.x];
        let turned = [nx - ny * step.y, ny + nx * step.y];
        let length = (turned[0] * turned[0] + turned[1] * turned[1]).sqrt();
        self.n = [turned[0] / length, turned[1] / length];
        self.kappa += step.z;
        Some(())
    }
}

/// Returns the weighted RMS distance of the points from the best circle, in pixels; `None` if no circle fits.
fn rms<T: Real>(shape: &Shape<T>) -> Option<T> {
    let count = shape.len();
    let at = |i: usize| shape.get(i).map(|p: &Place<T>| p.at);
    let (first, middle, last) = (at(count / 6)?, at(count / 2)?, at(count - 1 - count / 6)?);
    // Lengths are relative to the middle, and in units of the distance between the ends. This keeps the precision of
    // `f32`.
    let (dx, dy) = (last[0] - first[0], last[1] - first[1]);
    let (ex, ey) = (first[0] - middle[0], first[1] - middle[1]);
    let unit = (dx * dx + dy * dy + ex * ex + ey * ey).sqrt();
    if !(unit > T::one()) {
        return None;
    }
    let scaled = |p: [T; 2]| [(p[0] - middle[0]) / unit, (p[1] - middle[1]) / unit];
    let mut circle = Circle::through([T::ZERO; 2], scaled(first), scaled(last))?;
    for _ in 0..STEPS {
        circle.step(shape.iter().map(|p| (scaled(p.at), p.w)))?;
    }
    let (mut cost, mut weight) = (T::ZERO, T::ZERO);
    for p in shape {
        let (d, ..) = circle.distance(scaled(p.at));
        cost += p.w * d * d;
        weight += p.w;
    }
    let rms = (cost / weight.max(T::from_f64(1e-20))).sqrt() * unit;
    rms.is_finite().then_some(rms)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn shape<T: Real>(points: impl Iterator<Item = [f64; 2]>) -> Shape<T> {
        let place = |p: [f64; 2]| Place { at: p.map(T::from_f64), r: T::ZERO, w: T::one(), number: 0 };
        points.map(place).collect()
    }

    proptest! {
        /// Points of a circle of any size and place fit a circle in both precisions; so do points of a nearly straight
        /// line.
        #[test]
        fn circles_fit_circles(x in -500.0..2500.0f64, y in -500.0..2500.0f64, radius in 20.0..30_000.0f64,
                               from in 0.0..6.2f64, extent in 60.0..900.0f64) {
            let turn = (extent / radius).min(6.2) / 127.0;
            let at = |i: usize| {
                let (s, c) = libm::sincos(from + turn * i as f64);
                // The arc stays near (x, y), even if the circle is large.
                let (s0, c0) = libm::sincos(from);
                [x + radius * (c - c0), y + radius * (s - s0)]
            };
            prop_assert!(rms::<f64>(&shape((0..MOST).map(at))).unwrap() < 1e-6);
            prop_assert!(rms::<f32>(&shape((0..MOST).map(at))).unwrap() < 0.01);
        }
    }

    const MOST: usize = super::super::shape::MOST;

    /// An ellipse of ten to nine is no circle: its RMS has about the size of the difference.
    #[test]
    fn an_ellipse_is_no_circle() {
        let at = |i: usize| {
            let (s, c) = libm::sincos(i as f64 / 20.0);
            [500.0 + 100.0 * c, 400.0 + 90.0 * s]
        };
        let found = rms::<f32>(&shape((0..MOST).map(at))).unwrap();
        assert!((2.0..5.0).contains(&found), "{found}");
        assert!(rms::<f32>(&shape((0..2).map(at))).is_none());
    }
    /// Waves of three periods about a circle are not absorbed by any circle: their RMS is that of the waves. Waves of
    /// one period are another centre, and a constant is another radius.
    #[test]
    fn waves_about_a_circle_are_its_residuals() {
        let waves = |turn: f64, waves_px: [f64; 4]| {
            let at = |i: usize| {
                let angle = turn * i as f64 / MOST as f64 + 0.4;
                let off = (0..4).map(|k| waves_px[k] * libm::cos(k as f64 * angle)).sum::<f64>();
                let (s, c) = libm::sincos(angle);
                [700.0 + (250.0 + off) * c, 300.0 + (250.0 + off) * s]
            };
            rms::<f64>(&shape((0..MOST).map(at))).unwrap()
        };
        let whole = core::f64::consts::TAU;
        assert!((waves(whole, [0.0, 0.0, 0.0, 0.5]) - 0.5 * core::f64::consts::FRAC_1_SQRT_2).abs() < 1e-3);
        assert!((waves(whole, [3.0, 2.0, 0.0, 0.5]) - 0.5 * core::f64::consts::FRAC_1_SQRT_2).abs() < 0.02);
        // The digits of the best circle of an arc, after two steps from one through three of its points.
        for (turn, want) in [(whole, 2.063_064_334_975_713), (2.0, 0.892_740_617_053_6), (0.9, 0.055_206_010_823_270_5)]
        {
            let found = waves(turn, [1.0, 2.0, -1.5, 2.5]);
            assert!((found / want - 1.0).abs() < 1e-11, "{turn}: {found}");
        }
    }

    #[test]
    fn the_weights_of_the_points_count() {
        let at = |i: usize| {
            let (s, c) = libm::sincos(i as f64 / 30.0);
            [100.0 * c, 100.0 * s + if i % 8 == 3 { 6.0 } else { 0.0 }]
        };
        let mut points = shape::<f64>((0..MOST).map(at));
        let all = rms(&points).unwrap();
        points.iter_mut().filter(|p| p.number == 0).enumerate().for_each(|(i, p)| {
            if i % 8 == 3 {
                p.w = 0.0;
            }
        });
        assert!(all > 1.0 && rms(&points).unwrap() < 1e-9);
    }
}
