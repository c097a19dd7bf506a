//! The accuracy of several heads that are one sensor, by the equations of the sensor itself.

use hzn_core::Solution;
use hzn_core::camera::Camera;
use hzn_core::frames::{Cam, Cov3, UnitVec3};
use hzn_core::report::Free;
use hzn_core::rig::{Answered, Common, Config, Limb, Mount, NoJoint, Rig};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use serde::Serialize;

use super::design::{Design, DesignError, rotation_to_camera};
use super::sigmas::{Sums, tangent};

/// A rig that does not exist yet: equal heads that look at the limb around the point below the vehicle.
#[derive(Debug, Clone, PartialEq)]
pub struct RigDesign {
    /// The camera of each head, the body and the altitude.
    pub head: Design,
    /// Directions in which the heads look, degrees from an arbitrary azimuth; one to four.
    pub azimuths_deg: Vec<f64>,
    /// 1-sigma of each head's mount about each axis, degrees.
    pub mount_sigma_deg: f64,
    /// 1-sigma of the limb height that each head has for itself, and the length of its weather, kilometres.
    pub own_km: [f64; 2],
    /// 1-sigma of a tilt of the limb, kilometres; `None` derives it from the half-angle.
    pub tilt_sigma_km: Option<f64>,
}

/// The accuracy of a rig, 1-sigma.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RigSigmas {
    /// RMS of the error of the direction in both dimensions, degrees.
    pub rms_deg: f64,
    /// Larger sigma of the direction, degrees.
    pub largest_deg: f64,
    /// The angle that the error exceeds with a probability of 1e-4 if one head is wrong, degrees; `None` with one head.
    pub protection_deg: Option<f64>,
}

impl RigDesign {
    /// Returns the accuracy; `None` if the heads see too little of the limb for a direction.
    ///
    /// # Errors
    /// Fails if the camera is invalid or not above the limb.
    pub fn sigmas(&self) -> Result<Option<RigSigmas>, DesignError> {
        let half_angle_rad = self.head.half_angle_rad()?;
        let camera = Camera::try_new(&self.head.camera)?;
        let free = self.free(&camera, half_angle_rad);
        let solution = free.and_then(|free| self.solution(&free, half_angle_rad));
        let mounts: Option<Vec<Mount<f64>>> = self.azimuths_deg.iter().map(|azimuth| self.mount(*azimuth)).collect();
        let Some((solution, mounts)) = solution.zip(mounts) else { return Ok(None) };
        let (solution, camera) = (&solution, &camera);
        let answered =
            |mount| Some(Answered { solution, camera, mount, time_s: None, rate_rad_s: None, limb_group: 0 });
        let heads: Vec<_> = mounts.iter().map(answered).collect();
        let limb = Limb {
            radius_km: self.head.radius_km + self.head.limb_height_km,
            tilt_sigma_km: self.tilt_sigma_km,
            own_sigma_km: self.own_km[0],
            own_length_km: self.own_km[1],
        };
        let rig = Rig::new(&Config::DEFAULT)?;
        let answer: Result<_, NoJoint> = rig.join_epoch(&Common { limb, sigma_rad: 0.0 }, &heads).answer;
        Ok(answer.ok().map(|answer| {
            let rows = answer.covariance.rows();
            RigSigmas {
                rms_deg: (rows[0][0] + rows[1][1] + rows[2][2]).sqrt().to_degrees(),
                largest_deg: answer.covariance.sigma_max_rad().to_degrees(),
                protection_deg: answer.protection_rad.map(f64::to_degrees),
            }
        }))
    }

    /// Returns the mount of a head that looks in this direction. The vehicle's z axis points down.
    fn mount(&self, azimuth_deg: f64) -> Option<Mount<f64>> {
        let view = [azimuth_deg, self.head.depression_deg, self.head.roll_deg];
        let turn = rotation_to_camera(&-Vector3::z(), &Vector3::x(), view).transpose();
        let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
        let var = self.mount_sigma_deg.to_radians().powi(2);
        Mount::new([1.0, 0.0, 0.0, 0.0], [q.w, q.i, q.j, q.k], &[var, 0.0, 0.0, var, 0.0, var])
    }

    fn free(&self, camera: &Camera<f64>, half_angle_rad: f64) -> Option<Free<f64>> {
        let samples = self.head.sample_limb(camera, half_angle_rad);
        let p = Sums::new(&self.head, camera, half_angle_rad, &samples)?.free_covariance()?;
        let axis = self.axis()?;
        let (tilt, across) = tangent(&Vector3::from(axis.xyz()));
        let with_cos = tilt * p.m13 + across * p.m23;
        Some(Free {
            axis,
            covariance: covariance(&tilt, &across, &p),
            cos: half_angle_rad.cos(),
            var_cos: p.m33,
            axis_with_cos: Some(with_cos.into()),
            cos_per_px: 0.0,
            common: None,
        })
    }

