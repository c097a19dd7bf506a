//! Fits the limb as an elliptic cone by total least squares (Wang et al. 2022, 2.4). The method needs no size, altitude
//! or sphere.
//!
//! A limb ray satisfies sᵀ M s = 0. M is symmetric, and one eigenvalue has a sign that the others do not have: it
//! belongs to the axis (Wang 7 and 22). With e = (x², xy, y², xz, yz, 1), where 1 is x² + y² + z², this is e·v = 0:
//! M₁₁ = v₁ + v₆, M₂₂ = v₃ + v₆, M₃₃ = v₆, M₁₂ = v₂/2, M₁₃ = v₄/2, M₂₃ = v₅/2.
//!
//! * `tls` (10-17): v has the length 1 and the smallest Σ (e·v)². It is the right singular vector of the smallest
//!   singular value. Wang et al. divide by v₆ to have five unknowns, which fails for M₃₃ → 0, a limb through the image
//!   centre. The vector v equals their solution where their solution exists.
//! * `wtls` (18-21): the error of each point is weighed by the effect of one pixel on it. This minimises Σ (e·v)²/q
//!   with q = |∂(e·v)/∂(u, v)|². Their cofactor matrix has (5n)² elements. The points are independent, so that the
//!   matrix has one block for each point, and each iteration is one pass. It solves least squares of the rows e − δ,
//!   weighed by 1/q, with δ = J t (e·v)/q, t = Jᵀv, J = ∂e/∂(u, v). The printed (18) has x z = sin²θ cos²θ u/ρ. The
//!   correct form is sin θ cos θ u/ρ; here e is made from the unit ray.

use crate::base::linalg::{Triangle, V3, basis, dot, symmetric_eigen};
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};

/// Number of unknowns: the matrix of the cone up to its scale.
// Wang et al. have five unknowns and M₃₃ = 1. Six of length 1 are used here, because M₃₃ is 0 for a limb through the
// image centre.
const N: usize = 6;
/// Largest number of iterations of the weights.
const ITERATIONS: usize = 12;

/// A fitted elliptic cone and its response to the errors of the points.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Quadric<T> {
    /// Unit axis towards the body, in the camera frame.
    pub(crate) e: V3<T>,
    /// cos of the mean half-angle, whose cot² is the mean of the two values.
    pub(super) c: T,
    /// The six unknowns, as a vector of length 1.
    v: [T; N],
    /// Whether the points were weighed by the errors of their pixels.
    weighted: bool,
    /// Change of the axis (along the two vectors of `basis(e)`) and of `c` per unit of each of the six normal
    /// equations.
    gains: [[T; N]; 3],
    /// Number of points. `cost` is the sum of their squared distances, in px².
    pub(super) weight: T,
    pub(super) cost: T,
}

impl<T: Real> Quadric<T> {
    /// Fits the cone to the points with a weight. The fit uses weighted total least squares if the axis is more than
    /// `weigh_above_rad` from the optical axis. The result is `None` if the points do not determine a cone about one
    /// axis.
    pub(crate) fn fit(blocks: &[Block<T>], weigh_above_rad: T) -> Option<Self> {
        let v = tls(blocks)?;
        let shape = Shape::new(blocks, &v)?;
        let (_, cos_limit) = weigh_above_rad.sin_cos();
        let weighted = weigh_above_rad <= T::ZERO || shape.e.z < cos_limit;
        let (v, shape) = if weighted {
            let v = wtls(blocks, v)?;
            (v, Shape::new(blocks, &v)?)
        } else {
            (v, shape)
        };
        let mut triangle = Triangle::<T, N>::new();
        // The points do not determine the length of v, and it is not needed.
        triangle.push(v);
        let (mut weight, mut cost) = (T::ZERO, T::ZERO);
        each(blocks, |block, lane| {
            let point = Point::new(block, lane, &v);
            let (row, q) = point.row(&v, weighted);
            // Rows are rotated into a triangle instead of adding up products, because the two extra unknowns are nearly
            // undetermined on an arc.
            triangle.push(row.map(|x| x / q.sqrt()));
            weight += T::one();
            cost += point.residual * point.residual / point.q;
        });
        let mut gains = [[T::ZERO; N]; 3];
        for (gain, along) in gains.iter_mut().zip(shape.derivatives()) {
            *gain = triangle.solve(along)?;
        }
        let Shape { e, c, .. } = shape;
        Some(Self { e, c, v, weighted, gains, weight, cost })
    }

