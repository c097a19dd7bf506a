//! Normal equations: the sums of one pass over the points, and the steps that follow from them.

use super::config::{Config, HalfAngle};
use crate::base::linalg::{M3, V3, invert_spd2, invert_spd3};
use crate::base::real::Real;
use crate::geometry::block::{Block, HALF_LANES, LANES, LEAST_GRADIENT2, sum};
use crate::geometry::cone::Azimuth;
use crate::model::body::Expected;
use crate::model::edge_noise;

/// The expected half-angle as a row of the normal equations.
pub(super) struct HalfAngleRow<'a, T> {
    expected: &'a Expected<T>,
    /// Weight for a half-angle of unit variance, and for the expected variance.
    unit: T,
    weight: T,
}

impl<'a, T: Real> HalfAngleRow<'a, T> {
    /// Weighs the row by the number of independent errors of the edge: one error per two correlation lengths.
    pub(super) fn new(
        blocks: &[Block<T>],
        expected: &'a Expected<T>,
        config: &Config,
        noise: &edge_noise::Config,
    ) -> Option<Self> {
        if expected.free || config.half_angle == HalfAngle::Free {
            return None;
        }
        let (mut points, mut arc) = (T::ZERO, T::ZERO);
        for block in blocks {
            points += sum(&block.weight);
            arc += sum(&block.step_px);
        }
        let correlation = T::from_f64(2.0 * noise.correlation_px);
        let each =
            if correlation > T::ZERO { (points * correlation / arc.max(correlation)).max(T::one()) } else { T::one() };
        let sigma = T::from_f64(noise.sigma_px);
        // An expected half-angle without any sigma would have an infinite weight.
        let floor = expected.sin * T::from_f64(1e-6);
        let sigma_c = expected.sigma_cos.max(floor);
        let unit = sigma * sigma * each;
        Some(Self { expected, unit, weight: unit / (sigma_c * sigma_c) })
    }

    /// Returns the weight of the row and the difference of the expected cos α from `c`. A curved prior is made linear
    /// there.
    fn at(&self, c: T) -> (T, T) {
        if self.expected.is_curved {
            let (difference, weight) = self.expected.linear_near(c);
            return (self.unit * weight, difference);
        }
        (self.weight, self.expected.cos - c)
    }
}

/// Sums of one pass over the points.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sums<T> {
    /// Upper triangle of Σ w h hᵀ.
    pub(crate) n: [T; 6],
    pub(super) g: [T; 3],
    /// Σ of the robust weights. `cost` is Σ of the squared distances multiplied by these weights, px².
    pub(crate) weight: T,
    pub(crate) cost: T,
    /// Number of points beyond Tukey's cut-off, but within three times the cut-off. Only the last pass counts them.
    pub(super) nearby: T,
}

impl<T: Real> Sums<T> {
    /// Returns the reduction of the cost by a step, to the second order.
    pub(super) fn gain(&self, mean: [T; 2], ([d1, d2], dc): ([T; 2], T)) -> T {
        let [g1, g2, g3] = self.g;
        g1 * d1 + g2 * d2 + g3 * (dc - mean[0] * d1 - mean[1] * d2)
    }

    /// Returns the step (δ₁₂, δc) with a free half-angle, or with its prior.
    pub(super) fn step(&self, mean: [T; 2], prior: Option<&HalfAngleRow<'_, T>>, c: T) -> Option<([T; 2], T)> {
        let [mut n11, mut n12, mut n13, mut n22, mut n23, mut n33] = self.n;
        let [mut g1, mut g2, mut g3] = self.g;
        if let Some(p) = prior {
            // The prior adds the row [m, 1] for (δ₁₂, δc'), with the value c₀ − c.
            let ((w, v), [m1, m2]) = (p.at(c), mean);
            n11 += w * m1 * m1;
            n12 += w * m1 * m2;
            n13 += w * m1;
            n22 += w * m2 * m2;
            n23 += w * m2;
            n33 += w;
            g1 += w * m1 * v;
            g2 += w * m2 * v;
            g3 += w * v;
        }
        let p = invert_spd3(&[n11, n12, n13, n22, n23, n33])?;
        let d = p * V3::new(g1, g2, g3);
        Some(([d.x, d.y], d.z + mean[0] * d.x + mean[1] * d.y))
    }

    /// Returns the step with a fixed half-angle: δc = 0, and therefore δc' = −m·δ₁₂.
    pub(super) fn step_known(&self, mean: [T; 2]) -> Option<([T; 2], T)> {
        let [a, b, d] = invert_spd2(self.normal_fixed(mean))?;
        let [g1, g2, g3] = self.g;
        let (g1, g2) = (g1 - mean[0] * g3, g2 - mean[1] * g3);
        Some(([a * g1 + b * g2, b * g1 + d * g2], T::ZERO))
    }

    /// Returns the upper triangle of Σ w (Bᵀs)(Bᵀs)ᵀ.
    pub(crate) fn normal_fixed(&self, [m1, m2]: [T; 2]) -> [T; 3] {
        let [n11, n12, n13, n22, n23, n33] = self.n;
        // h₁₂ + m times (h₃ = −1): Bᵀs = h₁₂ − m h₃.
        [
            n11 - m1 * n13 - m1 * n13 + m1 * m1 * n33,
            n12 - m1 * n23 - m2 * n13 + m1 * m2 * n33,
            n22 - m2 * n23 - m2 * n23 + m2 * m2 * n33,
        ]
    }

    /// Returns the weighted RMS of |g|: the change of cos α if every point moves by one pixel across the limb, in 1/px.
    pub(crate) fn cos_per_px(&self) -> T {
        (self.weight / self.n[5].max(T::from_f64(1e-20))).sqrt()
    }

