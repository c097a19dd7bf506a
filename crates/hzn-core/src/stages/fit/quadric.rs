//! The limb as an elliptic cone, by total least squares (Wang et al. 2022, 2.4): no size, no altitude, no sphere.
//!
//! A limb ray satisfies sᵀ M s = 0, M symmetric with one eigenvalue of the distinct sign, that of the axis (Wang 7 and
//! 22). With e = (x², xy, y², xz, yz, 1), where 1 stands for x² + y² + z², this is e·v = 0:
//! M₁₁ = v₁ + v₆, M₂₂ = v₃ + v₆, M₃₃ = v₆, M₁₂ = v₂/2, M₁₃ = v₄/2, M₂₃ = v₅/2.
//!
//! * `tls` (10-17): the v of length 1 with the least Σ (e·v)², which is the right singular vector of the smallest
//!   singular value. Wang et al. divide by v₆ to have five unknowns, which fails for M₃₃ → 0, a limb through the image
//!   centre; the vector itself is their solution wherever they have one.
//! * `wtls` (18-21): every point's error weighed by what a pixel is to it, that is the least Σ (e·v)²/q with
//!   q = |∂(e·v)/∂(u, v)|². Their cofactor matrix has (5n)² elements; the points are independent, so that it falls
//!   apart into one block a point, and each iteration is one pass: least squares of the rows e − δ with
//!   δ = J t (e·v)/q, t = Jᵀv, J = ∂e/∂(u, v), weighed by 1/q. Printed (18) has x z = sin²θ cos²θ u/ρ; it is
//!   sin θ cos θ u/ρ, as here, where e is made of the unit ray itself.

use crate::base::linalg::{Triangle, V3, basis, dot, symmetric_eigen};
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};

/// Unknowns: the cone's matrix up to its scale.
const N: usize = 6;
/// Most iterations of the weights.
const ITERATIONS: usize = 12;

/// A fitted elliptic cone and how it answers to the points' errors.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Quadric<T> {
    /// Unit axis, towards the body.
    pub(crate) e: V3<T>,
    /// cos of the half-angle whose cot² is the mean of the two.
    pub(super) c: T,
    /// The six numbers, of length 1.
    v: [T; N],
    /// Weighed by the pixels' errors.
    weighted: bool,
    /// What a unit of each of the six normal equations moves: the axis along the two vectors of `basis(e)`, and `c`.
    gains: [[T; N]; 3],
    /// Points, and sum of their squared distances in pixels.
    pub(super) weight: T,
    pub(super) cost: T,
}

impl<T: Real> Quadric<T> {
    /// The cone through the points with a weight; weighted total least squares when the axis lies further than
    /// `weigh_above_rad` off the optical axis. `None` when the points do not determine a cone about one axis.
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
        // The length of v is not determined by the points, and need not be.
        triangle.push(v);
        let (mut weight, mut cost) = (T::ZERO, T::ZERO);
        each(blocks, |block, lane| {
            let point = Point::new(block, lane, &v);
            let (row, q) = point.row(&v, weighted);
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

    /// The six numbers.
    #[cfg(test)]
    pub(crate) fn numbers(&self) -> [T; N] {
        self.v
    }

    /// How far an error of a point along its gradient moves (axis, axis, cos α), and the gradient by (u, v).
    #[inline]
    pub(crate) fn influence(&self, block: &Block<T>, lane: usize) -> ([T; 3], [T; 2]) {
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

/// (x², xy, y², xz, yz, 1).
fn monomials<T: Real>(s: &V3<T>) -> [T; N] {
    [s.x * s.x, s.x * s.y, s.y * s.y, s.x * s.z, s.y * s.z, T::one()]
}

/// A point's part in the equations about `v`.
struct Point<T> {
    e: [T; N],
    /// e·v.
    residual: T,
    /// Jᵀv: its derivative by (u, v).
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
        // ∂x, ∂y, ∂z by (u, v).
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

    /// The row of the linearised equations, which `v` satisfies, and the square by whose root it is divided.
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

/// The smallest singular vector; `None` when it is not the only one.
fn tls<T: Real>(blocks: &[Block<T>]) -> Option<[T; N]> {
    let mut triangle = Triangle::<T, N>::new();
    each(blocks, |block, lane| triangle.push(monomials(&block.ray(lane))));
    let (values, [v, ..]) = triangle.singular();
    let floor = values[N - 1] * T::EPSILON * T::from_f64(16.0);
    (values[1] > floor && values[1].is_finite()).then_some(v)
}

fn wtls<T: Real>(blocks: &[Block<T>], mut v: [T; N]) -> Option<[T; N]> {
    for _ in 0..ITERATIONS {
        // A column more for the right-hand side.
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
        let step = triangle.kernel()?;
        let mut size = T::ZERO;
        for (x, d) in v.iter_mut().zip(step) {
            *x += d;
            size += d * d;
        }
        // Half a turn of the six numbers is another cone, or none.
        if !(size < T::from_f64(0.25)) {
            return None;
        }
        let per = T::one() / dot(&v, &v).sqrt();
        v = v.map(|x| x * per);
        // The weights hardly change with a step this small: the next would be lost in rounding.
        if size < T::EPSILON * T::from_f64(1e-3) {
            break;
        }
    }
    Some(v)
}

/// Axis and half-angles of a cone's matrix.
struct Shape<T> {
    e: V3<T>,
    c: T,
    /// Eigenvalue of the axis, the two others, and their eigenvectors.
    values: [T; 3],
    others: [V3<T>; 2],
}

impl<T: Real> Shape<T> {
    /// The eigenvector of the eigenvalue with the distinct sign, towards the points; `None` when there is no such one.
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

    /// Derivatives by v of the axis along `basis(e)` and of cos α.
    fn derivatives(&self) -> [[T; N]; 3] {
        let [axis, first, second] = self.values;
        let (b1, b2) = basis(&self.e);
        let mut out = [[T::ZERO; N]; 3];
        // ∂e = Σ u (uᵀ ∂M e)/(λ − λ_u) over the two others.
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

/// xᵀ M y as a sum over the six numbers.
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
