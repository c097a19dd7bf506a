//! A fix of a satellite navigation receiver.

use hzn_core::ellipsoid::{WGS84_A_M, WGS84_B_M, from_geodetic};
use hzn_nav::frames::{Fixed, Vector};
use nalgebra::Vector3;

/// A fix of the receiver; the velocity is relative to the Earth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fix {
    /// Time, s.
    pub time_s: f64,
    /// Position, m.
    pub position_m: Vector<Fixed>,
    /// Velocity, m/s; not finite if there is none.
    pub velocity_m_s: Vector<Fixed>,
    /// 1-sigma of each component of the position, m; NaN if the file does not have it.
    pub position_sigma_m: f64,
    /// 1-sigma of each component of the velocity, m/s; NaN if the file does not have it.
    pub velocity_sigma_m_s: f64,
}

/// What the file of a receiver says.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Receiver {
    /// The fixes, in the order of the file.
    pub fixes: Vec<Fix>,
    /// What was assumed or left out, for the user.
    pub notes: Vec<String>,
}

/// Returns the position in ECEF of a latitude and longitude in degrees, and a height above the ellipsoid.
pub(super) fn ecef_m(lat_deg: f64, lon_deg: f64, height_m: f64) -> Vector3<f64> {
    from_geodetic(lat_deg.to_radians(), lon_deg.to_radians(), height_m, WGS84_A_M, WGS84_B_M).into()
}
