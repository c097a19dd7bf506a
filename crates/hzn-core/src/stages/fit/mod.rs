//! Gauss-Newton on the sphere: fits the cone s·e = cos α to the edge points.
//!
//! The state is the unit axis e and k = 1 − cos α. For a small disc, k keeps its precision while cos α loses it; for
//! the same reason 1 − s·e is computed as |s − e|²/2. In the following, c = cos α. For each point, r = c − s·e is the
//! residual and g = ∂(s·e)/∂(u, v). Then |r|/|g| is the distance from the limb in pixels, so that w = 1/|g|² weighs by
//! pixels. Let h = [Bᵀs − m, −1], where B is the tangent basis at e and m is the mean of Bᵀs. A step solves
//! (Σ w h hᵀ) δ = Σ w r h. Subtracting the means keeps the sums well-conditioned in single precision; the third unknown
//! is then δc' = δc − m·δ₁₂.
//!
//! In the robust iterations, the expected half-angle is one more row. Its weight takes into account that the errors of
//! the edge are *correlated*. Then the half-angle is fitted freely with the weights that were found: for the
//! covariance, for the altitude estimate, and for the test of the candidate. `covariance` fuses the two half-angles.

mod angle;
mod circle;
pub(crate) mod closed;
mod cone;
mod config;
pub(crate) mod conic;
pub(crate) mod direct;
mod given;
mod published;
mod quadric;
mod sphere;
mod sums;

use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::block::Block;
use crate::geometry::camera::Camera;
use crate::model::body::Expected;
use crate::model::edge_noise;
use crate::stages::consensus::Consensus;
pub(crate) use cone::Fit;
use cone::count_points;
pub use config::{Config, HalfAngle, Method};
#[cfg(any(test, feature = "_edges"))]
pub(crate) use given::fit_at;
#[cfg(any(test, feature = "_edges"))]
pub(crate) use given::fit_position_from;
use published::fit_by;
use published::{HALF_TURN_RAD, elliptic};
pub(crate) use quadric::Quadric;
use sphere::sphere;
#[cfg(test)]
pub(crate) use sums::Weights;
pub(crate) use sums::{Sums, inverse};
#[cfg(test)]
pub(crate) use sums::{means, pass};

/// Fits the cone, and stores the weight of each point in its block. The result is `None` if the points do not determine
/// a cone.
pub(crate) fn fit<T: Real>(
    blocks: &mut [Block<T>],
    start: &Consensus<T>,
    expected: &Expected<T>,
    camera: &Camera<T>,
    threshold_px: T,
    config: &Config,
    noise: &edge_noise::Config,
) -> Option<Fit<T>> {
    let cone = match config.method {
        Method::Direct if cfg!(feature = "dlr") => {
            fit_by(blocks, start, threshold_px, |blocks| direct::fit(blocks).map(with_k))?
        }
        Method::Conic if cfg!(feature = "dlr") => {
            fit_by(blocks, start, threshold_px, |blocks| conic::fit(blocks).map(with_k))?
        }
        Method::Tls if cfg!(feature = "zju") => elliptic(blocks, start, threshold_px, HALF_TURN_RAD)?,
        Method::Wtls if cfg!(feature = "zju") => {
            elliptic(blocks, start, threshold_px, config.weigh_above_deg.to_radians())?
        }
        Method::Circle if cfg!(feature = "horace") => {
            fit_by(blocks, start, threshold_px, |blocks| circle::fit(blocks, camera).map(with_k))?
        }
        Method::LeastSquares if cfg!(feature = "position") => {
            fit_by(blocks, start, threshold_px, |blocks| closed::least_squares(blocks))?
        }
        Method::GeneralisedTls if cfg!(feature = "position") => {
            fit_by(blocks, start, threshold_px, |blocks| closed::generalised_tls(blocks))?
        }
        // `Config::check` refuses a method that is not built in.
        _ => sphere(blocks, start, expected, threshold_px, config, noise)?,
    };
    Some(count_points(blocks, cone))
}

/// Converts the cosine of a half-angle to 1 − cos.
// The published equations give a cosine, therefore a small disc has lost its digits before this line.
fn with_k<T: Real>((e, c): (V3<T>, T)) -> (V3<T>, T) {
    (e, T::one() - c)
}
