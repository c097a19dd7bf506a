//! The effect of a limb height that changes with the latitude on the direction of the limb's axis.
//!
//! The limb is the circle of points at which the lines of sight touch the Earth. From a position at the distance d the
//! point in the azimuth ψ from north has sin φ = u + w cos ψ, with u = s sin φ₀, w = √(1 − s²) cos φ₀, s = R/d and the
//! latitude φ₀ of the position. A height that is larger by δh moves the line of sight by δh/(d √(1 − s²)) away from
//! nadir. The part of the height without ψ changes the half-angle, as the constant error does. The part with cos ψ
//! tilts the axis, and a fit of axis and half-angle takes exactly this tilt, whatever part of the limb is visible. For
//! (3 sin² φ − 1)/2 a part with cos 2ψ is left, at most 3w²/4. It is neglected.

use crate::frames::{Fixed, Vector};

/// Mean radius of the Earth, km. A sphere is enough here: the flattening moves the latitude of the limb by less than
/// 0.2°, and the height changes by kilometres between equator and pole.
pub const RADIUS_KM: f64 = 6371.0;

/// The effect of one coefficient of [`Options::limb_latitude`](crate::options::Options::limb_latitude).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LatitudeTerm {
    /// Mean height along the limb by the coefficient.
    pub height: f64,
    /// Tilt of the axis by the coefficient, rad/km.
    pub tilt: Vector<Fixed>,
}

impl LatitudeTerm {
    /// Returns the effects of the coefficients of degree 1 and 2 from a position, m; `None` within the Earth.
    pub fn both(position_m: &Vector<Fixed>) -> Option<[Self; 2]> {
        let distance_m = position_m.norm();
        let up = position_m.try_normalize(1.0)?;
        let s = RADIUS_KM * 1e3 / distance_m;
        let cos_half = libm::sqrt(1.0 - s * s);
        if cos_half.is_nan() || cos_half <= 0.0 {
            return None;
        }
        let by_height = 1.0 / (distance_m * 1e-3 * cos_half);
        // The vector to the north keeps its length cos φ₀, because the tilt has this factor: over a pole it is 0.
        let [_, _, up_z] = up.xyz();
        let north = Vector::new(0.0, 0.0, 1.0) - up * up_z;
        let u = s * up_z;
        let w2 = cos_half * cos_half * north.norm_squared();
        let tilt = north * (cos_half * by_height);
        let second = Self { height: (3.0 * (u * u + 0.5 * w2) - 1.0) / 2.0, tilt: tilt * (3.0 * u) };
        Some([Self { height: u, tilt }, second])
    }
}
