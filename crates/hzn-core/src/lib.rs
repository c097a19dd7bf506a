//! hzn-core
#![no_std]
#![forbid(unsafe_code)]
#[cfg(any(feature = "std", test))]
extern crate std;

// Vocabulary.
mod block;
pub mod body;
pub mod camera;
pub mod ellipsoid;
pub mod error;
pub mod frames;
pub mod image;
mod limb;
mod linalg;
pub mod pixel;
pub mod real;
pub mod region;
mod rng;
pub mod status;
// Stages, in the order of the data's way.
pub mod binarize;
pub mod contour;
pub mod candidates;
mod undistort;
pub mod reject;
pub mod estimate;
pub mod covariance;
pub mod select;
// The whole.
pub mod pipeline;

pub use body::{Expected, Frame};
pub use pipeline::{Config, FlightHorizon, Horizon, HostHorizon, Observer, Report, Solution};
