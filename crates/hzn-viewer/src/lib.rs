//! The viewer: it shows what the sensor found in each picture, and its parameters can be tuned live.
//!
//! [`model`] holds the state and all decisions, without a window. [`work`] runs on separate threads. [`ui`] draws.

pub mod args;
pub mod measure;
pub mod model;
pub mod run;
pub mod ui;
pub mod work;
