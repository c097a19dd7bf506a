//! Private names for nalgebra's types, and small decompositions that in nalgebra have panic paths.

mod decompose;

pub(crate) use decompose::{Triangle, dot, symmetric_eigen};

use crate::base::real::Real;

/// Vector of three components.
pub(crate) type V3<T> = nalgebra::Vector3<T>;
/// Matrix of three by three.
pub(crate) type M3<T> = nalgebra::Matrix3<T>;

/// Returns two unit vectors that complete the unit vector `e` to a right-handed basis (b1, b2, e).
///
/// Duff et al. 2017, "Building an orthonormal basis, revisited": there is no square root, and the sign is the only
/// branch.
pub(crate) fn basis<T: Real>(e: &V3<T>) -> (V3<T>, V3<T>) {
    let one = T::one();
    // With the sign of z the divisor has at least length 1. Without it the basis would fail near e = −z.
    let sign = if e.z < T::zero() { -one } else { one };
    let a = -one / (sign + e.z);
    let b = e.x * e.y * a;
    (V3::new(one + sign * e.x * e.x * a, sign * b, -sign * e.x), V3::new(b, sign + e.y * e.y * a, -e.y))
}

/// Scales `v` to unit length; `None` when its length is about 0 or not finite.
pub(crate) fn unit<T: Real>(v: &V3<T>) -> Option<V3<T>> {
    let n2 = v.dot(v);
    // The limit lies far above the smallest normal f32 (1e-38), so that the reciprocal of the root stays finite.
    (n2 > T::from_f64(1e-30) && n2.is_finite()).then(|| v * (T::one() / n2.sqrt()))
}

/// Inverts a symmetric positive definite 3×3 matrix, given by its upper triangle (xx, xy, xz, yy, yz, zz). The method
/// is Cholesky after the diagonal is scaled to one. `None` when the matrix is not safely positive definite in this
/// precision.
pub(crate) fn invert_spd3<T: Real>(m: &[T; 6]) -> Option<M3<T>> {
    let [a, b, c, d, e, f] = *m;
    if !(a > T::zero() && d > T::zero() && f > T::zero()) {
        return None;
    }
    let one = T::one();
    // The unknowns have different units (radians, cosines, lengths). With a diagonal of ones, one limit for the pivots
    // serves all of them.
    let (sa, sd, sf) = (one / a.sqrt(), one / d.sqrt(), one / f.sqrt());
    let (b, c, e) = (b * sa * sd, c * sa * sf, e * sd * sf);
    // L of the scaled matrix [[1, b, c], [b, 1, e], [c, e, 1]].
    // A pivot below some rounding errors is only rounding: its reciprocal would be a covariance without meaning.
    let floor = T::EPSILON * T::from_f64(16.0);
    let l22 = one - b * b;
    if !(l22 > floor) {
        return None;
    }
    let l22 = l22.sqrt();
    let l32 = (e - b * c) / l22;
    let l33 = one - c * c - l32 * l32;
    if !(l33 > floor) {
        return None;
    }
    let l33 = l33.sqrt();
    // Rows of L⁻¹.
    let (i22, i33) = (one / l22, one / l33);
    let i21 = -b * i22;
    let i32 = -l32 * i22 * i33;
    let i31 = -(c + l32 * i21) * i33;
    let xx = (one + i21 * i21 + i31 * i31) * sa * sa;
    let xy = (i21 * i22 + i31 * i32) * sa * sd;
    let xz = i31 * i33 * sa * sf;
    let yy = (i22 * i22 + i32 * i32) * sd * sd;
    let yz = i32 * i33 * sd * sf;
    let zz = i33 * i33 * sf * sf;
    Some(M3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz))
}

/// Inverts a symmetric positive definite 2×2 matrix (xx, xy, yy); `None` when it is not safely positive definite.
pub(crate) fn invert_spd2<T: Real>([a, b, d]: [T; 3]) -> Option<[T; 3]> {
    // The determinant is compared with the product of the diagonal, so that the limit does not depend on units.
    let det = a * d - b * b;
    if !(a > T::zero() && d > T::zero() && det > T::EPSILON * T::from_f64(16.0) * a * d) {
        return None;
    }
    let s = T::one() / det;
    Some([d * s, -b * s, a * s])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn basis_is_orthonormal(x in -1.0..1.0f64, y in -1.0..1.0f64, z in -1.0..1.0f64) {
            prop_assume!(x * x + y * y + z * z > 1e-3);
            let e = unit(&V3::new(x, y, z)).unwrap();
            let (a, b) = basis(&e);
            prop_assert!((a.cross(&b) - e).norm() < 1e-14);
            prop_assert!((a.norm() - 1.0).abs() < 1e-14 && a.dot(&e).abs() < 1e-14);
        }

        #[test]
        fn inverse_times_matrix_is_one(v in proptest::array::uniform9(-2.0..2.0f64)) {
            let l = M3::from_row_slice(&v);
            let m = l * l.transpose() + M3::identity() * 0.05;
            let inv = invert_spd3(&[m.m11, m.m12, m.m13, m.m22, m.m23, m.m33]).unwrap();
            prop_assert!((inv * m - M3::identity()).norm() < 1e-9);
        }
    }

    #[test]
    fn singular_matrices_are_refused() {
        assert!(invert_spd3(&[1.0, 1.0, 0.0, 1.0, 0.0, 1.0f64]).is_none());
        assert!(invert_spd3(&[f64::NAN, 0.0, 0.0, 1.0, 0.0, 1.0]).is_none());
        assert!(invert_spd2([1.0, 1.0, 1.0f32]).is_none());
    }
}
