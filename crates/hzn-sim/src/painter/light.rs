//! The distribution of light on the body.

use hzn_core::ellipsoid::LimbCone;
use nalgebra::Vector3;

use crate::error::SceneError;
use crate::globe::{Globe, RayHit, View};
use crate::scene::{Light, Scene};
use crate::texture::smoothstep;

/// [`Light`], prepared for rendering.
#[derive(Debug, Clone)]
pub(super) enum PreparedLight {
    Full,
    Sun {
        direction: Vector3<f64>,
        twilight_rad: f64,
    },
    Sector {
        axis: Vector3<f64>,
        east: Vector3<f64>,
        south: Vector3<f64>,
        centre_rad: f64,
        half_width_rad: f64,
        fade_rad: f64,
    },
}

impl PreparedLight {
    pub(super) fn try_new(scene: &Scene, globe: Globe) -> Result<Self, SceneError> {
        Ok(match scene.light {
            Light::Full => Self::Full,
            Light::Sun { direction, twilight_rad } => {
                let direction = Vector3::from(direction).try_normalize(1e-12).ok_or(SceneError::Sun)?;
                Self::Sun { direction, twilight_rad }
            }
            Light::Sector { centre_rad, half_width_rad, fade_rad } => {
                let cone = LimbCone::try_new(scene.pose.position_m, globe.a_m, globe.b_m).ok_or(SceneError::Pose)?;
                let (axis, east) = (Vector3::from(cone.axis.xyz()), Vector3::from(cone.east.xyz()));
                Self::Sector { axis, east, south: axis.cross(&east), centre_rad, half_width_rad, fade_rad }
            }
        })
    }

    /// Returns the share of light that falls where the ray meets the body, 0 to 1.
    #[inline(always)]
    pub(super) fn share(&self, view: &View, hit: &RayHit, point: &Vector3<f64>) -> f32 {
        let x = match self {
            Self::Full => return 1.0,
            Self::Sun { direction, twilight_rad } => {
                let elevation = libm::asin(view.normal(point).dot(direction).clamp(-1.0, 1.0));
                elevation / twilight_rad.max(1e-9)
            }
            Self::Sector { east, south, axis, centre_rad, half_width_rad, fade_rad } => {
                let ray = view.direction(hit);
                let across = ray - axis * ray.dot(axis);
                let off = libm::atan2(across.dot(south), across.dot(east)) - centre_rad;
                let off = (off - core::f64::consts::TAU * (off / core::f64::consts::TAU).round()).abs();
                (half_width_rad - off) / fade_rad.max(1e-9)
            }
        };
        smoothstep((x + 0.5).clamp(0.0, 1.0) as f32)
    }
}
