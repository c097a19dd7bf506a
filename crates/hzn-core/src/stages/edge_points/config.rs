//! `[edge_points]` of sensor.toml: edges that are candidates for the limb, and their edge points.

use crate::base::error::{ConfigError, Limit, require};
use crate::base::keys::{Section, choices, section};

choices! {
    /// How a border pixel becomes an edge point.
    pub enum SubPixel {
        /// The point is where the brightness crosses the middle between the plateaus on both sides, in three rows
        /// smoothed along the edge.
        ///
        /// The Sun blooms into a glare that is no plateau: its edge point is where the brightness crosses the
        /// threshold.
        // It is the default because the blurred step costs a hundred times as much, and clouds distort real limbs by
        // more than it gains.
        @0 Linear = "linear";
        /// The point is the border pixel's centre, moved half a pixel to the dark side.
        @1 None = "none";
        /// A blurred step is fitted to 7×7 pixels between the means of the plateaus: the best accuracy, at about a
        /// hundred times the cost.
        @- Erf = "erf" needs "erf";
        /// Zernike moments of 7×7 pixels locate a step across a disc (Wang et al. 2022).
        @- Zernike = "zernike" needs "zju";
    }
}

section! {
    /// `[edge_points]` of sensor.toml: edges that are candidates for the limb, and their edge points.
    "edge_points" pub struct Config: Copy {
        /// Fewest border pixels of an edge that may be the limb; a small body or picture needs fewer.
        ///
        /// A larger value skips more lights and small clouds, and short limbs. For a small disc, half of its
        /// circumference in pixels is enough; in a picture of fewer than 80 rows or columns, half of its shorter side
        /// is enough.
        @70 min_points: u16 = 40, [3.0 or more];
        /// Points kept per edge, evenly along it; 0 keeps all that fit into memory.
        ///
        /// Fewer points take less time: 200 points take half the time, but single pictures are then lost or much less
        /// accurate.
        // With 300 points a Cortex-M7 needs a third less, but `tumble` has one more false answer and one answer less in
        // 200 pictures. On real limbs more than 600 gain little, because the errors are correlated over many pixels.
        @71 keep_points: u16 = 600, ["0 (all) or 16 to 65535"];
        /// How a border pixel becomes an edge point.
        @72 sub_pixel: SubPixel = SubPixel::Linear, [choice];
        /// For `zernike`: blur of the optics, px (standard deviation); 0 takes an edge for an ideal step.
        ///
        /// A blurred edge pulls the point of an ideal step towards the middle of the 7×7 pixels. With the blur known
        /// the pull is corrected.
        @- blur_px: f64 = 0.0, [0.0 to 3.0] { needs: "zju" };
    }
}

impl Config {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        self.check_keys()?;
        let keep = f64::from(self.keep_points);
        let enough = self.keep_points == 0 || self.keep_points >= 16;
        require(enough, "edge_points.keep_points", keep, Limit::Rule("must be 16 or more, or 0 to keep all"))
    }
}
