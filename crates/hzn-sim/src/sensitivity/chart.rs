//! Charts of the visible limb, and the error of a spherical Earth.

use hzn_core::ellipsoid::{LimbCone, WGS84_A_M, WGS84_B_M, from_geodetic};
use nalgebra::Vector3;
use serde::Serialize;

/// Full fields of view in degrees above which each kind of limb can be seen in the plane of a pinhole picture (Braun &
/// Barf 2022, section 2.7, with the two conditions corrected).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Visibility {
    /// Half-angle of the limb's cone in degrees.
    pub half_angle_deg: f64,
    /// An arc of an ellipse is visible above γ = 4α − π; 0 means always.
    pub ellipse_deg: f64,
    /// An arc of a hyperbola is visible above γ = π − 4α; 0 means always.
    pub hyperbola_deg: f64,
    /// The whole disc fits above γ = 2α.
    pub disc_deg: f64,
}

impl Visibility {
    /// Returns the fields of view for a half-angle in radians.
    pub fn new(half_angle_rad: f64) -> Self {
        let alpha = half_angle_rad.to_degrees();
        Self {
            half_angle_deg: alpha,
            ellipse_deg: (4.0 * alpha - 180.0).max(0.0),
            hyperbola_deg: (180.0 - 4.0 * alpha).max(0.0),
            disc_deg: 2.0 * alpha,
        }
    }
}

/// Angles in degrees between the directions "down" at a position above WGS-84.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Vertical {
    /// Angle from the direction to the Earth's centre to the geodetic vertical.
    pub geocentric_to_geodetic_deg: f64,
    /// Angle from the direction to the Earth's centre to the limb axis. It is the error of a spherical Earth model.
    pub geocentric_to_axis_deg: f64,
    /// Angle from the geodetic vertical to the limb axis.
    pub geodetic_to_axis_deg: f64,
    /// Difference of the limb cone's two half-angles.
    pub half_angle_spread_deg: f64,
}

impl Vertical {
    /// Returns the angles at a geodetic latitude (degrees) and an altitude (kilometres). Returns `None` if the altitude
    /// is not above `limb_height_km`.
    pub fn from_position(latitude_deg: f64, altitude_km: f64, limb_height_km: f64) -> Option<Self> {
        let latitude = latitude_deg.to_radians();
        let position = from_geodetic(latitude, 0.0, altitude_km * 1e3, WGS84_A_M, WGS84_B_M);
        let d = limb_height_km * 1e3;
        if !(altitude_km > limb_height_km) {
            return None;
        }
        let cone = LimbCone::<f64>::try_new(position, WGS84_A_M + d, WGS84_B_M + d)?;
        let (sin, cos) = latitude.sin_cos();
        let geodetic = -Vector3::new(cos, 0.0, sin);
        let geocentric = -Vector3::from(position).normalize();
        let axis = Vector3::from(cone.axis.xyz());
        let angle = |a: &Vector3<f64>, b: &Vector3<f64>| a.cross(b).norm().atan2(a.dot(b)).to_degrees();
        let (east, meridian) = cone.half_angles_rad();
        Some(Self {
            geocentric_to_geodetic_deg: angle(&geocentric, &geodetic),
            geocentric_to_axis_deg: angle(&geocentric, &axis),
            geodetic_to_axis_deg: angle(&geodetic, &axis),
            half_angle_spread_deg: (east - meridian).abs().to_degrees(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ellipse_at_238_km_needs_118_degrees() {
        let v = Visibility::new((6371.0f64 / 6609.0).asin());
        assert!((v.ellipse_deg - 118.3).abs() < 0.05 && v.hyperbola_deg == 0.0, "{v:?}");
        assert!((v.disc_deg - 2.0 * v.half_angle_deg).abs() < 1e-12);
        // From far away, small pictures show only ellipses.
        let far = Visibility::new((6371.0f64 / 42_157.0).asin());
        assert!(far.ellipse_deg == 0.0 && far.hyperbola_deg > 140.0);
    }

    /// The values are from section 6.1 of the mathematics: latitude 45°, without a limb height.
    #[test]
    fn the_axis_is_close_to_the_geodetic_vertical() {
        for (altitude, geodetic, axis, rest) in [
            (100.0, 0.1894, 0.1865, 0.0029),
            (240.0, 0.1854, 0.1787, 0.0067),
            (600.0, 0.1759, 0.1607, 0.0151),
            (2000.0, 0.1464, 0.1114, 0.0350),
            (20_000.0, 0.0465, 0.0112, 0.0352),
        ] {
            let v = Vertical::from_position(45.0, altitude, 0.0).unwrap();
            assert!((v.geocentric_to_geodetic_deg - geodetic).abs() < 1e-4, "{altitude} {v:?}");
            assert!((v.geocentric_to_axis_deg - axis).abs() < 1e-4, "{altitude} {v:?}");
            assert!((v.geodetic_to_axis_deg - rest).abs() < 1e-4, "{altitude} {v:?}");
        }
        for (altitude, spread) in [(100.0, 0.033), (240.0, 0.050), (600.0, 0.071), (2000.0, 0.095), (20_000.0, 0.045)] {
            let v = Vertical::from_position(0.0, altitude, 0.0).unwrap();
            assert!((v.half_angle_spread_deg - spread).abs() < 1e-3, "{altitude} {v:?}");
        }
        assert!(Vertical::from_position(10.0, 5.0, 10.0).is_none());
    }
}
