//! Whether pictures of a rolling shutter contradict the rates that they were processed with.
//!
//! Wrong rates bend the limb: each row is turned to another place. A picture that was taken with other rates then fits
//! better with those. [`RateTrial`] processes a picture again with the other rates that mistakes suggest, and
//! [`find_rate_fault`] compares all pictures. The turns between pictures say nothing here: a vehicle may turn otherwise
//! from one picture to the next.

use hzn_core::error::ConfigError;
use hzn_core::image::ImageView;
use hzn_core::{Config, Report};
use hzn_files::FrameData;

use crate::engine::AnySensor;

/// What may be wrong with the rates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RateFault {
    /// They are 57 times too large, as those in degrees per second are. Rates about other axes and rates of other times
    /// look alike if the true ones are small.
    TooLarge,
    /// They have the opposite sign, or the readout time has.
    Negated,
}

impl RateFault {
    /// All faults.
    pub const ALL: [Self; 2] = [Self::TooLarge, Self::Negated];

    /// Returns the factor that makes the rates right.
    const fn factor(self) -> f64 {
        match self {
            Self::TooLarge => core::f64::consts::PI / 180.0,
            Self::Negated => -1.0,
        }
    }
}

/// How much better a picture fits with the rates of each fault than with the told ones: the change of the logarithm of
/// the mean square distance from the limb. It is infinite if the picture has an answer with only one of them.
pub type Gains = [f64; RateFault::ALL.len()];

/// Probability that a flight with right rates is doubted, if its rates change nothing but chance.
const FALSE_ALARM: f64 = 0.01;
/// Smaller gains say nothing. The unevenness of a limb is alike over some tens of pixels, so that its 300 to 400 points
/// are about 30 independent ones, and their mean square is known to √(2/30) = 0.26. It also keeps a small error of the
/// lens, the same in all pictures, from looking like agreement.
const LEAST_GAIN: f64 = 0.26;

/// A sensor that processes pictures with other rates.
pub struct RateTrial {
    sensor: AnySensor,
    bodies: usize,
    threshold_px: f64,
}

impl RateTrial {
    /// Makes the trial from the sensor of the pictures.
    ///
    /// # Errors
    /// The first field outside its limits.
    pub fn new(config: &Config, flight: bool) -> Result<Self, ConfigError> {
        let (bodies, threshold_px) = (config.each_body().len(), config.consensus.threshold_px);
        Ok(Self { sensor: AnySensor::new(config, flight)?, bodies, threshold_px })
    }

    /// Returns how much better the first body of a picture fits with other rates; `None` if the picture has no rate, or
    /// no answer at all.
    pub fn compare(&mut self, view: &ImageView<'_>, data: &FrameData) -> Option<Gains> {
        let rate = data.rate_rad_s?;
        let mut fit = |factor: f64| {
            // An answer with other rates says nothing about the next one.
            self.sensor.remember(&vec![None; self.bodies]);
            let turned = FrameData { rate_rad_s: Some(rate.map(|r| r * factor)), ..data.clone() };
            Fit::of(self.sensor.process(view, Some(&turned), None).first()?.report.as_ref().ok()?)
        };
        let (told, others) = (fit(1.0), RateFault::ALL.map(|fault| fit(fault.factor())));
        if told.is_none() && others.iter().all(Option::is_none) {
            return None;
        }
        Some(others.map(|other| gain(told, other, self.threshold_px)))
    }
}

/// The fit of one answer.
#[derive(Debug, Clone, Copy)]
struct Fit {
    inliers: f64,
    rms_px: f64,
}

impl Fit {
    fn of(report: &Report<f64>) -> Option<Self> {
        let solution = report.solution.as_ref()?;
        Some(Self { inliers: f64::from(solution.inliers), rms_px: solution.rms_px })
    }

    /// Returns the sum of the squared distances. Each of `points` that is no inlier counts as one at the threshold.
    fn cost(self, points: f64, threshold_px: f64) -> f64 {
        self.inliers * self.rms_px.powi(2) + (points - self.inliers) * threshold_px.powi(2)
    }
}

fn gain(told: Option<Fit>, other: Option<Fit>, threshold_px: f64) -> f64 {
    match (told, other) {
        (Some(told), Some(other)) => {
            let points = told.inliers.max(other.inliers);
            let [before, after] = [told, other].map(|fit| fit.cost(points, threshold_px).max(f64::MIN_POSITIVE));
            let gain = (before / after).ln();
            if gain.abs() < LEAST_GAIN { 0.0 } else { gain }
        }
        (None, Some(_)) => f64::INFINITY,
        (Some(_), None) => f64::NEG_INFINITY,
        (None, None) => 0.0,
    }
}