    /// Returns the six unknowns.
    #[cfg(all(test, feature = "zju"))]
    pub(crate) fn numbers(&self) -> [T; N] {
        self.v
    }

    /// Returns the change of (axis, axis, cos α) per error of a point along its gradient, and the gradient by (u, v).
    #[inline]
    pub(crate) fn influence(&self, block: &Block<T>, lane: usize) -> ([T; 3], [T; 2]) {
        // The response is computed again for each point, because the blocks have no room for six numbers more.
        let point = Point::new(block, lane, &self.v);
        let (row, q) = point.row(&self.v, self.weighted);
        let weight = block.weight[lane & 7] / q;
        (self.gains.map(|gain| -dot(&gain, &row) * weight), point.t)
    }
}

/// Visits every point with a weight.
fn each<T: Real>(blocks: &[Block<T>], mut visit: impl FnMut(&Block<T>, usize)) {
    for block in blocks {
        for lane in 0..LANES {
            if block.weight[lane] > T::ZERO {
                visit(block, lane);
            }
        }
    }
}

/// Returns the monomials (x², xy, y², xz, yz, 1).
fn monomials<T: Real>(s: &V3<T>) -> [T; N] {
    [s.x * s.x, s.x * s.y, s.y * s.y, s.x * s.z, s.y * s.z, T::one()]
}

/// Contribution of a point to the equations about `v`.
struct Point<T> {
    e: [T; N],
    /// e·v.
    residual: T,
    /// Jᵀv: derivative of the residual by (u, v).
    t: [T; 2],
    /// |t|².
    q: T,
    /// J t.
    jt: [T; N],
}

impl<T: Real> Point<T> {
    fn new(block: &Block<T>, lane: usize, v: &[T; N]) -> Self {
        let s = block.ray(lane);
        let e = monomials(&s);
        let (one, zero) = (T::one(), T::ZERO);
        // Derivatives ∂x, ∂y, ∂z by (u, v).
        let d = [V3::new(one, zero, zero), V3::new(zero, one, zero), V3::new(zero, zero, one)]
            .map(|axis| block.gradient_at(lane, &axis));
        let two = T::from_f64(2.0);
        let t = [0, 1].map(|k| {
            let (dx, dy, dz) = (d[0][k], d[1][k], d[2][k]);
            v[0] * two * s.x * dx
                + v[1] * (s.x * dy + s.y * dx)
                + v[2] * two * s.y * dy
                + v[3] * (s.x * dz + s.z * dx)
                + v[4] * (s.y * dz + s.z * dy)
        });
        let [dx, dy, dz] = d.map(|d| d[0] * t[0] + d[1] * t[1]);
        let jt = [two * s.x * dx, s.x * dy + s.y * dx, two * s.y * dy, s.x * dz + s.z * dx, s.y * dz + s.z * dy, zero];
        Self { e, residual: dot(&e, v), t, q: (t[0] * t[0] + t[1] * t[1]).max(T::from_f64(1e-20)), jt }
    }

    /// Returns the row of the linearised equations, which `v` satisfies. The second value is the square of the divisor
    /// of the row.
    fn row(&self, v: &[T; N], weighted: bool) -> ([T; N], T) {
        let mut row = self.e;
        let (out, by, q) =
            if weighted { (&self.jt, self.residual / self.q, self.q) } else { (v, self.residual, T::one()) };
        for (x, y) in row.iter_mut().zip(out) {
            *x -= *y * by;
        }
        (row, q)
    }
}

/// Returns the singular vector of the smallest singular value; `None` if it is not unique.
fn tls<T: Real>(blocks: &[Block<T>]) -> Option<[T; N]> {
    let mut triangle = Triangle::<T, N>::new();
    each(blocks, |block, lane| triangle.push(monomials(&block.ray(lane))));
    let (values, [v, ..]) = triangle.singular_values();
    let floor = values[N - 1] * T::EPSILON * T::from_f64(16.0);
    (values[1] > floor && values[1].is_finite()).then_some(v)
}

