//! The fitted cone: the state of the iterations, the result of every method, and the fit with its statistics.

use super::quadric::Quadric;
use super::sums::Sums;
use crate::base::linalg::{V3, unit};
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES, sum};
use crate::image::Profiles;
use crate::model::tone::Tone;

/// A fitted cone.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fit<T> {
    /// Unit axis, in the camera frame.
    pub(crate) e: V3<T>,
    /// cos of the (mean) half-angle.
    pub(crate) c: T,
    /// 1 − cos of the half-angle, with the full relative precision.
    pub(crate) k: T,
    /// Whether the half-angle was fitted, too; otherwise it is the expected one.
    pub(crate) free: bool,
    /// Weighted RMS distance of the points from the limb in pixels.
    pub(crate) rms_px: T,
    /// Number of points with a weight.
    pub(crate) inliers: u32,
    /// Total length of the edge between adjacent points that both have a weight, in pixels.
    pub(crate) arc_px: T,
    /// Number of points beyond the cut-off of the weights, but within three times the cut-off.
    pub(crate) nearby: u32,
    /// Normal equations at the cone, about `mean`.
    pub(crate) sums: Sums<T>,
    /// Means of Bᵀs.
    pub(crate) mean: [T; 2],
    /// The elliptic cone of the methods that fit one. Its covariance is not the one of the normal equations. Read
    /// it by [`Self::quadric`].
    pub(crate) quadric: Option<Quadric<T>>,
    /// Width and contrast of the edge, and the tone of the picture, which the caller of the fit fills in.
    pub(crate) profiles: Profiles,
    pub(crate) tone: Option<Tone>,
}

impl<T: Real> Fit<T> {
    /// Returns the elliptic cone of the methods that fit one. Without the feature there is none.
    pub(crate) fn quadric(&self) -> Option<&Quadric<T>> {
        if cfg!(feature = "zju") { self.quadric.as_ref() } else { None }
    }
}

/// Makes the fit of a cone, and counts its points.
pub(super) fn count_points<T: Real>(blocks: &[Block<T>], cone: Cone<T>) -> Fit<T> {
    let (mut inliers, mut arc) = ([T::ZERO; LANES], [T::ZERO; LANES]);
    let mut before = T::ZERO;
    for block in blocks.iter() {
        let on = block.weight.map(|w| if w > T::ZERO { T::one() } else { T::ZERO });
        for l in 0..LANES {
            inliers[l] += on[l];
            // Only steps between two inliers count: a gap is no evidence for a limb.
            arc[l] += on[l] * before * block.step_px[l];
            before = on[l];
        }
    }
    let (inliers, arc) = (sum(&inliers).to_i32() as u32, sum(&arc));
    let Cone { at, mean, sums, free, .. } = cone;
    Fit {
        e: at.e,
        c: at.c(),
        k: at.k,
        free,
        rms_px: (sums.cost / sums.weight).sqrt(),
        inliers,
        arc_px: arc,
        nearby: at.nearby,
        sums,
        mean,
        quadric: cone.quadric,
        profiles: Profiles::default(),
        tone: None,
    }
}

/// Result of every method.
pub(super) struct Cone<T> {
    pub(super) at: State<T>,
    /// Means about which `sums` are formed.
    pub(super) mean: [T; 2],
    pub(super) sums: Sums<T>,
    pub(super) free: bool,
    pub(super) quadric: Option<Quadric<T>>,
}

/// State of the iterations.
#[derive(Clone, Copy)]
pub(super) struct State<T> {
    pub(super) e: V3<T>,
    /// 1 − cos of the half-angle.
    pub(super) k: T,
    /// Means of Bᵀs.
    pub(super) mean: [T; 2],
    pub(super) nearby: u32,
}

impl<T: Real> State<T> {
    /// cos of the half-angle.
    pub(super) fn c(&self) -> T {
        T::one() - self.k
    }
    /// sin of the half-angle.
    pub(super) fn sin(&self) -> T {
        // 1 − c² would cancel for a small disc; k (1 + c) is the same number without a difference.
        (self.k * (T::one() + self.c())).max(T::ZERO).sqrt()
    }
    /// Does a step and returns its size in radians; `None` if the new axis has no direction.
    pub(super) fn step(&mut self, b1: &V3<T>, b2: &V3<T>, ([d1, d2], dc): ([T; 2], T), sums: &Sums<T>) -> Option<T> {
        self.e = unit(&(self.e + b1 * d1 + b2 * d2))?;
        self.k -= dc;
        self.mean = sums.means(self.mean);
        Some(d1.abs() + d2.abs() + dc.abs())
    }
}
