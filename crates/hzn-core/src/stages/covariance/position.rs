//! From the fit in scaled space to the position of the body (math.md, 13.1, 13.4, 13.5).
//!
//! The centre of the body is r = U⁻¹e/sin α (13.3). Its covariance is G P Gᵀ (13.12), with the errors of limb height,
//! orientation and semi-axes added ([`super::consider`]). A known distance is fused after that, in three iterations,
//! because the uncertainty of a short arc is a ridge along which direction and distance change together. One linear
//! update would be off by many sigmas there.
//!
//! Lengths are in units of the mean semi-axis, so that single precision suffices at any distance.

use super::answer::{ConeCovariance, EdgeNoise, Fused, Located};
use super::consider::Sensitivity;
use super::fusion;
use crate::base::linalg::{M3, V3, basis, unit};
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};
use crate::geometry::scaling::ScaledCone;
use crate::model::body::{Expected, Target};
use crate::model::error_budget::ErrorBudget;
use crate::model::report::Position;
use crate::stages::fit::{self, Fit, HalfAngle};

/// A fitted half-angle counts if it is this many of its sigmas away from 0° and from 90°. Nearer than that, no
/// covariance describes the position (math.md, 13.5).
const GATE_SIGMAS: f64 = 5.0;
/// Iterations of the fusion with a known distance.
// With one linear update the NEES was 84 (20° arc, 1 px, range known to 0.1 %), with three iterations 3.4; ideal is 3.
const ITERATIONS: usize = 3;

/// Computes the position, and fuses the known distance. If the arc is too short for a position, the answer is the
/// direction that a known distance gives, and there is none without a known distance.
pub(super) fn fused<T: Real>(
    blocks: &[Block<T>],
    fit: &Fit<T>,
    p: &ConeCovariance<T>,
    edge: EdgeNoise<T>,
    expected: &Expected<T>,
    target: &Target<T>,
    config: &fit::Config,
    budget: Option<&mut ErrorBudget<T>>,
) -> Option<Fused<T>> {
    let by_direction = fusion::fused(fit, p, edge, expected, config, budget)?;
    let sin = (fit.k * (T::one() + fit.c)).max(T::ZERO).sqrt();
    if !is_determined(fit, sin, p.whole.m33) || !is_lit_inside(blocks, fit) {
        // With a known distance the half-angle is the expected one, so that the direction needs no fitted half-angle.
        return target.range.map(|_| by_direction);
    }
    let given = Sensitivity::new(blocks, fit, target)?;
    let light_px = if expected.is_in_sunlight { edge.shift_px } else { T::ZERO };
    let lights = light(&given, expected, &fit.e).map(|v| v * light_px);
    let free = located(fit, sin, p, target, &given, &lights);
    let range = target.range.filter(|_| config.half_angle != HalfAngle::Free);
    let (found, chi2) = match range {
        None => (free, T::ZERO),
        Some(range) => with_range(&free, target, range.sigma_m / target.unit_m)?,
    };
    answer(&by_direction, found, chi2, target)
}

/// Returns whether the half-angle is far enough from 0° and from 90°: α > 5 σ_α and 90° − α > 5 σ_α.
fn is_determined<T: Real>(fit: &Fit<T>, sin: T, var_cos: T) -> bool {
    let limit = T::from_f64(GATE_SIGMAS) * var_cos.sqrt() / sin;
    let alpha = sin.atan2(fit.c);
    alpha > limit && T::from_f64(core::f64::consts::FRAC_PI_2) - alpha > limit
}

/// Returns whether most of the edge is lit on the side of the axis. Noise can turn the curvature of a short arc over,
/// and the fitted body is then on the dark side.
fn is_lit_inside<T: Real>(blocks: &[Block<T>], fit: &Fit<T>) -> bool {
    let (mut inside, half) = (T::ZERO, fit.sums.weight * T::from_f64(0.5));
    for block in blocks {
        let [gu, gv] = block.gradient(&fit.e);
        for lane in 0..LANES {
            if block.weight[lane] > T::ZERO && block.is_lit_along(lane, [gu[lane], gv[lane]]) {
                inside += block.weight[lane];
            }
        }
        if inside > half {
            return true;
        }
    }
    false
}

