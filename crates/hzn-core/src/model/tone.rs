//! The curve between the light on the detector and the counts in the picture.

use crate::base::error::ConfigError;
use crate::base::keys::{Choice, Form, Value, check_number};
use crate::base::packed::{Packed, Packer, Unpacker};
use crate::base::real::Real;

/// The curve between light and counts. Counts and light are fractions of full scale.
///
/// The edge of a limb lies where the light is half of that inside it. If the curve is known, half of the light is found
/// in the counts. If it is unknown, the edge is taken at half of the counts: in a picture for the eye this is a fifth
/// of the light, so the limb appears higher, and a blurred edge lies outside of the true one.
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

/// A tone as a power law: the light is proportional to (counts + `offset`)^`gamma`, with both as fractions of full
/// scale.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Curve<T> {
    offset: T,
    gamma: T,
}

/// Width of the limb by day in counts that are proportional to the light, in scale heights. Its light is
/// 1 − exp(−e^(−h/H)), which has the slope ln 2/2 at half of it.
const LIMB_WIDTH: f64 = 2.0 / core::f64::consts::LN_2;
/// The same at half of the counts of sRGB: the widest of the usual curves, if the tone is unknown.
const LIMB_WIDTH_UNKNOWN: f64 = 4.9;

/// Returns the width of the limb by day in the counts of this tone, in scale heights: its whole step over the slope
/// where the edge is found.
// The gamma of the configuration is a double. Its conversion stays out of the stages, which compute in one precision.
#[inline(never)]
pub(crate) fn limb_width<T: Real>(tone: Option<Tone>) -> T {
    match tone.map(|tone| (tone, tone.curve::<T>())) {
        Some((Tone::Linear, _)) => T::from_f64(LIMB_WIDTH),
        Some((_, Some(curve))) => T::from_f64(LIMB_WIDTH) / curve.slope_at_half(),
        _ => T::from_f64(LIMB_WIDTH_UNKNOWN),
    }
}

impl<T: Real> Curve<T> {
    /// Returns the slope of the counts by the light at half of the light, both as parts of the largest.
    fn slope_at_half(&self) -> T {
        // c = (1 + offset) L^(1/γ) − offset
        let per = T::one() / self.gamma;
        let root = ((T::one() - per) * T::from_f64(core::f64::consts::LN_2)).exp();
        (T::one() + self.offset) * per * root
    }

    /// Returns the light of `counts` as a multiple of the light of `reference`. Both are fractions of full scale.
    pub(crate) fn light_over(&self, counts: T, reference: T) -> T {
        (self.gamma * ((counts + self.offset) / (reference + self.offset)).ln()).exp()
    }

    /// Returns the counts whose light is the mean of that of two counts. All of them are fractions of full scale.
    pub(crate) fn mid_level(&self, bright: T, dim: T) -> T {
        let (b, d) = (bright + self.offset, dim + self.offset);
        // The power of the quotient neither overflows nor loses digits. No light has the logarithm minus infinity.
        let half = (T::one() + (self.gamma * (d / b).ln()).exp()) * T::from_f64(0.5);
        b * (half.ln() / self.gamma).exp() - self.offset
    }
}

/// The limits of a gamma. Displays and cameras have 1 to 3; a value outside of these limits is another quantity.
const GAMMA: [f64; 2] = [0.2, 5.0];

/// The words in sensor.toml, with their meanings. A number is a gamma.
const WORDS: [(Tone, Choice); 4] = [
    (
        Tone::Linear,
        word("linear", 1, "Counts are proportional to the light, as in raw pictures and those of industrial cameras."),
    ),
    (Tone::Srgb, word("srgb", SRGB, "The curve of sRGB: photographs, and nearly every JPEG.")),
    (Tone::Bt709, word("bt709", BT709, "The curve of BT.709: video.")),
    (Tone::Unknown, word("unknown", UNKNOWN, "The curve is unknown: an edge is at half of the counts.")),
];

/// The numbers in flight of the words that are no gamma: all of them are outside of the limits of a gamma.
const UNKNOWN: u16 = 0;
const SRGB: u16 = 10;
const BT709: u16 = 11;

