//! UTC of the times of a flight.

use jiff::Timestamp;

use crate::error::Error;

/// UTC of time 0 of a flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Utc {
    /// Seconds since 1970, without leap seconds.
    pub unix_s: f64,
}

impl Utc {
    /// Reads a date and time such as `2019-06-13T04:00:00Z`.
    ///
    /// # Errors
    /// The text is not a date and time with an offset from UTC.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let time: Timestamp = text.parse().map_err(|_| {
            Error::unusable(format!("{text}: UTC such as 2019-06-13T04:00:00Z is expected (with the Z)"))
        })?;
        Ok(Self { unix_s: time.as_microsecond() as f64 * 1e-6 })
    }

    /// Returns the time at which this is called, as time 0.
    pub fn now() -> Self {
        Self { unix_s: Timestamp::now().as_microsecond() as f64 * 1e-6 }
    }

    /// Returns a time of the flight as ISO 8601 with microseconds, without a Z.
    pub fn iso(&self, time_s: f64) -> String {
        let us = ((self.unix_s + time_s) * 1e6).round();
        // The cast saturates; a flight is not that far from our time.
        let time = Timestamp::from_microsecond(us as i64).unwrap_or(Timestamp::UNIX_EPOCH);
        time.strftime("%Y-%m-%dT%H:%M:%S%.6f").to_string()
    }
}
