//! Covariance of the fit with correlated errors of neighbouring edge points, in one pass.
//!
//! Pixel errors in x and y are independent Gauss-Markov processes along the edge, with variance R and the correlation ρ
//! = exp(−Δs/L) from point to point. Let q = w h (the row in the normal equations) and b = q gᵀ. The covariance of the
//! fit is P = N⁻¹ (R X) N⁻¹, with X = Σ Σ b ρ… bᵀ over all pairs. The double sum reduces to a recursion: with c₁ = b₁
//! and c_{j+1} = ρ_j c_j + b_{j+1}, X = Σ (1 − ρ_j²) c_j c_jᵀ, where the last ρ is 0. With independent errors instead,
//! sigma would be about twenty times too small.
//!
//! R and L come from the configuration or from the residuals ([`Noise`]). Errors that all points of the edge share do
//! not appear in the residuals; each of them adds a term. Last, the expected half-angle is fused.

#[cfg(feature = "dlr")]
pub(crate) mod braun_barf;
mod common;
#[cfg(feature = "zju")]
mod elliptic;
mod noise;
#[cfg(feature = "reml")]
pub mod reml;

use crate::base::linalg::{M3, V3, basis, invert_spd2, unit};
use crate::base::real::Real;
use crate::geometry::block::{Block, HALF_LANES, LANES, exp_neg};
use crate::geometry::camera::Camera;
use crate::model::body::Expected;
use crate::stages::fit::{self, Fit};

pub use crate::model::edge_noise::{Config, Method, Noise};
pub use crate::model::error_budget::{ErrorBudget, Term};
pub(crate) use noise::measured_length_px;

/// The answer of a fit with its covariance.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fused<T> {
    /// Unit axis after fusing the expected half-angle, in the camera frame.
    pub(crate) e: V3<T>,
    /// cos of the half-angle after fusing.
    pub(crate) c: T,
    /// Covariance (11, 12, 22) on the tangent basis of `e`, rad².
    pub(crate) p: [T; 3],
    /// Variance of the freely fitted cos α; `None` when it was not fitted.
    pub(crate) var_free_cos: Option<T>,
    /// (ĉ − c₀)²/(P₃₃ + σ_c²): a χ² of one degree of freedom when the candidate is the body's limb.
    pub(crate) chi2: T,
    /// Errors of the edge points in this answer.
    pub(crate) edge: EdgeNoise<T>,
}

/// Errors of the edge points that a covariance includes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EdgeNoise<T> {
    /// Contribution to the variance of the freely fitted cos α; 0 if it was not fitted.
    pub(crate) var_cos: T,
    /// 1-sigma of an edge point in pixels. `length_px` is the correlation length, in pixels.
    pub(crate) sigma_px: T,
    pub(crate) length_px: T,
}

/// Computes the covariance of the fit from all sources of error, and then fuses the expected half-angle. The noise is
/// never below the values of the configuration. The contribution of each source is recorded in `budget`.
pub(crate) fn fuse<T: Real>(
    blocks: &[Block<T>],
    fit: &Fit<T>,
    expected: &Expected<T>,
    config: &Config,
    estimate: &fit::Config,
    camera: &Camera<T>,
    mut budget: Option<&mut ErrorBudget<T>>,
) -> Option<Fused<T>> {
    #[cfg(feature = "dlr")]
    if config.method == Method::BraunBarf {
        return braun_barf::fused(blocks, fit, config);
    }
    let noise = noise::EdgeNoiseModel::new(fit, config);
    #[cfg(feature = "zju")]
    if let Some(quadric) = &fit.quadric {
        let p = elliptic::covariance(blocks, quadric, noise.length_px) * noise.variance;
        return fused(fit, &p, noise.edge(p.m33), expected, estimate, budget);
    }
    let response = response(&fit.sums, fit.mean, fit.free)?;
    let mut p = sandwich(&response, &noise.correlated(blocks, fit, expected));
    let mut add = |term: Term, more: &M3<T>| {
        if let Some(budget) = budget.as_deref_mut() {
            budget.record(term, more);
        }
    };
    add(Term::EdgeNoise, &p);
    let edge = noise.edge(p.m33);
    common::add_terms(blocks, fit, expected, &noise, camera, |term, more| {
        p += more;
        add(term, more);
    })?;
    fused(fit, &p, edge, expected, estimate, budget)
}

