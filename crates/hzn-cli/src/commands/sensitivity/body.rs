//! Bodies, by name or radius.

use hzn_core::body::{self, Kind, Limb, MOON_RADIUS_KM, SUN_RADIUS_KM};
use hzn_core::ellipsoid::{EARTH_MEAN_RADIUS_M, WGS84_A_M, WGS84_B_M};
use hzn_files::plausible::doubt_altitude;

use crate::exit::{Stop, usage};
use crate::tell;

/// 1-sigma of the limb height of a body without air, kilometres: its mountains.
const BARE_SIGMA_KM: f64 = 2.0;

/// A body, with the limb height that is used if none is given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Body {
    pub(super) kind: Kind,
    /// Mean radius, for the studies that take the body for a sphere.
    pub(super) radius_km: f64,
    pub(super) radii_km: [f64; 3],
    pub(super) limb_height_km: f64,
    /// Its 1-sigma.
    pub(super) limb_height_sigma_km: f64,
    /// 1-sigma of the second harmonic of the limb height, if it is known of the body.
    pub(super) second_harmonic_km: Option<f64>,
}

impl Body {
    /// Returns the Earth (WGS-84) with the limb height that a sensor.toml has if it says nothing else.
    pub(super) fn earth() -> Self {
        let told = body::Config::of_kind(Kind::Earth, None);
        Self {
            kind: Kind::Earth,
            radius_km: EARTH_MEAN_RADIUS_M / 1e3,
            radii_km: [WGS84_A_M / 1e3, WGS84_A_M / 1e3, WGS84_B_M / 1e3],
            limb_height_km: told.limb_height_km,
            limb_height_sigma_km: told.limb_height_sigma_km,
            second_harmonic_km: None,
        }
    }

    /// Returns the same body with the limb of a band: its height and sigma.
    pub(super) fn with_limb(self, limb: Limb) -> Result<Self, Stop> {
        let Some([limb_height_km, limb_height_sigma_km]) = limb.thermal_km() else { return Ok(self) };
        if !matches!(self.kind, Kind::Earth | Kind::EarthSphere) {
            return Err(usage("--limb: only the Earth has the bands of its air; give --limb-height"));
        }
        Ok(Self { limb_height_km, limb_height_sigma_km, ..self })
    }

    /// Returns the body of a sensor.toml.
    pub(super) fn from_config(body: &body::Config) -> Self {
        let radius_km = body.mean_radius_km();
        let radii_km = body.figure_km().unwrap_or([radius_km; 3]);
        Self {
            kind: body.kind,
            radius_km,
            radii_km,
            limb_height_km: body.limb_height_km,
            limb_height_sigma_km: body.limb_height_sigma_km,
            second_harmonic_km: body.limb_height_harmonic_sigma_km,
        }
    }
}

/// Warns of an altitude that is probably in metres: nothing is seen from there, and the table would be empty.
pub(super) fn doubt_altitudes(bodies: &[Body], altitudes_km: &[f64]) {
    for body in bodies {
        let doubt = |km: &f64| doubt_altitude(body.kind, body.radius_km, *km);
        if let Some(doubt) = altitudes_km.iter().find_map(doubt) {
            tell::warning(format!("--altitude: {doubt}"));
            return;
        }
    }
}

impl std::str::FromStr for Body {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let bare = |kind, radius_km| Self {
            kind,
            radius_km,
            radii_km: [radius_km; 3],
            limb_height_km: 0.0,
            limb_height_sigma_km: BARE_SIGMA_KM,
            second_harmonic_km: None,
        };
        let earth = Self::earth();
        match text {
            "earth" => Ok(earth),
            "earth-sphere" => Ok(Self { kind: Kind::EarthSphere, radii_km: [earth.radius_km; 3], ..earth }),
            "moon" => Ok(bare(Kind::Moon, MOON_RADIUS_KM)),
            "sun" => Ok(bare(Kind::Sun, SUN_RADIUS_KM)),
            _ => {
                if let Some(kind) = Kind::ALL.iter().find(|kind| kind.name() == text && kind.planet().is_some()) {
                    return Ok(Self::from_config(&body::Config::of_kind(*kind, None)));
                }
                match text.parse::<f64>() {
                    Ok(km) if km > 0.0 && km.is_finite() => Ok(bare(Kind::Sphere, km)),
                    _ => Err(format!(
                        "{text:?} is not a body; expected earth, moon, sun, a planet such as jupiter, or a radius in \
                         kilometres"
                    )),
                }
            }
        }
    }
}
