//! Collects errors, sigmas and NEES of many answers.

use core::fmt;

use crate::Answer;

/// Statistics of the answers to pictures with known truth.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    /// Number of pictures.
    pub frames: usize,
    /// Angles between answer and truth in degrees, one per answer.
    pub errors_deg: Vec<f64>,
    /// Largest claimed standard deviation of each answer in degrees.
    pub sigmas_deg: Vec<f64>,
    /// NEES of each answer, with two degrees of freedom.
    pub nees: Vec<f64>,
}

impl Tally {
    /// Adds a picture, with or without an answer.
    pub fn add(&mut self, answer: Option<&Answer>, truth: [f64; 3]) {
        self.frames += 1;
        if let Some(a) = answer {
            self.errors_deg.push(a.error_deg(truth));
            self.sigmas_deg.push(a.sigma_deg());
            self.nees.push(a.nees(truth));
        }
    }
    /// Returns the number of pictures with an answer.
    pub fn answered(&self) -> usize {
        self.errors_deg.len()
    }
    /// Returns the root of the mean squared angle in degrees; NaN without answers.
    pub fn rms_deg(&self) -> f64 {
        mean(self.errors_deg.iter().map(|e| e * e)).sqrt()
    }
    /// Returns the largest angle in degrees; 0 without answers.
    pub fn worst_deg(&self) -> f64 {
        self.errors_deg.iter().fold(0.0, |m, &e| e.max(m))
    }
    /// Returns the median of the claimed standard deviations in degrees; NaN without answers.
    pub fn median_sigma_deg(&self) -> f64 {
        let mut sorted = self.sigmas_deg.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
    }
    /// Returns the mean NEES; it is 2 when the covariance is right.
    pub fn mean_nees(&self) -> f64 {
        mean(self.nees.iter().copied())
    }
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = values.len() as f64;
    values.sum::<f64>() / n
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} of {} answered, {:.4}° RMS, worst {:.4}°, median sigma {:.4}°, NEES {:.2}",
            self.answered(),
            self.frames,
            self.rms_deg(),
            self.worst_deg(),
            self.median_sigma_deg(),
            self.mean_nees()
        )
    }
}
