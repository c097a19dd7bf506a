//! Fits a conic to the edge points, and computes the axis from its coefficients (Braun & Barf 2022, (17) and (18),
//! corrected).
//!
//! On the plane z = 1 the limb of a sphere is A x² + B xy + C y² + D x + E y + F = 0. Least squares give the
//! coefficients under the constraint that the curve *is* an ellipse, 4AC − B² = 1, or a hyperbola, 4AC − B² = −1
//! (Fitzgibbon et al. 1999; O'Leary & Zsombor-Murray 2004). One eigenvalue problem gives both, and the curve closer to
//! the points is used. A parabola is between the two, and is fitted as an ellipse or as a hyperbola.
//!
//! As a quadratic form of rays, the conic is the cone e eᵀ − cos²α I times any factor. One eigenvalue has a sign that
//! the other two do not have; its eigenvector is the axis. The eigenvalues have the ratio sin²α to −cos²α. The printed
//! (18) takes square roots of the coefficients and loses the signs of the components of the axis, and so its direction.
//! It also assumes that the factor is 1, although the coefficients of a conic have a free factor. The nappe gives the
//! sign of the axis.

use super::direct::LEAST_Z;
use crate::base::linalg::{M3, Triangle, V3, symmetric_eigen, unit};
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES, LEAST_GRADIENT2};

/// Returns the axis and cos α of the conic closest to the points with a weight. The result is `None` if the points do
/// not determine a cone: if there are fewer than five, if all are on a line, or if the conic is no picture of a cone
/// about its axis.
pub(crate) fn fit<T: Real>(blocks: &[Block<T>]) -> Option<(V3<T>, T)> {
    let plane = Plane::new(blocks)?;
    let mut best: Option<(T, V3<T>, T)> = None;
    for conic in plane.conics(blocks)? {
        let Some((e, c)) = cone(&plane.rays(&conic), &plane.towards) else { continue };
        // The two curves are compared in pixels, because their algebraic residuals have different constraints and no
        // common unit.
        let off = distance2(blocks, &e, c);
        if off.is_finite() && best.is_none_or(|(b, _, _)| off < b) {
            best = Some((off, e, c));
        }
    }
    best.map(|(_, e, c)| (e, c))
}

/// Returns the mean squared distance of the points from a cone, in px².
fn distance2<T: Real>(blocks: &[Block<T>], e: &V3<T>, c: T) -> T {
    let (mut total, mut count) = (T::ZERO, T::ZERO);
    for b in blocks {
        let g = b.gradient(e);
        for l in 0..LANES {
            let r = c - b.ray(l).dot(e);
            total += b.weight[l] * r * r / (g[0][l] * g[0][l] + g[1][l] * g[1][l]).max(T::from_f64(LEAST_GRADIENT2));
            count += b.weight[l];
        }
    }
    total / count
}

/// Coefficients A to F of a conic, relative to the centre and the scale of the points.
type Conic<T> = [T; 6];

/// The points on the plane z = 1, moved to their centre and scaled to unit spread, because fourth powers of the
/// coordinates are summed.
struct Plane<T> {
    centre: [T; 2],
    scale: T,
    /// Mean direction of the points, which is on the visible nappe.
    towards: V3<T>,
}

impl<T: Real> Plane<T> {
    fn new(blocks: &[Block<T>]) -> Option<Self> {
        let (mut n, mut x, mut y) = (T::ZERO, T::ZERO, T::ZERO);
        let mut towards = V3::new(T::ZERO, T::ZERO, T::ZERO);
        each(blocks, |p, s| {
            n += T::one();
            x += p[0];
            y += p[1];
            towards += s;
        });
        if n < T::from_f64(5.0) {
            return None;
        }
        let centre = [x / n, y / n];
        let mut spread = T::ZERO;
        each(blocks, |p, _| {
            let (dx, dy) = (p[0] - centre[0], p[1] - centre[1]);
            spread += dx * dx + dy * dy;
        });
        let scale = (spread / n).sqrt();
        (scale > T::EPSILON).then_some(())?;
        Some(Self { centre, scale: T::one() / scale, towards: unit(&towards)? })
    }

