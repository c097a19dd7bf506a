//! Random numbers in sequence, from a seed.

use hzn_sim::counter::{Counter, Stream};

/// A source of random numbers that are used in order.
#[derive(Debug)]
pub(super) struct Dice {
    numbers: Counter,
    next: u64,
}

impl Dice {
    /// Makes the source for a part of a trial. Each `part` has independent numbers, so a change of one part does not
    /// change the others.
    pub(super) fn new(seed: u64, part: u64) -> Self {
        Self {
            numbers: Counter::new(seed.wrapping_mul(0x9E37_79B9).wrapping_add(part << 48), Stream::Artefact),
            next: 0,
        }
    }
    /// Returns a uniform number between two values.
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        self.next += 1;
        low + (high - low) * self.numbers.uniform(self.next)
    }
    /// Returns a number between two positive values, uniform in its logarithm.
    pub(super) fn between_log(&mut self, low: f64, high: f64) -> f64 {
        libm::exp(self.between(libm::log(low), libm::log(high)))
    }
    /// Returns a normal number with mean 0 and variance 1.
    pub(super) fn normal(&mut self) -> f64 {
        self.next += 1;
        self.numbers.normal(self.next)
    }
    /// Returns true with this probability.
    pub(super) fn chance(&mut self, probability: f64) -> bool {
        self.between(0.0, 1.0) < probability
    }
    /// Returns an angle between 0 and a full turn, radians.
    pub(super) fn turn(&mut self) -> f64 {
        self.between(0.0, core::f64::consts::TAU)
    }
    /// Returns a whole number from `low` to `high`, both included.
    pub(super) fn count(&mut self, low: u32, high: u32) -> u32 {
        low + (self.between(0.0, f64::from(high - low + 1)) as u32).min(high - low)
    }
    /// Returns one of several choices, with probabilities in proportion to the weights.
    pub(super) fn pick<T: Copy>(&mut self, choices: &[(f64, T)]) -> Option<T> {
        let total: f64 = choices.iter().map(|c| c.0).sum();
        let mut left = self.between(0.0, total);
        choices
            .iter()
            .find(|c| {
                left -= c.0;
                left < 0.0
            })
            .or(choices.last())
            .map(|c| c.1)
    }
}
