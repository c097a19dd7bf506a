//! The curve between the light on the detector and the counts in the picture.

use crate::base::error::ConfigError;
use crate::base::keys::{Choice, Form, Value, check_number};

/// The curve between light and counts. Counts and light are fractions of full scale.
///
/// The edge of a limb lies where the counts are half of those inside it. With another curve than a straight line this
/// is not half of the light: a limb in a picture for the eye appears higher.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Tone {
    /// Counts are proportional to the light.
    Linear,
    /// The curve of sRGB (IEC 61966-2-1), for pictures on a screen.
    Srgb,
    /// The curve of video, BT.709.
    Bt709,
    /// Counts are the light to the power of 1/gamma.
    Gamma(f64),
    /// Nothing is known about the curve.
    Unknown,
}

/// The words in sensor.toml, with their meanings. A number is a gamma.
const WORDS: [(Tone, Choice); 4] = [
    (
        Tone::Linear,
        word("linear", "Counts are proportional to the light, as in raw pictures and those of industrial cameras."),
    ),
    (Tone::Srgb, word("srgb", "The curve of sRGB: photographs, and nearly every JPEG.")),
    (Tone::Bt709, word("bt709", "The curve of BT.709: video.")),
    (Tone::Unknown, word("unknown", "The curve is unknown, so the limb height has its wider sigma.")),
];

const fn word(name: &'static str, doc: &'static str) -> Choice {
    Choice { name, doc, feature: None, is_built: true, flight: None }
}

impl Tone {
    /// Returns the light where the counts are half of full scale; `None` if it is unknown.
    ///
    /// ```
    /// use hzn_core::tone::Tone;
    ///
    /// assert_eq!(Tone::Linear.light_at_half(), Some(0.5));
    /// assert!((Tone::Srgb.light_at_half().ok_or("unknown")? - 0.214).abs() < 1e-3);
    /// # Ok::<(), &str>(())
    /// ```
    pub fn light_at_half(self) -> Option<f64> {
        match self {
            Self::Linear => Some(0.5),
            // Each curve is a power with an offset; its straight part near black ends far below half of full scale.
            Self::Srgb => Some(libm::pow((0.5 + 0.055) / 1.055, 2.4)),
            Self::Bt709 => Some(libm::pow((0.5 + 0.099) / 1.099, 1.0 / 0.45)),
            Self::Gamma(gamma) => Some(libm::pow(0.5, gamma)),
            Self::Unknown => None,
        }
    }

    /// Returns the word in sensor.toml; `None` for a gamma, which is a number there.
    pub fn word(self) -> Option<&'static str> {
        WORDS.iter().find(|(tone, _)| *tone == self).map(|(_, choice)| choice.name)
    }

    /// Returns the exponent of the curve's power: the gamma, or that with the same light at half of the counts. NaN if
    /// it is unknown.
    pub fn gamma(self) -> f64 {
        match self {
            Self::Gamma(gamma) => gamma,
            _ => self.light_at_half().map_or(f64::NAN, |light| -libm::log2(light)),
        }
    }

    /// Returns the tone of a word in sensor.toml.
    pub fn from_word(name: &str) -> Option<Self> {
        WORDS.iter().find(|(_, choice)| choice.name == name).map(|(tone, _)| *tone)
    }
}

impl core::fmt::Display for Tone {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match (self, self.word()) {
            (Self::Gamma(gamma), _) => write!(f, "gamma {gamma}"),
            (_, word) => f.write_str(word.unwrap_or_default()),
        }
    }
}

impl Value for Tone {
    const FORM: Form = Form::WordOrNumber;
    const CHOICES: &'static [Choice] = &[WORDS[0].1, WORDS[1].1, WORDS[2].1, WORDS[3].1];
    fn check(&self, path: &'static str, _low: f64, _above: bool, _high: f64) -> Result<(), ConfigError> {
        match self {
            // Displays and cameras have 1 to 3; a value outside of these limits is another quantity.
            Self::Gamma(gamma) => check_number(path, *gamma, 0.2, false, 5.0),
            _ => Ok(()),
        }
    }
}

#[cfg(feature = "serde")]
impl serde::Serialize for Tone {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match (self, self.word()) {
            (Self::Gamma(gamma), _) => serializer.serialize_f64(*gamma),
            (_, word) => serializer.serialize_str(word.unwrap_or_default()),
        }
    }
}

#[cfg(feature = "serde")]
impl<'de> serde::Deserialize<'de> for Tone {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader;
        impl serde::de::Visitor<'_> for Reader {
            type Value = Tone;
            fn expecting(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.write_str("\"linear\", \"srgb\", \"bt709\", \"unknown\", or a gamma such as 2.2")
            }
            fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<Tone, E> {
                Tone::from_word(word).ok_or_else(|| E::invalid_value(serde::de::Unexpected::Str(word), &self))
            }
            fn visit_f64<E: serde::de::Error>(self, gamma: f64) -> Result<Tone, E> {
                Ok(Tone::Gamma(gamma))
            }
            fn visit_i64<E: serde::de::Error>(self, gamma: i64) -> Result<Tone, E> {
                Ok(Tone::Gamma(gamma as f64))
            }
            fn visit_u64<E: serde::de::Error>(self, gamma: u64) -> Result<Tone, E> {
                Ok(Tone::Gamma(gamma as f64))
            }
        }
        deserializer.deserialize_any(Reader)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_the_counts_is_less_than_half_of_the_light() {
        let light = |tone: Tone| tone.light_at_half().unwrap();
        // The inverse curves, from IEC 61966-2-1 and ITU-R BT.709-6.
        let srgb = |light: f64| 1.055 * libm::pow(light, 1.0 / 2.4) - 0.055;
        let bt709 = |light: f64| 1.099 * libm::pow(light, 0.45) - 0.099;
        assert!((srgb(light(Tone::Srgb)) - 0.5).abs() < 1e-12);
        assert!((bt709(light(Tone::Bt709)) - 0.5).abs() < 1e-12);
        assert_eq!((light(Tone::Gamma(1.0)), light(Tone::Gamma(2.0))), (0.5, 0.25));
        assert_eq!(Tone::Unknown.light_at_half(), None);
    }

    #[test]
    fn words_are_read_back() {
        for choice in Tone::CHOICES {
            assert_eq!(Tone::from_word(choice.name).and_then(Tone::word), Some(choice.name));
        }
        assert!(Tone::from_word("log").is_none() && Tone::Gamma(2.2).word().is_none());
        assert!(Tone::Gamma(0.1).check("input.tone", 0.0, false, 0.0).is_err());
        assert!(Tone::Gamma(f64::NAN).check("input.tone", 0.0, false, 0.0).is_err());
    }
}
