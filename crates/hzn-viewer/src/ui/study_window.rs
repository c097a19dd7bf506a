//! The state of the window that sweeps a parameter.

use hzn_files::keys::Key;

use crate::work::study::{Study, Tally};

/// The sweep of one key.
pub(super) struct StudyWindow {
    pub(super) key: &'static Key,
    /// Work in progress; `None` before it begins.
    pub(super) study: Option<Study>,
    /// First and last value.
    pub(super) range: [f64; 2],
    pub(super) logarithmic: bool,
    /// Number of pictures that are done.
    pub(super) done: usize,
    pub(super) tallies: Vec<Tally>,
}

impl StudyWindow {
    /// Number of values of a sweep.
    pub(super) const VALUES: usize = 13;

    /// Returns the values, from the first to the last one.
    pub(super) fn values(&self) -> Vec<f64> {
        let [low, high] = self.range;
        let part = |i: usize| i as f64 / (Self::VALUES - 1) as f64;
        let value = |i: usize| match self.logarithmic && low > 0.0 {
            true => low * (high / low).powf(part(i)),
            false => low + (high - low) * part(i),
        };
        (0..Self::VALUES).map(value).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_values_reach_both_ends() {
        let key = hzn_files::keys::find("threshold.scale").unwrap();
        let mut window =
            StudyWindow { key, study: None, range: [0.5, 2.0], logarithmic: true, done: 0, tallies: Vec::new() };
        let values = window.values();
        assert!((values[0] - 0.5).abs() < 1e-12 && (values[12] - 2.0).abs() < 1e-12 && (values[6] - 1.0).abs() < 1e-12);
        window.logarithmic = false;
        assert!((window.values()[6] - 1.25).abs() < 1e-12);
    }
}
