//! The inliers as points of the picture with their residuals from the cone. Rival shapes are fitted to them: circles,
//! straight lines and polylines. A limb's points fit its cone as well as any of them.

use super::config::Config;
use crate::base::linalg::V3;
use crate::base::median;
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES, LEAST_GRADIENT2};
use crate::geometry::camera::Camera;
use crate::geometry::cone::Azimuth;
use crate::geometry::frames::UnitVec3;
use crate::stages::fit::Fit;

/// Largest number of inliers that are used, evenly along the edge. It gives the ratio of two residuals to about 10 %.
pub(super) const MOST: usize = 128;

/// Residuals below this count as equal, in pixels. Sampling and interpolation cause about this residual even for a
/// perfect edge.
pub(super) const RIVAL_FLOOR_PX: f64 = 0.03;

/// An inlier.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place<T> {
    /// Image point (u, v), in pixels.
    pub(super) at: [T; 2],
    /// Signed distance from the fitted cone, in pixels; positive outside.
    pub(super) r: T,
    /// Weight of the point in the fit.
    pub(super) w: T,
    /// Number of the edge point: its lane, and its block times [`LANES`].
    pub(super) number: u16,
}

/// Inliers in the order of the edge.
pub(super) type Shape<T> = heapless::Vec<Place<T>, MOST>;

/// The cone from which the residuals are measured.
pub(super) struct Curve<T> {
    e: V3<T>,
    k: T,
    azimuth: Option<Azimuth<T>>,
    east_along: T,
}

impl<T: Real> Curve<T> {
    pub(super) fn new(fit: &Fit<T>, azimuth: Option<Azimuth<T>>) -> Self {
        let east_along = azimuth.as_ref().map_or(T::ZERO, |a| a.east.dot(&fit.e));
        Self { e: fit.e, k: fit.k, azimuth, east_along }
    }
    /// Returns the axis of the cone.
    pub(super) fn axis(&self) -> &V3<T> {
        &self.e
    }
    /// Returns 1 − cos of the half-angle of the cone.
    pub(super) fn k(&self) -> T {
        self.k
    }
    /// Returns the signed distance of a point in pixels, positive outside of the cone.
    pub(super) fn distance(&self, block: &Block<T>, lane: usize) -> T {
        let s = block.ray(lane);
        let off = s - self.e;
        // 1 − s·e is computed as in the fit, which keeps its precision for a small disc.
        let mut r = off.dot(&off) * T::from_f64(0.5) - self.k;
        if let Some(a) = &self.azimuth {
            r += a.offset([s.x, s.y, s.z], s.dot(&self.e), self.east_along);
        }
        let [gu, gv] = block.gradient_at(lane, &self.e);
        r / (gu * gu + gv * gv).max(T::from_f64(LEAST_GRADIENT2)).sqrt()
    }
}

/// The residuals of a fit, and what they say about a rival of the cone.
pub(super) struct Residuals<'a, T> {
    pub(super) curve: &'a Curve<T>,
    pub(super) shape: &'a mut Shape<T>,
    /// Weighted RMS, in pixels.
    pub(super) rms_px: T,
    /// Noise from point to point, in pixels.
    pub(super) noise_px: T,
    /// Number of independent residuals.
    independent: T,
    /// Residuals below this count as equal, in pixels.
    floor_px: T,
    max_ratio: T,
    min_evidence: T,
    /// Evidence against the cone that the residuals do not show: the lens must have an error for it.
    bend: T,
}

impl<'a, T: Real> Residuals<'a, T> {
    pub(super) fn new(curve: &'a Curve<T>, shape: &'a mut Shape<T>, config: &Config) -> Self {
        Self {
            curve,
            rms_px: rms(shape),
            noise_px: local_noise(shape),
            independent: independent(shape),
            shape,
            floor_px: T::from_f64(RIVAL_FLOOR_PX),
            max_ratio: T::from_f64(config.max_rival_ratio),
            min_evidence: T::from_f64(config.min_evidence),
            bend: T::ZERO,
        }
    }

    /// Makes the residuals of a cone that was fitted together with uncertain parameters of the lens, from the χ² of the
    /// values that this fit needs, and its noise: the sigma of a point and the number of independent errors.
    pub(super) fn with_bend(self, chi2: T, noise_px: T, independent: T) -> Self {
        let (floor_px, independent) = (self.floor_px.max(noise_px), self.independent.min(independent));
        Self { bend: chi2, floor_px, independent, ..self }
    }

    /// Returns whether the points prove that they are on the cone and not on a curve with this RMS.
    pub(super) fn prove_cone_over(&self, rival_px: T) -> bool {
        self.evidence(rival_px, self.rms_px) - self.bend > self.min_evidence
    }

