//! The bit budget of the packets of pictures.

const US_PER_S: u64 = 1_000_000;

/// The bits that may be sent.
#[derive(Debug)]
pub(super) struct BitBudget {
    /// Bits times microseconds, so that no part of a bit is lost.
    credit: u64,
    since_us: u64,
}

impl BitBudget {
    pub(super) const fn new() -> Self {
        Self { credit: 0, since_us: 0 }
    }

    /// Returns whether `bits` may be sent now, and counts them. `rate` is in bits per second. At most one second's bits
    /// are saved, or the bits of one picture, if they are more.
    pub(super) fn allows(&mut self, bits: u32, rate: f64, now_us: u64) -> bool {
        // The limits of the parameter keep the product below 2^64.
        let (rate, cost) = (rate as u64, u64::from(bits) * US_PER_S);
        // At most an hour counts, so that the product stays below 2^64.
        let passed_us = now_us.saturating_sub(self.since_us).min(US_PER_S * 3600);
        self.since_us = now_us;
        // More than a second's bits are not saved, because a burst would fill the line after a pause. One picture may
        // need more: otherwise it would never be sent.
        self.credit = self.credit.saturating_add(passed_us.saturating_mul(rate)).min(cost.max(rate * US_PER_S));
        let rest = self.credit.checked_sub(cost);
        // A picture that is not sent costs nothing, so that a small one may be sent after it.
        self.credit = rest.unwrap_or(self.credit);
        rest.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_is_kept_to_the_bit() {
        let mut budget = BitBudget::new();
        // Thirty pictures a second of 2000 bits, for 1000 seconds, with 20 000 bits a second.
        let sent = (0..30_000u64).filter(|n| budget.allows(2000, 20_000.0, n * 1_000_000 / 30)).count();
        assert!((9_999..=10_010).contains(&sent), "{sent}");
        // A budget below one picture a second sends some nevertheless.
        let mut slow = BitBudget::new();
        let sent = (0..30_000u64).filter(|n| slow.allows(2000, 100.0, n * 1_000_000 / 30)).count();
        assert!((49..=50).contains(&sent), "{sent}");
    }
}
