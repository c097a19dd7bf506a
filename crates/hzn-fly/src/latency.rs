//! The time from the last byte of a picture to its packet on the line.

use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Width of a class, µs.
const STEP_US: u64 = 20;
/// Number of classes. Longer times are in the last one; the longest is kept exactly.
const CLASSES: usize = 5000;

/// Counts of latencies by their length. The memory does not grow with the flight.
#[derive(Debug, Default)]
pub struct Latency {
    counts: Mutex<Counts>,
}

#[derive(Debug, Default)]
struct Counts {
    classes: Vec<u64>,
    total: u64,
    longest: Duration,
}

/// What latencies were measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LatencySummary {
    /// Number of pictures.
    pub count: u64,
    /// Half of the pictures were faster, to 20 µs.
    pub median: Duration,
    /// 99 of 100 pictures were faster, to 20 µs.
    pub percent99: Duration,
    /// The slowest picture.
    pub longest: Duration,
}

impl Latency {
    /// Adds the latency of a picture.
    pub fn add(&self, latency: Duration) {
        let mut counts = self.counts.lock().unwrap_or_else(PoisonError::into_inner);
        counts.classes.resize(CLASSES, 0);
        let class = (latency.as_micros() as u64 / STEP_US).min(CLASSES as u64 - 1) as usize;
        if let Some(count) = counts.classes.get_mut(class) {
            *count += 1;
        }
        counts.total += 1;
        counts.longest = counts.longest.max(latency);
    }

    /// Returns the number of latencies.
    pub fn count(&self) -> u64 {
        self.counts.lock().unwrap_or_else(PoisonError::into_inner).total
    }

    /// Returns what was measured; `None` without a picture.
    pub fn summary(&self) -> Option<LatencySummary> {
        let counts = self.counts.lock().unwrap_or_else(PoisonError::into_inner);
        let below = |share: f64| {
            let wanted = (counts.total as f64 * share).ceil() as u64;
            let mut seen = 0;
            let class = counts.classes.iter().position(|n| {
                seen += n;
                seen >= wanted
            });
            let upper = Duration::from_micros((class.unwrap_or(CLASSES) as u64 + 1) * STEP_US);
            upper.min(counts.longest)
        };
        (counts.total > 0).then(|| LatencySummary {
            count: counts.total,
            median: below(0.5),
            percent99: below(0.99),
            longest: counts.longest,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_those_of_the_latencies() {
        let latency = Latency::default();
        assert_eq!(latency.summary(), None);
        (1..=1000).for_each(|us| latency.add(Duration::from_micros(us)));
        latency.add(Duration::from_secs(7));
        let summary = latency.summary().unwrap();
        assert_eq!(summary.count, 1001);
        assert_eq!((summary.median, summary.percent99), (Duration::from_micros(520), Duration::from_micros(1000)));
        assert_eq!(summary.longest, Duration::from_secs(7));
    }
}
