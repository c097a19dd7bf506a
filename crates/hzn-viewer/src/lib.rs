//! The viewer: see what the sensor saw, and tune it live.
//!
//! [`model`] is what is known and done, without a window; [`work`] happens on threads of its own; [`ui`] draws.

pub mod args;
pub mod measure;
pub mod model;
pub mod run;
pub mod ui;
pub mod work;
