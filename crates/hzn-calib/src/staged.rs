//! The stages of a fit: robust adjustment from a guess, then removal of outliers.

use hzn_core::camera::Config;

use crate::adjust::{Adjusted, Block, Free, adjust};
use crate::calibrated::Dropped;
use crate::robust;

/// Largest part of a picture's corners that may be outliers. With more of them the picture as a whole is doubtful.
const MAX_OUTLIERS: f64 = 1.0 / 3.0;
/// Maximum number of rounds of the removal of outliers. It ends when a round changes nothing.
const ROUNDS: usize = 10;

/// Adjusts a guess in three stages, each with robust weights: the focal length, then the coefficients, then all
/// parameters. Each stage starts near its solution. `None` if the guess is impossible.
pub(crate) fn adjust_in_stages(config: &Config, blocks: &[Block]) -> Option<Adjusted> {
    let model = config.model;
    let mut adjusted = adjust(config, blocks, &Free::focal())?;
    for free in [Free::focal(), Free::focal_and_coefficients(model), Free::all(model)] {
        for _ in 0..3 {
            robust::weigh(&adjusted.config, &mut adjusted.blocks);
            // A stage that fails leaves the result of the stage before.
            adjusted = adjust(&adjusted.config, &adjusted.blocks, &free).unwrap_or(adjusted);
        }
    }
    Some(adjusted)
}

/// Removes outliers and pictures that have too many of them, and adjusts again, until nothing changes. `places` has for
/// each picture its place among the blocks, or the reason why it is not there; it is kept up to date. The removal ends
/// when fewer than `min_blocks` are left.
pub(crate) fn remove_outliers(
    rough: Adjusted,
    places: &mut [Result<usize, Dropped>],
    min_blocks: usize,
) -> Option<Adjusted> {
    let free = Free::all(rough.config.model);
    let mut adjusted = rough;
    for _ in 0..ROUNDS {
        let changed = robust::reject(&adjusted.config, &mut adjusted.blocks);
        let outliers = |block: &Block| block.observations.iter().filter(|o| o.weight == 0.0).count();
        let worst = adjusted
            .blocks
            .iter()
            .enumerate()
            .map(|(n, block)| (n, outliers(block), block.observations.len()))
            .filter(|(_, outliers, of)| *outliers as f64 > MAX_OUTLIERS * *of as f64)
            .max_by(|a, b| (a.1 * b.2).cmp(&(b.1 * a.2)));
        // One picture at a time: without it, the others may agree.
        if let Some((n, outliers, of)) = worst {
            adjusted.blocks.remove(n);
            for place in places.iter_mut() {
                match place {
                    Ok(index) if *index == n => *place = Err(Dropped::Outliers { outliers, of }),
                    Ok(index) if *index > n => *index -= 1,
                    _ => {}
                }
            }
            if adjusted.blocks.len() < min_blocks {
                return Some(adjusted);
            }
            robust::weigh(&adjusted.config, &mut adjusted.blocks);
        }
        adjusted = adjust(&adjusted.config, &adjusted.blocks, &free)?;
        if !changed && worst.is_none() {
            break;
        }
    }
    Some(adjusted)
}
