//! What a sequence of epochs remembers of the epochs before.

use hzn_core::status::Status;

use super::joint::Joiner;
use super::levels::Levels;
use super::seen::{Repeat, Seen};
use crate::engine::Finished;
use crate::source::picture::Samples;

/// Returns a checksum of the samples of a picture, for [`Memory::find_repeats`].
pub fn digest(samples: &Samples) -> u32 {
    match samples {
        Samples::Bytes(bytes) => crc32fast::hash(bytes),
        Samples::Words(words) => crc32fast::hash(&words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<_>>()),
    }
}

/// The pictures of the last epoch, and the brightness at the last limb of each head.
#[derive(Debug, Clone)]
pub struct Memory {
    /// Time and digest of the last picture of each head.
    last: Vec<Option<(Option<f64>, u32)>>,
    levels: Levels,
}

impl Memory {
    /// Begins a sequence of a number of heads.
    pub fn new(heads: usize) -> Self {
        Self::with_levels(Levels::new(heads), heads)
    }

    /// Continues a sequence of which only the brightness at the last limbs is known.
    pub(super) fn with_levels(levels: Levels, heads: usize) -> Self {
        Self { last: vec![None; heads], levels }
    }

    /// Returns which pictures of an epoch have the digest of the picture before, or of another head. The noise of a
    /// camera never repeats, but a dark or clipped picture has none: a picture without an answer never counts, so that
    /// its own reason is reported. Neither does a picture at the time of the one before: it was only stored twice.
    pub fn find_repeats(&mut self, heads: &[Option<Finished>], digests: &[Option<u32>]) -> Vec<Option<Repeat>> {
        let timed = |(frame, digest): (&Option<Finished>, &Option<u32>)| Some((frame.as_ref()?.time_s, (*digest)?));
        let now: Vec<_> = heads.iter().zip(digests).map(timed).collect();
        let is_answered = |frame: &Finished| frame.outcomes.first().is_some_and(|o| o.status() == Status::Ok);
        let repeat = |(k, frame): (usize, &Option<Finished>)| {
            let (now_s, own) = frame.as_ref().filter(|frame| is_answered(frame)).and(now.get(k).copied().flatten())?;
            let others = now.iter().enumerate().filter(|(other, _)| *other != k).filter_map(|(_, seen)| *seen);
            if others.map(|(_, other)| other).any(|other| other == own) {
                return Some(Repeat::OtherHead);
            }
            let (before_s, before) = self.last.get(k).copied().flatten()?;
            (own == before && (now_s.is_none() || now_s != before_s)).then_some(Repeat::Before)
        };
        let repeats = heads.iter().enumerate().map(repeat).collect();
        self.last = now;
        repeats
    }

    /// Returns the pictures of an epoch as the joint answer takes them.
    pub fn see<'a>(
        &mut self,
        joiner: &Joiner,
        heads: &'a [Option<Finished>],
        repeats: &[Option<Repeat>],
    ) -> Vec<Seen<'a>> {
        let seen = |(k, (frame, repeats)): (usize, (&'a Option<Finished>, &Option<Repeat>))| {
            let level = self.levels.see(k, joiner.level(k, frame.as_ref()));
            Seen::new(frame.as_ref(), *repeats).with_level(level)
        };
        heads.iter().zip(repeats).enumerate().map(seen).collect()
    }
}
