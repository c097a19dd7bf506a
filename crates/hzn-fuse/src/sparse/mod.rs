//! Sparse least squares with covariances, for the whole flight at once.
//!
//! The unknowns come in blocks: a block of nine for the state at a time, and so on. Each error depends on a few blocks,
//! so the normal equations A δ = −b are sparse. faer orders the blocks (approximate minimum degree) and factors A = L
//! Lᵀ; the covariance A⁻¹ is computed where L has numbers, which is everywhere that an error joins two blocks.

#[cfg_attr(not(feature = "solve"), path = "absent.rs")]
mod cholesky;
mod factor;
mod marginals;
mod normal;
mod pattern;

pub use factor::Factor;
pub use marginals::Marginals;
pub use normal::{Linear, Normal};
pub use pattern::Pattern;

/// Where a sparse matrix has numbers: by columns, with the rows of each in order.
#[derive(Debug, Clone, Copy)]
struct Places<'a> {
    /// For each column the first of its row indices, and at the end their number.
    column_starts: &'a [usize],
    row_indices: &'a [usize],
}
