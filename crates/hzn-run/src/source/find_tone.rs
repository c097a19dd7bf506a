//! Finds the tone of a whole sequence, once for all of its pictures.

use hzn_core::tone::Tone;

use super::sequence::Source;
use super::tone::FoundTone;

/// Number of pictures that are examined. All must say the same.
const MAX_EXAMINED: usize = 4;

/// Returns the tones that the pictures of a sequence say, in words, if they differ. A picture may say none.
pub fn describe_mixed_tones(source: &dyn Source) -> Option<String> {
    if source.tone().is_some() {
        return None;
    }
    let mut all: Vec<Option<Tone>> = Vec::new();
    for payload in source.samples().take(MAX_EXAMINED) {
        let tone = payload.tone().map(|found| found.tone);
        if !all.contains(&tone) {
            all.push(tone);
        }
    }
    let words: Vec<String> =
        all.iter().map(|tone| tone.map_or_else(|| "unknown".to_owned(), |tone| tone.to_string())).collect();
    (words.len() > 1).then(|| words.join(", "))
}

/// Finds the tone of a sequence. Returns `None` if its pictures do not say it, or say different things.
pub fn find_tone(source: &dyn Source) -> Option<FoundTone> {
    source.tone().or_else(|| {
        let mut tones = source.samples().take(MAX_EXAMINED).map(|payload| payload.tone());
        let first = tones.next()??;
        tones.all(|other| other == Some(first)).then_some(first)
    })
}