    /// Replaces the normal equations by those of a part of the points.
    pub(crate) fn with_normal(&self, n: [T; 6]) -> Self {
        Self { n, ..*self }
    }

    /// Returns the means of Bᵀs, from the sums about the old means.
    pub(crate) fn means(&self, [m1, m2]: [T; 2]) -> [T; 2] {
        let w = self.n[5].max(T::from_f64(1e-20));
        [m1 - self.n[2] / w, m2 - self.n[4] / w]
    }
}

/// Returns the means of Bᵀs over all points with a weight.
pub(crate) fn means<T: Real>(blocks: &[Block<T>], b1: &V3<T>, b2: &V3<T>) -> [T; 2] {
    let (mut n, mut x, mut y) = ([T::ZERO; LANES], [T::ZERO; LANES], [T::ZERO; LANES]);
    for b in blocks {
        for l in 0..LANES {
            let w = b.weight[l];
            n[l] += w;
            x[l] += w * (b.s[0][l] * b1.x + b.s[1][l] * b1.y + b.s[2][l] * b1.z);
            y[l] += w * (b.s[0][l] * b2.x + b.s[1][l] * b2.y + b.s[2][l] * b2.z);
        }
    }
    let n = sum(&n).max(T::one());
    [sum(&x) / n, sum(&y) / n]
}

/// Weights of the points in a pass, in addition to 1/|g|².
pub(crate) enum Weights<T> {
    /// The weights that the points have.
    Kept,
    /// Tukey's weights. Only every `every`-th block is used, and represents the others.
    Tukey { cutoff2: T, every: usize },
    /// Tukey's weights, which are also stored in the points.
    Last { cutoff2: T },
}

/// Does one pass over the points: sums at (e, k), about `mean`.
pub(crate) fn pass<T: Real>(
    blocks: &mut [Block<T>],
    e: &V3<T>,
    b1: &V3<T>,
    b2: &V3<T>,
    k: T,
    mean: [T; 2],
    weights: &Weights<T>,
    azimuth: Option<&Azimuth<T>>,
) -> Sums<T> {
    let (inverse, every, last) = match *weights {
        Weights::Kept => (T::ZERO, 1, false),
        Weights::Tukey { cutoff2, every } => (T::one() / cutoff2, every, false),
        Weights::Last { cutoff2 } => (T::one() / cutoff2, 1, true),
    };
    // Eleven sums of four lanes stay in registers; with eight lanes each would be written to memory in the loop.
    let mut totals = [[T::ZERO; HALF_LANES]; 11];
    let mut nearby = [T::ZERO; LANES];
    let half = T::from_f64(0.5);
    let east_along = azimuth.map_or(T::ZERO, |a| a.east.dot(e));
    for b in blocks.iter_mut().step_by(every.max(1)) {
        let grad = b.gradient(e);
        let mut target = [-k; LANES];
        if let Some(a) = azimuth {
            for l in 0..LANES {
                let s = [b.s[0][l], b.s[1][l], b.s[2][l]];
                let d = s[0] * e.x + s[1] * e.y + s[2] * e.z;
                target[l] += a.offset(s, d, east_along);
            }
        }
        let [mut robust, mut parts] = [[T::ZERO; LANES]; 2];
        for l in 0..HALF_LANES {
            let mut terms = |l: usize| {
                // The difference from the axis is small for a small disc and keeps its digits; the cosine would lose
                // them.
                let (x, y, z) = (b.s[0][l] - e.x, b.s[1][l] - e.y, b.s[2][l] - e.z);
                let r = target[l] + (x * x + y * y + z * z) * half;
                let g2 = (grad[0][l] * grad[0][l] + grad[1][l] * grad[1][l]).max(T::from_f64(LEAST_GRADIENT2));
                let per = T::one() / g2;
                let d2 = r * r * per;
                parts[l] = d2 * inverse;
                // `max` in place of a branch: a point beyond the cut-off gets weight 0, and the lanes stay together.
                let u = (T::one() - parts[l]).max(T::ZERO);
                robust[l] = b.weight[l] * u * u;
                // The weights leave out the correlation of neighbours. Whitening was tried: it gains 9 to 11 % with a
                // known half-angle, but with a free one it is biased by 0.07° and more, because it differentiates the
                // edge.
                let w = robust[l] * per;
                let h1 = x * b1.x + y * b1.y + z * b1.z - mean[0];
                let h2 = x * b2.x + y * b2.y + z * b2.z - mean[1];
                let (w1, w2) = (w * h1, w * h2);
                [w1 * h1, w1 * h2, w1, w2 * h2, w2, w, w1 * r, w2 * r, w * r, robust[l], robust[l] * d2]
            };
            let (one, other) = (terms(l), terms(l + HALF_LANES));
            for (total, (a, b)) in totals.iter_mut().zip(one.iter().zip(&other)) {
                total[l] += *a + *b;
            }
        }
        if last {
            for l in 0..LANES {
                let beside = parts[l] > T::one() && parts[l] <= T::from_f64(9.0);
                nearby[l] += if beside { b.weight[l] } else { T::ZERO };
            }
            b.weight = robust;
        }
    }
    // The sums of a part are multiplied up, so that the expected half-angle keeps its weight against them.
    let times = T::from_i32(every as i32);
    let [n11, n12, n13, n22, n23, n33, g1, g2, g3, weight, cost] =
        totals.map(|[a, b, c, d]| ((a + b) + (c + d)) * times);
    Sums { n: [n11, n12, -n13, n22, -n23, n33], g: [g1, g2, -g3], weight, cost, nearby: sum(&nearby) * times }
}

/// Returns the inverse of the normal equations for a free half-angle, about `mean`.
pub(crate) fn inverse<T: Real>(sums: &Sums<T>) -> Option<M3<T>> {
    invert_spd3(&sums.n)
}
