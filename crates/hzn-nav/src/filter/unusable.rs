//! Why a measurement is not usable.

/// Why the filter cannot use a measurement. The state does not change then. Each reason has its own value, so that a
/// program can count them by source: a count without reasons hid that rounding cost 35 of the 90 directions of a
/// flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Unusable {
    /// The filter has no camera of this number.
    NoCamera,
    /// The camera sees fewer bodies than this number.
    NoBody,
    /// A number is not finite.
    NotFinite,
    /// The direction or its reference is a vector of length 0.
    NoDirection,
    /// The covariance has a variance that is more negative than rounding explains.
    NegativeVariance,
    /// The covariance of the innovation is not positive definite.
    Innovation,
}

impl Unusable {
    /// Returns the reason in words.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::NoCamera => "the filter has no camera of this number",
            Self::NoBody => "the camera has no body of this number",
            Self::NotFinite => "a number is not finite",
            Self::NoDirection => "the direction has length 0",
            Self::NegativeVariance => "the covariance has a negative variance",
            Self::Innovation => "the covariance of the innovation is not positive definite",
        }
    }
}

impl core::fmt::Display for Unusable {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.as_str())
    }
}

impl core::error::Error for Unusable {}
