//! The truth about a scene.

use hzn_core::body::{AU_KM, Kind, MOON_RADIUS_KM, SUN_RADIUS_KM};
use hzn_core::ellipsoid::LimbCone;
use hzn_core::frames::{Fixed, UnitVec3};
use hzn_files::truth::Truth;
use nalgebra::Vector3;

use crate::error::SceneError;
use crate::globe::Globe;
use crate::scene::{Light, Scene, World};

impl Scene {
    /// Returns the truth of the scene, for the name and time of a picture.
    ///
    /// # Errors
    /// Fails if the camera, the position or the light is invalid.
    pub fn truth(&self, file: &str, time_s: f64) -> Result<Truth, SceneError> {
        if let World::Ellipsoid(body) = &self.world {
            return self.ellipsoid_truth(body, file, time_s);
        }
        let globe = Globe::new(&self.body);
        let raised = globe.raised(self.body.limb_height_km * 1e3);
        let cone = LimbCone::try_new(self.pose.position_m, raised.a_m, raised.b_m).ok_or(SceneError::Pose)?;
        let camera_from_fixed = self.pose.fixed_from_camera().ok_or(SceneError::Pose)?.inverse();
        let moon = self.moon_ecef_m.and_then(|moon| {
            let to = [0, 1, 2].map(|i| moon[i] - self.pose.position_m[i]);
            Some(camera_from_fixed.apply(&UnitVec3::<Fixed, f64>::try_new(to)?).xyz())
        });
        let [axis_x, axis_y, axis_z] = camera_from_fixed.apply(&cone.axis).xyz();
        let sun = match self.light {
            Light::Sun { direction, .. } => {
                let direction = UnitVec3::<Fixed, f64>::try_new(direction).ok_or(SceneError::Sun)?;
                Some(camera_from_fixed.apply(&direction).xyz())
            }
            Light::Full | Light::Sector { .. } => None,
        };
        let [qw, qx, qy, qz] = self.pose.unit_q_fixed_from_camera_wxyz();
        let to_centre_km = self.pose.matrix().transpose() * -Vector3::from(self.pose.position_m) * 1e-3;
        let truth = Truth {
            file: file.to_owned(),
            time_s,
            body: self.body.kind.name().to_owned(),
            limb: u8::from(self.has_limb(self.body.kind)?),
            axis_x,
            axis_y,
            axis_z,
            half_angle_deg: cone.mean_half_angle_rad().to_degrees(),
            altitude_km: globe.altitude_m(self.pose.position_m) * 1e-3,
            sun_x: sun.map(|s| s[0]),
            sun_y: sun.map(|s| s[1]),
            sun_z: sun.map(|s| s[2]),
            moon_x: moon.map(|m| m[0]),
            moon_y: moon.map(|m| m[1]),
            moon_z: moon.map(|m| m[2]),
            qw,
            qx,
            qy,
            qz,
            ..Truth::default()
        };
        Ok(truth.with_position_km(to_centre_km.into()))
    }

    /// Returns the truth about Sun or Moon in a scene whose camera flies around the Earth. For every other kind it is
    /// [`Scene::truth`].
    ///
    /// # Errors
    /// Fails like [`Scene::truth`], and if the scene does not have the body.
    pub fn body_truth(&self, kind: Kind, file: &str, time_s: f64) -> Result<Truth, SceneError> {
        let truth = self.truth(file, time_s)?;
        let Some(disc) = self.sky_disc(kind)? else { return Ok(truth) };
        let camera_from_fixed = self.pose.fixed_from_camera().ok_or(SceneError::Pose)?.inverse();
        let direction = UnitVec3::<Fixed, f64>::try_new(disc.direction).ok_or(SceneError::Sun)?;
        let [axis_x, axis_y, axis_z] = camera_from_fixed.apply(&direction).xyz();
        let seen = Truth {
            body: kind.name().to_owned(),
            limb: u8::from(self.has_limb(kind)?),
            axis_x,
            axis_y,
            axis_z,
            half_angle_deg: disc.half_angle_rad.to_degrees(),
            altitude_km: disc.distance_m * 1e-3 - disc.radius_km,
            ..truth
        };
        let seen = seen.with_position_km([axis_x, axis_y, axis_z].map(|x| x * disc.distance_m * 1e-3));
        Ok(Truth { phase_deg: seen.phase_deg.filter(|_| kind != Kind::Sun), ..seen })
    }

    /// Returns Sun or Moon as a disc in the sky; `None` for other kinds, and if `kind` is the scene's own body.
    pub(super) fn sky_disc(&self, kind: Kind) -> Result<Option<SkyDisc>, SceneError> {
        if self.body.kind == kind {
            return Ok(None);
        }
        match kind {
            Kind::Sun => match self.light {
                Light::Sun { direction, .. } => {
                    let direction = Vector3::from(direction).try_normalize(1e-12).ok_or(SceneError::Sun)?;
                    let distance_m = AU_KM * 1e3;
                    Ok(Some(SkyDisc::new(direction * distance_m, SUN_RADIUS_KM)))
                }
                Light::Full | Light::Sector { .. } => Err(SceneError::Sun),
            },
            Kind::Moon => {
                let moon = Vector3::from(self.moon_ecef_m.ok_or(SceneError::Moon)?);
                Ok(Some(SkyDisc::new(moon - Vector3::from(self.pose.position_m), MOON_RADIUS_KM)))
            }
            _ => Ok(None),
        }
    }
}

/// A distant body as the camera sees it.
pub(super) struct SkyDisc {
    /// Direction to its centre, ECEF.
    pub(super) direction: [f64; 3],
    distance_m: f64,
    pub(super) half_angle_rad: f64,
    radius_km: f64,
}

impl SkyDisc {
    fn new(to_m: Vector3<f64>, radius_km: f64) -> Self {
        let distance_m = to_m.norm();
        let half_angle_rad = libm::asin((radius_km * 1e3 / distance_m).min(1.0));
        Self { direction: (to_m / distance_m).into(), distance_m, half_angle_rad, radius_km }
    }
}
