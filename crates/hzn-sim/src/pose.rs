//! Position and attitude of the camera.

use hzn_core::ellipsoid::{WGS84_A_M, WGS84_B_M, from_geodetic, geodetic};
use hzn_core::frames::{Cam, Fixed, Rotation};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Position and attitude of the camera.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pose {
    /// Position in metres: in ECEF for the Earth, otherwise in the body's own frame with the origin at its centre.
    pub position_m: [f64; 3],
    /// Quaternion, scalar first, that converts camera coordinates to ECEF coordinates.
    pub q_fixed_from_camera_wxyz: [f64; 4],
}

/// Direction in which a camera looks, relative to the geodetic vertical at its position.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Look {
    /// Azimuth of the optical axis in radians: 0 is north, π/2 is east.
    pub azimuth_rad: f64,
    /// Angle of the optical axis below the local horizontal in radians; π/2 looks straight down.
    pub depression_rad: f64,
    /// Turn about the optical axis in radians. At 0 the picture's x axis is horizontal and the ground is below. A
    /// positive value turns the camera clockwise as seen from behind it, so the scene turns anticlockwise in the
    /// picture.
    pub roll_rad: f64,
}

impl Look {
    /// Returns the look of a camera whose axis is `off_nadir_rad` away from straight down: 0 is down, π/2 is level.
    pub fn off_nadir(off_nadir_rad: f64, azimuth_rad: f64, roll_rad: f64) -> Self {
        Self { azimuth_rad, depression_rad: core::f64::consts::FRAC_PI_2 - off_nadir_rad, roll_rad }
    }
}

/// Returns the ECEF position in metres from geodetic latitude and longitude (degrees) and altitude above WGS-84
/// (kilometres).
pub fn position_m(lat_deg: f64, lon_deg: f64, altitude_km: f64) -> [f64; 3] {
    from_geodetic(lat_deg.to_radians(), lon_deg.to_radians(), altitude_km * 1e3, WGS84_A_M, WGS84_B_M)
}

/// Returns the unit vectors east, north and up (geodetic) in ECEF, for a position in ECEF metres.
fn east_north_up([x, y, z]: [f64; 3]) -> [Vector3<f64>; 3] {
    let (_, lat) = geodetic([x, y, z], WGS84_A_M, WGS84_B_M);
    let (sl, cl) = libm::sincos(lat);
    let (so, co) = libm::sincos(libm::atan2(y, x));
    [Vector3::new(-so, co, 0.0), Vector3::new(-sl * co, -sl * so, cl), Vector3::new(cl * co, cl * so, sl)]
}

impl Pose {
    /// Returns the pose of a camera at `position_m` (ECEF) that looks along `look`.
    pub fn looking(position_m: [f64; 3], look: Look) -> Self {
        let [east, north, up] = east_north_up(position_m);
        let (sa, ca) = libm::sincos(look.azimuth_rad);
        let (sd, cd) = libm::sincos(look.depression_rad);
        let (sr, cr) = libm::sincos(look.roll_rad);
        let forward = (east * sa + north * ca) * cd - up * sd;
        // It is horizontal by construction, also if the camera looks straight up or down.
        let right = east * ca - north * sa;
        let down = forward.cross(&right);
        let axes = [right * cr + down * sr, down * cr - right * sr, forward];
        Self::from_axes(position_m, axes.map(Into::into))
    }