    fn axis(&self) -> Option<UnitVec3<Cam, f64>> {
        UnitVec3::try_new(self.head.axis())
    }

    /// Returns the answer of a head with the covariance that it has alone: with altitude and limb height.
    fn solution(&self, free: &Free<f64>, half_angle_rad: f64) -> Option<Solution<f64>> {
        let with_cos = Vector3::from(free.axis_with_cos?);
        let gain = with_cos / (free.var_cos + self.head.variance_cos(half_angle_rad));
        let rows = free.covariance.rows();
        let fused = Matrix3::from_fn(|i, j| rows[i][j]) - gain * with_cos.transpose();
        let p = [fused.m11, fused.m12, fused.m13, fused.m22, fused.m23, fused.m33];
        Some(Solution {
            axis: self.axis()?,
            covariance: Cov3::from_upper(p),
            common: None,
            axis_fixed: None,
            axis_vehicle: None,
            half_angle_rad,
            fused_half_angle_rad: half_angle_rad,
            altitude_m: None,
            free: Some(*free),
            axis_by_cos: None,
            position: None,
            p_limb: None,
            is_airglow: false,
            rms_px: self.head.sigma_px,
            inliers: 0,
            arc_px: 0.0,
            candidate: 0,
        })
    }
}

fn covariance(tilt: &Vector3<f64>, across: &Vector3<f64>, p: &Matrix3<f64>) -> Cov3<Cam, f64> {
    let both = tilt * across.transpose();
    let m = tilt * tilt.transpose() * p.m11 + (both + both.transpose()) * p.m12 + across * across.transpose() * p.m22;
    Cov3::from_upper([m.m11, m.m12, m.m13, m.m22, m.m23, m.m33])
}

#[cfg(test)]
mod tests {
    use hzn_core::camera::{self, Model};

    use super::*;

    fn rig(azimuths_deg: &[f64]) -> RigDesign {
        let head = Design {
            camera: camera::Config::ideal(Model::Pinhole, 640, 480, 554.0),
            radius_km: 6371.0,
            altitude_km: 500.0,
            altitude_sigma_km: 0.0,
            limb_height_km: 25.0,
            limb_height_sigma_km: 10.0,
            depression_deg: 0.0,
            roll_deg: 0.0,
            sigma_px: 0.3,
            correlation_px: 25.0,
        };
        let head = Design { depression_deg: head.dip_deg().unwrap(), ..head };
        let (azimuths_deg, own_km) = (azimuths_deg.to_vec(), [0.0, 1000.0]);
        RigDesign { head, azimuths_deg, mount_sigma_deg: 0.0, own_km, tilt_sigma_km: Some(0.0) }
    }

    fn rms(design: &RigDesign) -> f64 {
        design.sigmas().unwrap().unwrap().rms_deg
    }

    #[test]
    fn opposite_heads_take_the_height_away() {
        let [one, two, four] = [&[0.0][..], &[0.0, 180.0], &[0.0, 90.0, 180.0, 270.0]].map(|a| rms(&rig(a)));
        assert!(one > 3.0 * two && two > 1.2 * four, "{one} {two} {four}");
        // One head is the design alone.
        let head = rig(&[0.0]).head;
        let sigmas = head.sigmas().unwrap().unwrap();
        assert!((sigmas.fused.pitch_deg.hypot(sigmas.fused.roll_deg) - one).abs() < 1e-9);
    }

    #[test]
    fn mounts_and_a_tilt_of_the_limb_add_up() {
        let two = rig(&[0.0, 180.0]);
        let with_mounts = rms(&RigDesign { mount_sigma_deg: 0.05, ..two.clone() });
        // Each head's turn across its limb moves the axis, but half of it in the mean of both.
        assert!((0.04..0.07).contains(&(with_mounts.powi(2) - rms(&two).powi(2)).sqrt()), "{with_mounts}");
        let tilted = rms(&RigDesign { tilt_sigma_km: Some(2.0), ..two.clone() });
        let by_km = two.head.half_angle_rad().unwrap().tan().to_degrees() / 6396.0;
        assert!(((tilted.powi(2) - rms(&two).powi(2)) / (2.0 * (2.0 * by_km).powi(2)) - 1.0).abs() < 1e-6);
        assert!(two.sigmas().unwrap().unwrap().protection_deg.is_some_and(|deg| deg > 0.1));
    }

    #[test]
    fn heads_without_a_limb_have_no_direction() {
        let mut design = rig(&[0.0, 180.0]);
        design.head.depression_deg = 90.0;
        assert_eq!(design.sigmas().unwrap(), None);
    }
}