fn wtls<T: Real>(blocks: &[Block<T>], mut v: [T; N]) -> Option<[T; N]> {
    for _ in 0..ITERATIONS {
        // The additional column holds the right-hand side.
        let mut triangle = Triangle::<T, { N + 1 }>::new();
        let push = |triangle: &mut Triangle<T, { N + 1 }>, row: [T; N], last: T, per: T| {
            let [a, b, c, d, e, f] = row.map(|x| x * per);
            triangle.push([a, b, c, d, e, f, last * per]);
        };
        push(&mut triangle, v, T::ZERO, T::one());
        each(blocks, |block, lane| {
            let point = Point::new(block, lane, &v);
            let (row, q) = point.row(&v, true);
            push(&mut triangle, row, point.residual, T::one() / q.sqrt());
        });
        let step = triangle.solve_with_unit_last()?;
        let mut size = T::ZERO;
        for (x, d) in v.iter_mut().zip(step) {
            *x += d;
            size += d * d;
        }
        // A step of half the length of `v` or more leads to another cone, or to none.
        if !(size < T::from_f64(0.25)) {
            return None;
        }
        let per = T::one() / dot(&v, &v).sqrt();
        v = v.map(|x| x * per);
        // After a step this small the weights hardly change, and a further step would be lost in rounding.
        if size < T::EPSILON * T::from_f64(1e-3) {
            break;
        }
    }
    Some(v)
}

/// Axis and half-angles of the matrix of a cone.
struct Shape<T> {
    e: V3<T>,
    c: T,
    /// Eigenvalue of the axis, then the two other eigenvalues; `others` are the eigenvectors of these two.
    values: [T; 3],
    others: [V3<T>; 2],
}

impl<T: Real> Shape<T> {
    /// Finds the eigenvector of the eigenvalue with the distinct sign, and turns it towards the points. The result is
    /// `None` if there is no distinct sign.
    fn new(blocks: &[Block<T>], v: &[T; N]) -> Option<Self> {
        let half = T::from_f64(0.5);
        let m = [
            [v[0] + v[5], v[1] * half, v[3] * half],
            [v[1] * half, v[2] + v[5], v[4] * half],
            [v[3] * half, v[4] * half, v[5]],
        ];
        let (values, vectors) = symmetric_eigen(m);
        let [a, b, c] = values;
        let [p, q, r] = vectors.map(V3::from);
        let zero = T::ZERO;
        let (values, e, others) = if a < zero && b < zero && c > zero {
            ([c, a, b], r, [p, q])
        } else if a < zero && b > zero && c > zero {
            ([a, b, c], p, [q, r])
        } else {
            return None;
        };
        let mut towards = zero;
        each(blocks, |block, lane| towards += block.ray(lane).dot(&e));
        let e = if towards < zero { -e } else { e };
        let cot2 = (values[1] + values[2]) / (values[0] * T::from_f64(-2.0));
        let c = (cot2 / (T::one() + cot2)).sqrt();
        (c < T::one()).then_some(Self { e, c, values, others })
    }

    /// Returns the derivatives by v of the axis along `basis(e)`, and of cos α.
    fn derivatives(&self) -> [[T; N]; 3] {
        let [axis, first, second] = self.values;
        let (b1, b2) = basis(&self.e);
        let mut out = [[T::ZERO; N]; 3];
        // ∂e = Σ u (uᵀ ∂M e)/(λ − λ_u) over the two other eigenvectors.
        for (u, value) in self.others.iter().zip([first, second]) {
            let by = form(u, &self.e);
            let per = T::one() / (axis - value);
            for k in 0..N {
                out[0][k] += u.dot(&b1) * per * by[k];
                out[1][k] += u.dot(&b2) * per * by[k];
            }
        }
        // cot² = −(λ₁ + λ₂)/(2 λ), ∂λ = uᵀ ∂M u, ∂c/∂cot² = 1/(2 c (1 + cot²)²).
        let cot2 = (first + second) / (axis * T::from_f64(-2.0));
        let outer = T::one() / (T::from_f64(2.0) * self.c * (T::one() + cot2) * (T::one() + cot2));
        let (own, p, q) =
            (form(&self.e, &self.e), form(&self.others[0], &self.others[0]), form(&self.others[1], &self.others[1]));
        for k in 0..N {
            out[2][k] = -outer * ((p[k] + q[k]) * T::from_f64(0.5) + cot2 * own[k]) / axis;
        }
        out
    }
}

/// Returns xᵀ M y as coefficients of the six unknowns.
fn form<T: Real>(x: &V3<T>, y: &V3<T>) -> [T; N] {
    let half = T::from_f64(0.5);
    [
        x.x * y.x,
        (x.x * y.y + x.y * y.x) * half,
        x.y * y.y,
        (x.x * y.z + x.z * y.x) * half,
        (x.y * y.z + x.z * y.y) * half,
        x.dot(y),
    ]
}
