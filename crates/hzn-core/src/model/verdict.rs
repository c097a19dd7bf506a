//! What became of a candidate.

/// One line a verdict: what it is, number, name. So that none can be left out of a list.
macro_rules! verdicts {
    ($($(#[$doc:meta])* $variant:ident = $number:literal, $name:literal;)*) => {
        /// What became of a candidate.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[repr(u8)]
        pub enum Verdict {
            $($(#[$doc])* $variant = $number,)*
        }

        impl Verdict {
            /// Every verdict in the order of its number.
            pub const ALL: &[Self] = &[$(Self::$variant),*];

            /// The name used in files and messages.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }
        }
    };
}
verdicts! {
    /// The answer.
    Chosen = 0, "chosen";
    /// Passed every gate, but another fits better.
    Passed = 1, "passed";
    /// No cone goes through enough of its points.
    NoConsensus = 2, "no-consensus";
    /// Fewer inliers than `select.min_inliers`.
    FewInliers = 3, "few-inliers";
    /// The inliers cover less than `select.min_arc_px`.
    ShortArc = 4, "short-arc";
    /// The RMS is above `select.max_rms_px`.
    Residuals = 5, "residuals";
    /// The fitted half-angle disagrees with the expected one.
    HalfAngle = 6, "half-angle";
    /// The standard deviation is above `select.max_sigma_deg`.
    Uncertain = 7, "uncertain";
    /// The fit did not converge or was singular, or could not be afforded any more.
    NoFit = 8, "no-fit";
    /// The fitted limb goes on where the picture shows none: too small a part of it is edge.
    Unsupported = 9, "unsupported";
    /// A curve through clutter: many edge points lie close beside the fitted limb, or a part of the edge follows it by
    /// chance.
    Indistinct = 10, "indistinct";
    /// Too much of what lies beyond the fitted limb is lit.
    NoSky = 11, "no-sky";
    /// The edge is the limb of another body, which was found in the same picture before.
    Taken = 12, "taken";
    /// No part of the limb that is expected about the fitted axis lies in the picture.
    OutOfView = 13, "out-of-view";
    /// The fitted circle is smaller or larger than the limb can be between the altitude limits.
    Radius = 14, "radius";
    /// The edge is too short or too rough for its curvature to tell on which side of it the body is, or a straight line
    /// of the image fits it nearly as well.
    Straight = 15, "straight";
    /// A circle of the image fits the points far better than the limb's cone: a lens flare.
    Circle = 16, "circle";
    /// Few straight pieces fit the points far better than the limb's cone: an iris, or a part of the vehicle.
    Polyline = 17, "polyline";
    /// The edge goes on smoothly beside the fitted limb.
    Departure = 18, "departure";
    /// What lies within the fitted limb is a band, with sky behind it.
    Band = 19, "band";
    /// The axis contradicts the given attitude.
    Attitude = 20, "attitude";
    /// The given Sun does not light this limb.
    Sun = 21, "sun";
    /// The axis is farther from the last answer than the vehicle can have turned.
    Rate = 22, "rate";
}
