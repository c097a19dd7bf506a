//! Closed forms of the fit of a position (math.md, 13.3): the vector n with σ·n = 1 for every limb ray, n = e/cos α.
//!
//! [`least_squares`] is the method of Christian & Robinson (2016). It takes the errors for errors of the right-hand
//! side, and is biased on short arcs: the disc seems too small and the range too long. [`generalised_tls`] knows that
//! the rays have the errors, and in which directions; it has no bias.

use crate::base::linalg::{M3, Triangle, V3, basis, symmetric_eigen, unit};
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};

/// Axis and 1 − cos of the half-angle.
type AxisAndK<T> = Option<(V3<T>, T)>;

fn weighted<T: Real>(blocks: &[Block<T>]) -> impl Iterator<Item = (&Block<T>, usize)> {
    blocks.iter().flat_map(|block| (0..LANES).filter(|&l| block.weight[l & 7] > T::ZERO).map(move |l| (block, l)))
}

/// Fits n by least squares with equal weights, as (13.8): in a basis along the mean ray ẑ, n = ẑ + B b + β ẑ with
/// xᵀb + z β = |x|²/(1 + z). The rows have unit columns, and the normal matrix is never formed.
pub(crate) fn least_squares<T: Real>(blocks: &[Block<T>]) -> AxisAndK<T> {
    let (b, beta, z, [b1, b2]) = solve_rows(blocks)?;
    // κ = n·n − 1 = tan²α without cancellation.
    let kappa = b[0] * b[0] + b[1] * b[1] + beta + beta + beta * beta;
    let n = z + b1 * b[0] + b2 * b[1] + z * beta;
    axis_of(&n, kappa)
}

/// Solution of (13.8): b and β, and the mean ray ẑ with its tangent basis, to which they belong.
type Rows<T> = ([T; 2], T, V3<T>, [V3<T>; 2]);

/// Solves (13.8).
fn solve_rows<T: Real>(blocks: &[Block<T>]) -> Option<Rows<T>> {
    let mean = weighted(blocks).fold(V3::zeros(), |sum, (block, lane)| sum + block.ray(lane));
    let z = unit(&mean)?;
    let (b1, b2) = basis(&z);
    let row = |block: &Block<T>, lane: usize| {
        let d = block.ray(lane) - z;
        let (x, y) = (d.dot(&b1), d.dot(&b2));
        let along = T::one() - d.dot(&d) * T::from_f64(0.5);
        [x, y, along, (x * x + y * y) / (T::one() + along)]
    };
    // The columns are scaled to unit length and solved by rotations, because the product HᵀH loses the disc of a far
    // body: at 1000 radii, on an arc of 20°, the error would be 2 %.
    let mut squares = [T::ZERO; 4];
    for (block, lane) in weighted(blocks) {
        squares.iter_mut().zip(row(block, lane)).for_each(|(sum, x)| *sum += x * x);
    }
    let scale = squares.map(|sum| T::one() / sum.sqrt());
    if !scale.iter().all(|s| s.is_finite()) {
        return None;
    }
    let mut triangle = Triangle::<T, 4>::new();
    for (block, lane) in weighted(blocks) {
        let mut scaled = row(block, lane);
        scaled.iter_mut().zip(scale).for_each(|(x, s)| *x *= s);
        triangle.push(scaled);
    }
    // The row times [b, β, 1] is 0 if the last column has the other sign.
    let [x, y, w, _] = triangle.solve_with_unit_last()?.map(|x| -x / scale[3]);
    Some(([x * scale[0], y * scale[1]], w * scale[2], z, [b1, b2]))
}

/// Returns axis and 1 − cos α of n with tan²α = `kappa`.
fn axis_of<T: Real>(n: &V3<T>, kappa: T) -> AxisAndK<T> {
    if !(kappa > T::ZERO && kappa.is_finite()) {
        return None;
    }
    // 1 − cos = 1 − 1/√(1 + κ) = κ/(√(1 + κ) (1 + √(1 + κ))).
    let root = (T::one() + kappa).sqrt();
    Some((unit(n)?, kappa / (root * (T::one() + root))))
}