/// Returns the position that the fit gives, with all errors of the given shape and orientation.
fn located<T: Real>(
    fit: &Fit<T>,
    sin: T,
    p: &ConeCovariance<T>,
    target: &Target<T>,
    given: &Sensitivity<T>,
    lights: &[V3<T>; 2],
) -> Located<T> {
    let from = &target.scaling.from;
    // A limb that is clipped everywhere stands higher; the shape stays the same.
    let grown = T::one() + target.raised_m / target.unit_m;
    let r = from * fit.e * (grown / sin);
    let g = by_cone(target, &fit.e, sin, fit.c) * grown;
    let (mut errors, mut common) = (p.whole + p.late, p.common + p.late);
    let mut add = |v: &V3<T>, sigma: T| {
        let more = v * v.transpose() * (sigma * sigma);
        errors += more;
        common += more;
    };
    // The errors are added before the distance is fused, because they are common to direction and distance: 1 km of
    // limb height moves the position by r/a km and is often the largest term.
    add(&given.by_limb, target.limb_sigma_m / target.unit_m);
    given.by_rotation.iter().for_each(|v| add(v, target.attitude_sigma_rad));
    given.by_axis.iter().for_each(|v| add(v, target.radii_sigma_m / target.unit_m));
    lights.iter().for_each(|v| add(v, T::one()));
    let covariance = g * errors * g.transpose();
    let common = g * common * g.transpose();
    Located { r, p: covariance, common, free_r: r, free_p: covariance, turn: None }
}

/// Returns the errors by light that changes along the limb, for a shift of one pixel. Without the direction to the Sun,
/// its azimuth is unknown, and each of the two components has half of the variance.
fn light<T: Real>(given: &Sensitivity<T>, expected: &Expected<T>, e: &V3<T>) -> [V3<T>; 2] {
    let (b1, b2) = basis(e);
    let [x, y] = given.by_light;
    let towards_sun = expected.sun_seen.as_ref().map(|sun| [sun.dot(&b1), sun.dot(&b2)]);
    match towards_sun.map(|[a, b]| (a, b, (a * a + b * b).sqrt())) {
        Some((a, b, length)) if length > T::from_f64(1e-6) => [(x * a + y * b) / length, V3::zeros()],
        _ => [x, y].map(|v| v * T::from_f64(core::f64::consts::FRAC_1_SQRT_2)),
    }
}

/// Returns the derivative of U⁻¹ e/sin α by (δ₁₂, δc): (13.12) with δα = −δc/sin α.
pub(crate) fn by_cone<T: Real>(target: &Target<T>, e: &V3<T>, sin: T, cos: T) -> M3<T> {
    let from = target.scaling.from;
    let (b1, b2) = basis(e);
    let per = T::one() / sin;
    M3::from_columns(&[from * b1 * per, from * b2 * per, from * e * (cos * per * per * per)])
}

/// Fuses the known distance, as (13.14), written with the gain so that no matrix is inverted. Returns χ² of one degree
/// of freedom, too.
pub(crate) fn with_range<T: Real>(free: &Located<T>, target: &Target<T>, sigma: T) -> Option<(Located<T>, T)> {
    let Located { r: start, p, .. } = *free;
    let (mut x, mut chi2) = (start, T::ZERO);
    let (mut covariance, mut common) = (p, free.common);
    for _ in 0..ITERATIONS {
        let u = unit(&x)?;
        let distance = target.range_m(&u)? / target.unit_m;
        let pu = p * u;
        let total = u.dot(&pu) + sigma * sigma;
        // The measurement is linearised about the last x, but the state starts from the fit again. Otherwise the same
        // distance would count three times.
        let innovation = distance - x.dot(&u) - u.dot(&(start - x));
        x = start + pu * (innovation / total);
        covariance = p - pu * pu.transpose() * (T::one() / total);
        common = common_with_range(&free.common, &u, &(pu * (T::one() / total)), sigma);
        chi2 = innovation * innovation / total;
    }
    Some((Located { r: x, p: covariance, common, ..*free }, chi2))
}

/// Returns the common part after the fusion of the known distance: (I − k uᵀ) C (I − k uᵀ)ᵀ + k kᵀ σ². The error of the
/// distance is common as the altitude of which it comes.
fn common_with_range<T: Real>(common: &M3<T>, u: &V3<T>, gain: &V3<T>, sigma: T) -> M3<T> {
    let along = common * u;
    let crossed = gain * along.transpose();
    common - crossed - crossed.transpose() + gain * gain.transpose() * (u.dot(&along) + sigma * sigma)
}

