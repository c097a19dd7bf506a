//! Types that the stages and the pipeline share: the body, its limb, errors, the answer.

pub mod body;
mod border;
pub mod edge_noise;
pub mod error_budget;
pub mod evidence;
pub(crate) mod found_limb;
pub mod observer;
mod protection;
pub mod report;
pub mod status;
pub(crate) mod threshold;
pub mod tone;
pub mod verdict;
pub mod work;
