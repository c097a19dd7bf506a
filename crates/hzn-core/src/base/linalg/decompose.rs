//! Decompositions of small matrices by rotations: Jacobi's for a symmetric matrix, Givens' row by row for a tall one.

use crate::base::real::Real;

/// Maximum number of sweeps over all pairs. Convergence is quadratic: six are enough for 6×6 in double precision.
// The limit is there because a matrix with NaN never converges, and the function must end.
const SWEEPS: usize = 16;

/// Returns the eigenvalues of a symmetric N×N matrix, smallest first, and the unit eigenvectors as rows in the same
/// order.
///
/// The method is cyclic Jacobi rotations (Golub & Van Loan, Matrix Computations, 8.5). The function is total: a matrix
/// that is not finite gives values that are not finite, in a bounded time.
pub(crate) fn symmetric_eigen<T: Real, const N: usize>(mut m: [[T; N]; N]) -> ([T; N], [[T; N]; N]) {
    let mut vectors = identity();
    for _ in 0..SWEEPS {
        let mut off = T::ZERO;
        let mut all = T::ZERO;
        for (i, row) in m.iter().enumerate() {
            for (j, x) in row.iter().enumerate() {
                all += *x * *x;
                off += if i == j { T::ZERO } else { *x * *x };
            }
        }
        // The negated comparison also ends the loop for NaN; `off <= limit` would run all sweeps.
        if !(off > all * T::EPSILON * T::EPSILON * T::from_f64(0.01)) {
            break;
        }
        for p in 0..N {
            for q in p + 1..N {
                // This rotation makes m[p][q] zero.
                let Some((c, s)) = rotation(m[p][p], m[q][q], m[p][q]) else { continue };
                for row in &mut m {
                    (row[p], row[q]) = rotate_pair(row[p], row[q], c, s);
                }
                for j in 0..N {
                    (m[p][j], m[q][j]) = rotate_pair(m[p][j], m[q][j], c, s);
                    (vectors[p][j], vectors[q][j]) = rotate_pair(vectors[p][j], vectors[q][j], c, s);
                }
            }
        }
    }
    let mut values = [T::ZERO; N];
    for i in 0..N {
        values[i] = m[i][i];
    }
    sort(&mut values, &mut vectors);
    (values, vectors)
}

/// The triangle R of the QR decomposition of a tall matrix A that arrives row by row: RᵀR = AᵀA. The product AᵀA is
/// never computed, so single precision is enough.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Triangle<T, const N: usize>([[T; N]; N]);

impl<T: Real, const N: usize> Triangle<T, N> {
    /// Creates the triangle of a matrix without rows.
    pub(crate) fn new() -> Self {
        Self([[T::ZERO; N]; N])
    }

    /// Adds a row by Givens rotations.
    pub(crate) fn push(&mut self, mut row: [T; N]) {
        for i in 0..N {
            let (a, b) = (self.0[i][i], row[i]);
            let h2 = a * a + b * b;
            // Squares of small numbers can be 0 in single precision; the rotation would then divide by 0.
            if b == T::ZERO || !(h2 > T::ZERO) {
                continue;
            }
            // One division serves both factors, because a division takes many times as long as a product.
            let per = T::one() / h2.sqrt();
            let (c, s) = (a * per, b * per);
            for j in i..N {
                let (x, y) = (self.0[i][j], row[j]);
                self.0[i][j] = c * x + s * y;
                row[j] = c * y - s * x;
            }
        }
    }

    /// Returns the rows of R.
    pub(crate) fn rows(&self) -> &[[T; N]; N] {
        &self.0
    }

