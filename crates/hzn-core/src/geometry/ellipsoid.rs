//! The limb of an ellipsoid of revolution.
//!
//! The rays that touch an ellipsoid form an elliptic cone. The axis and the two half-angles of the cone follow in
//! closed form from the position alone; no attitude is needed. A horizon sensor measures the **limb axis**. In low
//! orbit it is within 0.02° of the geodetic vertical and up to 0.19° from the direction to the Earth's centre.

use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::frames::{Fixed, UnitVec3};

/// WGS-84 equatorial radius in metres.
pub const WGS84_A_M: f64 = 6_378_137.0;
/// WGS-84 polar radius in metres.
pub const WGS84_B_M: f64 = 6_356_752.314_245_179;
/// Mean radius of the Earth in metres (IUGG R1).
pub const EARTH_MEAN_RADIUS_M: f64 = 6_371_008.8;

/// The cone of rays that touch an ellipsoid, seen from one position.
///
/// ```
/// use hzn_core::ellipsoid::{LimbCone, WGS84_A_M, WGS84_B_M};
///
/// // Above the equator, the limb to the east and west is wider than the limb towards the poles.
/// let cone = LimbCone::<f64>::try_new([7_000e3, 0.0, 0.0], WGS84_A_M, WGS84_B_M).expect("above the surface");
/// let (east, meridian) = cone.half_angles_rad();
/// assert!(east > meridian && cone.axis.xyz()[0] == -1.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimbCone<T> {
    /// Axis of the cone, towards the body.
    pub axis: UnitVec3<Fixed, T>,
    /// cot² of the half-angle in the east-west plane through the axis.
    pub cot2_east: T,
    /// cot² of the half-angle in the meridian plane.
    pub cot2_meridian: T,
    /// Unit vector to the east at the position; at the poles the y axis.
    pub east: UnitVec3<Fixed, T>,
}

impl<T: Real> LimbCone<T> {
    /// Returns the cone of the ellipsoid with semi-axes `a_m` (equator) and `b_m` (pole) seen from `position_m` (ECEF,
    /// metres). `None` when the position is not outside the ellipsoid or not finite.
    ///
    /// The matrix of the cone is that of the polar form. In the meridian plane its axis lies at the angle
    /// ψ = ½ atan2(2 p z, P − Q) with P = p² − a², Q = z² − b². tan² of the half-angles is a²/μ₁ and −μ₂/μ₁ with
    /// μ = (P + Q)/2 ± √(((P − Q)/2)² + p² z²). Differences of squares are computed as products, in units of a.
    pub fn try_new(position_m: [T; 3], a_m: T, b_m: T) -> Option<Self> {
        let one = T::one();
        // Lengths are in units of a, so that squares of metres do not use up the range of single precision.
        let [x, y, z] = position_m.map(|v| v / a_m);
        let b = b_m / a_m;
        let p = (x * x + y * y).sqrt();
        // The products keep the digits that p² − a² would lose near the surface, where both squares are nearly equal.
        let (pp, qq) = ((p - one) * (p + one), (z - b) * (z + b));
        let xx = p * z;
        let eta = (pp - qq) * T::from_f64(0.5);
        let mean = (pp + qq) * T::from_f64(0.5);
        let root = (eta * eta + xx * xx).sqrt();
        let mu1 = mean + root;
        // μ1 μ2 = PQ − p²z² = −(b²p² + z² − b²): the product form keeps μ2 exact where it is small.
        let mu2 = (pp * qq - xx * xx) / mu1;
        // Outside means p²/a² + z²/b² > 1.
        let outside = p * p + z * z / (b * b) - one;
        if !(outside > T::EPSILON * T::from_f64(4.0) && mu1 > T::zero() && mu1.is_finite() && mu2 < T::zero()) {
            return None;
        }
        // `atan2` needs no case for the equator or the poles, where one of the arguments is 0.
        let psi = (xx + xx).atan2(pp - qq) * T::from_f64(0.5);
        let (sin, cos) = psi.sin_cos();
        // Over a pole every direction is east; any one will do, because the cone is circular there.
        let (ex, ey) = if p > T::EPSILON { (x / p, y / p) } else { (one, T::zero()) };
        let u = V3::new(ex * cos, ey * cos, sin);
        // The formula gives a line and not a direction. The axis points to the body, against the position.
        let sign = if u.x * x + u.y * y + u.z * z > T::zero() { -one } else { one };
        Some(Self {
            axis: UnitVec3::assume_unit(u * sign),
            cot2_east: mu1,
            cot2_meridian: -mu1 / mu2,
            east: UnitVec3::assume_unit(V3::new(-ey, ex, T::zero())),
        })
    }

