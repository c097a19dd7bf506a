//! Counts the epochs of a rig whose heads contradict each other, against those that chance explains.

/// How the reason of an epoch begins whose heads contradict each other.
const INCONSISTENT: &str = "inconsistent";
/// Probability of a false alarm over all epochs: that of three sigmas.
const SURE: f64 = 0.003;

/// Counts epochs by what the check of the heads says.
#[derive(Default)]
pub(crate) struct Contradictions {
    epochs: u64,
    answers: u64,
    /// Epochs without an answer, because the heads contradict each other.
    refused: u64,
    /// Epochs in which a head was excluded.
    excluded: u64,
}

impl Contradictions {
    /// Counts the joint answer of an epoch. `has_excluded` says that its check excluded a head.
    pub(crate) fn count(&mut self, is_answer: bool, detail: &str, has_excluded: bool) {
        self.epochs += 1;
        self.answers += u64::from(is_answer);
        let is_refused = !is_answer && detail.starts_with(INCONSISTENT);
        self.refused += u64::from(is_refused);
        self.excluded += u64::from(has_excluded && !is_refused);
    }

    /// Returns whether no epoch has an answer, and several are refused.
    pub(crate) fn is_in_all(&self, false_alarm: f64) -> bool {
        self.answers == 0 && self.refused > most_by_chance(self.epochs, false_alarm)
    }

    /// Says that the heads contradict each other more often than by chance, if other epochs have answers.
    pub(crate) fn describe_doubt(&self, false_alarm: f64) -> Option<String> {
        let most = most_by_chance(self.epochs, false_alarm);
        (self.refused > most && self.answers > 0).then(|| {
            format!(
                "the answers are doubtful: the heads contradict each other in {} of {} epochs, far more often than by \
                 chance (at most {most}, from rig.false_alarm). An error of a mount or of a lens that is just below \
                 the limit is in the other answers, too, and their sigma does not contain it: check the mounts (`hzn \
                 calibrate rig --check`) and the lenses before you use them",
                self.refused, self.epochs
            )
        })
    }

    /// Says that the joint answer refuses more epochs, or excludes a head from more of them, than chance explains.
    pub(crate) fn describe(&self, false_alarm: f64) -> Option<String> {
        let most = most_by_chance(self.epochs, false_alarm);
        (self.refused + self.excluded > most).then(|| {
            format!(
                "in {} of {} epochs the heads contradict each other by more than the sigmas that are told ({} without \
                 an answer, {} with a head excluded); by chance it is at most {most}, from rig.false_alarm",
                self.refused + self.excluded,
                self.epochs,
                self.refused,
                self.excluded
            )
        })
    }
}

/// Returns the largest number of contradictions that chance explains: a larger one has at most the probability
/// [`SURE`] if each epoch has the probability `false_alarm`. Neighbouring epochs share much of their error, so that one
/// event may be two epochs long.
pub(crate) fn most_by_chance(epochs: u64, false_alarm: f64) -> u64 {
    // Probabilities of the binomial distribution, one after the other.
    let odds = false_alarm / (1.0 - false_alarm);
    let mut own = (epochs as f64 * (-false_alarm).ln_1p()).exp();
    let mut at_most = own;
    let mut count = 0;
    while at_most < 1.0 - SURE && count < epochs {
        own *= odds * (epochs - count) as f64 / (count + 1) as f64;
        at_most += own;
        count += 1;
    }
    count.max(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(answers: u64, refused: u64, excluded: u64) -> Contradictions {
        let mut seen = Contradictions::default();
        (0..answers).for_each(|k| seen.count(true, "", k < excluded));
        (0..refused).for_each(|_| seen.count(false, "inconsistent: why", false));
        seen
    }

    #[test]
    fn the_limit_is_that_of_the_binomial_distribution() {
        // Of 3000 epochs three are expected, and more than nine in 0.11 % of the cases, more than eight in 0.38 %.
        assert_eq!([most_by_chance(3000, 1e-3), most_by_chance(80, 1e-3)], [9, 2]);
        assert!(most_by_chance(80, 0.05) > 8);
    }

    #[test]
    fn contradictions_cast_doubt_on_the_other_answers() {
        assert!(seen(22, 8, 0).describe_doubt(1e-3).is_some_and(|what| what.contains("8 of 30 epochs")));
        assert!(seen(60, 3, 0).describe_doubt(1e-3).is_some());
        // Chance, a single event, no answer at all, and a head that is excluded as it should be.
        for good in [seen(2997, 3, 0), seen(20, 2, 0), seen(0, 4, 0), seen(80, 0, 40)] {
            assert_eq!(good.describe_doubt(1e-3), None);
        }
        assert!(seen(0, 4, 0).is_in_all(1e-3) && !seen(0, 1, 0).is_in_all(1e-3));
        // For the mounts, an excluded head counts as well.
        assert!(seen(80, 0, 40).describe(1e-3).is_some() && seen(80, 0, 1).describe(1e-3).is_none());
    }
}
