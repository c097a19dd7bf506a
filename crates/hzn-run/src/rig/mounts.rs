//! The attitude of a head on the vehicle, from rig.toml.

use hzn_core::rig::Mount;
use hzn_files::rig::{HeadMount, RigMount, turn_after};

/// Returns the mount of a head on the vehicle; `None` if a quaternion has no direction, which rig.toml cannot have.
pub(super) fn mount(rig: &RigMount, head: &HeadMount) -> Option<Mount<f64>> {
    Mount::new(rig.q_vehicle_from_rig_wxyz, head.q_rig_from_camera_wxyz, &head.covariance_rad2())
}

/// Returns the angle of a mount to another attitude of the camera in degrees.
pub(super) fn angle_deg(mount: &Mount<f64>, q_vehicle_from_camera_wxyz: [f64; 4]) -> f64 {
    let [w, x, y, z] = q_vehicle_from_camera_wxyz;
    let length = q_vehicle_from_camera_wxyz.iter().map(|x| x * x).sum::<f64>().sqrt();
    let [_, x, y, z] = turn_after([w, -x, -y, -z], mount.q_vehicle_from_camera_wxyz());
    2.0 * ((x * x + y * y + z * z).sqrt() / length).min(1.0).asin().to_degrees()
}

/// Returns the largest 1-sigma of the rotation about an axis of the vehicle, in degrees.
pub(super) fn sigma_deg(mount: &Mount<f64>) -> f64 {
    let [xx, _, _, yy, _, zz] = *mount.covariance_rad2();
    xx.max(yy).max(zz).sqrt().to_degrees()
}
