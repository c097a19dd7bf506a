//! The threshold between dark and lit, in counts.

use super::histogram::Histogram;
use crate::base::real::Real;
use crate::model::threshold::{Config, Method};

/// Returns the threshold in counts if the configuration fixes it, otherwise `None`.
pub(crate) fn fixed_level<T: Real>(config: &Config, full_scale: u16) -> Option<u16> {
    let unit = if config.level < 1.0 { f64::from(full_scale) } else { 1.0 };
    (config.method == Method::Fixed).then(|| counts(T::from_f64(config.level * unit)))
}

/// The threshold, and statistics of the sample from which it comes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level<T> {
    /// Threshold in counts. A pixel is lit at this value or above.
    pub level: u16,
    /// Mean of the sample in counts.
    pub mean: T,
    /// Number of pixels in the sample.
    pub samples: u32,
    /// Mean of the dark pixels of the sample, in counts.
    pub dark: T,
    /// Mean of the lit pixels of the sample minus the mean of the dark ones, in counts; 0 if one class is empty.
    pub contrast: T,
    /// Standard deviation of the dark pixels of the sample, in counts: their noise and the slope of their brightness.
    pub(crate) spread: T,
    /// Number of places that were drawn, in all samples: those that the region leaves out, too.
    pub(crate) drawn: u32,
}

impl<T: Real> Level<T> {
    /// Returns the threshold at the fraction `part` of the way from the dark pixels to this threshold, in counts. A
    /// `part` of 1 gives this threshold. Half of a threshold then means half of the light, even if the sky is not
    /// black, as in 16-bit pictures of a thermal camera.
    pub(crate) fn at_fraction(&self, part: f64) -> u16 {
        let level = T::from_i32(i32::from(self.level));
        counts(self.dark + (level - self.dark) * T::from_f64(part))
    }
}

impl<T: Real> Level<T> {
    /// Makes the threshold `level` of a sample.
    pub(super) fn new(sample: &Histogram, level: u16, mean: T, samples: u32, drawn: u32) -> Self {
        let (dark, contrast) = sample.classes(level, mean);
        Self { level, mean, samples, dark, contrast, spread: sample.dark_spread(level, dark), drawn }
    }

    /// Returns the threshold that is `noise` counts above the mean of the dark pixels, rounded upwards.
    pub(crate) fn at_noise(&self, noise: T) -> u16 {
        counts((self.dark + noise).floor() + T::one())
    }
}

/// Converts a threshold to whole counts from 1 to 65535; a threshold of 0 would make every pixel lit.
pub(super) fn counts<T: Real>(level: T) -> u16 {
    level.to_i32().clamp(1, 65535) as u16
}
