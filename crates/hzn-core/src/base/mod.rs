//! Numerical tools that do not depend on pictures, the errors, and the macros of the keys.

pub mod error;
#[macro_use]
pub mod keys;
pub(crate) mod linalg;
pub(crate) mod median;
pub(crate) mod packed;
pub(crate) mod parts;
pub mod real;
pub(crate) mod rng;
pub(crate) mod sort;
