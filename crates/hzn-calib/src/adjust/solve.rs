//! The Levenberg-Marquardt iteration.

use hzn_core::camera::Config;
use nalgebra::{DMatrix, DVector};

use super::block::{BOW, Block};
use super::free::Free;
use super::normal::{Normal, cost};

/// Maximum number of accepted and refused steps. An adjustment from a sensible start needs 10 to 30.
const MAX_STEPS: usize = 200;
/// Damping of the first step (Marquardt 1963); the usual choice.
const FIRST_DAMPING: f64 = 1e-3;
/// Largest damping. With it a step changes nothing any more.
const MAX_DAMPING: f64 = 1e12;
/// The iteration ends when the predicted relative decrease of the cost is smaller. The steps left are then 10⁻⁶ of
/// their standard errors.
const MIN_DECREASE: f64 = 1e-12;

/// The result of an adjustment.
#[derive(Debug, Clone)]
pub(crate) struct Adjusted {
    /// The lens.
    pub(crate) config: Config,
    /// The blocks with their poses.
    pub(crate) blocks: Vec<Block>,
    /// Weighted sum of the squared residuals, px².
    pub(crate) cost: f64,
    /// Information matrix of the free parameters with the poses unknown, for residuals of 1 px in u and v. It is
    /// singular if the observations do not determine the parameters.
    pub(crate) information: DMatrix<f64>,
    /// The same for each block, and the gradient of its cost with the pose eliminated. The gradients add up to 0.
    pub(crate) reduced: Vec<(DMatrix<f64>, DVector<f64>)>,
    /// Change of the bow of the board against the start, mm; see [`Block::bent`].
    pub(crate) bow_mm: [f64; BOW],
}

/// Adjusts the free parameters and all poses. The result is `None` if the start is impossible: an observation has no
/// image point, or a block has fewer observations than its pose needs.
pub(crate) fn adjust(config: &Config, blocks: &[Block], free: &Free) -> Option<Adjusted> {
    let (mut config, mut blocks) = (config.clone(), blocks.to_vec());
    let mut normal = Normal::new(&config, &blocks, free)?;
    let mut bow_mm = [0.0; BOW];
    let mut damping = FIRST_DAMPING;
    for _ in 0..MAX_STEPS {
        let Some(step) = normal.step(damping) else {
            damping *= 10.0;
            if damping > MAX_DAMPING {
                break;
            }
            continue;
        };
        if step.predicted <= MIN_DECREASE * normal.cost {
            break;
        }
        let moved = free.moved(&config, step.lens.as_slice());
        let bow_step = free.bow_step(step.lens.as_slice());
        let moved_blocks: Vec<Block> =
            blocks.iter().zip(&step.poses).map(|(b, pose)| b.moved(pose).bent(bow_step)).collect();
        if is_usable(&moved) && cost(&moved, &moved_blocks) < normal.cost {
            (config, blocks) = (moved, moved_blocks);
            bow_mm = core::array::from_fn(|k| bow_mm[k] + bow_step[k]);
            normal = Normal::new(&config, &blocks, free)?;
            damping = (damping * 0.1).max(1e-12);
        } else {
            damping *= 10.0;
            if damping > MAX_DAMPING {
                break;
            }
        }
    }
    let n = free.len();
    let reduced = normal.reduced().unwrap_or_default().into_iter();
    let reduced: Vec<(DMatrix<f64>, DVector<f64>)> =
        reduced.map(|(all, gradient)| (all.view((0, 0), (n, n)).into(), gradient.rows(0, n).into())).collect();
    let information = reduced.iter().fold(DMatrix::zeros(n, n), |sum, (of_block, _)| sum + of_block);
    Some(Adjusted { config, blocks, cost: normal.cost, information, reduced, bow_mm })
}

/// Adjusts the pose of one block with a fixed lens.
pub(crate) fn adjust_pose(config: &Config, block: &Block) -> Option<Block> {
    adjust(config, std::slice::from_ref(block), &Free::none())?.blocks.pop()
}

/// Returns whether the values can be those of a lens. A step beyond them is refused.
fn is_usable(config: &Config) -> bool {
    config.fx_px > 0.0 && config.fy_px > 0.0 && config.k.iter().all(|k| k.is_finite())
}