/// Returns the linear map from Σ w h x, about the means, to the errors (δ₁₂, δc) that a signal x in the residuals
/// causes. It is T N⁻¹ with T = [[I, 0], [mᵀ, 1]]. With a fixed half-angle it is the inverse of the upper block, and δc
/// is 0.
pub(crate) fn response<T: Real>(sums: &fit::Sums<T>, [m1, m2]: [T; 2], free: bool) -> Option<M3<T>> {
    let (one, zero) = (T::one(), T::ZERO);
    if free {
        return Some(M3::new(one, zero, zero, zero, one, zero, m1, m2, one) * fit::inverse(sums)?);
    }
    let [a, b, d] = invert_spd2(sums.normal_fixed([m1, m2]))?;
    // The rows are Bᵀs = h₁₂ − m h₃.
    Some(M3::new(a, b, -(a * m1 + b * m2), b, d, -(b * m1 + d * m2), zero, zero, zero))
}

/// Returns the covariance of (δ₁₂, δc) from the upper triangle of the covariance of the right-hand side.
pub(crate) fn sandwich<T: Real>(response: &M3<T>, x: &[T; 6]) -> M3<T> {
    response * M3::new(x[0], x[1], x[2], x[1], x[3], x[4], x[2], x[4], x[5]) * response.transpose()
}

/// Fuses a fit and the covariance of its (δ₁₂, δc) with the expected half-angle, unless this half-angle is not to be
/// used.
fn fused<T: Real>(
    fit: &Fit<T>,
    p: &M3<T>,
    edge: EdgeNoise<T>,
    expected: &Expected<T>,
    estimate: &fit::Config,
    budget: Option<&mut ErrorBudget<T>>,
) -> Option<Fused<T>> {
    let (b1, b2) = basis(&fit.e);
    let var_c = expected.sigma_cos * expected.sigma_cos;
    let var_free = fit.free.then_some(p.m33);
    if !fit.free || estimate.half_angle == fit::HalfAngle::Free || expected.free {
        // If the half-angle is fixed at the expected one, its error causes a proportional error of the axis.
        let k = fixed_half_angle_gain(fit);
        let var_c = if estimate.half_angle == fit::HalfAngle::Known { T::ZERO } else { var_c };
        let (k, var_c) = k.filter(|_| !fit.free).map_or(([T::ZERO; 2], T::ZERO), |k| (k, var_c));
        if let Some(budget) = budget {
            budget.project(&b1, &b2, [T::ZERO; 2], k.map(|k| k * var_c.sqrt()), expected);
        }
        let p = [p.m11 + k[0] * k[0] * var_c, p.m12 + k[0] * k[1] * var_c, p.m22 + k[1] * k[1] * var_c];
        return Some(Fused { e: fit.e, c: fit.c, p, var_free_cos: var_free, chi2: T::ZERO, edge });
    }
    let total = p.m33 + var_c;
    let difference = expected.cos - fit.c;
    let k = V3::new(p.m13, p.m23, p.m33) * (T::one() / total);
    let e = unit(&(fit.e + b1 * (k.x * difference) + b2 * (k.y * difference)))?;
    if let Some(budget) = budget {
        budget.project(&b1, &b2, [k.x, k.y], [k.x * expected.sigma_cos, k.y * expected.sigma_cos], expected);
    }
    // The tangent basis at the fused axis differs only by a small rotation. The covariance is therefore transformed
    // through the camera frame without other changes.
    let fused = [p.m11 - k.x * p.m13, p.m12 - k.x * p.m23, p.m22 - k.y * p.m23];
    let (n1, n2) = basis(&e);
    let turn = |n: &V3<T>| [n.dot(&b1), n.dot(&b2)];
    let (r1, r2) = (turn(&n1), turn(&n2));
    let form =
        |a: [T; 2], b: [T; 2]| a[0] * (fused[0] * b[0] + fused[1] * b[1]) + a[1] * (fused[1] * b[0] + fused[2] * b[1]);
    Some(Fused {
        e,
        c: fit.c + k.z * difference,
        p: [form(r1, r1), form(r1, r2), form(r2, r2)],
        var_free_cos: var_free,
        chi2: difference * difference / total,
        edge,
    })
}

