//! Looks for bodies that become darker towards the Sun that was told.

use hzn_run::engine::Finished;
use hzn_run::explain;

use crate::tell;

/// Mean correlation of brightness and height of the Sun below which the Sun is doubted: two sigma of a picture in which
/// they have nothing to do with each other. With the right Sun it is far above zero, because every surface is dark at
/// the border of the night.
const LIMIT: f64 = -0.3;

/// Collects the correlations of the answers with a told Sun.
#[derive(Default)]
pub(crate) struct ToldSun {
    answers: u64,
    sum: f64,
}

impl ToldSun {
    pub(crate) fn count(&mut self, frame: &Finished) {
        let is_answered = frame.answers().first().is_some_and(Option::is_some);
        if let Some(correlation) = frame.brightness_by_sun.filter(|_| is_answered) {
            self.answers += 1;
            self.sum += correlation;
        }
    }

    /// Returns what contradicts the Sun.
    fn describe(&self) -> Option<String> {
        (self.sum < LIMIT * self.answers as f64).then(|| {
            format!(
                "the body becomes darker towards the Sun that was told ({}, mean correlation {:.2}). Is the sign of \
                 the Sun's direction right, and its frame? sun_x, sun_y, sun_z point from the camera to the Sun, in \
                 the axes of the camera (x right, y down, z forward). With a wrong one, the border of the night is \
                 answered as the limb",
                explain::counted(self.answers, "answer"),
                self.sum / self.answers as f64
            )
        })
    }

    /// Tells it, also in a quiet run, because all answers have the same source of the Sun's direction.
    pub(crate) fn tell(&self) {
        if let Some(what) = self.describe() {
            tell::warning(format_args!("the answers are doubtful: {what}"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_that_becomes_darker_towards_the_sun_is_told() {
        let of = |answers, mean: f64| ToldSun { answers, sum: mean * answers as f64 }.describe();
        assert!(of(5, -0.6).is_some_and(|what| what.contains("5 answers, mean correlation -0.60")));
        assert!(of(1, -0.45).is_some());
        for right in [of(0, 0.0), of(8, 0.95), of(3, -0.2)] {
            assert_eq!(right, None);
        }
    }
}
