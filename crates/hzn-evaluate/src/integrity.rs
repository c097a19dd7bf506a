//! The protection level against the error: the Stanford diagram as numbers.

use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF};

use crate::case::Case;
use crate::quantile::quantile;

/// Upper ends of the ranges of error over protection level. Answers above the last one are misleading.
const RANGES: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// The protection level of many answers against their errors. An answer whose error is above its level is misleading.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Integrity {
    /// Number of answers with a protection level to pictures with a limb in view.
    pub answers: usize,
    /// Number of misleading ones among them.
    pub misleading: usize,
    /// Share of misleading answers.
    pub share: f64,
    /// Its 95 % interval (Clopper and Pearson 1934), for answers whose errors are independent. The answers of one
    /// flight are not: the interval is then too narrow.
    pub interval: [f64; 2],
    /// Median of the level, degrees.
    pub median_deg: f64,
    /// Median of the level, as a multiple of the larger standard deviation.
    pub median_sigmas: f64,
    /// Number of answers in each range of error over level.
    pub ranges: Vec<IntegrityRange>,
}

/// The answers in a range of error over protection level.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct IntegrityRange {
    /// Lower end.
    pub above: f64,
    /// Upper end, which belongs to the range; `None` for the misleading answers.
    pub up_to: Option<f64>,
    /// Number of answers to pictures with a limb in view.
    pub with_limb: usize,
    /// Number of answers to pictures without a limb in view. The level does not hold for these, because it holds for an
    /// edge that is the limb.
    pub without_limb: usize,
}

impl Integrity {
    /// Compares the answers of one body with their levels; `None` if no answer to a limb has a level.
    pub(crate) fn of(cases: &[&Case]) -> Option<Self> {
        let protected: Vec<_> =
            cases.iter().filter_map(|c| c.miss.and_then(|m| Some((c.limb, m, m.found.protection_deg?)))).collect();
        let of_limb = || protected.iter().filter(|(has_limb, ..)| *has_limb);
        let sorted = |value: &dyn Fn(f64, f64) -> f64| {
            let mut values: Vec<f64> = of_limb().map(|(_, m, level)| value(*level, m.sigma_max_deg)).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        let (answers, misleading) = (of_limb().count(), of_limb().filter(|(_, m, level)| m.angle_deg > *level).count());
        let ratios: Vec<(bool, f64)> = protected.iter().map(|(limb, m, level)| (*limb, m.angle_deg / level)).collect();
        (answers > 0).then(|| Self {
            answers,
            misleading,
            share: misleading as f64 / answers as f64,
            interval: share_interval(misleading, answers),
            median_deg: quantile(&sorted(&|level, _| level), 0.5),
            median_sigmas: quantile(&sorted(&|level, sigma| level / sigma), 0.5),
            ranges: ranges(&ratios),
        })
    }
}

/// Counts answers by error over level, with and without a limb in view.
fn ranges(ratios: &[(bool, f64)]) -> Vec<IntegrityRange> {
    let ends = || RANGES.into_iter().map(Some).chain([None]);
    let count = |above: f64, up_to: Option<f64>, limb: bool| {
        let is_in = |ratio: f64| (ratio > above || above == 0.0) && up_to.is_none_or(|most| ratio <= most);
        ratios.iter().filter(|(has_limb, ratio)| *has_limb == limb && is_in(*ratio)).count()
    };
    let range = |(above, up_to)| IntegrityRange {
        above,
        up_to,
        with_limb: count(above, up_to, true),
        without_limb: count(above, up_to, false),
    };
    [0.0].into_iter().chain(RANGES).zip(ends()).map(range).collect()
}

/// Returns the 95 % interval of the probability of an event that happened `hits` times in `trials`, after Clopper and
/// Pearson (1934).
pub fn share_interval(hits: usize, trials: usize) -> [f64; 2] {
    let quantile = |a: usize, b: usize, p: f64| Beta::new(a as f64, b as f64).map_or(f64::NAN, |x| x.inverse_cdf(p));
    let low = if hits == 0 { 0.0 } else { quantile(hits, trials - hits + 1, 0.025) };
    let high = if hits >= trials { 1.0 } else { quantile(hits + 1, trials - hits, 0.975) };
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_those_of_clopper_and_pearson() {
        // Values of R: binom.test(0, 100)$conf.int and so on.
        for (hits, trials, low, high) in
            [(0, 100, 0.0, 0.036_217), (2, 100, 0.002_431, 0.070_384), (5, 5, 0.478_176, 1.0)]
        {
            let [a, b] = share_interval(hits, trials);
            assert!((a - low).abs() < 1e-5 && (b - high).abs() < 1e-5, "{hits} of {trials}: {a} {b}");
        }
    }
}
