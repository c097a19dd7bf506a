//! The covariance A⁻¹ where L has numbers: selected inversion (Takahashi, Fagan & Chen 1973).
//!
//! From L Lᵀ Z = 1 follows, for a column j of L with the rows R below the diagonal,
//!
//! Z_ij = −Σ_{k∈R} Z_ik L_kj / L_jj for i ∈ R,   Z_jj = 1/L_jj² − Σ_{k∈R} Z_jk L_kj / L_jj,
//!
//! from the last column to the first one. Every Z_ik that is needed is at a place where L has a number.

use nalgebra::DMatrix;

use super::Places;
use super::factor::Factor;
use super::pattern::Pattern;

/// The covariance of blocks that an error joins.
#[derive(Debug, Clone)]
pub struct Marginals<'a> {
    pattern: &'a Pattern,
    column_starts: Vec<usize>,
    row_indices: Vec<usize>,
    values: Vec<f64>,
}

impl<'a> Marginals<'a> {
    /// Computes the covariance from the factor.
    pub fn new(pattern: &'a Pattern, factor: &Factor<'_>) -> Self {
        let Places { column_starts: starts, row_indices: rows } = factor.places();
        let mut values = vec![0.0; rows.len()];
        // For each row the share L_ij / L_jj of the column at hand, and the sum that becomes −Z_ij.
        let (mut share, mut sum) = (vec![0.0; pattern.len()], vec![0.0; pattern.len()]);
        let mut column_of = vec![usize::MAX; pattern.len()];
        for j in (0..pattern.len()).rev() {
            let (first, end) = (starts[j], starts[j + 1]);
            let below = &rows[first + 1..end];
            let diagonal = factor.values[first];
            for (place, i) in below.iter().enumerate() {
                share[*i] = factor.values[first + 1 + place] / diagonal;
                (sum[*i], column_of[*i]) = (0.0, j);
            }
            for &k in below {
                let mut own = values[starts[k]] * share[k];
                for place in starts[k] + 1..starts[k + 1] {
                    let i = rows[place];
                    if column_of[i] == j {
                        sum[i] += values[place] * share[k];
                        own += values[place] * share[i];
                    }
                }
                sum[k] += own;
            }
            let mut variance = 1.0 / (diagonal * diagonal);
            for (place, i) in below.iter().enumerate() {
                values[first + 1 + place] = -sum[*i];
                variance += sum[*i] * share[*i];
            }
            values[first] = variance;
        }
        Self { pattern, column_starts: starts.to_vec(), row_indices: rows.to_vec(), values }
    }

    /// Returns the covariance of two blocks; `None` if no error joins them.
    pub fn block(&self, a: usize, b: usize) -> Option<DMatrix<f64>> {
        let mut out = DMatrix::zeros(self.pattern.size(a), self.pattern.size(b));
        for i in 0..out.nrows() {
            for j in 0..out.ncols() {
                out[(i, j)] = self.at(self.pattern.start(a) + i, self.pattern.start(b) + j)?;
            }
        }
        Some(out)
    }

    fn at(&self, i: usize, j: usize) -> Option<f64> {
        let (row, column) = (i.max(j), i.min(j));
        let (first, end) = (*self.column_starts.get(column)?, *self.column_starts.get(column + 1)?);
        let found = self.row_indices.get(first..end)?.binary_search(&row).ok()?;
        self.values.get(first + found).copied()
    }
}
