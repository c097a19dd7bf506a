//! Correlation of the residuals along the edge. It is only plotted; no value of the calibration comes from it.

use super::cone::Cone;

/// Width of a class of distances, in pixels.
const WIDTH_PX: f64 = 8.0;
/// Number of classes. The first has the products of each point with itself.
const CLASSES: usize = 60;

/// Sums of products of residuals, by their distance along the edge.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Lags {
    sums: [f64; CLASSES],
    counts: [f64; CLASSES],
}

impl Lags {
    pub(super) fn new(cone: &Cone) -> Self {
        let mut lags = Self { sums: [0.0; CLASSES], counts: [0.0; CLASSES] };
        for (i, one) in cone.rows.iter().enumerate() {
            let mut distance_px = 0.0;
            for other in cone.rows.get(i..).unwrap_or_default() {
                let weight = one.weight * other.weight;
                let class = if distance_px > 0.0 { 1 + (distance_px / WIDTH_PX) as usize } else { 0 };
                let (Some(sum), Some(count)) = (lags.sums.get_mut(class), lags.counts.get_mut(class)) else { break };
                *sum += weight * one.r_px * other.r_px;
                *count += weight;
                distance_px += other.step_px;
            }
        }
        lags
    }
}

/// Returns the correlation of all pictures' residuals by distance: (pixels, correlation).
pub(super) fn correlation<'a>(all: impl Iterator<Item = &'a Lags>) -> Vec<(f64, f64)> {
    let mut total = Lags { sums: [0.0; CLASSES], counts: [0.0; CLASSES] };
    for lags in all {
        let Some(own) = lags.counts.first().filter(|n| **n > 0.0).map(|n| lags.sums[0] / n) else { continue };
        // Each picture is scaled by its mean square residual.
        for class in 0..CLASSES {
            total.sums[class] += lags.sums[class] / own.max(1e-12);
            total.counts[class] += lags.counts[class];
        }
    }
    let middle = |class: usize| if class == 0 { 0.0 } else { (class as f64 - 0.5) * WIDTH_PX };
    let each = total.sums.iter().zip(&total.counts).enumerate();
    each.filter(|(_, (_, n))| **n > 0.0).map(|(class, (sum, n))| (middle(class), sum / n)).collect()
}
