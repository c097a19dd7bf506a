//! Robust weights of observations.

use hzn_core::camera::{Config, Equation};

use crate::adjust::Block;

/// Width of the Cauchy loss in standard deviations, for 95 % efficiency with normal errors (Holland & Welsch 1977).
const CAUCHY: f64 = 2.3849;
/// The median length of a residual whose two coordinates have a standard deviation of 1: √(2 ln 2).
const MEDIAN_LENGTH: f64 = 1.1774;
/// Largest length of a residual in standard deviations. Normal errors exceed it once in 25 000 observations:
/// exp(−4.5²/2) = 4·10⁻⁵.
const MAX_LENGTH: f64 = 4.5;

/// Returns the lengths of all residuals, px, block by block.
fn lengths_px(config: &Config, blocks: &[Block]) -> Vec<Vec<f64>> {
    let lens = Equation::new(config);
    let length = |[u, v]: [f64; 2]| {
        let length = u.hypot(v);
        if length.is_finite() { length } else { f64::INFINITY }
    };
    blocks.iter().map(|block| block.residuals_px(&lens).into_iter().map(length).collect()).collect()
}

/// Returns the 1-sigma of a coordinate from the median length of the residuals, which outliers hardly change.
fn sigma_px(lengths: &[Vec<f64>]) -> f64 {
    let mut all: Vec<f64> = lengths.iter().flatten().copied().collect();
    all.sort_by(f64::total_cmp);
    let median = all.get(all.len() / 2).copied().unwrap_or(0.0);
    // Exact data would leave a scale of zero.
    (median / MEDIAN_LENGTH).max(1e-9)
}

/// Gives every observation its weight by the Cauchy loss.
pub(crate) fn weigh(config: &Config, blocks: &mut [Block]) {
    let lengths = lengths_px(config, blocks);
    let scale = CAUCHY * sigma_px(&lengths);
    for (block, lengths) in blocks.iter_mut().zip(&lengths) {
        for (o, length) in block.observations.iter_mut().zip(lengths) {
            o.weight = 1.0 / (1.0 + (length / scale).powi(2));
        }
    }
}

/// Gives outliers the weight 0 and all other observations the weight 1. Returns whether a weight has changed.
pub(crate) fn reject(config: &Config, blocks: &mut [Block]) -> bool {
    let lengths = lengths_px(config, blocks);
    let limit = MAX_LENGTH * sigma_px(&lengths);
    let mut changed = false;
    for (block, lengths) in blocks.iter_mut().zip(&lengths) {
        for (o, length) in block.observations.iter_mut().zip(lengths) {
            let weight = if *length <= limit { 1.0 } else { 0.0 };
            changed |= weight != o.weight;
            o.weight = weight;
        }
    }
    changed
}
