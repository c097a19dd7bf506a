//! Edge points and their errors.

use hzn_core::pixel::ImagePoint;

use crate::counter::{Counter, Stream};

/// Errors of edge points in pixels. Errors along u and along v are independent.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum EdgeNoise {
    /// All points are exactly on the limb.
    #[default]
    None,
    /// All points have independent errors.
    White {
        /// Standard deviation along u and along v in pixels.
        sigma_px: f64,
    },
    /// Errors are a Gauss-Markov process along each segment of limb, with correlation exp(−arc/`correlation_px`).
    GaussMarkov {
        /// Variance along u and along v in px²; the R of the covariance model.
        variance_px2: f64,
        /// Correlation length in pixels along the limb; the L of the covariance model.
        correlation_px: f64,
    },
}

/// A point of the visible limb.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimbPoint {
    /// Measured position in the picture, with its error.
    pub point: ImagePoint<f64>,
    /// Exact position in the picture.
    pub exact: ImagePoint<f64>,
    /// Azimuth in radians. It counts about the limb axis: 0 is east of the position, π/2 is the direction axis × east.
    /// For a scene with an ellipsoid it counts as in [`LimbArc`](crate::LimbArc).
    pub azimuth_rad: f64,
    /// Number of the uninterrupted segment of limb, from 0.
    pub segment: usize,
    /// Arc length in pixels from the start of the segment.
    pub arc_px: f64,
}

/// The errors of successive points.
pub(crate) struct EdgeErrors {
    noise: EdgeNoise,
    u: Counter,
    v: Counter,
    index: u64,
    /// Segment, arc length and error of the point before.
    last: Option<(usize, f64, [f64; 2])>,
}

impl EdgeErrors {
    pub(crate) fn new(seed: u64, noise: EdgeNoise) -> Self {
        Self { noise, u: Counter::new(seed, Stream::EdgeU), v: Counter::new(seed, Stream::EdgeV), index: 0, last: None }
    }

    /// Returns the next point with its error, from its exact position and its place on the limb.
    pub(crate) fn disturbed(&mut self, exact: ImagePoint<f64>, segment: usize, arc_px: f64) -> ImagePoint<f64> {
        let [du, dv] = self.next(segment, arc_px);
        ImagePoint { u: exact.u + du, v: exact.v + dv }
    }

    fn next(&mut self, segment: usize, arc_px: f64) -> [f64; 2] {
        let normal = [self.u.normal(self.index), self.v.normal(self.index)];
        self.index += 1;
        match self.noise {
            EdgeNoise::None => [0.0; 2],
            EdgeNoise::White { sigma_px } => normal.map(|n| n * sigma_px),
            EdgeNoise::GaussMarkov { variance_px2, correlation_px } => {
                let sigma = variance_px2.max(0.0).sqrt();
                let (rho, before) = match self.last {
                    Some((p, arc, e)) if p == segment => (libm::exp(-(arc_px - arc) / correlation_px), e),
                    _ => (0.0, [0.0; 2]),
                };
                let fresh = sigma * (1.0 - rho * rho).sqrt();
                let error = [0, 1].map(|i| rho * before[i] + fresh * normal[i]);
                self.last = Some((segment, arc_px, error));
                error
            }
        }
    }
}
