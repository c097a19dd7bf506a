//! Sum over all pairs of points whose errors are correlated along the edge.

use nalgebra::{SMatrix, SVector, Vector2};

/// A point's contribution to the normal equations.
pub(super) struct Row<const N: usize> {
    pub(super) q: SVector<f64, N>,
    pub(super) g: Vector2<f64>,
    /// Correlation with the point before; 0 at the first point of a segment.
    pub(super) rho: f64,
}

/// Returns the sum X over all pairs of points, Σ (b bᵀ + b aᵀ + a bᵀ) with b = q gᵀ and a ← ρ (a + b).
pub(super) fn correlated<const N: usize>(rows: &[Row<N>]) -> SMatrix<f64, N, N> {
    let mut x = SMatrix::<f64, N, N>::zeros();
    let (mut a, mut before) = (SMatrix::<f64, N, 2>::zeros(), SMatrix::<f64, N, 2>::zeros());
    for row in rows {
        let b = row.q * row.g.transpose();
        a = (a + before) * row.rho;
        x += b * b.transpose() + b * a.transpose() + a * b.transpose();
        before = b;
    }
    x
}
