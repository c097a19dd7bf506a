//! Two unit vectors across a direction.

/// Returns two unit vectors that span the plane perpendicular to `axis`, of unit length.
pub(crate) fn basis([x, y, z]: [f64; 3]) -> ([f64; 3], [f64; 3]) {
    // A coordinate axis far from `axis` gives a well conditioned product.
    let far = if x.abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let b1 = cross([x, y, z], far);
    let n = b1.iter().map(|v| v * v).sum::<f64>().sqrt();
    let b1 = b1.map(|v| v / n);
    (b1, cross([x, y, z], b1))
}
