//! Parts of vectors and matrices at places that are only known at run time. A place outside does nothing, so that no
//! panic is linked; the layout has no such place.

use nalgebra::{SMatrix, SVector, Vector3};

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

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;

    #[test]
    fn places_outside_do_nothing() {
        let mut matrix = SMatrix::<f64, 4, 4>::zeros();
        put(&mut matrix, (3, 3), &Matrix3::identity());
        assert_eq!((matrix[(3, 3)], matrix.sum()), (1.0, 1.0));
        scale_row(&mut matrix, 9, 2.0);
        assert_eq!(three(&SVector::<f64, 4>::repeat(1.0), 3), Vector3::new(1.0, 0.0, 0.0));
    }
}