    /// Returns the best ellipse and the best hyperbola.
    ///
    /// A triangle of the rows (1, x, y, x², xy, y²) separates the quadratic terms from the linear ones. Let R be its
    /// last three rows and columns. Then aᵀ RᵀR a is the least sum of squares for a = (A, B, C). It is minimised for a
    /// given aᵀ C a = 4AC − B². With the singular values σ and vectors V of R, and a = V σ⁻¹ y, this is an ordinary
    /// symmetric problem. The largest eigenvalue of σ⁻¹ Vᵀ C V σ⁻¹ belongs to the ellipse, and the smallest to the
    /// hyperbola.
    fn conics(&self, blocks: &[Block<T>]) -> Option<[Conic<T>; 2]> {
        let mut triangle = Triangle::<T, 6>::new();
        each(blocks, |p, _| {
            let (x, y) = self.place(p);
            triangle.push([T::one(), x, y, x * x, x * y, y * y]);
        });
        let [[r11, r12, r13, r14, r15, r16], [_, r22, r23, r24, r25, r26], [_, _, r33, r34, r35, r36], rest @ ..] =
            *triangle.rows();
        let mut quadratic = Triangle::<T, 3>::new();
        for [_, _, _, a, b, c] in rest {
            quadratic.push([a, b, c]);
        }
        let (values, vectors) = quadratic.singular_values();
        // If the points are exactly on a conic, the smallest singular value is zero except for rounding. If the next
        // one is zero, too, more than one conic goes through the points: they are on a line, or at fewer than five
        // places.
        let floor = values[2] * T::EPSILON * T::from_f64(4.0);
        if !(values[1] > floor * T::from_f64(16.0) && r33.abs() > T::EPSILON * T::from_f64(64.0) * r11.abs()) {
            return None;
        }
        let half: [[T; 3]; 3] =
            core::array::from_fn(|i| core::array::from_fn(|j| vectors[i][j] / values[i].max(floor)));
        let discriminant = |a: &[T; 3], b: &[T; 3]| (a[0] * b[2] + a[2] * b[0]) * T::from_f64(2.0) - a[1] * b[1];
        let problem = core::array::from_fn(|i| core::array::from_fn(|j| discriminant(&half[i], &half[j])));
        let (_, solutions) = symmetric_eigen::<T, 3>(problem);
        let conic = |y: &[T; 3]| -> Conic<T> {
            let [a, b, c]: [T; 3] = core::array::from_fn(|k| half[0][k] * y[0] + half[1][k] * y[1] + half[2][k] * y[2]);
            // The first three rows give the linear terms, from the last row to the first.
            let e = -(r34 * a + r35 * b + r36 * c) / r33;
            let d = -(r24 * a + r25 * b + r26 * c + r23 * e) / r22;
            let f = -(r14 * a + r15 * b + r16 * c + r12 * d + r13 * e) / r11;
            [a, b, c, d, e, f]
        };
        Some([conic(&solutions[2]), conic(&solutions[0])])
    }

    fn place(&self, [x, y]: [T; 2]) -> (T, T) {
        ((x - self.centre[0]) * self.scale, (y - self.centre[1]) * self.scale)
    }

    /// Returns the conic as a quadratic form of rays (x, y, 1), normalised so that the largest entry is 1.
    fn rays(&self, &[a, b, c, d, e, f]: &Conic<T>) -> [[T; 3]; 3] {
        let half = T::from_f64(0.5);
        let local = M3::new(a, b * half, d * half, b * half, c, e * half, d * half, e * half, f);
        let (k, zero) = (self.scale, T::ZERO);
        let [x, y] = self.centre;
        let t = M3::new(k, zero, -k * x, zero, k, -k * y, zero, zero, T::one());
        let m = t.transpose() * local * t;
        let mut largest = T::ZERO;
        for value in m.iter() {
            largest = largest.max(value.abs());
        }
        // The scale of a conic is free. With 1 as the largest entry, squares stay in the range of single precision,
        // which would otherwise depend on it.
        let by = T::one() / largest.max(T::from_f64(1e-30));
        core::array::from_fn(|i| core::array::from_fn(|j| m[(i, j)] * by))
    }
}

/// Returns the axis and cos α of the cone rᵀ m r = 0, on the nappe of `towards`: (18), corrected. The result is `None`
/// if all eigenvalues have the same sign, because then there is no cone.
pub(crate) fn cone<T: Real>(m: &[[T; 3]; 3], towards: &V3<T>) -> Option<(V3<T>, T)> {
    let (values, vectors) = symmetric_eigen(*m);
    let [low, mid, high] = values;
    // One eigenvalue is positive and two are negative, or the other way round, depending on the factor.
    let (own, others, axis) = if mid < T::ZERO && high > T::ZERO {
        (high, low + mid, &vectors[2])
    } else if mid > T::ZERO && low < T::ZERO {
        (low, mid + high, &vectors[0])
    } else {
        return None;
    };
    // cot²α of an elliptic cone is the mean of its two values.
    let cot2 = -others * T::from_f64(0.5) / own;
    let c = (cot2 / (T::one() + cot2)).sqrt();
    let e = unit(&V3::from(*axis))?;
    let e = if e.dot(towards) < T::ZERO { -e } else { e };
    (c > T::ZERO && c < T::one()).then_some((e, c))
}

fn each<T: Real>(blocks: &[Block<T>], mut visit: impl FnMut([T; 2], V3<T>)) {
    for b in blocks {
        for l in 0..LANES {
            let z = b.s[2][l];
            if b.weight[l] > T::ZERO && z > T::from_f64(LEAST_Z) {
                visit([b.s[0][l] / z, b.s[1][l] / z], b.ray(l));
            }
        }
    }
}
