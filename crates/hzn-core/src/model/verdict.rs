//! The verdict on a candidate.

/// Declares the verdicts. One line per verdict has the documentation, the number and the name, so that no list can omit
/// a verdict.
macro_rules! verdicts {
    ($($(#[$doc:meta])* $variant:ident = $number:literal, $name:literal;)*) => {
        /// The verdict on a candidate.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        // Telemetry sends the number, therefore a number never changes.
        #[repr(u8)]
        pub enum Verdict {
            $($(#[$doc])* $variant = $number,)*
        }

        impl Verdict {
            /// All verdicts in the order of their numbers.
            pub const ALL: &[Self] = &[$(Self::$variant),*];

            /// Returns the name used in files and messages.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }
        }
    };
}
verdicts! {
    /// The candidate is the answer.
    Chosen = 0, "chosen";
    /// The candidate passed every gate, but another one fits better.
    Passed = 1, "passed";
    /// No cone goes through enough of the candidate's points.
    NoConsensus = 2, "no-consensus";
    /// The candidate has fewer inliers than `gates.min_inliers`.
    FewInliers = 3, "few-inliers";
    /// The inliers cover less than `gates.min_arc_px`.
    ShortArc = 4, "short-arc";
    /// The RMS is above `gates.max_rms_px`.
    Residuals = 5, "residuals";
    /// The fitted half-angle disagrees with the expected one.
    HalfAngle = 6, "half-angle";
    /// The standard deviation is above `gates.max_sigma_deg`.
    Uncertain = 7, "uncertain";
    /// The fit did not converge, was singular, or the work budget was used up.
    NoFit = 8, "no-fit";
    /// The fitted limb goes on where the picture shows no edge: edge points cover too little of it.
    Unsupported = 9, "unsupported";
    /// The curve goes through clutter: many edge points lie close to the fitted limb, or a part of the edge follows it
    /// by chance.
    Indistinct = 10, "indistinct";
    /// Too much of the picture beyond the fitted limb is lit.
    NoSky = 11, "no-sky";
    /// The edge is the limb of another body that was found in the same picture before.
    Taken = 12, "taken";
    /// The limb that is expected about the fitted axis lies entirely outside the picture.
    OutOfView = 13, "out-of-view";
    /// The fitted circle is smaller or larger than the limb can be between the altitude limits.
    Radius = 14, "radius";
    /// The edge is too short or too rough to show by its curvature on which side the body is, or a straight line of the
    /// image fits it nearly as well.
    Straight = 15, "straight";
    /// A circle of the image fits the points far better than the limb's cone: the edge is a lens flare.
    Circle = 16, "circle";
    /// A few straight pieces fit the points far better than the limb's cone: the edge is an iris or a part of the
    /// vehicle.
    Polyline = 17, "polyline";
    /// The edge goes on smoothly but departs from the fitted limb.
    Departure = 18, "departure";
    /// The lit area within the fitted limb is a band, with sky behind it.
    Band = 19, "band";
    /// The axis contradicts the attitude of the prior.
    Attitude = 20, "attitude";
    /// The Sun direction of the prior does not light this limb, or the picture shows within the limb that the Sun is
    /// elsewhere.
    Sun = 21, "sun";
    /// The axis is farther from the last answer than the vehicle can have turned.
    Rate = 22, "rate";
    /// The candidate won, but light reaches higher above the fitted limb than air does. The edge belongs to airglow or
    /// aurora, or it cannot be told from one that does, as in an overexposed picture of the day that blooms; so the
    /// picture has no answer.
    Glow = 23, "glow";
    /// The brightness hardly changes across the fitted limb: the edge is a contour line of light that fades slowly. Or
    /// it is one in the air above the limb.
    Faint = 24, "faint";
    /// The time and the position of the prior say that it is night: the Sun lights no part of the limb.
    Night = 25, "night";
    /// All evidence together makes it too improbable that the edge is the limb.
    Unlikely = 26, "unlikely";
    /// The candidate won, but its edge stays in the picture while the vehicle turns: it belongs to the window, the lens
    /// or the vehicle. Or the picture is an earlier one to the last bit.
    Fixed = 27, "fixed";
    /// It is night, `body.night` asks for the airglow, and the edge is not the outer edge of its layer: below it the
    /// light does not become less, or less of it is left than a layer leaves.
    Layer = 28, "layer";
}
