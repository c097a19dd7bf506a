//! Bodies, by name or radius.

use hzn_core::body::{self, MOON_RADIUS_KM, SUN_RADIUS_KM};
use hzn_core::ellipsoid::EARTH_MEAN_RADIUS_M;

/// A sphere, with the limb height that is used if none is given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Body {
    pub(super) radius_km: f64,
    pub(super) limb_height_km: f64,
}

impl Body {
    /// The mean Earth, with the visible limb at 10 km.
    pub(super) const EARTH: Self = Self { radius_km: EARTH_MEAN_RADIUS_M / 1e3, limb_height_km: 10.0 };

    /// Returns the body of a sensor.toml, as a sphere.
    pub(super) fn from_config(body: &body::Config) -> Self {
        Self { radius_km: body.mean_radius_km(), limb_height_km: body.limb_height_km }
    }
}

impl std::str::FromStr for Body {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let bare = |radius_km| Self { radius_km, limb_height_km: 0.0 };
        match text {
            "earth" | "earth-sphere" => Ok(Self::EARTH),
            "moon" => Ok(bare(MOON_RADIUS_KM)),
            "sun" => Ok(bare(SUN_RADIUS_KM)),
            _ => match text.parse::<f64>() {
                Ok(km) if km > 0.0 && km.is_finite() => Ok(bare(km)),
                _ => Err(format!("{text:?} is not a body; expected earth, moon, sun, or a radius in kilometres")),
            },
        }
    }
}
