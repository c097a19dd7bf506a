//! Quantiles of sorted values.

/// Returns the value below which the share `p` of the sorted values lies. It is linear between neighbours, and NaN if
/// there are no values.
pub(crate) fn quantile(sorted: &[f64], p: f64) -> f64 {
    let place = p * sorted.len().saturating_sub(1) as f64;
    let (below, part) = (place.floor() as usize, place.fract());
    match (sorted.get(below), sorted.get(below + 1)) {
        (Some(a), Some(b)) => a + part * (b - a),
        (Some(a), None) => *a,
        _ => f64::NAN,
    }
}