    /// Returns the singular values of the rows so far, smallest first, and the right singular vectors as rows in the
    /// same order. Rotations make the columns of R orthogonal to each other (one-sided Jacobi, Hestenes 1958), which
    /// keeps small values exact.
    pub(crate) fn singular_values(&self) -> ([T; N], [[T; N]; N]) {
        // The columns of R are the rows of `u`.
        let mut u = [[T::ZERO; N]; N];
        for i in 0..N {
            for j in 0..N {
                u[j][i] = self.0[i][j];
            }
        }
        let mut v = identity();
        for _ in 0..SWEEPS {
            let mut moved = false;
            for p in 0..N {
                for q in p + 1..N {
                    let (a, b, d) = (dot(&u[p], &u[p]), dot(&u[q], &u[q]), dot(&u[p], &u[q]));
                    // The angle of two columns is compared with rounding, not with a fixed number, because the columns
                    // may have any length.
                    if !(d * d > a * b * T::EPSILON * T::EPSILON) {
                        continue;
                    }
                    let Some((c, s)) = rotation(a, b, d) else { continue };
                    moved = true;
                    for j in 0..N {
                        (u[p][j], u[q][j]) = rotate_pair(u[p][j], u[q][j], c, s);
                        (v[p][j], v[q][j]) = rotate_pair(v[p][j], v[q][j], c, s);
                    }
                }
            }
            if !moved {
                break;
            }
        }
        let mut values = u.map(|column| dot(&column, &column).sqrt());
        sort(&mut values, &mut v);
        (values, v)
    }

    /// Returns the x with last component 1 that minimises the sum of (row · x)² over the rows. `None` when the rows do
    /// not determine x in this precision.
    pub(crate) fn solve_with_unit_last(&self) -> Option<[T; N]> {
        let floor = self.floor(N.saturating_sub(1))?;
        let mut x = [T::ZERO; N];
        if let Some(last) = x.last_mut() {
            *last = T::one();
        }
        for i in (0..N.saturating_sub(1)).rev() {
            if !(self.0[i][i].abs() > floor) {
                return None;
            }
            let sum = dot(&self.0[i], &x);
            x[i] = -sum / self.0[i][i];
        }
        Some(x)
    }

    /// Returns the limit that the first `n` elements of the diagonal must exceed. `None` when there were no rows, or
    /// when a row is not finite.
    // The limit is relative to the largest element, because rows may have any unit. With N rounding errors a diagonal
    // element below it has no correct digit.
    fn floor(&self, n: usize) -> Option<T> {
        let largest = (0..n.min(N)).fold(T::ZERO, |l, i| l.max(self.0[i][i].abs()));
        (largest > T::ZERO && largest.is_finite()).then(|| largest * T::EPSILON * T::from_f64(N as f64))
    }

    /// Returns x with RᵀR x = b; `None` when the rows do not determine x in this precision.
    pub(crate) fn solve(&self, b: [T; N]) -> Option<[T; N]> {
        let floor = self.floor(N)?;
        if (0..N).any(|i| !(self.0[i][i].abs() > floor)) {
            return None;
        }
        let mut x = b;
        for i in 0..N {
            for j in 0..i {
                x[i] -= self.0[j][i] * x[j];
            }
            x[i] /= self.0[i][i];
        }
        for i in (0..N).rev() {
            for j in i + 1..N {
                x[i] -= self.0[i][j] * x[j];
            }
            x[i] /= self.0[i][i];
        }
        Some(x)
    }
}

/// Returns the cosine and sine of the rotation that makes [[a, d], [d, b]] diagonal; `None` when it is diagonal
/// already.
fn rotation<T: Real>(a: T, b: T, d: T) -> Option<(T, T)> {
    if d == T::ZERO {
        return None;
    }
    let one = T::one();
    // This form gives the smaller of the two angles, because the sweeps are proven to converge for it (Golub & Van
    // Loan, 8.5). The larger one would exchange the two values.
    let tau = (b - a) / (d + d);
    let t = one / (tau.abs() + (one + tau * tau).sqrt());
    let t = if tau < T::ZERO { -t } else { t };
    let c = one / (one + t * t).sqrt();
    // For a tiny `d` the square of `tau` is infinite, and `t` is 0: the rotation does nothing, which is right.
    (t.is_finite() && c.is_finite()).then_some((c, t * c))
}

#[inline(always)]
fn rotate_pair<T: Real>(x: T, y: T, c: T, s: T) -> (T, T) {
    (c * x - s * y, s * x + c * y)
}

/// Returns the dot product of two vectors.
pub(crate) fn dot<T: Real, const N: usize>(a: &[T; N], b: &[T; N]) -> T {
    a.iter().zip(b).fold(T::ZERO, |sum, (x, y)| sum + *x * *y)
}

fn identity<T: Real, const N: usize>() -> [[T; N]; N] {
    let mut m = [[T::ZERO; N]; N];
    for (i, row) in m.iter_mut().enumerate() {
        row[i] = T::one();
    }
    m
}

