//! The camera matrix of OpenCV.

/// Returns fx, fy, cx, cy of a camera matrix in the order of its rows, in pixels.
///
/// # Errors
/// The matrix is not [fx, 0, cx; 0, fy, cy; 0, 0, 1]: hzn's lenses have no skew.
pub fn camera_matrix(rows: [f64; 9]) -> Result<[f64; 4], String> {
    let [fx, skew, cx, below, fy, cy, last @ ..] = rows;
    if let Some(bad) = rows.iter().find(|x| !x.is_finite()) {
        return Err(format!("has the value {bad}; finite numbers are expected"));
    }
    if [fx, fy, cx, cy] == [0.0; 4] {
        return Err("is all zeros: the camera is not calibrated; calibrate it first".into());
    }
    if below != 0.0 || last != [0.0, 0.0, 1.0] {
        let transposed = skew == 0.0 && cx == 0.0 && cy == 0.0 && last[2] == 1.0;
        let hint = if transposed { "; it is transposed, as MATLAB keeps it: swap rows and columns" } else { "" };
        return Err(format!("must be [fx, 0, cx; 0, fy, cy; 0, 0, 1]{hint}"));
    }
    if skew != 0.0 {
        return Err(format!("has a skew of {skew} px, which hzn's lenses do not have; calibrate without it"));
    }
    Ok([fx, fy, cx, cy])
}
