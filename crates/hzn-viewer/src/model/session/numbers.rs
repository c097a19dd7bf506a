//! Numbers of a sensor.toml, and how they are written.

/// Returns a value that is a number.
pub(super) fn number(value: &toml::Value) -> Option<f64> {
    match value {
        toml::Value::Float(x) => Some(*x),
        toml::Value::Integer(n) => Some(*n as f64),
        _ => None,
    }
}

/// Rounds a number to five significant digits, as a person would write it.
pub(super) fn tidy(x: f64) -> f64 {
    if x == 0.0 || !x.is_finite() {
        return x;
    }
    let digits = (4 - x.abs().log10().floor() as i32).clamp(0, 9);
    let scale = 10f64.powi(digits);
    (x * scale).round() / scale
}

/// Rounds a coordinate of a mask corner to tenths of a pixel, which is fine enough.
pub(super) fn tidy_px(x: f64) -> f64 {
    (x * 10.0).round() / 10.0
}
