//! Chooses answers that say whether altitude and lens are right.

use hzn_core::Config;
use hzn_run::engine::Finished;
use hzn_run::record;

use super::spread::Spread;

/// An answer with the altitude that its half-angle says.
#[derive(Debug, Clone, Copy)]
struct Measured {
    index: u64,
    /// Its distance from the altitude that was told, in its sigmas.
    sigmas: f64,
}

/// Collects answers with a measured altitude.
#[derive(Debug, Default)]
pub(crate) struct Altitudes {
    measured: Spread<Measured>,
}

impl Altitudes {
    pub(crate) fn count(&mut self, frame: &Finished, config: &Config) {
        let solution = frame.outcomes.first().and_then(|first| first.report.as_ref().ok()?.solution.as_ref());
        let Some((measured_m, sigma_m)) = solution.and_then(|solution| solution.altitude_m) else { return };
        let bodies = config.each_body();
        let told_km = bodies.first().and_then(|body| record::altitude_km(frame.data.as_ref(), body));
        let Some(told_km) = told_km else { return };
        let sigmas = (measured_m * 1e-3 - told_km) / (sigma_m * 1e-3).max(f64::MIN_POSITIVE);
        self.measured.add(Measured { index: frame.index, sigmas });
    }

    /// Returns the numbers of pictures that are worth a comparison of all half-angles: none if they agree as well as
    /// chance lets them agree, because the comparison processes them again.
    pub(crate) fn pictures(&self) -> Vec<u64> {
        let squares: Vec<f64> = self.measured.each().map(|measured| measured.sigmas.powi(2)).collect();
        if squares.iter().sum::<f64>() <= squares.len() as f64 {
            return Vec::new();
        }
        self.measured.choose(|measured| Some(measured.index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_that_agree_are_not_looked_at_again() {
        let with = |sigmas: [f64; 4]| {
            let mut altitudes = Altitudes::default();
            (0..).zip(sigmas).for_each(|(index, sigmas)| altitudes.measured.add(Measured { index, sigmas }));
            altitudes.pictures()
        };
        assert!(with([0.5, -0.9, 1.2, 0.1]).is_empty());
        assert_eq!(with([1.8, 1.5, 2.1, 1.9]), [0, 1, 2, 3]);
        assert!(Altitudes::default().pictures().is_empty());
    }
}