/// Returns the answer in scaled space for the gates: axis, half-angle and covariance that belong to a position.
fn answer<T: Real>(fitted: &Fused<T>, found: Located<T>, chi2: T, target: &Target<T>) -> Option<Fused<T>> {
    let y = target.scaling.to * found.r;
    let length2 = y.dot(&y);
    let grown = T::one() + target.raised_m / target.unit_m;
    let per_length = T::one() / length2.sqrt();
    let e = y * per_length;
    let sin = grown * per_length;
    let c = (T::one() - sin * sin).max(T::ZERO).sqrt();
    if !(sin > T::ZERO && c > T::ZERO) {
        return None;
    }
    let (b1, b2) = basis(&e);
    // δe = (I − e eᵀ) U δr/‖U r‖.
    let (g1, g2) = (target.scaling.to * b1 * per_length, target.scaling.to * b2 * per_length);
    let across = |p: &M3<T>| [g1.dot(&(p * g1)), g1.dot(&(p * g2)), g2.dot(&(p * g2))];
    Some(Fused {
        e,
        c,
        p: across(&found.p),
        common: Some(across(&found.common)),
        // The fused distance is no half-angle; its derivative by the expected cosine does not exist.
        by_cos: [T::ZERO; 2],
        chi2,
        located: Some(found),
        ..*fitted
    })
}

/// The parts of a solution that depend on the position.
pub(crate) struct Placed<T> {
    /// Axis in the camera frame with its covariance on the tangent basis.
    pub(crate) axis: V3<T>,
    pub(crate) p: [T; 3],
    /// The part of `p` that the next picture shares.
    pub(crate) common: Option<[T; 3]>,
    /// Half-angles of the limb in the camera frame: before and after the known distance was fused; radians.
    pub(crate) half_angles_rad: [T; 2],
    /// Altitude before the known distance was fused, and its 1-sigma, metres; `None` if there is only a direction.
    pub(crate) altitude_m: Option<(T, T)>,
    pub(crate) position: Option<Position<T>>,
}

/// Converts an answer in scaled space to the camera frame. `None` if it has no direction.
pub(crate) fn place<T: Real>(fused: &Fused<T>, target: &Target<T>, mean_radius_m: T) -> Option<Placed<T>> {
    let Some(found) = &fused.located else { return direction(fused, target) };
    let unit_m = target.unit_m;
    let (r, free_r) = (found.r * unit_m, found.free_r * unit_m);
    let (axis, half_angle) = target.limb_cone(&r)?;
    let (_, free_half_angle) = target.limb_cone(&free_r)?;
    let length = |v: &V3<T>| v.dot(v).sqrt();
    let per = T::one() / length(&found.r);
    let (b1, b2) = basis(&axis);
    let across = |p: &M3<T>| {
        let form = |a: &V3<T>, b: &V3<T>| a.dot(&(p * b)) * per * per;
        [form(&b1, &b1), form(&b1, &b2), form(&b2, &b2)]
    };
    let free_u = unit(&free_r)?;
    let sigma_m = free_u.dot(&(found.free_p * free_u)).max(T::ZERO).sqrt() * unit_m;
    let p = found.p * (unit_m * unit_m);
    let body_fixed = target.body_fixed(&r);
    Some(Placed {
        axis,
        p: across(&found.p),
        common: Some(across(&found.common)),
        half_angles_rad: [free_half_angle, half_angle],
        altitude_m: Some((target.altitude_m(&free_r, mean_radius_m), sigma_m)),
        position: Some(Position {
            centre_m: r.into(),
            covariance_m2: [p.m11, p.m12, p.m13, p.m22, p.m23, p.m33],
            free_range_m: (length(&free_r), sigma_m),
            body_fixed_m: target.has_attitude.then(|| body_fixed.into()),
            yaw_rad: found.turn.map(|turn| (turn.rad, turn.sigma_rad)),
            limb: ScaledCone { e: fused.e, c: fused.c, scaling: Some(target.scaling) },
        }),
    })
}

/// Converts an answer without a position: the direction of a body at the known distance.
fn direction<T: Real>(fused: &Fused<T>, target: &Target<T>) -> Option<Placed<T>> {
    let long = target.scaling.from * fused.e;
    let per_length = T::one() / long.dot(&long).sqrt();
    let u = long * per_length;
    let r = u * target.range_m(&u)?;
    let (axis, half_angle) = target.limb_cone(&r)?;
    let (e1, e2) = basis(&fused.e);
    let (b1, b2) = basis(&axis);
    // du = (I − u uᵀ) U⁻¹ de/‖U⁻¹ e‖; the small angle between u and the limb axis does not matter.
    let by = |b: &V3<T>| [&e1, &e2].map(|e| b.dot(&(target.scaling.from * e)) * per_length);
    let (g1, g2) = (by(&b1), by(&b2));
    let across = |[p11, p12, p22]: [T; 3]| {
        let form = |a: [T; 2], b: [T; 2]| a[0] * (p11 * b[0] + p12 * b[1]) + a[1] * (p12 * b[0] + p22 * b[1]);
        [form(g1, g1), form(g1, g2), form(g2, g2)]
    };
    Some(Placed {
        axis,
        p: across(fused.p),
        common: fused.common.map(across),
        half_angles_rad: [half_angle; 2],
        altitude_m: None,
        position: None,
    })
}
