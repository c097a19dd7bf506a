//! Computes the nadir directly from the edge points, without a conic (Braun & Barf 2022, (24)).
//!
//! On the plane z = 1, a limb point p = s/s_z satisfies p·e = cos α ‖p‖, which is linear in e. Least squares over all
//! points give e = (HᵀH)⁻¹ Hᵀ (cos α ‖p‖), with the p as rows of H. In unit rays, these are the equations s·e = cos α
//! with the weights 1/s_z². A point far from the optical axis therefore counts more, and beyond 90° there is no plane.
//!
//! The paper says that α must be known. This is not necessary: another cos α scales e and does not change its
//! direction. The length of the result is the assumed cos α divided by the measured one, so it *measures* α. This is
//! also the weakness of the method: the half-angle is free, which increases the error on a short arc by a factor of
//! three to six (book/theory/math.md).

use crate::base::linalg::{M3, V3, basis, invert_spd3};
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};

/// Points with a smaller s_z (cosine of the angle to the optical axis) are not used, because they are not on the plane.
// A point counts 1/s_z², which is above 1000 here: one point near 90° would decide over all others.
pub(crate) const LEAST_Z: f64 = 0.03;

/// Largest number of refinement rounds. Each round removes the error that rounding left in the round before, as far as
/// the condition of the equations allows.
// One round is not enough, because in single precision the plain normal equations of the paper are wrong by 0.015° at
// 20 km.
const ROUNDS: usize = 4;

/// Returns the least-squares nadir of the points with a weight: the unit axis and cos α. The result is `None` if the
/// points do not determine a cone: if there are fewer than three, or if all are in a plane through the camera.
pub(crate) fn fit<T: Real>(blocks: &[Block<T>]) -> Option<(V3<T>, T)> {
    let one = T::one();
    // The start is the mean direction. The equations are solved for the rest, in a basis along this direction, so that
    // single precision suffices: p·δ = ‖p‖ − p·e, with cos α assumed to be 1.
    let mut e = mean(blocks)?;
    let (b1, b2) = basis(&e);
    let normal = Normal::new(blocks, &b1, &b2, &e.clone())?;
    for _ in 0..ROUNDS {
        let step = normal.solve(blocks, &e);
        e += step;
        if !(step.dot(&step) > T::EPSILON * T::EPSILON * e.dot(&e)) {
            break;
        }
    }
    let norm = e.dot(&e).sqrt();
    // The assumed cos α is 1.
    let c = one / norm;
    (norm.is_finite() && c > T::ZERO && c < one).then(|| (e * c, c))
}

/// Returns the mean direction of the points.
fn mean<T: Real>(blocks: &[Block<T>]) -> Option<V3<T>> {
    let mut total = V3::new(T::ZERO, T::ZERO, T::ZERO);
    for b in blocks {
        for l in 0..LANES {
            if weight(b, l) > T::ZERO {
                total += b.ray(l);
            }
        }
    }
    crate::base::linalg::unit(&total)
}

/// Returns 1/s_z² for a point with a weight, otherwise 0.
fn weight<T: Real>(b: &Block<T>, l: usize) -> T {
    let z = b.s[2][l & 7];
    if b.weight[l & 7] > T::ZERO && z > T::from_f64(LEAST_Z) { T::one() / (z * z) } else { T::ZERO }
}

/// Inverse of HᵀH in the basis (b1, b2, e). The first two columns are made orthogonal to the third one.
pub(crate) struct Normal<T> {
    axes: [V3<T>; 3],
    /// Multiple of the third column that is subtracted from each of the first two.
    shear: [T; 2],
    inverse: M3<T>,
}

impl<T: Real> Normal<T> {
    pub(crate) fn new(blocks: &[Block<T>], b1: &V3<T>, b2: &V3<T>, e: &V3<T>) -> Option<Self> {
        let (mut s13, mut s23, mut s33) = (T::ZERO, T::ZERO, T::ZERO);
        each(blocks, |w, s| {
            let z = s.dot(e);
            s13 += w * s.dot(b1) * z;
            s23 += w * s.dot(b2) * z;
            s33 += w * z * z;
        });
        if !(s33 > T::ZERO) {
            return None;
        }
        // On a short arc the first two columns are nearly multiples of the third; without the shear the inverse would
        // lose digits.
        let shear = [s13 / s33, s23 / s33];
        let mut n = [T::ZERO; 6];
        each(blocks, |w, s| {
            let [x, y, z] = row(&s, [b1, b2, e], shear);
            n[0] += w * x * x;
            n[1] += w * x * y;
            n[2] += w * x * z;
            n[3] += w * y * y;
            n[4] += w * y * z;
            n[5] += w * z * z;
        });
        Some(Self { axes: [*b1, *b2, *e], shear, inverse: invert_spd3(&n)? })
    }

    /// Returns the row of a ray, without its weight.
    pub(crate) fn row(&self, s: &V3<T>) -> V3<T> {
        let [a, b, c] = &self.axes;
        V3::from(row(s, [a, b, c], self.shear))
    }

    /// Returns (HᵀH)⁻¹ in the sheared basis.
    pub(crate) fn inverse(&self) -> &M3<T> {
        &self.inverse
    }

    /// Converts a solution in the sheared basis to a vector of the camera frame. With rows x' = x − m z, the unknowns
    /// are (x, y, z + m·(x, y)), so that z follows.
    pub(crate) fn vector(&self, d: &V3<T>) -> V3<T> {
        let z = d.z - self.shear[0] * d.x - self.shear[1] * d.y;
        self.axes[0] * d.x + self.axes[1] * d.y + self.axes[2] * z
    }

    /// Solves p·δ = ‖p‖ − p·e by least squares.
    fn solve(&self, blocks: &[Block<T>], e: &V3<T>) -> V3<T> {
        let mut right = V3::new(T::ZERO, T::ZERO, T::ZERO);
        each(blocks, |w, s| {
            right += self.row(&s) * (w * (T::one() - s.dot(e)));
        });
        self.vector(&(self.inverse * right))
    }
}

fn row<T: Real>(s: &V3<T>, [a, b, c]: [&V3<T>; 3], shear: [T; 2]) -> [T; 3] {
    let z = s.dot(c);
    [s.dot(a) - shear[0] * z, s.dot(b) - shear[1] * z, z]
}

fn each<T: Real>(blocks: &[Block<T>], mut visit: impl FnMut(T, V3<T>)) {
    for b in blocks {
        for l in 0..LANES {
            let w = weight(b, l);
            if w > T::ZERO {
                visit(w, b.ray(l));
            }
        }
    }
}