    /// Returns the pose of a camera at `position_m` whose axes x, y, z point along these three ECEF directions. The
    /// directions must be orthogonal, right-handed and of unit length.
    pub fn from_axes(position_m: [f64; 3], axes_fixed: [[f64; 3]; 3]) -> Self {
        let columns = axes_fixed.map(Vector3::from);
        let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&columns));
        let q = UnitQuaternion::from_rotation_matrix(&rotation);
        Self { position_m, q_fixed_from_camera_wxyz: [q.w, q.i, q.j, q.k] }
    }

    /// Returns the attitude as a typed rotation; `None` if the quaternion has no length or is not finite.
    pub fn fixed_from_camera(&self) -> Option<Rotation<Cam, Fixed, f64>> {
        // The name of the field states the direction: camera to ECEF.
        Rotation::assume_from_quaternion(self.q_fixed_from_camera_wxyz)
    }

    /// Returns the pose rotated about the camera's own axes by the rotation vector `error_rad` (camera frame, radians).
    /// A navigation system with this error would report the returned attitude.
    pub fn disturbed(&self, error_rad: [f64; 3]) -> Self {
        let [w, x, y, z] = self.q_fixed_from_camera_wxyz;
        let q = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z))
            * UnitQuaternion::from_scaled_axis(Vector3::from(error_rad));
        Self { q_fixed_from_camera_wxyz: [q.w, q.i, q.j, q.k], ..*self }
    }

    /// Returns the quaternion at unit length, scalar first.
    pub(crate) fn unit_q_fixed_from_camera_wxyz(&self) -> [f64; 4] {
        let n = self.q_fixed_from_camera_wxyz.iter().map(|x| x * x).sum::<f64>().sqrt();
        self.q_fixed_from_camera_wxyz.map(|x| x / n)
    }

    /// Returns the matrix that converts camera coordinates to ECEF coordinates.
    pub(crate) fn matrix(&self) -> Matrix3<f64> {
        let [w, x, y, z] = self.q_fixed_from_camera_wxyz;
        *UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z)).to_rotation_matrix().matrix()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_core::frames::UnitVec3;

    fn axis(pose: &Pose, cam: [f64; 3]) -> Vector3<f64> {
        Vector3::from(pose.fixed_from_camera().unwrap().apply(&UnitVec3::try_new(cam).unwrap()).xyz())
    }

    #[test]
    fn level_camera_to_the_east_at_the_equator() {
        let p = position_m(0.0, 0.0, 100.0);
        let pose = Pose::looking(p, Look { azimuth_rad: core::f64::consts::FRAC_PI_2, ..Look::default() });
        // At (0°, 0°), east is y, north is z and up is x.
        assert!((axis(&pose, [0.0, 0.0, 1.0]) - Vector3::y()).norm() < 1e-12);
        assert!((axis(&pose, [1.0, 0.0, 0.0]) + Vector3::z()).norm() < 1e-12);
        assert!((axis(&pose, [0.0, 1.0, 0.0]) + Vector3::x()).norm() < 1e-12);
    }

    #[test]
    fn depression_and_off_nadir_are_complements() {
        let p = position_m(52.0, 5.0, 240.0);
        let [_, _, up] = east_north_up(p);
        let look = Look { azimuth_rad: 1.0, depression_rad: 0.35, roll_rad: 2.0 };
        let pose = Pose::looking(p, look);
        assert!((axis(&pose, [0.0, 0.0, 1.0]).dot(&up) + libm::sin(0.35)).abs() < 1e-12);
        let same = Look::off_nadir(core::f64::consts::FRAC_PI_2 - 0.35, 1.0, 2.0);
        assert!((same.depression_rad - look.depression_rad).abs() < 1e-15);
        // Straight down needs no special case.
        let down = Pose::looking(p, Look::off_nadir(0.0, 0.3, 0.0));
        assert!((axis(&down, [0.0, 0.0, 1.0]) + up).norm() < 1e-12);
        assert!(
            (down.matrix()
                - Matrix3::from_columns(&[
                    axis(&down, [1.0, 0.0, 0.0]),
                    axis(&down, [0.0, 1.0, 0.0]),
                    axis(&down, [0.0, 0.0, 1.0]),
                ]))
            .norm()
                < 1e-12
        );
    }

    #[test]
    fn roll_turns_the_right_hand_side_down() {
        let p = position_m(10.0, 20.0, 300.0);
        let [_, _, up] = east_north_up(p);
        let pose = Pose::looking(p, Look { roll_rad: 0.5, ..Look::default() });
        assert!(axis(&pose, [1.0, 0.0, 0.0]).dot(&up) < -0.4);
    }

    #[test]
    fn disturbance_turns_by_its_length() {
        let pose = Pose::looking(position_m(1.0, 2.0, 300.0), Look::default());
        let off = pose.disturbed([0.0, 0.03, 0.04]);
        let x = axis(&pose, [1.0, 0.0, 0.0]).dot(&axis(&off, [1.0, 0.0, 0.0]));
        assert!((libm::acos(x) - 0.05).abs() < 1e-9);
    }
}
