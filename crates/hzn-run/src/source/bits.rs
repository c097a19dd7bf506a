//! How many bits of 16-bit words a camera uses, found once for a whole sequence.
//!
//! A camera of 10, 12 or 14 bits often writes its counts into the lower bits of words. Full scale is then not 65535,
//! and levels in fractions of it would be far too high. One picture does not tell: it may be dark. So pictures are
//! taken evenly from the whole sequence, by their places and not by what comes first, and the answer holds for all of
//! them.

use super::Source;

/// Pictures that are looked at, and one more where one picture stands for its folder.
pub(super) const LOOKED_AT: usize = 16;
/// So many pictures without words at the beginning: the sequence has none.
const BYTES: usize = 3;
/// Bits that cameras have.
const BITS: [u8; 5] = [8, 10, 12, 14, 16];

/// Significant bits, as the samples of a sequence show them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FoundBits {
    /// The fewest of 8, 10, 12, 14 and 16 that hold every sample that was looked at.
    pub bits: u8,
    /// The largest of those samples.
    pub most: u16,
    /// Pictures that were looked at.
    pub pictures: usize,
}

impl std::fmt::Display for FoundBits {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { bits, most, pictures } = self;
        let of = crate::explain::counted(*pictures as u64, "picture");
        write!(
            f,
            "samples are words of 16 bits that reach {most} in {of} looked at: taken as {bits} bits; if the camera has \
             others, say so with bits = ... in [input] of sensor.toml"
        )
    }
}

/// Finds the significant bits of a sequence of words; `None` where its pictures are of bytes, or where the source
/// knows.
pub fn find_bits(source: &dyn Source) -> Option<FoundBits> {
    if source.bits().is_some() {
        return None;
    }
    let (mut most, mut pictures) = (0, 0);
    for (i, payload) in source.samples().take(LOOKED_AT + 1).enumerate() {
        match payload.largest_word() {
            Some(word) => (most, pictures) = (word.max(most), pictures + 1),
            None if pictures == 0 && i + 1 >= BYTES => return None,
            None => {}
        }
    }
    let bits = BITS.into_iter().find(|bits| u32::from(most) >> bits == 0)?;
    // Black pictures tell nothing.
    (most > 0).then_some(FoundBits { bits, most, pictures })
}

/// The text of a sensor.toml with a key of `[input]`; text that is no TOML stays as it is.
pub fn with_key(text: &str, key: &str, value: impl Into<toml_edit::Value>) -> String {
    let Ok(mut document) = text.parse::<toml_edit::DocumentMut>() else { return text.to_owned() };
    let input = document.entry("input").or_insert_with(toml_edit::table);
    if let Some(input) = input.as_table_like_mut() {
        input.insert(key, toml_edit::value(value));
    }
    document.to_string()
}

/// Places of the pictures to look at, evenly from a sequence of `count`, its first and last among them.
pub(super) fn places(count: usize) -> impl Iterator<Item = usize> {
    let n = count.min(LOOKED_AT);
    (0..n).map(move |i| if n > 1 { i * (count - 1) / (n - 1) } else { 0 })
}