/// Sorts the values, smallest first, and the vectors with them, by insertion.
// An insertion sort is enough because N is at most 6.
fn sort<T: Real, const N: usize>(values: &mut [T; N], vectors: &mut [[T; N]; N]) {
    for end in 1..N {
        for i in (1..=end).rev() {
            let (Ok([before, value]), Ok(vectors)) =
                (values.get_disjoint_mut([i - 1, i]), vectors.get_disjoint_mut([i - 1, i]))
            else {
                return;
            };
            if !(*value < *before) {
                break;
            }
            core::mem::swap(before, value);
            let [before, vector] = vectors;
            core::mem::swap(before, vector);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn matrix() -> impl Strategy<Value = [[f64; 6]; 6]> {
        proptest::array::uniform6(proptest::array::uniform6(-3.0..3.0f64)).prop_map(|m| {
            let mut s = m;
            for i in 0..6 {
                for j in 0..6 {
                    s[i][j] = m[i][j] + m[j][i];
                }
            }
            s
        })
    }

    proptest! {
        #[test]
        fn eigenvectors_are_orthonormal_and_belong_to_their_values(m in matrix()) {
            let (values, vectors) = symmetric_eigen(m);
            for k in 0..6 {
                prop_assert!(k == 0 || values[k - 1] <= values[k]);
                for l in 0..6 {
                    let product = dot(&vectors[k], &vectors[l]);
                    prop_assert!((product - f64::from(u8::from(k == l))).abs() < 1e-13);
                    prop_assert!((dot(&m[l], &vectors[k]) - values[k] * vectors[k][l]).abs() < 1e-12);
                }
            }
        }

        #[test]
        fn singular_values_are_the_roots_of_the_eigenvalues(
            rows in proptest::collection::vec(proptest::array::uniform6(-3.0..3.0f64), 6..40),
        ) {
            let mut triangle = Triangle::new();
            let mut square = [[0.0; 6]; 6];
            for row in &rows {
                triangle.push(*row);
                for i in 0..6 {
                    for j in 0..6 {
                        square[i][j] += row[i] * row[j];
                    }
                }
            }
            let (values, vectors) = triangle.singular_values();
            let (squares, _) = symmetric_eigen(square);
            for k in 0..6 {
                prop_assert!((values[k] * values[k] - squares[k]).abs() < 1e-11 * squares[5]);
                for l in 0..6 {
                    let off = dot(&square[l], &vectors[k]) - values[k] * values[k] * vectors[k][l];
                    prop_assert!(off.abs() < 1e-11 * squares[5]);
                }
            }
            prop_assume!(values[0] > 1e-3);
            let b = [1.0, -2.0, 0.5, 3.0, 0.0, 1.0];
            let x = triangle.solve(b).unwrap();
            for l in 0..6 {
                prop_assert!((dot(&square[l], &x) - b[l]).abs() < 1e-5);
            }
        }

        #[test]
        fn garbage_comes_to_an_end(m in proptest::array::uniform3(proptest::array::uniform3(any::<f32>()))) {
            let _ = symmetric_eigen(m);
            let mut triangle = Triangle::new();
            for row in m {
                triangle.push(row);
            }
            let _ = triangle.singular_values();
            if let Some(x) = triangle.solve([1.0; 3]) {
                let odd = |x: f32| !x.is_finite() || x.abs() > 1e15 || x.abs() < 1e-15;
                prop_assert!(!x[0].is_nan() || m.iter().flatten().any(|x| odd(*x)));
            }
        }
    }

    #[test]
    fn small_singular_values_survive_single_precision() {
        // The columns are nearly dependent: after squaring, nothing of 1e-5 would be left next to 1 in f32.
        let mut triangle = Triangle::<f32, 2>::new();
        for i in 0..100 {
            let x = (i as f32 * 0.37).sin();
            triangle.push([x, x + 1e-5 * (i as f32 * 1.7).cos()]);
        }
        let ([small, _], [v, _]) = triangle.singular_values();
        // The expected value is |noise| / √2, where |noise| is the root of the sum of a hundred points of 1/2.
        assert!((small / (1e-5 * 7.07 / 1.414) - 1.0).abs() < 0.1, "{small}");
        assert!((v[0] + v[1]).abs() < 1e-4);
        assert!(Triangle::<f32, 2>::new().solve([1.0, 1.0]).is_none());
    }
}
