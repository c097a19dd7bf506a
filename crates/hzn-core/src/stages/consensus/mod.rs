//! Outlier rejection: finds the cone that most points agree on.
//!
//! The default method is random sample consensus (RANSAC) with the minimal solver for a known half-angle, which needs
//! two points. It uses three points if the sigma of the half-angle is above one degree. A further point verifies each
//! hypothesis, so that most wrong hypotheses cost little. The others are scored by truncated squared distances on a
//! part of the points. With 80 % outliers, 574 draws find the limb with a probability of 99 %.

mod config;
mod inliers;
mod mlesac;
mod noise;
mod preverified;
mod ransac;
mod sampled;
mod two_point;

use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};
use crate::geometry::cone::through_three;
use crate::model::body::Expected;
use crate::model::work::WorkBudget;
use two_point::{ray, search};

pub use config::{Config, Method};
pub(crate) use inliers::{Consensus, Threshold};

/// Finds the consensus. A point whose lit side is away from the consensus gets weight 0, because it belongs to another
/// edge. The result is `None` if no cone goes through about a tenth of the points.
pub(crate) fn find<T: Real>(
    blocks: &mut [Block<T>],
    count: u32,
    expected: &Expected<T>,
    focal_px: T,
    threshold: Threshold<T>,
    config: &Config,
    work: &mut WorkBudget,
) -> Option<Consensus<T>> {
    let best = match config.method {
        Method::None => {
            // The ends and the middle are used, because points far apart give the best start for the fit.
            let (a, b) = (ray(blocks, 0)?, ray(blocks, count.saturating_sub(1))?);
            let mid = ray(blocks, count / 2)?;
            let (e, c) = through_three(&a, &mid, &b)?;
            return Some(Consensus { e, c, draws: 1, all: true });
        }
        Method::Ransac if cfg!(feature = "dlr") => return ransac::find(blocks, count, threshold, config, work),
        Method::RansacPreverify if cfg!(feature = "zju") => {
            return preverified::find(blocks, count, threshold, config, work);
        }
        Method::Mlesac if cfg!(feature = "zju") => {
            return mlesac::find(blocks, count, focal_px, threshold, config, work);
        }
        // `Config::check` refuses a method that is not built in.
        _ => search(blocks, count, expected, focal_px, threshold, config, work)?,
    };
    for block in blocks {
        let g = block.gradient(&best.e);
        for lane in 0..LANES {
            // The closure runs only for points that pass the first test, because it costs a root.
            let lit = || expected.is_lit(&block.ray(lane), &best.e, best.c, focal_px);
            if !(block.is_lit_along(lane, [g[0][lane], g[1][lane]]) && lit()) {
                block.weight[lane] = T::ZERO;
            }
        }
    }
    Some(best)
}
