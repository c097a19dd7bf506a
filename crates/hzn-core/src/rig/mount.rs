//! The attitude of a head on the vehicle, with its covariance.

use super::head::{symmetric, upper};
use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::frames::{Cam, Rotation, Vehicle};

/// The attitude of a head on the vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mount<T> {
    q_vehicle_from_camera_wxyz: [T; 4],
    covariance_rad2: [T; 6],
}

impl<T: Real> Mount<T> {
    /// Makes the mount of a head on a rig, from two quaternions, scalar first, which may have any length above 0.
    ///
    /// `covariance_rad2` is the upper triangle (xx, xy, xz, yy, yz, zz) of the covariance of a small rotation of the
    /// camera about the axes of the rig. `None` if a quaternion has no direction.
    pub fn new(
        q_vehicle_from_rig_wxyz: [T; 4],
        q_rig_from_camera_wxyz: [T; 4],
        covariance_rad2: &[T; 6],
    ) -> Option<Self> {
        let rig = normalised(q_vehicle_from_rig_wxyz)?;
        let turn = Rotation::<Vehicle, Vehicle, T>::assume_from_quaternion(rig)?.to_matrix();
        Some(Self {
            q_vehicle_from_camera_wxyz: product(rig, normalised(q_rig_from_camera_wxyz)?),
            covariance_rad2: upper(&(turn * symmetric(covariance_rad2) * turn.transpose())),
        })
    }

    /// Returns the rotation from the camera to the vehicle as a unit quaternion, scalar first.
    pub fn q_vehicle_from_camera_wxyz(&self) -> [T; 4] {
        self.q_vehicle_from_camera_wxyz
    }

    /// Returns the covariance (xx, xy, xz, yy, yz, zz) of a small rotation about the vehicle's axes, rad². The error of
    /// the rig on the vehicle is not in it, because all heads share it.
    pub fn covariance_rad2(&self) -> &[T; 6] {
        &self.covariance_rad2
    }

    /// Returns the rotation from the camera to the axes that the vehicle has `after_s` later, if the camera turns at
    /// this rate (its own axes). A direction that stays where it is then has these coordinates.
    pub fn after(&self, after_s: T, rate_rad_s: Option<[T; 3]>) -> Option<Rotation<Cam, Vehicle, T>> {
        let own = self.q_vehicle_from_camera_wxyz;
        let Some(rate) = rate_rad_s else { return Rotation::assume_from_quaternion(own) };
        let turn = Rotation::<Cam, Vehicle, T>::assume_from_quaternion(own)?.to_matrix();
        let half = (turn * V3::from(rate)) * (T::from_f64(-0.5) * after_s);
        let angle = half.dot(&half).sqrt();
        let (sin, cos) = angle.sin_cos();
        let sinc = if angle < T::from_f64(1e-8) { T::one() } else { sin / angle };
        Rotation::assume_from_quaternion(product([cos, half.x * sinc, half.y * sinc, half.z * sinc], own))
    }
}

fn normalised<T: Real>(q: [T; 4]) -> Option<[T; 4]> {
    let length = q.iter().fold(T::ZERO, |sum, &x| sum + x * x).sqrt();
    (length > T::ZERO && length.is_finite()).then(|| q.map(|x| x / length))
}

/// Returns the rotation `b` followed by `a`.
fn product<T: Real>([aw, ax, ay, az]: [T; 4], [bw, bx, by, bz]: [T; 4]) -> [T; 4] {
    [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::frames::UnitVec3;

    const HALF: f64 = core::f64::consts::FRAC_1_SQRT_2;

    #[test]
    fn mounts_follow_each_other_and_turn_their_covariance() {
        // The covariance about the rig's x axis is one about the vehicle's y axis.
        let covariance = [4.0, 0.0, 0.0, 1.0, 0.0, 0.0];
        let mount = Mount::new([2.0 * HALF, 0.0, 0.0, 2.0 * HALF], [HALF, HALF, 0.0, 0.0], &covariance).unwrap();
        let want = [1.0, 0.0, 0.0, 4.0, 0.0, 0.0];
        assert!(mount.covariance_rad2().iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-12), "{mount:?}");
        let z = UnitVec3::try_new([0.0, 0.0, 1.0]).unwrap();
        // The camera's z axis is the rig's −y axis, and that is the vehicle's x axis.
        let [x, ..] = mount.after(0.0, None).unwrap().apply(&z).xyz();
        assert!((x - 1.0).abs() < 1e-15);
        assert_eq!(Mount::new([0.0; 4], [1.0, 0.0, 0.0, 0.0], &covariance), None);
    }

    #[test]
    fn a_turning_vehicle_leaves_a_direction_behind() {
        // The camera's z axis is the vehicle's −y axis, and its y axis is the vehicle's z axis.
        let mount = Mount::new([1.0, 0.0, 0.0, 0.0], [HALF, HALF, 0.0, 0.0], &[0.0; 6]).unwrap();
        let x = UnitVec3::try_new([1.0, 0.0, 0.0]).unwrap();
        // After a turn of 0.2 rad about the vehicle's z axis, the direction has turned by −0.2 rad in its axes.
        let [a, b, _] = mount.after(2.0, Some([0.0, 0.1, 0.0])).unwrap().apply(&x).xyz();
        assert!((a - 0.2f64.cos()).abs() < 1e-15 && (b + 0.2f64.sin()).abs() < 1e-15);
    }
}