const fn word(name: &'static str, number: u16, doc: &'static str) -> Choice {
    Choice { name, doc, feature: None, is_built: true, flight: Some(number) }
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

    /// Returns the curve as a power law, if counts are known not to be proportional to the light.
    pub(crate) fn curve<T: Real>(self) -> Option<Curve<T>> {
        // The straight part of sRGB and BT.709 near black is left out: at its end the light is 0.3 % and 1.8 %.
        let (offset, gamma) = match self {
            Self::Srgb => (0.055, 2.4),
            Self::Bt709 => (0.099, 1.0 / 0.45),
            Self::Gamma(gamma) => (0.0, gamma),
            Self::Linear | Self::Unknown => return None,
        };
        Some(Curve { offset: T::from_f64(offset), gamma: T::from_f64(gamma) })
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
    /// Returns a gamma, 1 for linear counts, or the number of a word.
    fn number(&self, _place: u16) -> f64 {
        match self {
            Self::Unknown => UNKNOWN.into(),
            Self::Linear => 1.0,
            Self::Gamma(gamma) => *gamma,
            Self::Srgb => SRGB.into(),
            Self::Bt709 => BT709.into(),
        }
    }
    fn set_number(&mut self, _place: u16, number: f64) -> Option<()> {
        let is = |word: u16| number == f64::from(word);
        *self = match number {
            _ if is(UNKNOWN) => Self::Unknown,
            1.0 => Self::Linear,
            _ if is(SRGB) => Self::Srgb,
            _ if is(BT709) => Self::Bt709,
            gamma => Self::Gamma(Some(gamma).filter(|gamma| gamma.is_finite())?),
        };
        Some(())
    }
    fn empty() -> Option<Self> {
        Some(Self::Unknown)
    }
    fn check(&self, path: &'static str, _low: f64, _above: bool, _high: f64) -> Result<(), ConfigError> {
        match self {
            Self::Gamma(gamma) => check_number(path, *gamma, GAMMA[0], false, GAMMA[1]),
            _ => Ok(()),
        }
    }
}

impl Packed for Tone {
    fn pack(&self, to: &mut Packer<'_>) {
        self.number(0).pack(to);
    }
    fn unpack(from: &mut Unpacker<'_>) -> Self {
        let mut tone = Self::Unknown;
        let number = f64::unpack(from);
        // A word has a number outside of the limits of a gamma.
        let is_taken = tone.set_number(0, number).is_some();
        from.require(is_taken);
        if let Self::Gamma(gamma) = tone {
            from.limit(gamma, GAMMA[0], false, GAMMA[1]);
        }
        tone
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
    fn a_limb_is_as_wide_as_its_slope_says() {
        let srgb = |light: f64| 1.055 * libm::pow(light, 1.0 / 2.4) - 0.055;
        let bt709 = |light: f64| 1.099 * libm::pow(light, 0.45) - 0.099;
        // The inverse of the slope of the counts by the height, in scale heights, where the edge is.
        let width = |counts: &dyn Fn(f64) -> f64, light: f64| {
            let height = |light: f64| -libm::log(-libm::log(1.0 - light));
            let step = 1e-5;
            (height(light - step) - height(light + step)).abs() / (counts(light + step) - counts(light - step))
        };
        let of = |tone| limb_width::<f64>(tone);
        assert!((of(Some(Tone::Linear)) - width(&|light| light, 0.5)).abs() < 1e-3);
        assert!((of(Some(Tone::Srgb)) - width(&srgb, 0.5)).abs() < 1e-3);
        assert!((of(Some(Tone::Bt709)) - width(&bt709, 0.5)).abs() < 1e-3);
        let half_of_counts = Tone::Srgb.light_at_half().unwrap();
        assert!((of(None) - width(&srgb, half_of_counts)).abs() < 0.02, "{}", width(&srgb, half_of_counts));
        assert_eq!(of(Some(Tone::Unknown)), of(None));
    }

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

    #[test]
    fn numbers_in_flight_are_read_back() {
        for tone in [Tone::Linear, Tone::Srgb, Tone::Bt709, Tone::Gamma(2.2), Tone::Unknown] {
            let mut read = Tone::Linear;
            assert_eq!(read.set_number(0, tone.number(0)), Some(()));
            assert_eq!(read, tone);
        }
        let mut left_out = Some(Tone::Srgb);
        assert_eq!((left_out.set_number(0, f64::NAN), left_out), (Some(()), None));
        assert_eq!(Tone::Linear.set_number(0, f64::INFINITY), None);
    }

    #[test]
    fn the_mid_level_has_the_mean_of_both_lights() {
        let srgb = |counts: f64| libm::pow((counts + 0.055) / 1.055, 2.4);
        let bt709 = |counts: f64| libm::pow((counts + 0.099) / 1.099, 1.0 / 0.45);
        let cube = |counts: f64| counts * counts * counts;
        let curves: [(Tone, &dyn Fn(f64) -> f64); 3] =
            [(Tone::Srgb, &srgb), (Tone::Bt709, &bt709), (Tone::Gamma(3.0), &cube)];
        for (tone, light) in curves {
            let curve = tone.curve::<f64>().unwrap();
            for (bright, dim) in [(1.0, 0.0), (1.0, 0.9), (0.5, 0.1), (0.1, 0.0), (0.05, 0.04)] {
                let level = curve.mid_level(bright, dim);
                assert!((light(level) - 0.5 * (light(bright) + light(dim))).abs() < 1e-12, "{tone} {bright} {dim}");
                let single = tone.curve::<f32>().unwrap().mid_level(bright as f32, dim as f32);
                assert!((f64::from(single) - level).abs() < 1e-6, "{tone} {bright} {dim}");
                assert!((curve.light_over(level, bright) * light(bright) - light(level)).abs() < 1e-12, "{tone}");
            }
        }
        assert!(Tone::Linear.curve::<f64>().is_none() && Tone::Unknown.curve::<f64>().is_none());
    }
}