/// Returns the change of the axis for δc = 1 with a fixed half-angle: Σ w Bᵀs · 1 through the normal equations.
fn fixed_half_angle_gain<T: Real>(fit: &Fit<T>) -> Option<[T; 2]> {
    let (sums, mean) = (&fit.sums, fit.mean);
    let n = invert_spd2(sums.normal_fixed(mean))?;
    let (k1, k2) = (mean[0] * sums.n[5] - sums.n[2], mean[1] * sums.n[5] - sums.n[4]);
    Some([n[0] * k1 + n[1] * k2, n[1] * k1 + n[2] * k2])
}

/// Returns the upper triangle of Σ (1 − ρ²) c cᵀ about `mean`.
pub(crate) fn correlated<T: Real>(
    blocks: &[Block<T>],
    e: &V3<T>,
    b1: &V3<T>,
    b2: &V3<T>,
    mean: [T; 2],
    length_px: T,
) -> [T; 6] {
    let mut sums = [[T::ZERO; HALF_LANES]; 6];
    // c for the errors in u and for those in v.
    let mut c = [[T::ZERO; 3]; 2];
    let per_length = if length_px > T::ZERO { T::one() / length_px } else { T::ZERO };
    for block in blocks {
        let g = block.gradient(e);
        let mut q = [[T::ZERO; LANES]; 3];
        for l in 0..LANES {
            let (sx, sy, sz) = (block.s[0][l], block.s[1][l], block.s[2][l]);
            let w = block.weight[l] / (g[0][l] * g[0][l] + g[1][l] * g[1][l]).max(T::from_f64(1e-20));
            q[0][l] = w * (sx * b1.x + sy * b1.y + sz * b1.z - mean[0]);
            q[1][l] = w * (sx * b2.x + sy * b2.y + sz * b2.z - mean[1]);
            q[2][l] = -w;
        }
        let rho =
            if per_length > T::ZERO { exp_neg(&block.step_px.map(|step| step * per_length)) } else { [T::ZERO; LANES] };
        // Each step completes the term of the point before with 1 − ρ², then updates c. Only the update depends on the
        // lane before.
        let gap = rho.map(|r| T::one() - r * r);
        let mut before = [[[T::ZERO; LANES]; 3]; 2];
        for (before, (c, g)) in before.iter_mut().zip(c.iter_mut().zip(&g)) {
            for i in 0..3 {
                for l in 0..LANES {
                    before[i][l] = c[i];
                    c[i] = rho[l] * c[i] + q[i][l] * g[l];
                }
            }
        }
        let [[u1, u2, u3], [v1, v2, v3]] = &before;
        for l in 0..HALF_LANES {
            let terms = |l: usize| {
                let (g1, g2, g3) = (gap[l] * u1[l], gap[l] * u2[l], gap[l] * u3[l]);
                let (h1, h2, h3) = (gap[l] * v1[l], gap[l] * v2[l], gap[l] * v3[l]);
                [
                    g1 * u1[l] + h1 * v1[l],
                    g1 * u2[l] + h1 * v2[l],
                    g1 * u3[l] + h1 * v3[l],
                    g2 * u2[l] + h2 * v2[l],
                    g2 * u3[l] + h2 * v3[l],
                    g3 * u3[l] + h3 * v3[l],
                ]
            };
            let (one, other) = (terms(l), terms(l + HALF_LANES));
            for (sum, (a, b)) in sums.iter_mut().zip(one.iter().zip(&other)) {
                sum[l] += *a + *b;
            }
        }
    }
    let mut x = sums.map(|[a, b, c, d]| (a + b) + (c + d));
    for [c1, c2, c3] in c {
        x[0] += c1 * c1;
        x[1] += c1 * c2;
        x[2] += c1 * c3;
        x[3] += c2 * c2;
        x[4] += c2 * c3;
        x[5] += c3 * c3;
    }
    x
}
