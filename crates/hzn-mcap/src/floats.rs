//! Samples with a fraction as the words of a picture.

/// Least and largest word of numbers with a fraction: an eighth of the range is left at both ends, because a sample at
/// the end of the range counts as clipped, and a clipped limb seems higher.
const ROOM: [u16; 2] = [1 << 13, 7 << 13];

/// Converts numbers with a fraction, such as temperatures, to 16 bits: the smallest becomes 8192 and the largest 57344,
/// and what lies between keeps its place on the line. A number that is not finite becomes 8192.
///
/// # Errors
/// Every number is the same or not finite, so that there is no scale.
pub fn words_from_floats(values: &[f64]) -> Result<Vec<u16>, String> {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), value| (a.min(value), b.max(value)));
    let [least, largest] = ROOM.map(f64::from);
    let scale = (largest - least) / (high - low);
    if !(high > low && scale > 0.0 && scale.is_finite()) {
        return Err("every number of the picture is the same, or not finite".to_owned());
    }
    let word = |value: &f64| if value.is_finite() { least + (value - low) * scale } else { least };
    Ok(values.iter().map(|value| word(value).round() as u16).collect())
}

/// Part of the numbers at each end that may be hot pixels or missing values.
const ENDS: f64 = 5e-4;
/// Smallest part of the 16 bits that the other numbers use without advice: 8 bits are left of them.
const CROWDED: f64 = 1.0 / 192.0;

/// Returns advice about `words` of [`words_from_floats`] if few numbers, such as a hot pixel, set the scale: the others
/// then have fewer levels than a picture of 8 bits. `None` for any other words.
///
/// ```
/// use hzn_mcap::{doubt_scale, words_from_floats};
///
/// let mut kelvin: Vec<f64> = (0..10_000).map(|i| 210.0 + 0.01 * f64::from(i)).collect();
/// assert!(doubt_scale(&words_from_floats(&kelvin)?).is_none());
/// kelvin[77] = 1e6;
/// assert!(doubt_scale(&words_from_floats(&kelvin)?).is_some_and(|advice| advice.contains("hot pixel")));
/// # Ok::<(), String>(())
/// ```
pub fn doubt_scale(words: &[u16]) -> Option<String> {
    let [least, largest] = ROOM;
    if words.iter().min() != Some(&least) || words.iter().max() != Some(&largest) {
        return None;
    }
    let mut sorted = words.to_vec();
    sorted.sort_unstable();
    let at = |part: f64| sorted.get((part * (sorted.len() - 1) as f64).round() as usize).copied().map(f64::from);
    let part = (at(1.0 - ENDS)? - at(ENDS)?) / f64::from(largest - least);
    (part < CROWDED).then(|| {
        format!(
            "{:.1} % of the numbers lie in {:.2} % of the range from the smallest to the largest, which becomes 16 \
             bits: if a hot pixel or a missing value is at its end, clip the numbers, or write NaN there",
            100.0 * (1.0 - 2.0 * ENDS),
            100.0 * part
        )
    })
}