    /// Returns whether the residuals are larger than noise.
    pub(super) fn exceed_noise(&self) -> bool {
        self.exceed(self.noise_px.max(self.floor_px))
    }

    /// Returns whether the residuals are larger than those of a noise by more than the largest ratio.
    pub(super) fn exceed(&self, noise_px: T) -> bool {
        self.rms_px > self.max_ratio * noise_px
    }

    /// Returns whether some other curve may fit better. No smooth curve can fit better than the noise from point to
    /// point.
    pub(super) fn allow_rival(&self) -> bool {
        self.exceed_noise() || self.evidence(self.rms_px, self.noise_px) + self.bend > self.min_evidence
    }

    /// Returns whether a curve with this RMS replaces the cone: its residuals are far smaller, or the evidence for it
    /// is large. `more` is the number of parameters that it has more than the cone; each needs more evidence.
    pub(super) fn prefer(&self, rival_px: T, more: T) -> bool {
        let needed = self.min_evidence + self.independent.ln() * more;
        self.rms_px > self.max_ratio * rival_px.max(self.floor_px)
            || (self.evidence(self.rms_px, rival_px) + self.bend > needed && self.min_evidence > T::ZERO)
    }

    /// Returns the evidence against a curve with the first RMS, for one with the second: twice the logarithm of the
    /// likelihood ratio, n ln(v/v').
    fn evidence(&self, against_px: T, for_px: T) -> T {
        let v = against_px.max(self.floor_px) / for_px.max(self.floor_px);
        self.independent * (v * v).ln()
    }
}

/// Fills `shape` with the inliers, thinned to [`MOST`]. A list that is returned would be copied.
pub(super) fn collect_inliers<T: Real>(
    blocks: &[Block<T>],
    fit: &Fit<T>,
    curve: &Curve<T>,
    camera: &Camera<T>,
    shape: &mut Shape<T>,
) {
    let every = fit.inliers.div_ceil(MOST as u32).max(1);
    let mut passed = every / 2;
    for (number, block) in blocks.iter().enumerate() {
        for lane in 0..LANES {
            let w = block.weight[lane];
            if !(w > T::ZERO) {
                continue;
            }
            passed += 1;
            if passed < every {
                continue;
            }
            passed = 0;
            let Some(at) = camera.project(&UnitVec3::assume_unit(block.ray(lane))) else { continue };
            // No workspace has more than 65 535 points.
            let number = (number * LANES + lane) as u16;
            if shape.push(Place { at: [at.u, at.v], r: curve.distance(block, lane), w, number }).is_err() {
                return;
            }
        }
    }
}

/// Returns the weighted RMS of the residuals, in pixels.
pub(super) fn rms<T: Real>(shape: &Shape<T>) -> T {
    let (mut cost, mut weight) = (T::ZERO, T::ZERO);
    for p in shape {
        cost += p.w * p.r * p.r;
        weight += p.w;
    }
    (cost / weight.max(T::from_f64(1e-20))).sqrt()
}

/// Returns the noise from point to point, in pixels; a misfit does not contribute. The noise comes from the median of
/// |r_i − (r_{i−1} + r_{i+1})/2|, which is 0.6745 √1.5 times the sigma of independent errors.
fn local_noise<T: Real>(shape: &Shape<T>) -> T {
    let half = T::from_f64(0.5);
    let mut all = heapless::Vec::<T, MOST>::new();
    let mut most = T::ZERO;
    for w in shape.windows(3) {
        if let [a, b, c] = w {
            let second = (b.r - (a.r + c.r) * half).abs();
            most = most.max(second);
            let _ = all.push(second);
        }
    }
    median::median_of_reals(&all, most) * T::from_f64(1.0 / (0.6745 * 1.224_744_871))
}

/// Returns the arc over which the residuals are correlated, in points of the shape: 1 + 2 Σ ρ_k up to the first below
/// 0.05.
fn correlated_points<T: Real>(shape: &Shape<T>) -> T {
    let products = |lag: usize| {
        let (mut sum, mut count) = (T::ZERO, 0);
        for (a, b) in shape.iter().zip(shape.iter().skip(lag)) {
            sum += a.r * b.r;
            count += 1;
        }
        sum / T::from_i32(count.max(1))
    };
    let variance = products(0).max(T::from_f64(1e-20));
    let mut sum = T::from_f64(0.5);
    for lag in 1..shape.len() / 2 {
        let rho = products(lag) / variance;
        if !(rho > T::from_f64(0.05)) {
            break;
        }
        sum += rho;
    }
    sum + sum
}

/// Returns the number of independent residuals, at least 3.
fn independent<T: Real>(shape: &Shape<T>) -> T {
    (T::from_i32(shape.len() as i32) / correlated_points(shape).max(T::one())).max(T::from_f64(3.0))
}
