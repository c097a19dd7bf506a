//! `[recover]`: what follows when the first look at a picture gives no answer.

use crate::base::keys::{choices, section};

choices! {
    /// What follows when no edge of the whole picture gives an answer.
    pub enum Method {
        /// Nothing follows.
        @- None = "none";
        /// The picture is cut into halves, and halves without an answer again (Barf 2014, 2.2.6).
        @- Division = "division" needs "horace";
    }
}

choices! {
    /// How the answers of several parts become one.
    pub enum Combine {
        /// The median of each component: a part that took another edge for the limb does no harm.
        @- Median = "median";
        /// The mean of each component.
        @- Mean = "mean";
    }
}

/// Most further looks at other thresholds.
pub const MAX_LEVELS: usize = 4;

section! {
    /// `[recover]` of sensor.toml: further looks at a picture without an answer.
    "recover" pub struct Config {
        /// Thresholds of further looks, from the mean of the dark pixels (0) to the first look's threshold (1); `[]`
        /// allows only one look.
        ///
        /// Up to 4 looks follow one after the other, until there is an answer. Otsu's threshold follows the brightest
        /// clouds: most of the limb of a half-lit disc may lie below it. Every look can be wrong, so they are few; all
        /// draw on one `limits.max_work`. A `fixed` threshold stays: then there is one look.
        @- levels: heapless::Vec<f64, MAX_LEVELS> = levels(), [0.05 to 4.0];
        /// Lowest threshold of a further look, in standard deviations of the dark pixels' noise above their mean.
        @- min_sigma: f64 = 3.0, [0.0 to 100.0];
        /// Smallest part of an edge's points that lie on the limb in a further look.
        ///
        /// Every look is another chance for a curve through a part of something else, such as the glow above a limb.
        @- min_part: f64 = 0.5, [0.0 to 1.0];
        /// Widest dark frame around the picture that is found and left out, px; 0 looks for none.
        ///
        /// Demosaicing leaves one to four rows and columns black. A frame is dark all around, and at least an eighth of
        /// the pixels next to it are lit: next to a lit body it would join the limb to the picture's own outline.
        @- frame_px: u16 = 8, [0.0 to 64.0];
        /// What follows when no edge of the whole picture gives an answer.
        @- method: Method = Method::None, [choice];
        /// For `division`: parts below this fraction of the picture's area are not cut again.
        @- least_part: f64 = 0.1, [0.015625 to 1.0] { needs: "horace" };
        /// For `division`: how the answers of several parts become one.
        @- combine: Combine = Combine::Median, [choice] { needs: "horace" };
    }
}

/// Half and a quarter of the way are for a limb that is dimmer than clouds; twice the way is for a limb under a glare,
/// or in air that is lit above it.
const LEVELS: [f64; 3] = [0.5, 0.25, 2.0];

fn levels() -> heapless::Vec<f64, MAX_LEVELS> {
    let mut levels = heapless::Vec::new();
    // The list has room for them.
    let _ = levels.extend_from_slice(&LEVELS);
    levels
}
