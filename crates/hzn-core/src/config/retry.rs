//! When the first look at a picture gives no answer.

use crate::base::error::{ConfigError, between};

/// What is done then.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Method {
    /// Nothing.
    #[default]
    None,
    /// The picture is cut in halves, and those that give no answer again (Barf 2014, 2.2.6).
    #[cfg(feature = "horace")]
    Division,
}

/// What the answers of several parts make together.
#[cfg(feature = "horace")]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Combine {
    /// The median of each component: a part that took something else for the limb does no harm.
    #[default]
    Median,
    /// The mean of each component.
    Mean,
}

/// Most further looks at other levels.
pub const MAX_LEVELS: usize = 4;

/// `[recover]` of sensor.toml.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct Config {
    /// Levels at which a picture without an answer is looked at again, one after the other: how far from the dark pixels'
    /// mean to the first look's level, 0.05 to 4 (1 is that level itself); up to 4 of them, none for a single look. Otsu's
    /// level follows what is brightest: of a disc half lit, with clouds, most of the limb lies below it, and below half of it
    /// nothing. Each look may be wrong, too, so there are few; all draw on `limits.max_work`. A `fixed` level is kept.
    pub levels: heapless::Vec<f64, MAX_LEVELS>,
    /// Lowest level of a further look, standard deviations of the dark pixels' noise above their mean, 0 to 100: an edge in the
    /// noise of the sky is none.
    pub min_sigma: f64,
    /// Part of an edge's points that must lie on the limb in a further look, 0 to 1. Each look is another chance for a curve
    /// through a part of something else, such as the glow above a limb: a further one asks for most of the edge.
    pub min_part: f64,
    /// Widest dark frame around the picture that is found and left out, in pixels, 0 to 64; 0 looks for none. Rows and
    /// columns that demosaicing leaves black are one to four. A frame is dark all around at the level, and an eighth or more
    /// of the pixels next to it are lit: over a lit body it would join the limb to the picture's own outline.
    pub frame_px: u16,
    /// What is done when no edge of the whole picture gives an answer.
    pub method: Method,
    /// For `division`: parts that are smaller than this fraction of the picture's area are not cut again, 1/64 to 1.
    #[cfg(feature = "horace")]
    pub least_part: f64,
    /// For `division`: what the answers of several parts make together.
    #[cfg(feature = "horace")]
    pub combine: Combine,
}

/// Half of the way and a quarter for a limb that is dimmer than clouds, and twice as far for one under a glare or in air
/// that is lit above it.
const LEVELS: [f64; 3] = [0.5, 0.25, 2.0];

impl Default for Config {
    fn default() -> Self {
        let mut levels = heapless::Vec::new();
        // There is room for them.
        let _ = levels.extend_from_slice(&LEVELS);
        Self {
            levels,
            min_sigma: 3.0,
            min_part: 0.5,
            frame_px: 8,
            method: Method::None,
            #[cfg(feature = "horace")]
            least_part: 0.1,
            #[cfg(feature = "horace")]
            combine: Combine::Median,
        }
    }
}

impl Config {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        for &part in &self.levels {
            between("recover.levels", part, 0.05, 4.0)?;
        }
        between("recover.min_sigma", self.min_sigma, 0.0, 100.0)?;
        between("recover.min_part", self.min_part, 0.0, 1.0)?;
        between("recover.frame_px", f64::from(self.frame_px), 0.0, 64.0)?;
        #[cfg(feature = "horace")]
        between("recover.least_part", self.least_part, 1.0 / 64.0, 1.0)?;
        Ok(())
    }
}
