//! Fuses the fitted half-angle with the expected one.

use super::answer::{ConeCovariance, EdgeNoise, Fused};
use crate::base::linalg::{M3, V3, basis, invert_spd2, unit};
use crate::base::real::Real;
use crate::model::body::Expected;
use crate::model::error_budget::ErrorBudget;
use crate::stages::fit;
use crate::stages::fit::Fit;

/// Fuses a fit and the covariance of its (δ₁₂, δc) with the expected half-angle. The cone stays as it is if its
/// half-angle was not fitted, or if the configuration or the body leaves the half-angle free.
pub(super) fn fused<T: Real>(
    fit: &Fit<T>,
    covariance: &ConeCovariance<T>,
    edge: EdgeNoise<T>,
    expected: &Expected<T>,
    config: &fit::Config,
    budget: Option<&mut ErrorBudget<T>>,
) -> Option<Fused<T>> {
    let (b1, b2) = basis(&fit.e);
    let var_c = expected.sigma_cos * expected.sigma_cos;
    let p = &covariance.whole;
    let var_free = fit.free.then_some(p.m33);
    let free_p = [p.m11, p.m12, p.m22];
    // A half-angle that was not fitted cannot be fused: its variance and its correlation with the axis do not exist.
    if !fit.free || config.half_angle == fit::HalfAngle::Free || expected.free {
        return Some(unfused(fit, covariance, edge, expected, config, budget));
    }
    let total = p.m33 + var_c;
    let difference = expected.cos - fit.c;
    let [k, moved, prior] = gain(fit, p, expected, total);
    let e = unit(&(fit.e + b1 * moved.x + b2 * moved.y))?;
    if let Some(budget) = budget {
        budget.project(&b1, &b2, [k.x, k.y], [prior.x, prior.y], expected);
    }
    // The tangent basis at the fused axis differs only by a small rotation. The covariance is therefore transformed
    // through the camera frame without other changes.
    let fused = [p.m11 - k.x * p.m13, p.m12 - k.x * p.m23, p.m22 - k.y * p.m23];
    let (n1, n2) = basis(&e);
    let turn = |n: &V3<T>| [n.dot(&b1), n.dot(&b2)];
    let (r1, r2) = (turn(&n1), turn(&n2));
    let late = projected([k.x, k.y], &covariance.late);
    let common = projected([k.x, k.y], &covariance.common);
    let sum = |a: [T; 3], b: [T; 3]| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
    let turned = |[p11, p12, p22]: [T; 3]| {
        let form = |a: [T; 2], b: [T; 2]| a[0] * (p11 * b[0] + p12 * b[1]) + a[1] * (p12 * b[0] + p22 * b[1]);
        [form(r1, r1), form(r1, r2), form(r2, r2)]
    };
    Some(Fused {
        e,
        c: fit.c + moved.z,
        p: turned(sum(fused, late)),
        common: Some(turned(sum(sum(common, late), [prior.x * prior.x, prior.x * prior.y, prior.y * prior.y]))),
        free_p,
        free_with_cos: [p.m13, p.m23],
        free_common: Some(covariance.common),
        by_cos: [k.x, k.y],
        var_free_cos: var_free,
        // The test is made before the fusion. Afterwards both half-angles agree by construction.
        chi2: difference * difference / total,
        edge,
        located: None,
    })
}

/// Returns the gain of the fusion, the change of (δ₁₂, δc), and its change for one sigma of the expected half-angle.
///
/// The axis moves with the half-angle, because on an arc both are known only together: on a short arc the fusion makes
/// sigma three to six times smaller.
fn gain<T: Real>(fit: &Fit<T>, p: &M3<T>, expected: &Expected<T>, total: T) -> [V3<T>; 3] {
    let with_half_angle = V3::new(p.m13, p.m23, p.m33);
    match expected.update(fit.c, p.m33) {
        None => {
            let k = with_half_angle * (T::one() / total);
            [k, k * (expected.cos - fit.c), k * expected.sigma_cos]
        }
        Some(exact) => [exact.weight, exact.moved, exact.sigma_weight].map(|x| with_half_angle * x),
    }
}

/// Returns the answer of a fit whose half-angle is not fused with the expected one.
fn unfused<T: Real>(
    fit: &Fit<T>,
    covariance: &ConeCovariance<T>,
    edge: EdgeNoise<T>,
    expected: &Expected<T>,
    config: &fit::Config,
    budget: Option<&mut ErrorBudget<T>>,
) -> Fused<T> {
    let (b1, b2) = basis(&fit.e);
    let var_c = expected.fixed_variance();
    let p = &covariance.whole;
    let (var_free, free_p) = (fit.free.then_some(p.m33), [p.m11, p.m12, p.m22]);
    // If the half-angle is fixed at the expected one, its error causes a proportional error of the axis.
    let k = fixed_half_angle_gain(fit);
    // A half-angle that is told as known counts as exact.
    let var_c = if config.half_angle == fit::HalfAngle::Known { T::ZERO } else { var_c };
    let (k, var_c) = k.filter(|_| !fit.free).map_or(([T::ZERO; 2], T::ZERO), |k| (k, var_c));
    if let Some(budget) = budget {
        budget.project(&b1, &b2, [T::ZERO; 2], k.map(|k| k * var_c.sqrt()), expected);
    }
    let with_prior =
        |p: &M3<T>| [p.m11 + k[0] * k[0] * var_c, p.m12 + k[0] * k[1] * var_c, p.m22 + k[1] * k[1] * var_c];
    Fused {
        e: fit.e,
        c: fit.c,
        p: with_prior(&(p + covariance.late)),
        common: Some(with_prior(&(covariance.common + covariance.late))),
        free_p,
        free_with_cos: [p.m13, p.m23],
        free_common: Some(covariance.common),
        by_cos: k,
        var_free_cos: var_free,
        chi2: T::ZERO,
        edge,
        located: None,
    }
}

/// Returns what a covariance C of (δ₁₂, δc) becomes by the fusion, on the tangent basis of the fitted axis:
/// (I, −k) C (I, −k)ᵀ. The expected cosine of the variance σ_c² adds k kᵀ σ_c².
///
/// The gain k weighs all errors of the fit and of the expected half-angle. While the geometry stays, it is the same in
/// the next picture, so that it carries the common part of both sides over. The expected half-angle is common as a
/// whole: the next picture is told the same limb height and radius, and an altitude with nearly the same error.
fn projected<T: Real>([k1, k2]: [T; 2], c: &M3<T>) -> [T; 3] {
    let (c13, c23) = (c.m13 - k1 * c.m33, c.m23 - k2 * c.m33);
    [c.m11 - k1 * (c.m13 + c13), c.m12 - k2 * c.m13 - k1 * c23, c.m22 - k2 * (c.m23 + c23)]
}

/// Returns the change of the axis for δc = 1 with a fixed half-angle: the solution of the normal equations for the
/// right-hand side Σ w Bᵀs.
pub(super) fn fixed_half_angle_gain<T: Real>(fit: &Fit<T>) -> Option<[T; 2]> {
    let (sums, mean) = (&fit.sums, fit.mean);
    let n = invert_spd2(sums.normal_fixed(mean))?;
    let (k1, k2) = (mean[0] * sums.n[5] - sums.n[2], mean[1] * sums.n[5] - sums.n[4]);
    Some([n[0] * k1 + n[1] * k2, n[1] * k1 + n[2] * k2])
}
