//! Counts answers whose edge is more likely no limb, which the default of `gates.min_p_limb` does not refuse.

use hzn_core::gates;
use hzn_run::engine::Finished;
use hzn_run::explain;

use crate::tell;

/// Below this probability, the edge of an answer is more likely no limb.
const EVEN: f64 = 0.5;

/// Counts answers by the probability that their edge is the limb.
#[derive(Default)]
pub(crate) struct Improbable {
    /// Answers with a probability, and those among them below [`EVEN`].
    known: u64,
    below: u64,
    /// The least probable one: the picture and its probability.
    least: Option<(String, f64)>,
}

impl Improbable {
    pub(crate) fn count(&mut self, frame: &Finished) {
        let reports = frame.outcomes.iter().filter_map(|outcome| outcome.report.as_ref().ok());
        for p in reports.filter_map(|report| report.solution.as_ref()?.p_limb) {
            self.add(&frame.name, p);
        }
    }

    fn add(&mut self, name: &str, p_limb: f64) {
        self.known += 1;
        self.below += u64::from(p_limb < EVEN);
        if self.least.as_ref().is_none_or(|(_, least)| p_limb < *least) {
            self.least = Some((name.to_owned(), p_limb));
        }
    }

    /// Returns how many answers are improbable, and the key that refuses them; `None` if there are none.
    fn describe(&self) -> Option<String> {
        let (name, least) = self.least.as_ref().filter(|_| self.below > 0)?;
        let answers = explain::counted(self.known, "answer");
        Some(format!(
            "{} of {answers} with status ok have a p_limb below {EVEN}: their edge is more likely no limb (least \
             {least:.3}, in {name}). gates.min_p_limb = {EVEN} refuses them",
            self.below
        ))
    }

    /// Tells it, also in a quiet run, because a program that reads only the statuses takes such answers. Nothing is
    /// left to say if the gate is at or above this probability.
    pub(crate) fn tell(&self, gates: &gates::Config) {
        self.told(gates).iter().for_each(tell::warning);
    }

    /// Tells it of a head of a rig.
    pub(crate) fn tell_of_head(&self, name: &str, gates: &gates::Config) {
        self.told(gates).iter().for_each(|what| tell::warning(format_args!("{name}: {what}")));
    }

    fn told(&self, gates: &gates::Config) -> Option<String> {
        self.describe().filter(|_| gates.min_p_limb < EVEN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_improbable_answers_are_told() {
        let mut seen = Improbable::default();
        seen.add("a.png", 0.5);
        seen.add("b.png", 0.99);
        assert_eq!(seen.describe(), None);
        seen.add("c.png", 0.0062);
        let what = seen.describe().unwrap();
        assert!(what.starts_with("1 of 3 answers") && what.contains("0.006, in c.png"), "{what}");
    }
}
