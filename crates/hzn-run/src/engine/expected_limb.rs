//! The limb that is expected in a picture.

use hzn_core::body::Expected;
use hzn_core::real::Real;

/// What is expected of the limb of one body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExpectedLimb {
    /// Half-angle of its cone, radians.
    pub half_angle_rad: f64,
    /// Height above the surface and its 1-sigma, km, as place, season and night select them.
    pub height_and_sigma_km: [f64; 2],
    /// Whether it is the outer edge of the layer of airglow.
    pub is_airglow: bool,
}

impl ExpectedLimb {
    pub(super) fn from_expected<T: Real + Into<f64>>(expected: &Expected<T>) -> Self {
        let (height_m, sigma_m) = expected.limb_height_and_sigma_m();
        Self {
            half_angle_rad: expected.half_angle_rad().into(),
            height_and_sigma_km: [height_m, sigma_m].map(|m| m.into() * 1e-3),
            is_airglow: expected.is_airglow(),
        }
    }
}
