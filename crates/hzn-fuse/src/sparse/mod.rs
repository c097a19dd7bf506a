//! Sparse least squares with covariances, for the whole flight at once.
//!
//! The unknowns come in blocks: a block of nine for the state at a time, and so on. Each error depends on a few blocks,
//! so the normal equations A δ = −b are sparse. faer orders the blocks (approximate minimum degree) and factors A = L
//! Lᵀ; the covariance A⁻¹ is computed where L has numbers, which is everywhere that an error joins two blocks.

mod factor;
mod marginals;
mod normal;
mod pattern;

pub use factor::Factor;
pub use marginals::Marginals;
pub use normal::{Linear, Normal};
pub use pattern::Pattern;
