//! The exact time of a picture, in whole nanoseconds.

/// Largest difference in seconds between a time and the stamp that it comes from. Today's times in double precision
/// have steps of 0.24 µs, and no camera takes two pictures within this time.
const SAME_S: f64 = 1e-6;
/// Nanoseconds in a second.
const NS: u64 = 1_000_000_000;

/// What a recording states about the origin of a picture: a number of seconds cannot hold the time exactly.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Stamp {
    /// Time in nanoseconds.
    pub time_ns: u64,
    /// Name of the frame of the picture, if the message of the picture names one.
    pub frame_id: Option<String>,
}

impl Stamp {
    /// Creates a stamp; an empty name is none.
    #[cfg(feature = "recordings")]
    pub(crate) fn new(time_ns: u64, frame_id: &str) -> Self {
        Self { time_ns, frame_id: Some(frame_id.to_owned()).filter(|name| !name.is_empty()) }
    }

    /// Returns the time in seconds.
    pub fn time_s(&self) -> f64 {
        (self.time_ns / NS) as f64 + (self.time_ns % NS) as f64 * 1e-9
    }

    /// Returns whether a time in seconds is this one but for its rounding. Another table may have replaced the time.
    pub fn is_at(&self, time_s: Option<f64>) -> bool {
        time_s.is_some_and(|time_s| (time_s - self.time_s()).abs() <= SAME_S)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_of_another_clock_is_not_that_of_the_stamp() {
        let stamp = Stamp { time_ns: 1_700_000_069_487_179_487, frame_id: None };
        assert!(stamp.is_at(Some(stamp.time_s())) && stamp.is_at(Some(1_700_000_069.487_179_5)));
        assert!(!stamp.is_at(Some(1_700_000_069.487_19)) && !stamp.is_at(Some(f64::NAN)) && !stamp.is_at(None));
    }
}
