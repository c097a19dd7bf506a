//! `[consensus]` of sensor.toml: the cone that most edge points agree on, and their outliers.

use crate::base::keys::{choices, section};

choices! {
    /// How the inliers are found.
    pub enum Method {
        /// RANSAC draws two points and takes the expected half-angle (or draws three points where this half-angle is
        /// too uncertain); a further point verifies a draw before it is scored.
        @0 TwoPoint = "two-point";
        /// Every point is an inlier.
        @1 None = "none";
        /// RANSAC draws three points and scores every draw with every point (Braun & Barf 2022, 3.6).
        @- Ransac = "ransac" needs "dlr";
        /// RANSAC draws five points, of which two verify the cone through the other three before the cone is scored
        /// (Wang et al. 2022, 2.3); this needs about 20000 draws.
        @- RansacPreverify = "ransac-preverify" needs "zju";
        /// RANSAC draws three points and scores every draw by the likelihood of a mixture of inliers and outliers (Torr
        /// & Zisserman 2000).
        @- Mlesac = "mlesac" needs "zju";
    }
}

section! {
    /// `[consensus]` of sensor.toml: the cone that most edge points agree on, and their outliers.
    "consensus" pub struct Config: Copy {
        /// How the inliers are found.
        @80 method: Method = Method::TwoPoint, [choice];
        /// Largest distance from the limb at which a point belongs to the consensus, px; the fit `sphere` also weights
        /// points up to twice as far away.
        ///
        /// A larger value keeps a rough limb or a poorly calibrated one, and more outliers with it. A value within the
        /// noise finds inliers on any curve.
        // Before most of today's gates, 1494 artefacts gave 185 false answers at 3 px and 309 to 511 at 0.5 to 1.5 px,
        // because a threshold within the noise finds inliers on any curve.
        @81 threshold_px: f64 = 3.0, [above 0.0 to 1000.0];
        /// Where an edge is noisy, the largest distance rises from `threshold_px` to this many times the noise from
        /// point to point; 0 keeps it at `threshold_px`.
        ///
        /// Two sigmas include 95 % of a limb's points. With a distance below the noise, the inliers are points that lie
        /// near some limb by chance. The distance rises at most to the sigma of the limb height; it does not rise for a
        /// body whose half-angle is free, such as the Sun.
        // Without it HORACE's camera lost every seventh limb: the edge was spread over 60 px, so that only points that
        // lay near some limb by chance stayed.
        @84 noise_sigma: f64 = 2.0, [0.0 to 100.0];
        /// Seed of the random draws; the same seed gives the same answer.
        // The seed is a key and not the time, so that a picture has the same answer whenever it is processed.
        @82 seed: u32 = 1, [0.0 to 4294967295.0];
        /// Largest number of draws; 800 find the limb among 80 % of outliers.
        ///
        /// More draws take more time in pictures with many outliers; fewer draws may miss the limb there.
        // Two points and one for the verification need 574 draws at 80 % of outliers for a success of 99 %.
        @83 max_draws: u32 = 800, [1.0 to 100000.0];
    }
}
