//! What the stages and the whole talk about: the body, its limb, errors, the answer.

pub mod body;
pub mod edge_noise;
pub mod error_budget;
pub mod observer;
pub mod report;
pub mod status;
pub(crate) mod threshold;
pub mod verdict;
pub mod work;
