//! Kalibr's `omni` lens: the unified projection of Mei & Rives 2007, with radial and tangential distortion after it.
//!
//! Without distortion it is `eucm` with β = 1: the image point f x/(ξρ + z), with ρ the length of the direction, is
//! f/(1 + ξ) · x/(αρ + (1 − α)z) with α = ξ/(1 + ξ). With distortion no lens of hzn is equal to it.

use hzn_core::camera::{Config, Model};

/// An `omni` lens with distortion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Omni {
    /// Width and height of the picture in pixels.
    pub size_px: [u16; 2],
    /// Distance ξ of the second projection's centre from that of the sphere, at least 0.
    pub xi: f64,
    /// fx, fy, cx, cy in pixels.
    pub intrinsics_px: [f64; 4],
    /// k1, k2, p1, p2.
    pub distortion: [f64; 4],
}

impl Omni {
    /// Projects a direction (camera frame). `None` if nothing is projected from there.
    pub fn project(&self, [x, y, z]: [f64; 3]) -> Option<[f64; 2]> {
        let rho = (x * x + y * y + z * z).sqrt();
        let depth = z + self.xi * rho;
        // For ξ below 1 the projection ends at a plane, for ξ above 1 where the sphere covers itself: cos θ = −1/ξ.
        if !(depth > 1e-3 * rho) || (self.xi > 1.0 && z * self.xi <= -rho) {
            return None;
        }
        let (x, y) = (x / depth, y / depth);
        let [k1, k2, p1, p2] = self.distortion;
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * k2);
        let u = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
        let v = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
        let [fx, fy, cx, cy] = self.intrinsics_px;
        Some([fx * u + cx, fy * v + cy])
    }

    /// Returns the same lens as `eucm`; `None` if it has distortion.
    pub fn to_eucm(&self) -> Option<Config> {
        if self.distortion != [0.0; 4] {
            return None;
        }
        let [fx, fy, cx, cy] = self.intrinsics_px;
        let scale = 1.0 / (1.0 + self.xi);
        let mut config = Config::ideal(Model::Eucm, self.size_px[0], self.size_px[1], fx * scale);
        (config.fy_px, config.cx_px, config.cy_px) = (fy * scale, cx, cy);
        config.k = [self.xi * scale, 1.0].into_iter().collect();
        Some(config)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_core::camera::Equation;

    #[test]
    fn without_distortion_it_is_eucm() {
        let omni = Omni {
            size_px: [752, 480],
            xi: 0.80065662,
            intrinsics_px: [833.006, 830.345, 373.850, 253.749],
            distortion: [0.0; 4],
        };
        let eucm = Equation::new(&omni.to_eucm().unwrap());
        for direction in [[0.1, 0.2, 1.0], [0.0, 0.0, 2.0], [-1.0, 0.5, 0.7]] {
            let [u, v] = omni.project(direction).unwrap();
            let p = eucm.project(direction).unwrap().point;
            assert!((p.u - u).abs() < 1e-9 && (p.v - v).abs() < 1e-9, "{p:?} {u} {v}");
        }
        assert!(omni.project([0.0, 0.0, -1.0]).is_none());
        assert!(Omni { distortion: [0.1, 0.0, 0.0, 0.0], ..omni }.to_eucm().is_none());
    }
}
