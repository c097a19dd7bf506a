//! What an error costs: false measurements pull less than right ones, instead of being refused.

/// How the cost of an error grows above a limit. Below it all are squares: nothing is taken from a right measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loss {
    /// Like the error itself (Huber 1964). There is one minimum, so that the first steps, from far away, find it.
    Huber,
    /// Less and less: the square s costs 2 L − L²/s for the limit L, at most 2 L. A false measurement stops pulling.
    Bounded,
}

impl Loss {
    /// Returns the cost and the weight of an error with a square, for a limit of the square.
    pub(crate) fn of(self, square: f64, limit: f64) -> (f64, f64) {
        if square <= limit {
            return (square, 1.0);
        }
        match self {
            Self::Huber => (2.0 * (limit * square).sqrt() - limit, (limit / square).sqrt()),
            Self::Bounded => (2.0 * limit - limit * limit / square, (limit / square).powi(2)),
        }
    }
}
