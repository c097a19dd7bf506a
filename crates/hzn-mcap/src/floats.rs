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
