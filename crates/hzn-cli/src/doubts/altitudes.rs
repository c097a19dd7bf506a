//! Chooses answers that say whether altitude and lens are right.

use hzn_core::Config;
use hzn_core::status::Status;
use hzn_run::engine::Finished;
use hzn_run::record;

use super::spread::Spread;

/// An answer with the altitude that its half-angle says.
#[derive(Debug, Clone, Copy)]
struct Measured {
    index: u64,
    /// Its distance from the altitude that was told, in its sigmas.
    sigmas: f64,
    /// Direction of the body in the picture, from the optical axis: cosine and sine of its angle.
    side: [f64; 2],
}

/// Fewest answers that are at several places in the picture.
const ENOUGH: usize = 3;
/// Length of the mean of the directions up to which answers are at several places; it is 0.9 if they scatter by 26° to
/// both sides. The principal point of a limb that is always at one side cannot be told from the attitude.
const SEVERAL: f64 = 0.9;

/// Collects answers with a measured altitude, and the pictures that show any edge.
#[derive(Debug, Default)]
pub(crate) struct Altitudes {
    measured: Spread<Measured>,
    with_edge: Spread<u64>,
}

impl Altitudes {
    pub(crate) fn count(&mut self, frame: &Finished, config: &Config) {
        let Some(report) = frame.outcomes.first().and_then(|first| first.report.as_ref().ok()) else { return };
        if matches!(report.status, Status::Ok | Status::Rejected) {
            self.with_edge.add(frame.index);
        }
        let Some((measured_m, sigma_m)) = report.solution.as_ref().and_then(|solution| solution.altitude_m) else {
            return;
        };
        let bodies = config.each_body();
        let told_km = bodies.first().and_then(|body| record::altitude_km(frame.data.as_ref(), body));
        let Some(told_km) = told_km else { return };
        let sigmas = (measured_m * 1e-3 - told_km) / (sigma_m * 1e-3).max(f64::MIN_POSITIVE);
        let [x, y, _] = report.solution.as_ref().map_or([0.0; 3], |solution| solution.axis.xyz());
        let side = if x == 0.0 && y == 0.0 { [0.0; 2] } else { [x, y].map(|part| part / x.hypot(y)) };
        self.measured.add(Measured { index: frame.index, sigmas, side });
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

    /// Returns whether the body is at several sides of the pictures, so that they show the principal point.
    pub(crate) fn are_at_several_places(&self) -> bool {
        let sum = self.measured.each().fold([0.0; 2], |[x, y], answer| [x + answer.side[0], y + answer.side[1]]);
        let answers = self.measured.each().count();
        answers >= ENOUGH && sum[0].hypot(sum[1]) <= SEVERAL * answers as f64
    }

    /// Returns the numbers of pictures with an answer or with an edge that was refused: a fault of the lens refuses
    /// those that show most of it.
    pub(crate) fn with_edge(&self) -> Vec<u64> {
        self.with_edge.choose(Some)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_that_agree_are_not_looked_at_again() {
        let with = |sigmas: [f64; 4]| {
            let mut altitudes = Altitudes::default();
            (0..)
                .zip(sigmas)
                .for_each(|(index, sigmas)| altitudes.measured.add(Measured { index, sigmas, side: [0.0; 2] }));
            altitudes.pictures()
        };
        assert!(with([0.5, -0.9, 1.2, 0.1]).is_empty());
        assert_eq!(with([1.8, 1.5, 2.1, 1.9]), [0, 1, 2, 3]);
        assert!(Altitudes::default().pictures().is_empty());
    }

    #[test]
    fn answers_at_several_sides_are_noticed() {
        let with = |number: u64, step_rad: f64| {
            let mut altitudes = Altitudes::default();
            for index in 0..number {
                let (sin, cos) = (step_rad * index as f64).sin_cos();
                altitudes.measured.add(Measured { index, sigmas: 0.3, side: [cos, sin] });
            }
            altitudes.are_at_several_places()
        };
        assert!(with(16, 1.3) && with(8, 0.5) && !with(16, 0.02) && !with(2, 1.3));
        assert!(!Altitudes::default().are_at_several_places());
    }
}
