//! The description of a body: `[world.ellipsoid]`.

use hzn_nav::planets;
use serde::{Deserialize, Serialize};

use super::haze::Haze;
use super::ring::Ring;
use super::surface::Surface;

/// A body in sunlight, in front of a dark sky.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Ellipsoid {
    /// Name of a planet or moon whose radii are known ([`hzn_nav::planets`]). Give either the name or `radii_km`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Semi-axes along the body-fixed x, y and z axis, kilometres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radii_km: Option<[f64; 3]>,
    /// Height of the surface above the semi-axes, kilometres; for a gas planet, that of its clouds.
    pub surface_height_km: f64,
    /// 1-sigma of the limb height that sensor.toml tells, kilometres.
    pub limb_height_sigma_km: f64,
    /// Direction to the Sun, body-fixed, for a trajectory that does not have it (`table`). It need not have unit
    /// length.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sun: Option<[f64; 3]>,
    /// Light over the whole picture, in front of sky and night side: stray light, or an offset of the detector. It is a
    /// fraction of full scale at exposure 1.
    pub background: f64,
    /// The surface.
    pub surface: Surface,
    /// Haze above the surface; without it the body has no air.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub haze: Option<Haze>,
    /// Rings in the plane of the equator.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rings: Vec<Ring>,
}

impl Ellipsoid {
    /// Returns a body without air, with a uniform surface.
    pub fn from_radii(radii_km: [f64; 3]) -> Self {
        Self { radii_km: Some(radii_km), ..Self::default() }
    }

    /// Returns a planet or moon with a name, without air, with a uniform surface.
    pub fn named(name: &str) -> Self {
        Self { name: Some(name.to_owned()), ..Self::default() }
    }

    /// Returns the semi-axes without any height, kilometres. [`Ellipsoid::check`] refuses a body without semi-axes.
    pub fn radii_km(&self) -> [f64; 3] {
        let by_name = || self.name.as_deref().and_then(planets::find).map(|body| body.radii_km());
        self.radii_km.or_else(by_name).unwrap_or([f64::NAN; 3])
    }

    /// Returns the mean of the semi-axes, kilometres. Altitudes count above it.
    pub fn mean_radius_km(&self) -> f64 {
        self.radii_km().iter().sum::<f64>() / 3.0
    }

    /// Returns the height of the limb above the semi-axes, kilometres: the surface, or the height where the haze along
    /// the ray has half of the brightness of thick haze.
    pub fn limb_height_km(&self) -> f64 {
        let haze_km = self.haze.map_or(0.0, |haze| haze.half_height_km(self.mean_radius_km()));
        self.surface_height_km + haze_km.max(0.0)
    }

    /// Returns the semi-axes of the surface, metres.
    pub(crate) fn surface_m(&self) -> [f64; 3] {
        self.radii_km().map(|r| (r + self.surface_height_km) * 1e3)
    }

    /// Returns the semi-axes of the limb, metres.
    pub fn limb_m(&self) -> [f64; 3] {
        let height_km = self.limb_height_km();
        self.radii_km().map(|r| (r + height_km) * 1e3)
    }

    /// Returns the kind of the body in sensor.toml and truth.csv: its name, or `ellipsoid`.
    pub fn kind(&self) -> &str {
        self.name.as_deref().unwrap_or("ellipsoid")
    }

    /// Checks all values.
    ///
    /// # Errors
    /// Returns the first key with an invalid value, and the rule.
    pub fn check(&self) -> Result<(), (String, String)> {
        let wrong = |key: &str, rule: String| Err((key.to_owned(), rule));
        match (&self.name, self.radii_km) {
            (Some(name), None) if planets::find(name).is_none() => {
                let names: Vec<&str> = planets::BODIES.iter().map(|body| body.name).collect();
                return wrong(
                    "name",
                    format!("{name:?} has no radii here: give radii_km, or one of {}", names.join(", ")),
                );
            }
            (Some(_), Some(_)) => return wrong("radii_km", "is not allowed with name; remove one of them".into()),
            (None, None) => return wrong("radii_km", "is missing: give [a, b, c] in km, or name".into()),
            _ => {}
        }
        if !self.radii_km().iter().all(|r| (1e-3..=1e7).contains(r)) {
            return wrong("radii_km", format!("{:?} is refused: each must be 0.001 to 1e7", self.radii_km()));
        }
        let lowest = self.radii_km().into_iter().fold(f64::INFINITY, f64::min);
        let limits = [
            ("surface_height_km", self.surface_height_km, [-0.5 * lowest, 0.5 * lowest]),
            ("limb_height_sigma_km", self.limb_height_sigma_km, [0.0, lowest]),
            ("background", self.background, [0.0, 1.0]),
        ];
        let own = limits.into_iter().chain(self.surface.limits());
        let haze = self.haze.iter().flat_map(|haze| haze.limits(lowest));
        let rings = self.rings.iter().flat_map(Ring::limits);
        for (key, value, [low, high]) in own.chain(haze).chain(rings) {
            if !(low..=high).contains(&value) {
                return wrong(key, format!("{value} is refused: must be {low} to {high}"));
            }
        }
        if self.sun.is_some_and(|s| !(s.iter().map(|x| x * x).sum::<f64>() > 0.0) || s.iter().any(|x| !x.is_finite())) {
            return wrong("sun", "must be a direction: three finite numbers, not all zero".into());
        }
        Ok(())
    }
}
