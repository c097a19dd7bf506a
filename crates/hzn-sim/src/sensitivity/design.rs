//! Camera, body and position of a sensor that does not exist yet.

use hzn_core::body::PriorError;
use hzn_core::camera;
use hzn_core::error::ConfigError;
use nalgebra::{Matrix3, Vector3};

/// A camera above a sphere.
#[derive(Debug, Clone, PartialEq)]
pub struct Design {
    /// The lens and the size of the picture.
    pub camera: camera::Config,
    /// Radius of the body in kilometres, above 0.
    pub radius_km: f64,
    /// Altitude above the body in kilometres; it must be above the limb height.
    pub altitude_km: f64,
    /// 1-sigma of the altitude in kilometres, 0 or more.
    pub altitude_sigma_km: f64,
    /// Height of the visible limb above the surface in kilometres.
    pub limb_height_km: f64,
    /// 1-sigma of the limb height in kilometres, 0 or more.
    pub limb_height_sigma_km: f64,
    /// Angle of the optical axis below the local horizontal in degrees; 90 looks straight down.
    pub depression_deg: f64,
    /// Turn about the optical axis in degrees.
    pub roll_deg: f64,
    /// 1-sigma of an edge point along u and along v, in pixels.
    pub sigma_px: f64,
    /// Correlation length of the errors along the edge in pixels; 0 means white errors.
    pub correlation_px: f64,
}

/// The reason why a design is invalid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DesignError {
    /// The camera is out of its limits.
    #[error(transparent)]
    Camera(#[from] ConfigError),
    /// The sensor refuses what it is told of the place.
    #[error("{0}")]
    Prior(PriorError),
    /// The camera is not above the limb.
    #[error("the camera at {altitude_km} km is not above the limb at {limb_height_km} km, or the body has no radius")]
    Inside {
        /// Altitude of the camera in kilometres.
        altitude_km: f64,
        /// Height of the limb in kilometres.
        limb_height_km: f64,
    },
}

impl Design {
    /// Returns the half-angle of the limb's cone in radians: sin α = (R + d)/(R + H).
    ///
    /// # Errors
    /// Fails if the camera is not above the limb.
    pub fn half_angle_rad(&self) -> Result<f64, DesignError> {
        let sin = (self.radius_km + self.limb_height_km) / (self.radius_km + self.altitude_km);
        if self.radius_km > 0.0 && sin > 0.0 && sin < 1.0 {
            Ok(sin.asin())
        } else {
            Err(DesignError::Inside { altitude_km: self.altitude_km, limb_height_km: self.limb_height_km })
        }
    }

    /// Returns the unit direction to the body's centre in the camera frame.
    pub fn axis(&self) -> [f64; 3] {
        let (sd, cd) = self.depression_deg.to_radians().sin_cos();
        let (sr, cr) = self.roll_deg.to_radians().sin_cos();
        [sr * cd, cr * cd, sd]
    }

    /// Returns the angle in degrees from the local horizontal down to the nearest point of the limb.
    ///
    /// # Errors
    /// Fails like [`Self::half_angle_rad`].
    pub fn dip_deg(&self) -> Result<f64, DesignError> {
        Ok(90.0 - self.half_angle_rad()?.to_degrees())
    }
}

/// Returns the rotation into the camera frame for a camera with this local vertical and north. The camera looks in the
/// direction `azimuth` (from north over east), `depression` below the horizontal, and is turned by `roll` about its
/// optical axis, all in degrees. The direction down is then that of [`Design::axis`].
pub(super) fn rotation_to_camera(
    up: &Vector3<f64>,
    north: &Vector3<f64>,
    [azimuth, depression, roll]: [f64; 3],
) -> Matrix3<f64> {
    let [(sa, ca), (sd, cd), (sr, cr)] = [azimuth, depression, roll].map(|deg| deg.to_radians().sin_cos());
    let ahead = north * ca + north.cross(up) * sa;
    let z = ahead * cd - up * sd;
    let down = -up * cd - ahead * sd;
    let right = down.cross(&z);
    let (x, y) = (right * cr + down * sr, down * cr - right * sr);
    Matrix3::from_rows(&[x.transpose(), y.transpose(), z.transpose()])
}
