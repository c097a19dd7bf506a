//! Planets, moons and minor planets by name: their shapes and their limbs.
//!
//! The semi-axes are those of the IAU Working Group on Cartographic Coordinates and Rotational Elements (Archinal et
//! al. 2018, "Report: 2015", tables 4 to 6). Those of the giant planets are at the pressure of 1 bar.
//!
//! The limb heights are defaults for a sensor that nobody told better:
//!
//! - A body without air has its limb at the ellipsoid. The sigma is 0.3 % of the mean radius, or the RMS deviation of
//!   the surface from the ellipsoid (the same report) where that is larger. Vesta and Phobos get 5 %: their ellipsoids
//!   leave out whole mountains.
//! - In the air of a giant planet the slant path along the limb is √(2πRh) long, over a hundred scale heights h. The
//!   limb
//!   is therefore seen three scale heights above the level of 1 bar, ± 3.
//! - Venus shows its haze above the clouds, Mars its dust, Titan its haze.
//!
//! The scale height of the air gives the height that overexposure adds, as for the Earth.

use super::Kind;

/// The shape and the limb of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planet {
    /// Semi-axes along the body-fixed x, y and z axes (z to the north pole), kilometres.
    pub radii_km: [f64; 3],
    /// Height of the visible limb above the ellipsoid and its 1-sigma, kilometres.
    pub limb_height_km: f64,
    /// 1-sigma of the limb height, kilometres.
    pub limb_height_sigma_km: f64,
    /// Scale height of the air, kilometres; 0 for a body without air.
    pub scale_height_km: f64,
}

impl Kind {
    /// Returns shape and limb of a body that has its own name; `None` for the Earth, Sun, Moon and bodies without a
    /// name.
    pub fn planet(self) -> Option<Planet> {
        let (radii_km, limb_height_km, limb_height_sigma_km, scale_height_km) = shape_and_limb(self)?;
        Some(Planet { radii_km, limb_height_km, limb_height_sigma_km, scale_height_km })
    }
}

/// Semi-axes, limb height, its sigma, scale height; kilometres.
// One line a body can be compared with the tables of the report; rustfmt would break them.
#[rustfmt::skip]
fn shape_and_limb(kind: Kind) -> Option<([f64; 3], f64, f64, f64)> {
    Some(match kind {
        Kind::Mercury => ([2440.53, 2440.53, 2438.26], 0.0, 7.0, 0.0),
        Kind::Venus => ([6051.8, 6051.8, 6051.8], 70.0, 15.0, 5.0),
        Kind::Mars => ([3396.19, 3396.19, 3376.20], 20.0, 20.0, 11.0),
        Kind::Jupiter => ([71492.0, 71492.0, 66854.0], 80.0, 80.0, 27.0),
        Kind::Saturn => ([60268.0, 60268.0, 54364.0], 180.0, 180.0, 60.0),
        Kind::Uranus => ([25559.0, 25559.0, 24973.0], 80.0, 80.0, 28.0),
        Kind::Neptune => ([24764.0, 24764.0, 24341.0], 60.0, 60.0, 20.0),
        Kind::Pluto => ([1188.3, 1188.3, 1188.3], 20.0, 20.0, 30.0),
        Kind::Ceres => ([487.3, 487.3, 446.0], 0.0, 3.0, 0.0),
        Kind::Vesta => ([289.0, 280.0, 229.0], 0.0, 13.0, 0.0),
        Kind::Phobos => ([13.0, 11.4, 9.1], 0.0, 0.5, 0.0),
        Kind::Deimos => ([7.8, 6.0, 5.1], 0.0, 0.3, 0.0),
        Kind::Io => ([1829.4, 1819.4, 1815.7], 0.0, 5.5, 0.0),
        Kind::Europa => ([1562.6, 1560.3, 1559.5], 0.0, 4.7, 0.0),
        Kind::Ganymede => ([2631.2, 2631.2, 2631.2], 0.0, 7.9, 0.0),
        Kind::Callisto => ([2410.3, 2410.3, 2410.3], 0.0, 7.2, 0.0),
        Kind::Mimas => ([207.8, 196.7, 190.6], 0.0, 0.6, 0.0),
        Kind::Enceladus => ([256.6, 251.4, 248.3], 0.0, 0.8, 0.0),
        Kind::Tethys => ([538.4, 528.3, 526.3], 0.0, 1.7, 0.0),
        Kind::Dione => ([563.4, 561.3, 559.6], 0.0, 1.7, 0.0),
        Kind::Rhea => ([765.0, 763.1, 762.4], 0.0, 2.3, 0.0),
        Kind::Titan => ([2575.15, 2574.78, 2574.47], 250.0, 100.0, 40.0),
        Kind::Iapetus => ([745.7, 745.7, 712.1], 0.0, 7.0, 0.0),
        Kind::Miranda => ([240.4, 234.2, 232.9], 0.0, 1.6, 0.0),
        Kind::Ariel => ([581.1, 577.9, 577.7], 0.0, 1.7, 0.0),
        Kind::Umbriel => ([584.7, 584.7, 584.7], 0.0, 2.6, 0.0),
        Kind::Titania => ([788.9, 788.9, 788.9], 0.0, 2.4, 0.0),
        Kind::Oberon => ([761.4, 761.4, 761.4], 0.0, 2.3, 0.0),
        Kind::Triton => ([1352.6, 1352.6, 1352.6], 5.0, 5.0, 15.0),
        Kind::Charon => ([606.0, 606.0, 606.0], 0.0, 1.8, 0.0),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_named_body_has_a_shape() {
        let others = [Kind::Earth, Kind::EarthSphere, Kind::Sun, Kind::Moon, Kind::Sphere, Kind::Ellipsoid];
        for kind in Kind::ALL {
            let planet = kind.planet();
            assert_eq!(planet.is_none(), others.contains(kind), "{}", kind.name());
            let Some(Planet { radii_km: [a, b, c], limb_height_sigma_km, .. }) = planet else { continue };
            assert!(a >= b && b >= c && c > 5.0 && limb_height_sigma_km > 0.0, "{}", kind.name());
        }
    }
}
