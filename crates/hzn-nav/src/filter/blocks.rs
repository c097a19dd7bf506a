//! Parts of vectors and matrices at places that are only known at run time. A place outside does nothing, so that no
//! panic is linked; the layout has no such place.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Returns three components of a vector.
pub(super) fn three<const N: usize>(vector: &SVector<f64, N>, first: usize) -> Vector3<f64> {
    Vector3::from_fn(|i, _| vector.get(first + i).copied().unwrap_or(0.0))
}

/// Replaces three components of a vector.
pub(super) fn put_three<const N: usize>(vector: &mut SVector<f64, N>, first: usize, value: &Vector3<f64>) {
    for (i, value) in value.iter().enumerate() {
        if let Some(x) = vector.get_mut(first + i) {
            *x = *value;
        }
    }
}

/// Replaces one number of a matrix.
pub(super) fn set<const R: usize, const C: usize>(matrix: &mut SMatrix<f64, R, C>, at: (usize, usize), value: f64) {
    if let Some(x) = matrix.get_mut(at) {
        *x = value;
    }
}

/// Replaces a block of a matrix.
pub(super) fn put<const R: usize, const C: usize, const BR: usize, const BC: usize>(
    matrix: &mut SMatrix<f64, R, C>,
    (row, column): (usize, usize),
    block: &SMatrix<f64, BR, BC>,
) {
    for (j, numbers) in block.column_iter().enumerate() {
        for (i, number) in numbers.iter().enumerate() {
            set(matrix, (row + i, column + j), *number);
        }
    }
}

/// Returns three rows of a matrix.
pub(super) fn three_rows<const R: usize, const C: usize>(
    matrix: &SMatrix<f64, R, C>,
    first: usize,
) -> SMatrix<f64, 3, C> {
    SMatrix::from_fn(|i, j| matrix.get((first + i, j)).copied().unwrap_or(0.0))
}

/// Returns three columns of a matrix.
pub(super) fn three_columns<const R: usize, const C: usize>(
    matrix: &SMatrix<f64, R, C>,
    first: usize,
) -> SMatrix<f64, R, 3> {
    SMatrix::from_fn(|i, j| matrix.get((i, first + j)).copied().unwrap_or(0.0))
}

/// Multiplies a row by a factor.
pub(super) fn scale_row<const R: usize, const C: usize>(matrix: &mut SMatrix<f64, R, C>, row: usize, factor: f64) {
    for j in 0..C {
        if let Some(x) = matrix.get_mut((row, j)) {
            *x *= factor;
        }
    }
}

/// Multiplies a column by a factor.
pub(super) fn scale_column<const R: usize, const C: usize>(
    matrix: &mut SMatrix<f64, R, C>,
    column: usize,
    factor: f64,
) {
    for i in 0..R {
        if let Some(x) = matrix.get_mut((i, column)) {
            *x *= factor;
        }
    }
}

/// Returns the symmetric root of a positive definite matrix, or its inverse with −1. `None` if an eigenvalue is not
/// positive.
pub(super) fn root(matrix: &Matrix3<f64>, sign: i32) -> Option<Matrix3<f64>> {
    let (values, vectors) = eigen(matrix);
    let mut roots = Vector3::zeros();
    for (root, value) in roots.iter_mut().zip(&values) {
        if !(*value > 0.0) {
            return None;
        }
        *root = if sign < 0 { 1.0 / libm::sqrt(*value) } else { libm::sqrt(*value) };
    }
    Some(vectors * Matrix3::from_diagonal(&roots) * vectors.transpose())
}

/// Returns eigenvalues and eigenvectors (columns) of a symmetric matrix, by Jacobi's rotations.
fn eigen(matrix: &Matrix3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    let (mut a, mut v) = (*matrix, Matrix3::identity());
    // Five sweeps are enough for doubles; the convergence is quadratic.
    for _ in 0..6 {
        rotate::<0, 1>(&mut a, &mut v);
        rotate::<0, 2>(&mut a, &mut v);
        rotate::<1, 2>(&mut a, &mut v);
    }
    (a.diagonal(), v)
}

/// Makes the component (P, Q) of a symmetric matrix zero.
fn rotate<const P: usize, const Q: usize>(a: &mut Matrix3<f64>, v: &mut Matrix3<f64>) {
    let off = a[(P, Q)];
    if off == 0.0 {
        return;
    }
    let theta = (a[(Q, Q)] - a[(P, P)]) / (2.0 * off);
    let t = libm::copysign(1.0, theta) / (libm::fabs(theta) + libm::sqrt(theta * theta + 1.0));
    let c = 1.0 / libm::sqrt(t * t + 1.0);
    let s = t * c;
    let mut j = Matrix3::identity();
    (j[(P, P)], j[(Q, Q)], j[(P, Q)], j[(Q, P)]) = (c, c, s, -s);
    *a = j.transpose() * *a * j;
    // The rotation leaves this number at the size of rounding errors.
    (a[(P, Q)], a[(Q, P)]) = (0.0, 0.0);
    *v *= j;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_of_covariances_of_any_size() {
        let turn = nalgebra::UnitQuaternion::from_euler_angles(0.3, -1.2, 2.0).to_rotation_matrix().into_inner();
        for sizes in [[1.0, 1.0, 1.0], [1e-6, 3e-7, 1e-14], [4.0, 1e-3, 2.0], [1e-14, 1e-14, 1.0]] {
            let matrix = turn * Matrix3::from_diagonal(&Vector3::from(sizes)) * turn.transpose();
            let whole = root(&matrix, 1).unwrap();
            assert!((whole * whole - matrix).norm() < 1e-14 * matrix.norm(), "{sizes:?}");
            assert!((whole * root(&matrix, -1).unwrap() - Matrix3::identity()).norm() < 1e-5, "{sizes:?}");
            assert_eq!(root(&(matrix - Matrix3::identity() * 10.0), 1), None);
        }
    }

    #[test]
    fn places_outside_do_nothing() {
        let mut matrix = SMatrix::<f64, 4, 4>::zeros();
        put(&mut matrix, (3, 3), &Matrix3::identity());
        assert_eq!((matrix[(3, 3)], matrix.sum()), (1.0, 1.0));
        scale_row(&mut matrix, 9, 2.0);
        assert_eq!(three(&SVector::<f64, 4>::repeat(1.0), 3), Vector3::new(1.0, 0.0, 0.0));
    }
}
