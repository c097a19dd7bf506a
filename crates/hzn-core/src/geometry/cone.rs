//! The cone of limb rays, s·e = cos α, which the stages consensus, fit and gates share.

use crate::base::linalg::V3;
use crate::base::real::Real;

/// Returns the axes of the two cones of half-angle α (cos α = `c`) through two unit rays. `None` when the rays are more
/// than 2α apart, or equal.
///
/// e = a (s₁ + s₂) ± √((1 − 2a²(1 + s₁·s₂))/|n|²) n with a = c/(1 + s₁·s₂), n = s₁ × s₂.
#[inline]
pub(crate) fn through_two<T: Real>(s1: &V3<T>, s2: &V3<T>, c: T) -> Option<[V3<T>; 2]> {
    let one = T::one();
    let n = s1.cross(s2);
    let n2 = n.dot(&n);
    let sum = one + s1.dot(s2);
    // For closer rays the radicand, a small difference over n², has hardly a correct digit; opposite rays have no mean
    // direction. Therefore neither is a pair.
    if !(n2 > T::EPSILON * T::from_f64(100.0) && sum > T::EPSILON * T::from_f64(100.0)) {
        return None;
    }
    let a = c / sum;
    let radicand = (one - (a + a) * a * sum) / n2;
    // A negative radicand means that the rays are more than 2α apart: no cone of this half-angle touches both.
    if !(radicand >= T::zero()) {
        return None;
    }
    let (mid, off) = ((s1 + s2) * a, n * radicand.sqrt());
    // Both signs are hypotheses, because the two points alone do not say on which side the body is.
    Some([mid + off, mid - off])
}

/// Returns axis and cos α of the cone through three unit rays. The axis is the normal of the plane through their tips,
/// turned towards the rays.
#[inline]
pub(crate) fn through_three<T: Real>(s1: &V3<T>, s2: &V3<T>, s3: &V3<T>) -> Option<(V3<T>, T)> {
    let n = (s2 - s1).cross(&(s3 - s1));
    let n2 = n.dot(&n);
    if !(n2 > T::EPSILON * T::EPSILON) {
        return None;
    }
    let e = n * (T::one() / n2.sqrt());
    let c = e.dot(s1);
    // A plane has two normals. The axis is the one towards the rays, because limb rays are less than 90° from it.
    Some(if c < T::zero() { (-e, -c) } else { (e, c) })
}

/// cos α as a function of azimuth, for an ellipsoid whose east direction is known in the camera frame.
///
/// cot²α(φ) = cot²α_E cos²φ + cot²α_M sin²φ, written as an offset from the mean cone, so that a free half-angle shifts
/// α_E and α_M in the same way.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Azimuth<T> {
    pub(crate) east: V3<T>,
    pub(crate) cot2_east: T,
    pub(crate) cot2_meridian: T,
    /// cos of the mean half-angle.
    pub(crate) mean_cos: T,
    pub(crate) north: V3<T>,
    /// First and second harmonic of cos α in azimuth, counted from north. They are added to the offset of the
    /// ellipsoid, and describe a limb height that varies with latitude.
    pub(crate) harmonics_cos: [T; 2],
}

impl<T: Real> Azimuth<T> {
    /// Returns cos α(φ) − cos ᾱ for a ray `s` about the axis `e`, with d = s·e and `east_along` = east·e.
    #[inline(always)]
    pub(crate) fn offset(&self, s: [T; 3], d: T, east_along: T) -> T {
        let one = T::one();
        // A ray along the axis has no azimuth, and the floor avoids a division by 0.
        let transverse = (one - d * d).max(T::EPSILON);
        // The component of the ray's transverse part along east; east itself is transverse to the axis.
        let along = s[0] * self.east.x + s[1] * self.east.y + s[2] * self.east.z - d * east_along;
        // Rounding can make the quotient larger than 1, and the cotangent would leave the range between the two
        // half-angles.
        let cos2 = (along * along / transverse).min(one);
        let cot2 = self.cot2_meridian + (self.cot2_east - self.cot2_meridian) * cos2;
        let [first, second] = self.harmonics_cos;
        let mut height = second * (one - cos2 - cos2);
        // The test saves a root a point for bodies whose limb height does not vary with latitude.
        if first != T::ZERO {
            // North may lie some degrees off the tangent plane. This changes only a small part of a small term.
            let along = s[0] * self.north.x + s[1] * self.north.y + s[2] * self.north.z;
            height += first * along / transverse.sqrt();
        }
        (cot2 / (one + cot2)).sqrt() - self.mean_cos + height
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::linalg::{basis, unit};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn both_solvers_find_the_cone(x in -1.0..1.0f64, y in -1.0..1.0f64, alpha in 0.01..1.5f64,
                                      p in 0.0..1.5f64, q in 1.8..3.0f64, r in 3.3..5.0f64) {
            let e = unit(&V3::new(x, y, 0.7)).unwrap();
            let (b1, b2) = basis(&e);
            let (sin, cos) = libm::sincos(alpha);
            let ray = |phi: f64| e * cos + (b1 * libm::cos(phi) + b2 * libm::sin(phi)) * sin;
            let (s1, s2, s3) = (ray(p), ray(q), ray(r));
            let two = through_two(&s1, &s2, cos).unwrap();
            prop_assert!(two.iter().any(|v| (v - e).norm() < 1e-7), "{two:?} {e:?}");
            for v in two {
                prop_assert!((v.norm() - 1.0).abs() < 1e-7);
            }
            let (v, c) = through_three(&s1, &s2, &s3).unwrap();
            prop_assert!((v - e).norm() < 1e-7 && (c - cos).abs() < 1e-7);
        }
    }

    #[test]
    fn degenerate_rays_give_none() {
        let s = V3::new(0.0, 0.0, 1.0f64);
        assert!(through_two(&s, &s, 0.5).is_none());
        assert!(through_two(&s, &V3::new(1.0, 0.0, 0.0), 0.99).is_none());
        assert!(through_three(&s, &s, &V3::new(1.0, 0.0, 0.0)).is_none());
    }
}
