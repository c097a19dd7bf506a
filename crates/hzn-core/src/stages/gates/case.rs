//! A fitted edge with everything that a gate can ask about it.

use super::config::Config;
use super::view::Cover;
use crate::base::real::Real;
use crate::geometry::block::Block;
use crate::geometry::camera::Camera;
use crate::image::region::Region;
use crate::model::body::Expected;
use crate::model::found_limb::FoundLimb;
use crate::model::verdict::Verdict;
use crate::stages::covariance::Fused;
use crate::stages::fit::{self, Fit};

/// A fitted edge, which the gates judge.
pub(crate) struct Case<'a, T> {
    /// Number of the candidate.
    pub(crate) number: u32,
    /// The cone that was fitted to the edge with a free half-angle.
    pub(crate) fit: &'a Fit<T>,
    /// The same cone after the expected half-angle was fused.
    pub(crate) fused: &'a Fused<T>,
    /// Largest standard deviation of the axis.
    pub(crate) sigma_max_rad: T,
    pub(crate) expected: &'a Expected<T>,
    /// Limbs of the bodies that were found before in the same picture.
    pub(crate) taken: &'a [FoundLimb<T>],
    /// Edge points with their weights in the fit. Inliers have a weight above 0.
    pub(crate) blocks: &'a [Block<T>],
    /// Number of edge points.
    pub(crate) points: u32,
    /// Number of edge points at the threshold of the picture, because no local mid-level was found.
    pub(crate) fallback: u32,
    /// Smallest part of the points that must be inliers; it is larger in a further look.
    pub(crate) min_inlier_share: f64,
    /// Factor by which the noise of the edge raises the threshold of the consensus; the largest RMS grows by the same
    /// factor.
    pub(crate) raised: T,
    /// Largest distance of an inlier from the cone of the consensus, px.
    pub(crate) width_px: T,
    pub(crate) camera: &'a Camera<T>,
    pub(crate) region: &'a Region<T>,
    pub(crate) fit_config: &'a fit::Config,
    pub(crate) config: &'a Config,
    /// What the inliers cover of the limb in view.
    pub(crate) cover: Cover<T>,
}

impl<T: Real> Case<'_, T> {
    /// Returns the cosine of the half-angle that the limb about the fitted axis is expected to have.
    pub(super) fn expected_cos(&self) -> T {
        if self.expected.free { self.fit.c } else { self.expected.cos }
    }
    /// Returns the derivative of s·e by the height of the limb, 1/m. An angle is a height divided by the distance
    /// (R + d) cot α of the limb; that of s·e = cos ρ is sin ρ dρ.
    pub(super) fn cos_by_m(&self) -> T {
        let (c, expected) = (self.fused.c, self.expected);
        let radius_m = (expected.radius_m + expected.limb_m).max(T::one());
        (T::one() - c * c).max(T::ZERO) / (c.max(T::from_f64(1e-6)) * radius_m)
    }
    /// Returns the weighted RMS divided by the part of the limb in view that edge points cover.
    pub(super) fn score(&self) -> T {
        self.fit.rms_px.max(T::from_f64(0.05)) / self.cover.share.max(T::from_f64(1e-3))
    }
    /// Returns whether at least this part of the edge's points are inliers.
    pub(super) fn has_inliers_of(&self, share: f64) -> bool {
        T::from_i32(self.fit.inliers as i32) >= T::from_i32(self.points as i32) * T::from_f64(share)
    }
}

/// Returns the verdict as an error if the gate refuses the edge.
pub(super) fn refuse_if(is_refused: bool, verdict: Verdict) -> Result<(), Verdict> {
    if is_refused { Err(verdict) } else { Ok(()) }
}
