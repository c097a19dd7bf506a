//! What the samples of 16-bit words say about the number of bits of their camera.

use std::collections::BTreeSet;

/// If at least this many bits of all samples are unused, this is not by chance.
const UNUSED_BITS: u32 = 2;
/// So many bits are not 0 by chance: the lowest k bits of n different samples are all 0 with a probability of 2^(−k·n),
/// which is one in a million here.
const CERTAIN_BITS: usize = 20;

/// The levels of samples of 16 bits.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Levels {
    /// The largest sample.
    pub largest: u16,
    /// The bits that are set in any sample.
    set: u16,
    /// Different samples above 0; more than [`CERTAIN_BITS`] are not kept.
    different: BTreeSet<u16>,
}

impl Levels {
    /// Adds the samples of `more`.
    pub fn add(&mut self, more: &Self) {
        self.extend(more.different.iter().copied());
        self.largest = self.largest.max(more.largest);
        self.set |= more.set;
    }

    /// Returns the number of the camera's bits if they are probably the upper bits of the words, as libraries of
    /// industrial cameras shift them. Full scale is then that of 16 bits. Pictures of fewer bits that were multiplied
    /// look the same.
    pub fn upper_bits(&self) -> Option<u8> {
        let unused = self.set.trailing_zeros().min(15);
        let is_certain = unused as usize * self.different.len() >= CERTAIN_BITS;
        (unused >= UNUSED_BITS && is_certain).then_some(16 - unused as u8)
    }

    /// Returns advice if the samples leave bits unused at the top, and the number of bits is not known.
    pub fn advice(&self) -> Option<String> {
        let largest = self.largest;
        let bits = (16 - largest.leading_zeros()).max(8);
        let fewer = || match self.upper_bits() {
            Some(upper) => of_upper_bits(upper),
            None => format!("if the camera has fewer bits than the file, set bits = {bits} in [input] of sensor.toml"),
        };
        (bits + UNUSED_BITS <= 16).then(|| format!("the largest sample is {largest} of 65535: {}", fewer()))
    }

    /// Returns advice if a sample needs more bits than were told: it then counts as clipped.
    pub fn exceed(&self, bits: u8) -> Option<String> {
        let (largest, needed) = (self.largest, 16 - self.largest.leading_zeros());
        let cure = || match self.upper_bits() {
            Some(upper) => of_upper_bits(upper),
            None => format!("set bits = {needed}"),
        };
        (needed > u32::from(bits)).then(|| {
            format!("the largest sample is {largest}, which has {needed} bits, but bits = {bits} was told: {}", cure())
        })
    }
}

/// Says in words what samples mean that use only the upper bits.
pub(super) fn of_upper_bits(bits: u8) -> String {
    let step = 1u32 << (16 - bits.min(16));
    format!(
        "all samples are multiples of {step}: if the camera writes its {bits} bits into the upper bits of the words, \
         set bits = 16"
    )
}

impl Extend<u16> for Levels {
    fn extend<I: IntoIterator<Item = u16>>(&mut self, samples: I) {
        for sample in samples {
            self.largest = self.largest.max(sample);
            self.set |= sample;
            if sample > 0 && self.different.len() < CERTAIN_BITS {
                self.different.insert(sample);
            }
        }
    }
}

impl FromIterator<u16> for Levels {
    fn from_iter<I: IntoIterator<Item = u16>>(samples: I) -> Self {
        let mut levels = Self::default();
        levels.extend(samples);
        levels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A dark picture of a camera with 12 bits: in the lower bits of the words, in the upper ones, and of two levels
    /// only, which say nothing.
    #[test]
    fn shifted_bits_are_told_from_unused_ones() {
        let dark = (0..500).map(|i| i * 7 % 500);
        let lower: Levels = dark.clone().collect();
        assert_eq!(lower.upper_bits(), None);
        assert!(lower.advice().is_some_and(|text| text.contains("bits = 9")), "{lower:?}");
        let upper: Levels = dark.map(|sample| sample << 4).collect();
        assert_eq!((upper.upper_bits(), upper.largest), (Some(12), 499 << 4));
        let text = upper.advice().unwrap();
        assert!(text.contains("all samples are multiples of 16") && text.ends_with("set bits = 16"), "{text}");
        let two: Levels = [0, 4080, 0, 4080].into_iter().collect();
        assert_eq!(two.upper_bits(), None);
        assert!(two.advice().is_some());
        assert!(two.exceed(12).is_none() && two.exceed(8).is_some_and(|text| text.ends_with("set bits = 12")));
        assert!(upper.exceed(16).is_none() && upper.exceed(12).is_some_and(|text| text.ends_with("set bits = 16")));
    }

    #[test]
    fn levels_of_several_pictures_are_those_of_all_samples() {
        let pictures: [Levels; 2] = [(1..9).map(|i| i << 8).collect(), (20..30).map(|i| i << 4).collect()];
        let mut all = Levels::default();
        pictures.iter().for_each(|picture| all.add(picture));
        assert_eq!(all, (1..9).map(|i| i << 8).chain((20..30).map(|i| i << 4)).collect());
        assert_eq!(all.upper_bits(), Some(12));
        let mut odd = all.clone();
        odd.add(&[257].into_iter().collect());
        assert_eq!(odd.upper_bits(), None);
    }
}
