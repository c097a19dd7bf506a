//! OpenCV's lens with 8 or 12 coefficients: a ratio of two polynomials of r², and thin prisms.

/// A lens of OpenCV with more than five coefficients. The formula is that of OpenCV's page "Camera Calibration and 3D
/// Reconstruction".
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rational {
    /// Width and height of the picture in pixels.
    pub size_px: [u16; 2],
    /// fx, fy, cx, cy in pixels.
    pub intrinsics_px: [f64; 4],
    /// k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4.
    pub distortion: [f64; 12],
}

impl Rational {
    /// Projects a direction (camera frame). `None` if nothing is projected from there.
    pub fn project(&self, [x, y, z]: [f64; 3]) -> Option<[f64; 2]> {
        if !(z > 1e-3 * (x * x + y * y + z * z).sqrt()) {
            return None;
        }
        let (x, y) = (x / z, y / z);
        let [k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4] = self.distortion;
        let r2 = x * x + y * y;
        let below = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
        // Beyond a root of the denominator the picture is turned inside out.
        if !(below > 0.0) {
            return None;
        }
        let radial = (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))) / below;
        let u = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) + r2 * (s1 + r2 * s2);
        let v = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y + r2 * (s3 + r2 * s4);
        let [fx, fy, cx, cy] = self.intrinsics_px;
        Some([fx * u + cx, fy * v + cy])
    }
}
