//! Finds the tone of a whole sequence, once for all of its pictures.

use super::sequence::Source;
use super::tone::FoundTone;

/// Number of pictures that are examined. All must say the same.
const MAX_EXAMINED: usize = 4;

/// Finds the tone of a sequence. Returns `None` if its pictures do not say it, or say different things.
pub fn find_tone(source: &dyn Source) -> Option<FoundTone> {
    source.tone().or_else(|| {
        let mut tones = source.samples().take(MAX_EXAMINED).map(|payload| payload.tone());
        let first = tones.next()??;
        tones.all(|other| other == Some(first)).then_some(first)
    })
}
