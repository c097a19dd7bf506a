//! `[retry]`: further looks and division, when the first look at a picture gives no answer.

use crate::base::keys::{choices, section};

choices! {
    /// The step that follows when no edge of the whole picture gives an answer.
    pub enum Method {
        /// There is no further step.
        @- None = "none";
        /// The picture is cut into halves, and halves without an answer are cut again (Barf 2014, 2.2.6).
        @- Division = "division" needs "horace";
    }
}

choices! {
    /// Method that combines the answers of several parts.
    pub enum Combine {
        /// The median of each component; a part with a wrong edge does no harm.
        @- Median = "median";
        /// The mean of each component.
        @- Mean = "mean";
    }
}

/// Maximum number of further looks at other thresholds.
pub const MAX_LEVELS: usize = 4;

section! {
    /// `[retry]` of sensor.toml: further looks at a picture without an answer.
    "retry" pub struct Config {
        /// Thresholds of further looks, on a scale from the mean of the dark pixels (0) to the first look's threshold
        /// (1); `[]` allows only one look.
        ///
        /// Up to 4 looks follow one after the other, until there is an answer. Otsu's threshold follows the brightest
        /// clouds, and most of the limb of a half-lit disc may lie below it. A threshold below `min_sigma` is raised to
        /// it if the disc of the body is smaller than the picture, and skipped otherwise: 0 is a look just above the
        /// noise of the sky, for half-lit discs only. More looks answer more pictures, but every look can give a false
        /// answer; all looks share one `limits.max_work`. With a `fixed` threshold there is only one look.
        @- levels: heapless::Vec<f64, MAX_LEVELS> = levels(), [0.0 to 4.0];
        /// Lowest threshold of every look, in standard deviations of the dark pixels' noise above their mean; a `fixed`
        /// threshold is kept.
        ///
        /// A smaller value finds fainter limbs; below 3, the threshold follows the noise of the sky.
        // Below three deviations a threshold follows the noise of the sky: there the limb was found 25 km too high.
        @- min_sigma: f64 = 3.0, [0.0 to 100.0];
        /// Widest dark frame around the picture that is detected and left out, px; 0 turns the detection off.
        ///
        /// Demosaicing leaves one to four rows and columns black. A frame is dark on all sides, and at least an eighth
        /// of the pixels next to it are lit. Next to a lit body, a frame would join the limb to the outline of the
        /// picture.
        // Eight pixels are twice what demosaicing leaves.
        @- frame_px: u16 = 8, [0.0 to 64.0];
        /// The step that follows when no edge of the whole picture gives an answer.
        @- method: Method = Method::None, [choice];
        /// For `division`: parts below this fraction of the picture's area are not cut again; a smaller value costs
        /// more time.
        @- least_part: f64 = 0.1, [0.015625 to 1.0] { needs: "horace" };
        /// For `division`: method that combines the answers of several parts.
        @- combine: Combine = Combine::Median, [choice] { needs: "horace" };
    }
}

/// The thresholds at 0.5 and 0.25 are for a limb that is dimmer than clouds. The threshold at 2 is for a limb under a
/// glare, or with lit air above it. The threshold at 0, just above the noise of the sky, is the last one: it shows the
/// whole lit limb of a half-lit disc, and every faint edge in the sky.
// With these looks the scene `horace` answers 40 instead of 35 of 46 limbs, and none of 14 pictures without a limb,
// which is why there are three of them. The fourth answers half-lit discs whose clouds are brighter than most of the
// limb.
const LEVELS: [f64; 4] = [0.5, 0.25, 2.0, 0.0];

fn levels() -> heapless::Vec<f64, MAX_LEVELS> {
    let mut levels = heapless::Vec::new();
    // The list has room for all of them.
    let _ = levels.extend_from_slice(&LEVELS);
    levels
}
