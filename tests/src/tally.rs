//! Errors, sigmas and NEES of many answers.

use core::fmt;

use crate::Answer;

/// What became of a number of pictures with truth.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    /// Pictures.
    pub frames: usize,
    /// Angles between answer and truth in degrees, one an answer.
    pub errors_deg: Vec<f64>,
    /// Standard deviations that the answers claim, in degrees.
    pub sigmas_deg: Vec<f64>,
    /// Squared errors over covariances, two degrees of freedom.
    pub nees: Vec<f64>,
}

impl Tally {
    /// Counts a picture, answered or not.
    pub fn add(&mut self, answer: Option<&Answer>, truth: [f64; 3]) {
        self.frames += 1;
        if let Some(a) = answer {
            self.errors_deg.push(a.error_deg(truth));
            self.sigmas_deg.push(a.sigma_deg());
            self.nees.push(a.nees(truth));
        }
    }
    /// Pictures with an answer.
    pub fn answered(&self) -> usize {
        self.errors_deg.len()
    }
    /// Root of the mean squared angle; NaN without answers.
    pub fn rms_deg(&self) -> f64 {
        mean(self.errors_deg.iter().map(|e| e * e)).sqrt()
    }
    /// The largest angle; 0 without answers.
    pub fn worst_deg(&self) -> f64 {
        self.errors_deg.iter().fold(0.0, |m, &e| e.max(m))
    }
    /// The middle of the claimed standard deviations; NaN without answers.
    pub fn median_sigma_deg(&self) -> f64 {
        let mut sorted = self.sigmas_deg.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
    }
    /// Mean of the squared errors over covariances; 2 when errors are as large as they are said to be.
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
