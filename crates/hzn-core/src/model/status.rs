//! The outcome of a picture. The numbers never change.

use core::fmt;

/// Outcome of one picture. The numbers are frozen, because files and telemetry contain them.
///
/// ```
/// use hzn_core::status::Status;
///
/// assert_eq!((Status::NoLimb.name(), Status::NoLimb as u8), ("no-limb", 1));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u8)]
pub enum Status {
    /// A direction was found and passed every gate.
    Ok = 0,
    /// No edge in the picture is a limb of the body.
    #[default]
    // The default is an outcome without an answer, so that a status that nobody set never looks like one.
    NoLimb = 1,
    /// The mean brightness is below `brightness.min_mean`.
    TooDark = 2,
    /// The mean brightness is above `brightness.max_mean`.
    TooBright = 3,
    /// Edges were found, but none has enough points to be fitted.
    TooFewPoints = 4,
    /// Two different directions fit about equally well.
    Ambiguous = 5,
    /// A direction was fitted but failed a gate (residual, half-angle, arc length).
    Rejected = 6,
    /// Lists overflowed or the work budget was used up, and there is no answer.
    Truncated = 7,
    /// The picture could not be read (host only).
    Unreadable = 8,
    /// The altitude, which determines the cone of the body, is unknown or not above the limb height (host only).
    NoAltitude = 9,
}

impl Status {
    /// All statuses in the order of their numbers.
    pub const ALL: [Self; 10] = [
        Self::Ok,
        Self::NoLimb,
        Self::TooDark,
        Self::TooBright,
        Self::TooFewPoints,
        Self::Ambiguous,
        Self::Rejected,
        Self::Truncated,
        Self::Unreadable,
        Self::NoAltitude,
    ];

    /// Returns the name used in files, for example `no-limb`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::NoLimb => "no-limb",
            Self::TooDark => "too-dark",
            Self::TooBright => "too-bright",
            Self::TooFewPoints => "too-few-points",
            Self::Ambiguous => "ambiguous",
            Self::Rejected => "rejected",
            Self::Truncated => "truncated",
            Self::Unreadable => "unreadable",
            Self::NoAltitude => "no-altitude",
        }
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // `pad` and not `write_str`, so that a width in a format string is kept.
        f.pad(self.name())
    }
}

/// The stages, in the order in which a picture passes through them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
#[repr(u8)]
pub enum Stage {
    /// Brightness gate and threshold.
    #[default]
    Threshold = 0,
    /// Search along the border and border following.
    Contour = 1,
    /// Sub-pixel edge points of a candidate.
    EdgePoints = 2,
    /// Rays of the edge points.
    Rays = 3,
    /// Consensus: the cone that most rays agree on, and the outliers.
    Consensus = 4,
    /// Fit of the cone.
    Fit = 5,
    /// Covariance of the fit.
    Covariance = 6,
    /// Gates, and the choice of the best candidate.
    Gates = 7,
}

impl Stage {
    /// All stages in order.
    pub const ALL: [Self; 8] = [
        Self::Threshold,
        Self::Contour,
        Self::EdgePoints,
        Self::Rays,
        Self::Consensus,
        Self::Fit,
        Self::Covariance,
        Self::Gates,
    ];
    /// Returns the name used in files and messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Threshold => "threshold",
            Self::Contour => "contour",
            Self::EdgePoints => "edge_points",
            Self::Rays => "rays",
            Self::Consensus => "consensus",
            Self::Fit => "fit",
            Self::Covariance => "covariance",
            Self::Gates => "gates",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_names_are_frozen() {
        let names = [
            "ok",
            "no-limb",
            "too-dark",
            "too-bright",
            "too-few-points",
            "ambiguous",
            "rejected",
            "truncated",
            "unreadable",
            "no-altitude",
        ];
        for (n, (status, name)) in Status::ALL.iter().zip(names).enumerate() {
            assert_eq!((*status as usize, status.name()), (n, name));
        }
        for (n, stage) in Stage::ALL.iter().enumerate() {
            assert_eq!(*stage as usize, n);
        }
    }
}
