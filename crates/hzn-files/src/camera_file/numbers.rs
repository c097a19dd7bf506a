//! Numbers and lists of the written files.

use hzn_core::camera::Config;

/// Returns fx, fy, cx, cy in pixels.
pub(super) fn intrinsics(c: &Config) -> [f64; 4] {
    [c.fx_px, c.fy_px, c.cx_px, c.cy_px]
}

/// Returns the camera matrix, row by row.
pub(super) fn matrix(c: &Config) -> [f64; 9] {
    [c.fx_px, 0.0, c.cx_px, 0.0, c.fy_px, c.cy_px, 0.0, 0.0, 1.0]
}

/// Returns the projection matrix without rectification, row by row.
pub(super) fn projection(c: &Config) -> [f64; 12] {
    [c.fx_px, 0.0, c.cx_px, 0.0, 0.0, c.fy_px, c.cy_px, 0.0, 0.0, 0.0, 1.0, 0.0]
}

/// The rotation of a camera without rectification, row by row.
pub(super) const RECTIFICATION: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// Formats a list, as YAML, JSON and TOML have it.
pub(super) fn format_list(numbers: &[f64]) -> String {
    format!("[{}]", numbers.iter().map(|&x| format_number(x)).collect::<Vec<_>>().join(", "))
}

/// Formats a number so that it is read back to the last bit. YAML 1.1 and OpenCV read `1e-5` as a word, so a decimal
/// point is added.
pub(super) fn format_number(x: f64) -> String {
    let text = format!("{x:?}");
    match text.split_once('e') {
        Some((digits, exponent)) if !digits.contains('.') => format!("{digits}.0e{exponent}"),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_a_point() {
        assert_eq!(
            (format_number(1e-7), format_number(300.0), format_number(1.5e-9)),
            ("1.0e-7".into(), "300.0".into(), "1.5e-9".into())
        );
    }
}
