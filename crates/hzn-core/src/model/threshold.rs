//! The threshold between dark and lit, for all bodies or for one body.

use crate::base::error::{ConfigError, Limit, require};
use crate::base::keys::{Form, Section, Value, choices, section};

choices! {
    /// Method that finds the threshold.
    pub enum Method {
        /// The threshold separates the histogram of a sparse sample into two classes as well as possible (Otsu 1979).
        @0 Otsu = "otsu";
        /// The threshold is `level`.
        @1 Fixed = "fixed";
        /// The threshold is `factor` times the mean of the sample.
        @2 Dynamic = "dynamic";
        /// The threshold is halfway between the brightness on both sides of the limb in the previous picture; if that
        /// picture had no answer, `otsu` is used.
        @- Track = "track";
    }
}

section! {
    /// `[threshold]` of sensor.toml: the threshold between dark and lit.
    "threshold" pub struct Config: Copy {
        /// Method that finds the threshold.
        @50 method: Method = Method::Otsu, [choice];
        /// For `fixed`: a pixel is lit at this value or above, in the picture's own counts; a value below 1 is a
        /// fraction of full scale.
        ///
        /// A level above the brightness of the limb finds no limb. A level within the noise of the sky finds edges in
        /// the sky, which cost time.
        @51 level: f64 = 64.0, [above 0.0 to 65535.0];
        /// For `dynamic`: the threshold is this factor times the mean of the sample; a larger factor gives a higher
        /// threshold.
        @52 factor: f64 = 1.0, [above 0.0 to 100.0];
        /// For `otsu`: factor by which the threshold is multiplied; a larger factor gives a higher threshold.
        ///
        /// Use it to test how much an answer depends on the threshold.
        @53 scale: f64 = 1.0, [0.1 to 10.0];
    }
}

/// Threshold that separates the Sun from everything else, at 0.9 of full scale.
// A Sun among other bodies is clipped, and everything else that is lit stays below 0.9. Otsu's threshold would lie
// between sky and ground, and a Sun would be looked for on clouds. It is a static because a reference to it is
// returned.
pub(crate) static SUN: Config = Config { method: Method::Fixed, level: 0.9, factor: 1.0, scale: 1.0 };

section! {
    /// `[brightness]` of sensor.toml: the brightness that a picture must have to be processed.
    "brightness" pub struct Brightness: Copy {
        /// Smallest mean brightness of the picture, as a fraction of full scale; a darker picture has the status
        /// `too-dark`.
        ///
        /// A value above 0 saves the time of pictures of the night side or of the sky alone.
        @40 min_mean: f64 = 0.0, [0.0 to 1.0];
        /// Largest mean brightness of the picture, as a fraction of full scale; a brighter picture has the status
        /// `too-bright`.
        ///
        /// It must not be below `min_mean`. A smaller value refuses pictures that the Sun or the exposure saturates.
        @41 max_mean: f64 = 0.98, [0.0 to 1.0];
    }
}

impl Brightness {
    /// The limits that no picture exceeds.
    pub(crate) const ANY: Self = Self { min_mean: 0.0, max_mean: 1.0 };

    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        self.check_keys()?;
        let limit = Limit::Between(self.min_mean, 1.0);
        require(self.max_mean >= self.min_mean, "brightness.max_mean", self.max_mean, limit)
    }
}

/// Each body may have its own table with these keys.
impl Value for Config {
    const FORM: Form = Form::Table;
    fn check(&self, _path: &'static str, _low: f64, _above: bool, _high: f64) -> Result<(), ConfigError> {
        self.check_keys()
    }
}