/// Fits the plane through the scaled rays by generalised total least squares, as (13.9): the smallest eigenvalue of
/// S v = λ C v, where S is the scatter of the rays and C the sum of their covariances for errors of one pixel.
pub(crate) fn generalised_tls<T: Real>(blocks: &[Block<T>]) -> AxisAndK<T> {
    let (mut count, mut mean) = (T::ZERO, V3::zeros());
    for (block, lane) in weighted(blocks) {
        count += T::one();
        mean += block.ray(lane);
    }
    let mean = mean / count;
    let z = unit(&mean)?;
    let (b1, b2) = basis(&z);
    // In the basis along the mean ray, the two small directions are kept apart from the large one.
    let to_basis = M3::from_rows(&[b1.transpose(), b2.transpose(), z.transpose()]);
    let (mut s, mut c) = (M3::zeros(), M3::zeros());
    for (block, lane) in weighted(blocks) {
        let d = to_basis * (block.ray(lane) - mean);
        s += d * d.transpose();
        let [x, y, w] = block.ray_with_derivative(lane).jacobian();
        for k in 0..2 {
            let j = to_basis * V3::new(x[k], y[k], w[k]);
            c += j * j.transpose();
        }
    }
    // C is factored and never S, because S is singular for rays without noise.
    let l_inverse = inverse_root(&c)?;
    let m = l_inverse * s * l_inverse.transpose();
    let (_, vectors) = symmetric_eigen([[m.m11, m.m12, m.m13], [m.m12, m.m22, m.m23], [m.m13, m.m23, m.m33]]);
    let v = to_basis.transpose() * (l_inverse.transpose() * V3::from(vectors[0]));
    let v = unit(&v)?;
    let cos = v.dot(&mean);
    let (v, cos) = if cos < T::ZERO { (-v, -cos) } else { (v, cos) };
    // n = v/(v·mean), so that cos α = v·mean, and sin²α = |v − mean|² − (1 − mean·mean) + … keeps small discs exact:
    // 1 − v·mean = |v − mean|²/2 + (1 − mean·mean)/2.
    let d = v - mean;
    let k = (d.dot(&d) + (T::one() - mean.dot(&mean))) * T::from_f64(0.5);
    (k > T::ZERO && cos > T::ZERO).then_some((v, k))
}

/// Returns L⁻¹ of the Cholesky factor C = L Lᵀ.
fn inverse_root<T: Real>(c: &M3<T>) -> Option<M3<T>> {
    let l11 = c.m11.sqrt();
    let (l21, l31) = (c.m12 / l11, c.m13 / l11);
    let l22 = (c.m22 - l21 * l21).sqrt();
    let l32 = (c.m23 - l31 * l21) / l22;
    let l33 = (c.m33 - l31 * l31 - l32 * l32).sqrt();
    let (i11, i22, i33) = (T::one() / l11, T::one() / l22, T::one() / l33);
    let (i21, i32) = (-l21 * i11 * i22, -l32 * i22 * i33);
    let i31 = -(l31 * i11 + l32 * i21) * i33;
    let zero = T::ZERO;
    (i11.is_finite() && i22.is_finite() && i33.is_finite())
        .then(|| M3::new(i11, zero, zero, i21, i22, zero, i31, i32, i33))
}

/// Returns the covariance of the least-squares n per square pixel of white noise, as (13.7), with the weights that the
/// method uses, which are all equal.
#[cfg(any(test, feature = "_edges"))]
pub(crate) fn least_squares_covariance<T: Real>(blocks: &[Block<T>], n: &V3<T>) -> Option<M3<T>> {
    let (mut t, mut noise) = ([T::ZERO; 6], M3::zeros());
    for (block, lane) in weighted(blocks) {
        let s = block.ray(lane);
        let [gu, gv] = block.gradient_at(lane, n);
        let square = s * s.transpose();
        noise += square * (gu * gu + gv * gv);
        let terms = [square.m11, square.m12, square.m13, square.m22, square.m23, square.m33];
        t.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
    }
    let inverse = crate::base::linalg::invert_spd3(&t)?;
    Some(inverse * noise * inverse)
}
