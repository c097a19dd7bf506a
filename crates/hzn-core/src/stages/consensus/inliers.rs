//! The definition of an inlier: the threshold for its distance, and the cone that most points agree on.

use super::config::Config;
use super::noise;
use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::block::Block;
use crate::model::body::Expected;

/// Largest distance from the limb at which a point of one edge can be an inlier.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Threshold<T> {
    /// The largest distance, in pixels.
    pub(crate) px: T,
    /// Ratio of the largest distance to `threshold_px`, 1 or more. The largest RMS of the fit grows with it.
    pub(crate) factor: T,
}

impl<T: Real> Threshold<T> {
    /// Uses `threshold_px` of the configuration as it is.
    #[cfg(test)]
    pub(crate) fn from_config(config: &Config) -> Self {
        Self { px: T::from_f64(config.threshold_px), factor: T::one() }
    }
    /// Makes the threshold for the first `count` points of the blocks, which are rays in the order of the edge.
    ///
    /// Noise raises the threshold at most to the sigma of the limb height. Air does not spread a limb farther, so an
    /// edge with more scatter belongs to something else.
    ///
    /// `uneven_px` is the largest distance of the limb from its mean cone, [`Expected::uneven_px`]. It doubles as the
    /// room for noise, so that the threshold stays as it is where the distance is small.
    pub(crate) fn new(
        blocks: &[Block<T>],
        count: u32,
        expected: &Expected<T>,
        focal_px: T,
        uneven_px: T,
        config: &Config,
    ) -> Self {
        let told = T::from_f64(config.threshold_px);
        // A disc with a free half-angle has no limb height whose sigma could bound its noise.
        let most = if expected.free { told } else { told.max(expected.limb_sigma_rad() * focal_px) };
        let factor = T::from_f64(config.noise_sigma);
        // The noise is measured only if it may change the threshold, because it is a pass over all points.
        let px = if most > told && factor > T::ZERO {
            told.max((factor * noise::point_to_point(blocks, count)).min(most))
        } else {
            told
        };
        let px = px.max(uneven_px + uneven_px);
        Self { px, factor: px / told }
    }
}

/// The cone that most points agree on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Consensus<T> {
    /// Unit axis of the cone, in the camera frame.
    pub(crate) e: V3<T>,
    /// cos of the half-angle of the cone.
    pub(crate) c: T,
    /// Number of draws.
    pub(crate) draws: u32,
    /// Whether every point is an inlier, so that the fit leaves no point out.
    pub(crate) all: bool,
}
