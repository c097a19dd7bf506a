//! The default method: Gauss-Newton on the sphere with Tukey's weights, then with fixed weights.

use super::cone::{Cone, State};
use super::config::{Config, HalfAngle};
use super::sums::{HalfAngleRow, Sums, Weights, means, pass};
use crate::base::linalg::{basis, unit};
use crate::base::real::Real;
use crate::geometry::block::Block;
use crate::geometry::cone::Azimuth;
use crate::model::body::Expected;
use crate::model::edge_noise;
use crate::stages::consensus::Consensus;

/// Tukey's constant: it gives 95 % efficiency for Gaussian errors.
const TUKEY: f64 = 4.685;

/// Largest number of robust iterations. `SETTLE` is the largest number of iterations with fixed weights.
// A pass less was tried: it changes the robust weights, and with them single answers.
const ROBUST: usize = 10;

/// Number of blocks that the first robust iterations use.
const PART: usize = 24;

const SETTLE: usize = 5;

/// Fits the cone in robust iterations with the expected half-angle, then fits the half-angle freely with the weights
/// that were found.
pub(super) fn sphere<T: Real>(
    blocks: &mut [Block<T>],
    start: &Consensus<T>,
    expected: &Expected<T>,
    threshold_px: T,
    config: &Config,
    noise: &edge_noise::Config,
) -> Option<Cone<T>> {
    let azimuth = expected.azimuth();
    let azimuth = azimuth.as_ref();
    let known = config.half_angle == HalfAngle::Known && !expected.free;
    let (robust, sums) = robust(blocks, start, expected, threshold_px, known, config, noise, azimuth)?;
    let refined = expected.target().map(|_| expected.seen_along(&robust.e));
    let expected = refined.as_ref().unwrap_or(expected);
    if let Some(target) = expected.target()
        && let Some(cone) = super::angle::settle(blocks, robust, Some(sums), &target.scaling)
    {
        return Some(cone);
    }
    // Without a known distance there is no expected half-angle to use instead.
    if expected.target().is_some_and(|target| target.range.is_none()) {
        return None;
    }
    let freely = if known { None } else { settle(blocks, robust, Some(sums), true, azimuth) };
    let ((at, mean, sums), free) = match freely {
        Some(settled) => (settled, true),
        // For Sun and Moon there is no expected half-angle to use instead.
        None if expected.free => return None,
        // A short arc does not determine a half-angle. The expected one is then fixed, and its error is added to the
        // covariance.
        None => (settle(blocks, State { k: T::one() - expected.cos, ..robust }, None, false, azimuth)?, false),
    };
    Some(Cone { at, mean, sums, free, quadric: None })
}