/// Returns what is wrong with the rates, with the number of pictures that fit better without the fault; `None` if the
/// pictures do not contradict them.
pub fn find_rate_fault(pictures: &[Gains]) -> Option<(RateFault, usize)> {
    let of = |i: usize| pictures.iter().filter_map(|gains| gains.get(i).copied()).collect::<Vec<f64>>();
    let limit = FALSE_ALARM / RateFault::ALL.len() as f64;
    let faults = RateFault::ALL.into_iter().enumerate().map(|(i, fault)| (fault, of(i)));
    let found = faults.filter(|(_, gains)| chance(gains) < limit);
    let (fault, gains) = found.max_by(|(_, a), (_, b)| median(a).total_cmp(&median(b)))?;
    Some((fault, gains.iter().filter(|gain| **gain > 0.0).count()))
}

/// Returns the probability that values whose signs are chance are as positive as these: the signed-rank test of
/// Wilcoxon, exact, also with ties (Hollander, Wolfe and Chicken, Nonparametric Statistical Methods, section 3.1).
fn chance(gains: &[f64]) -> f64 {
    let mut sizes: Vec<(f64, bool)> =
        gains.iter().filter(|gain| **gain != 0.0).map(|gain| (gain.abs(), *gain < 0.0)).collect();
    sizes.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Equal sizes share the mean of their ranks. Twice the rank is a whole number.
    let mut doubled: Vec<(usize, bool)> = Vec::with_capacity(sizes.len());
    for equal in sizes.chunk_by(|a, b| a.0 == b.0) {
        let rank = 2 * doubled.len() + equal.len() + 1;
        doubled.extend(equal.iter().map(|(_, is_negative)| (rank, *is_negative)));
    }
    let worse: usize = doubled.iter().filter(|(_, is_negative)| *is_negative).map(|(rank, _)| rank).sum();
    // The probability of each sum of the negative ranks, rank by rank.
    let mut probabilities = vec![1.0];
    for (rank, _) in &doubled {
        let mut next = vec![0.0; probabilities.len() + rank];
        for (sum, p) in probabilities.iter().enumerate() {
            for at in [sum, sum + rank] {
                if let Some(slot) = next.get_mut(at) {
                    *slot += 0.5 * p;
                }
            }
        }
        probabilities = next;
    }
    probabilities.iter().take(worse + 1).sum()
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_signed_ranks_have_their_exact_probability() {
        // Of the 32 patterns of five signs, one has no negative rank, one each the sums 1 and 2, two the sum 3.
        let close = |gains: &[f64], of_32: f64| (chance(gains) - of_32 / 32.0).abs() < 1e-12;
        assert!(close(&[5.0, 4.0, 3.0, 2.0, 1.0], 1.0) && close(&[5.0, 4.0, 3.0, 2.0, -1.0], 2.0));
        assert!(close(&[5.0, 4.0, -3.0, 2.0, 1.0], 5.0));
        assert!(close(&[5.0, 4.0, 3.0, 0.0, 0.0, 2.0, 1.0], 1.0), "zeros say nothing");
        // The sizes 2, 2 share the rank 1.5. The sums up to 1.5 are 0, 1.5 and 1.5.
        assert!(close(&[5.0, 4.0, 3.0, 2.0, -2.0], 3.0) && close(&[f64::INFINITY; 5], 1.0));
        assert_eq!(chance(&[]), 1.0);
    }

    #[test]
    fn only_pictures_that_agree_contradict_the_rates() {
        let all =
            |good: usize, bad: usize| [vec![[0.5, -f64::INFINITY]; good], vec![[-0.5, -f64::INFINITY]; bad]].concat();
        assert_eq!(find_rate_fault(&all(8, 0)), Some((RateFault::TooLarge, 8)));
        assert_eq!(find_rate_fault(&all(7, 0)), None, "one of 128 flights looks like this by chance");
        assert_eq!(find_rate_fault(&all(11, 5)), None);
        // Smaller rates are better than those of the wrong sign, and the right ones are better still.
        assert_eq!(find_rate_fault(&[[0.5, 1.0]; 9]), Some((RateFault::Negated, 9)));
    }

    #[test]
    fn a_lost_limb_counts_as_much_as_its_points_at_the_threshold() {
        let fit = |inliers: f64, rms_px: f64| Some(Fit { inliers, rms_px });
        assert!(gain(fit(200.0, 0.1), fit(400.0, 0.2), 3.0) > 0.0, "the other rates fit twice as many points");
        assert!(gain(fit(400.0, 0.2), fit(400.0, 0.1), 3.0) > 0.0);
        assert_eq!(gain(fit(400.0, 0.22), fit(400.0, 0.2), 3.0), 0.0, "such a difference is chance");
        assert_eq!(gain(None, fit(9.0, 1.0), 3.0), f64::INFINITY);
        assert_eq!(gain(None, None, 3.0), 0.0);
    }
}
