//! Shape and rotation of planets, moons and dwarf planets.
//!
//! The body-fixed frame of a body has its z axis along the pole and its x axis on the prime meridian, both as the
//! International Astronomical Union defines them. [`BODIES`] has the numbers; its file names their source.
//!
//! The pole has the right ascension α₀ and the declination δ₀ in the ICRF, and W is the angle from the node of the
//! equator to the prime meridian. With T in Julian centuries and d in days of barycentric dynamical time since J2000:
//!
//! α₀ = a + b T + Σ a_i sin θ_i, δ₀ = c + e T + Σ d_i cos θ_i, W = w₀ + w₁ d + w₂ T² + Σ w_i sin θ_i.
//!
//! Each periodic term that is left out is below 0.01°. The rotation of Jupiter and Saturn is that of the magnetic
//! field; clouds turn up to 1 % faster.

mod table;

pub use table::BODIES;

use hzn_core::body::{Kind, MOON_RADIUS_KM};
use nalgebra::{Quaternion, UnitQuaternion};

use crate::frames::{Fixed, Inertial, Rotation, Vector};

/// Shape and rotation of a body. Angles are in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planet {
    /// Name in lower case, as in `kind` of sensor.toml.
    pub name: &'static str,
    /// Right ascension of the pole at J2000, and its rate per century.
    pub right_ascension: [f64; 2],
    /// Declination of the pole at J2000, and its rate per century.
    pub declination: [f64; 2],
    /// W at J2000, its rate per day, and its quadratic part per century².
    pub meridian: [f64; 3],
    /// Periodic terms: the angle θ with its rate per century and its quadratic part per century², and the amplitudes in
    /// right ascension, declination and W.
    pub terms: &'static [([f64; 3], [f64; 3])],
}

/// Orientation of a body at one time, in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Orientation {
    /// Right ascension of the pole in the ICRF.
    pub right_ascension_deg: f64,
    /// Declination of the pole in the ICRF.
    pub declination_deg: f64,
    /// Angle from the ascending node of the body's equator on the ICRF equator to the prime meridian. It has no limits.
    pub meridian_deg: f64,
}

/// Returns the body with a name in lower case.
///
/// ```
/// use hzn_nav::{planets, time};
///
/// let jupiter = planets::find("jupiter").ok_or("no such body")?;
/// assert_eq!(jupiter.radii_km(), [71_492.0, 71_492.0, 66_854.0]);
/// let days = time::tt_days_since_j2000(1_735_689_600.0); // 2025-01-01T00:00 UTC
/// let pole = jupiter.orientation(days).pole();
/// let in_its_own_frame = jupiter.fixed_from_inertial(days) * pole;
/// assert!((in_its_own_frame.xyz()[2] - 1.0).abs() < 1e-15);
/// # Ok::<(), &str>(())
/// ```
pub fn find(name: &str) -> Option<&'static Planet> {
    BODIES.iter().find(|body| body.name == name)
}

impl Planet {
    /// Returns the semi-axes along the body-fixed x, y and z axis, kilometres: those of the sensor
    /// ([`hzn_core::body::Planet`]).
    pub fn radii_km(&self) -> [f64; 3] {
        // The sensor has the table, so that a scene and the sensor that looks at it cannot have different radii.
        let kind = Kind::ALL.iter().find(|kind| kind.name() == self.name);
        kind.and_then(|kind| kind.planet()).map_or([MOON_RADIUS_KM; 3], |planet| planet.radii_km)
    }

    /// Returns the orientation at a time. `tdb_days` counts days of barycentric dynamical time since J2000; terrestrial
    /// time ([`crate::time::tt_days_since_j2000`]) differs by less than 2 ms.
    pub fn orientation(&self, tdb_days: f64) -> Orientation {
        let t = tdb_days / 36_525.0;
        let ([ra, ra_rate], [dec, dec_rate], [w, w_rate, w_square]) =
            (self.right_ascension, self.declination, self.meridian);
        let mut all = [ra + ra_rate * t, dec + dec_rate * t, w + w_rate * tdb_days + w_square * t * t];
        for ([at_j2000, rate, square], amplitudes) in self.terms {
            let (sin, cos) = libm::sincos((at_j2000 + rate * t + square * t * t).to_radians());
            let wave = [sin, cos, sin];
            (0..3).for_each(|i| all[i] += amplitudes[i] * wave[i]);
        }
        let [right_ascension_deg, declination_deg, meridian_deg] = all;
        Orientation { right_ascension_deg, declination_deg, meridian_deg }
    }

    /// Returns the rotation from the ICRF to the body-fixed frame at a time, as in [`Planet::orientation`].
    pub fn fixed_from_inertial(&self, tdb_days: f64) -> Rotation<Inertial, Fixed> {
        self.orientation(tdb_days).fixed_from_inertial()
    }
}

impl Orientation {
    /// Returns the rotation from the ICRF to the body-fixed frame: R₃(W) R₁(90° − δ₀) R₃(90° + α₀).
    pub fn fixed_from_inertial(&self) -> Rotation<Inertial, Fixed> {
        // The axes turn by the angle, so the coordinates turn back.
        let half = |deg: f64| libm::sincos(-0.5 * deg.to_radians());
        let about_z = |deg: f64| {
            let (s, c) = half(deg);
            Quaternion::new(c, 0.0, 0.0, s)
        };
        let (s, c) = half(90.0 - self.declination_deg);
        let tilt = Quaternion::new(c, s, 0.0, 0.0);
        let whole = about_z(self.meridian_deg) * tilt * about_z(90.0 + self.right_ascension_deg);
        UnitQuaternion::new_normalize(whole).into()
    }

    /// Returns the direction of the pole.
    pub fn pole(&self) -> Vector<Inertial> {
        let (sin_ra, cos_ra) = libm::sincos(self.right_ascension_deg.to_radians());
        let (sin_dec, cos_dec) = libm::sincos(self.declination_deg.to_radians());
        Vector::new(cos_dec * cos_ra, cos_dec * sin_ra, sin_dec)
    }
}