/// Does the iterations with Tukey's weights. The cut-off begins at three thresholds and then follows the residuals,
/// between half a threshold and two thresholds. The function stores the last weights in the points, and returns the
/// sums with them.
pub(super) fn robust<T: Real>(
    blocks: &mut [Block<T>],
    start: &Consensus<T>,
    expected: &Expected<T>,
    threshold_px: T,
    known: bool,
    config: &Config,
    noise: &edge_noise::Config,
    azimuth: Option<&Azimuth<T>>,
) -> Option<(State<T>, Sums<T>)> {
    // With a floor of half a threshold a clean edge keeps its own tails; above two thresholds the clutter would take
    // part.
    let (widest, narrowest) = (threshold_px * T::from_f64(2.0), threshold_px * T::from_f64(0.5));
    // The cut-off begins wide, so that a consensus which is a little off does not lose the limb on one side.
    let mut cutoff = threshold_px * T::from_f64(3.0);
    let prior = HalfAngleRow::new(blocks, expected, config, noise);
    let e = unit(&start.e)?;
    let (b1, b2) = basis(&e);
    let k = T::one() - if known { expected.cos } else { start.c };
    let mut at = State { e, k, mean: means(blocks, &b1, &b2), nearby: 0 };
    // A part of the points brings the cone near; the last iterations use all points.
    let mut every = blocks.len().div_ceil(PART).max(1);
    for _ in 0..ROBUST {
        let (b1, b2) = basis(&at.e);
        let weights = Weights::Tukey { cutoff2: cutoff * cutoff, every };
        let sums = pass(blocks, &at.e, &b1, &b2, at.k, at.mean, &weights, azimuth);
        let free = if known { None } else { sums.step(at.mean, prior.as_ref(), at.c()) };
        let step = match free {
            Some(step) => step,
            None => sums.step_known(at.mean)?,
        };
        let size = at.step(&b1, &b2, step, &sums)?;
        at.k = clamp(at.k);
        let spread = (sums.cost / sums.weight.max(T::from_f64(1e-20))).sqrt() * T::from_f64(1.2);
        let next = (spread * T::from_f64(TUKEY)).max(narrowest).min(widest);
        // With all points, the next step is much smaller than this one. With a part of the points, the cone is only as
        // good as this part, so more iterations would not help.
        let small = T::from_f64(if every == 1 { 5e-4 } else { 1e-4 });
        let settled = (next - cutoff).abs() < cutoff * T::from_f64(0.05) && size < small * at.sin();
        cutoff = next;
        // The iterations with fixed weights give the last digits, with all points.
        if settled {
            break;
        }
        // The size is compared with the sine of the half-angle, so that small discs are fitted as well as large ones.
        if size < T::from_f64(1e-3) * at.sin() {
            every = 1;
        }
    }
    let (b1, b2) = basis(&at.e);
    let weights = Weights::Last { cutoff2: cutoff * cutoff };
    let last = pass(blocks, &at.e, &b1, &b2, at.k, at.mean, &weights, azimuth);
    at.nearby = last.nearby.to_i32() as u32;
    (last.weight > T::from_f64(3.0)).then_some((at, last))
}

/// Iterates with fixed weights until convergence, and returns the normal equations there with the means about which
/// they are formed. The result is `None` if the points do not determine the cone; for a free half-angle, this happens
/// if the arc is too short. `first` are the sums at the start, if they are known.
fn settle<T: Real>(
    blocks: &mut [Block<T>],
    start: State<T>,
    mut first: Option<Sums<T>>,
    free: bool,
    azimuth: Option<&Azimuth<T>>,
) -> Option<(State<T>, [T; 2], Sums<T>)> {
    let mut at = start;
    let mut end = None;
    for _ in 0..SETTLE {
        let (b1, b2) = basis(&at.e);
        let mean = at.mean;
        // The sums of the last robust pass are those of the first step, which saves a pass.
        let known = first.take();
        let mut sums = known.unwrap_or_else(|| pass(blocks, &at.e, &b1, &b2, at.k, mean, &Weights::Kept, azimuth));
        let step = if free { sums.step(mean, None, at.c())? } else { sums.step_known(mean)? };
        sums.cost = (sums.cost - sums.gain(mean, step)).max(T::ZERO);
        let size = at.step(&b1, &b2, step, &sums)?;
        // An axis more than 20° from the robust solution belongs to another cone.
        if !(at.k > T::ZERO && at.k < T::from_f64(2.0)) || at.e.dot(&start.e) < T::from_f64(0.94) {
            return None;
        }
        end = Some((at, mean, sums));
        // Convergence is quadratic: after a step this small nothing remains to be corrected, and the sums are the final
        // ones.
        if size * size < T::EPSILON * T::from_f64(2.0) * at.sin() {
            break;
        }
    }
    end
}

/// Limits 1 − cos to its valid range.
// The lower limit only keeps a step beyond the point of no size from becoming negative. It is the half-angle of 1e-12
// rad, far below a pixel of every lens: a limit that a body can reach, such as 1e-9 (9 arc seconds), spoils its fit.
fn clamp<T: Real>(k: T) -> T {
    k.max(T::from_f64(5e-25)).min(T::from_f64(2.0 - 1e-6))
}
