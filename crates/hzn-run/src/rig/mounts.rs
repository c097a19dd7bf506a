//! The attitude of a head on the vehicle, with its covariance.

use hzn_core::frames::{Cam, Rotation, UnitVec3, Vehicle};
use hzn_files::rig::{self, RigMount, turn_after};

/// The mount of a head.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mount {
    /// Rotation from the camera to the vehicle, scalar first, of unit length.
    pub(super) q_vehicle_from_camera_wxyz: [f64; 4],
    /// Covariance of a small rotation about the vehicle's axes, rad²: xx, xy, xz, yy, yz, zz. The error of the rig on
    /// the vehicle is not in it, because all heads share it.
    pub(super) covariance_rad2: [f64; 6],
}

impl Mount {
    pub(super) fn new(rig: &RigMount, head: &rig::HeadMount) -> Self {
        let q_vehicle_from_rig = normalise(rig.q_vehicle_from_rig_wxyz);
        Self {
            q_vehicle_from_camera_wxyz: turn_after(q_vehicle_from_rig, normalise(head.q_rig_from_camera_wxyz)),
            covariance_rad2: turn_covariance(q_vehicle_from_rig, head.covariance_rad2()),
        }
    }

    /// Returns the rotation from the camera to the axes that the vehicle has `after_s` later, if it turns at this rate
    /// (vehicle axes). A direction that stays where it is then has these coordinates.
    pub(super) fn after(&self, after_s: f64, rate_rad_s: Option<[f64; 3]>) -> Option<Rotation<Cam, Vehicle, f64>> {
        let half = rate_rad_s.unwrap_or_default().map(|rate| -0.5 * rate * after_s);
        let angle = half.iter().map(|x| x * x).sum::<f64>().sqrt();
        let sinc = if angle < 1e-8 { 1.0 } else { angle.sin() / angle };
        let [x, y, z] = half.map(|x| x * sinc);
        Rotation::assume_from_quaternion(turn_after([angle.cos(), x, y, z], self.q_vehicle_from_camera_wxyz))
    }

    /// Returns the angle to another attitude of the camera in degrees.
    pub(super) fn angle_deg(&self, q_vehicle_from_camera_wxyz: [f64; 4]) -> f64 {
        let [w, x, y, z] = normalise(q_vehicle_from_camera_wxyz);
        let [_, x, y, z] = turn_after([w, -x, -y, -z], self.q_vehicle_from_camera_wxyz);
        2.0 * (x * x + y * y + z * z).sqrt().min(1.0).asin().to_degrees()
    }

    /// Returns the largest 1-sigma of the rotation about an axis of the vehicle, in degrees.
    pub(super) fn sigma_deg(&self) -> f64 {
        let [xx, _, _, yy, _, zz] = self.covariance_rad2;
        xx.max(yy).max(zz).sqrt().to_degrees()
    }

    /// Returns a vector in the axes of the vehicle, for one in those of the camera. Its length is kept.
    pub(super) fn to_vehicle(self, camera: [f64; 3]) -> Option<[f64; 3]> {
        let length = camera.iter().map(|x| x * x).sum::<f64>().sqrt();
        let mount = Rotation::<Cam, Vehicle, f64>::assume_from_quaternion(self.q_vehicle_from_camera_wxyz)?;
        Some(mount.apply(&UnitVec3::try_new(camera)?).xyz().map(|x| x * length))
    }
}

fn normalise(q: [f64; 4]) -> [f64; 4] {
    let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    q.map(|x| x / length)
}

/// Returns a covariance in the axes to which a quaternion turns.
fn turn_covariance(q: [f64; 4], [xx, xy, xz, yy, yz, zz]: [f64; 6]) -> [f64; 6] {
    let Some(rotation) = Rotation::<Vehicle, Vehicle, f64>::assume_from_quaternion(q) else {
        return [xx, xy, xz, yy, yz, zz];
    };
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    // The new axes in the old ones.
    let old = axes.map(|axis| UnitVec3::try_new(axis).map_or(axis, |axis| rotation.inverse().apply(&axis).xyz()));
    form([xx, xy, xz, yy, yz, zz], old)
}

/// Returns the covariance of the components along three vectors, as an upper triangle.
pub(super) fn form([xx, xy, xz, yy, yz, zz]: [f64; 6], along: [[f64; 3]; 3]) -> [f64; 6] {
    let rows = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let at = |[a, b]: [[f64; 3]; 2]| dot(a, rows.map(|row| dot(row, b)));
    let [x, y, z] = along;
    [[x, x], [x, y], [x, z], [y, y], [y, z], [z, z]].map(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;

    fn head(covariance_deg2: Option<[f64; 6]>) -> rig::HeadMount {
        rig::HeadMount { q_rig_from_camera_wxyz: [HALF, HALF, 0.0, 0.0], sigma_deg: 0.1, covariance_deg2 }
    }

    #[test]
    fn mounts_follow_each_other_and_turn_their_covariance() {
        let rig = RigMount { q_vehicle_from_rig_wxyz: [HALF, 0.0, 0.0, HALF], sigma_deg: 0.0 };
        // The covariance about the rig's x axis is one about the vehicle's y axis.
        let mount = Mount::new(&rig, &head(Some([4.0, 0.0, 0.0, 1.0, 0.0, 0.0])));
        let deg2 = mount.covariance_rad2.map(|x| x * 1f64.to_degrees().powi(2));
        let want = [1.0, 0.0, 0.0, 4.0, 0.0, 0.0];
        assert!(deg2.iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-12), "{deg2:?}");
        let z = UnitVec3::try_new([0.0, 0.0, 1.0]).unwrap();
        // The camera's z axis is the rig's −y axis, and that is the vehicle's x axis.
        let [x, ..] = mount.after(0.0, None).unwrap().apply(&z).xyz();
        assert!((x - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_turning_vehicle_leaves_a_direction_behind() {
        let mount = Mount::new(
            &RigMount::default(),
            &rig::HeadMount { q_rig_from_camera_wxyz: [1.0, 0.0, 0.0, 0.0], ..head(None) },
        );
        let x = UnitVec3::try_new([1.0, 0.0, 0.0]).unwrap();
        // After a turn of 0.2 rad about z, the direction has turned by −0.2 rad in the axes of the vehicle.
        let [a, b, _] = mount.after(2.0, Some([0.0, 0.0, 0.1])).unwrap().apply(&x).xyz();
        assert!((a - 0.2f64.cos()).abs() < 1e-15 && (b + 0.2f64.sin()).abs() < 1e-15);
    }
}