    /// Returns the half-angle in radians whose cot² is the mean of the two: the best single cone.
    pub fn mean_half_angle_rad(&self) -> T {
        T::one().atan2(((self.cot2_east + self.cot2_meridian) * T::from_f64(0.5)).sqrt())
    }
    /// Returns the half-angles in the east-west and in the meridian plane, radians.
    pub fn half_angles_rad(&self) -> (T, T) {
        (T::one().atan2(self.cot2_east.sqrt()), T::one().atan2(self.cot2_meridian.sqrt()))
    }
}

/// Converts an ECEF position in metres to (height above the ellipsoid in metres, geodetic latitude in radians), by
/// Bowring's method with two iterations.
pub fn geodetic<T: Real>([x, y, z]: [T; 3], a_m: T, b_m: T) -> (T, T) {
    let one = T::one();
    let (p, z, b) = ((x * x + y * y).sqrt() / a_m, z / a_m, b_m / a_m);
    let e2 = (one - b) * (one + b);
    let ep2 = e2 / (b * b);
    // Parametric latitude.
    let mut beta = z.atan2(p * b);
    let mut lat = beta;
    // The number of rounds is fixed, so that the time does not depend on the place. Three are right to 1e-5 m up to
    // 20000 km.
    for _ in 0..3 {
        let (s, c) = beta.sin_cos();
        lat = (z + ep2 * b * s * s * s).atan2(p - e2 * c * c * c);
        let (s, c) = lat.sin_cos();
        beta = (b * s).atan2(c);
    }
    let (s, c) = lat.sin_cos();
    let (sb, cb) = beta.sin_cos();
    // Distance to the foot point along the normal.
    // The height is measured along the normal. The usual p/cos φ − N would divide by 0 over a pole.
    let h = (p - cb) * c + (z - b * sb) * s;
    (h * a_m, lat)
}

/// Converts a geodetic latitude and longitude (radians) and height (metres) to an ECEF position in metres.
///
/// ```
/// use hzn_core::ellipsoid::{WGS84_A_M, WGS84_B_M, from_geodetic, geodetic};
///
/// let position_m = from_geodetic(0.8, 0.2, 400e3, WGS84_A_M, WGS84_B_M);
/// let (height_m, latitude_rad) = geodetic(position_m, WGS84_A_M, WGS84_B_M);
/// assert!((height_m - 400e3).abs() < 1e-3 && (latitude_rad - 0.8).abs() < 1e-9);
/// ```
pub fn from_geodetic<T: Real>(lat_rad: T, lon_rad: T, height_m: T, a_m: T, b_m: T) -> [T; 3] {
    let (sl, cl) = lat_rad.sin_cos();
    let (so, co) = lon_rad.sin_cos();
    let q = b_m / a_m;
    let n = a_m / (cl * cl + q * q * sl * sl).sqrt();
    [(n + height_m) * cl * co, (n + height_m) * cl * so, (n * q * q + height_m) * sl]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn geodetic_and_back() {
        for (lat, h) in [(0.0, 0.0), (0.7, 230e3), (-1.3, 600e3), (1.57, 100e3), (0.3, 20_000e3)] {
            let p = from_geodetic(lat, 0.4, h, WGS84_A_M, WGS84_B_M);
            let (hh, ll) = geodetic(p, WGS84_A_M, WGS84_B_M);
            assert!((hh - h).abs() < 1e-5 && (ll - lat).abs() < 1e-11, "{lat} {h}: {hh} {ll}");
        }
    }

    #[test]
    fn a_sphere_gives_the_simple_cone() {
        let c = LimbCone::<f64>::try_new([0.0, 3.0, 4.0], 1.0, 1.0).unwrap();
        assert!((c.mean_half_angle_rad() - libm::asin(0.2)).abs() < 1e-15);
        assert!((c.axis.xyz()[2] + 0.8).abs() < 1e-15);
    }

    #[test]
    fn inside_is_refused() {
        assert!(LimbCone::<f64>::try_new([0.0, 0.0, 0.9], 1.0, 1.0).is_none());
        assert!(LimbCone::<f64>::try_new([f64::NAN, 0.0, 0.9], 1.0, 1.0).is_none());
        assert!(LimbCone::<f32>::try_new([0.0; 3], 1.0, 1.0).is_none());
    }
}
