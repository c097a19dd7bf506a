//! Finds how many bits of 16-bit words a camera uses, once for a whole sequence.
//!
//! A camera with 10, 12 or 14 bits often writes its counts into the lower bits of words. Full scale is then not 65535,
//! and thresholds given as fractions of 65535 would be far too high. Others shift them into the upper bits; then it is.
//! Dark pictures of the two kinds look alike, and the user is told. One picture is not enough, because it may be dark.
//! Therefore pictures are sampled evenly from the whole sequence, by their place in it, and the result holds for all
//! pictures.

use hzn_core::Config;

use super::levels::{Levels, of_upper_bits};
use super::sequence::Source;

/// Number of pictures that are examined. If the input is one picture, it is examined in addition to those of its
/// folder.
pub(super) const MAX_EXAMINED: usize = 16;
/// If this many pictures at the beginning have no words, the sequence has none.
const MAX_PICTURES_WITHOUT_WORDS: usize = 3;
/// Numbers of bits that cameras have.
const BITS: [u8; 5] = [8, 10, 12, 14, 16];

/// Significant bits, determined from the samples of a sequence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FoundBits {
    /// The smallest of 8, 10, 12, 14 and 16 bits that can represent every examined sample.
    pub bits: u8,
    /// The largest examined sample.
    pub largest_sample: u16,
    /// Number of pictures that were examined.
    pub pictures: usize,
    /// Number of the camera's bits if they are probably the upper ones of the words, see [`Levels::upper_bits`].
    pub upper_bits: Option<u8>,
}

impl std::fmt::Display for FoundBits {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { bits, largest_sample, pictures, upper_bits } = self;
        let examined = crate::explain::counted(*pictures as u64, "picture");
        write!(
            f,
            "the largest 16-bit sample in {examined} is {largest_sample}: the camera is assumed to have {bits} bits; \
             if it has another number, set bits = ... in [input] of sensor.toml"
        )?;
        upper_bits.map_or(Ok(()), |upper| write!(f, "; {}", of_upper_bits(upper)))
    }
}

/// Finds the significant bits of a sequence of words. Only pictures of the sensor's size are examined. Returns `None`
/// if the pictures have 8-bit samples, if all samples are 0, or if the source itself knows the bits.
pub fn find_bits(source: &dyn Source, sensor: &Config) -> Option<FoundBits> {
    if source.bits().is_some() {
        return None;
    }
    let (mut levels, mut pictures) = (Levels::default(), 0);
    for (i, payload) in source.samples().take(MAX_EXAMINED + 1).enumerate() {
        match payload.levels(sensor) {
            Some(more) => {
                levels.add(&more);
                pictures += 1;
            }
            None if pictures == 0 && i + 1 >= MAX_PICTURES_WITHOUT_WORDS => return None,
            None => {}
        }
    }
    let largest_sample = levels.largest;
    let fits = |bits: &u8| u32::from(largest_sample) >> bits == 0;
    let bits = BITS.into_iter().find(fits)?;
    // Black pictures contain no information about the bits.
    (largest_sample > 0).then_some(FoundBits { bits, largest_sample, pictures, upper_bits: levels.upper_bits() })
}

/// Returns the text of a sensor.toml with this key set in a section. Text that is not TOML is returned unchanged.
pub fn with_key(text: &str, section: &str, key: &str, value: impl Into<toml_edit::Value>) -> String {
    let Ok(mut document) = text.parse::<toml_edit::DocumentMut>() else { return text.to_owned() };
    let section = document.entry(section).or_insert_with(toml_edit::table);
    if let Some(section) = section.as_table_like_mut() {
        section.insert(key, toml_edit::value(value));
    }
    document.to_string()
}

/// Returns the places of the pictures to examine, evenly spread over a sequence of `count`, including its first and
/// last.
pub(super) fn places(count: usize) -> impl Iterator<Item = usize> {
    let n = count.min(MAX_EXAMINED);
    (0..n).map(move |i| if n > 1 { i * (count - 1) / (n - 1) } else { 0 })
}
