//! The horizon sensor's core: from a picture of a limb to the direction of the body, with a covariance for a
//! navigation filter.
//!
//! No heap, fixed memory, no unsafe code; `process` answers any picture with a report. Functions that IEEE 754 does not
//! round correctly come from one library and sums have one order, so that the answer does not depend on the machine. A
//! picture goes one way, one module a stage, and nothing runs back:
//!
//! ```text
//! image → binarize → contour → candidates → undistort → reject → estimate → covariance → select → Report
//! ```
//!
//! | stage | parameters | from | to |
//! |---|---|---|---|
//! | [`binarize`] | [`binarize::Config`], [`binarize::Gate`] | a sparse sample of the picture | the level between dark and lit |
//! | [`contour`] | [`contour::Config`] | pixels at the border, then along the edges | border pixels of one edge after another |
//! | [`candidates`] | [`candidates::Config`] | border pixels | sub-pixel points at the local mid-level |
//! | undistort | [`camera::Config`] | points | unit rays with their derivatives |
//! | [`reject`] | [`reject::Config`] | rays | the cone that most agree on |
//! | [`estimate`] | [`estimate::Config`] | that cone and the rays | the fitted cone, half-angle free, and weights |
//! | [`covariance`] | [`covariance::Config`] | the fit and the noise model | covariance, and the expected half-angle fused |
//! | [`select`] | [`select::Config`] | the answer | a verdict; the best of all candidates |
//!
//! Each module begins with its equations and their source; the project's docs/math.md has them in one place. They are tested
//! beside the code, and against data of other programs (`golden`).
//!
//! [`pipeline`] knows them all. Frames and units: [`frames`] (camera x right, y down, z forward), [`pixel`] (pixel
//! centres at integers); metres, radians and pixels inside, kilometres and degrees in [`Config`].
//!
//! ```
//! use hzn_core::camera::{self, Model};
//! use hzn_core::image::{Grey, Layout};
//! use hzn_core::{Config, FlightHorizon, Frame};
//!
//! let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 64, 48, 60.0));
//! config.body.altitude_km = Some(230.0);
//! let mut horizon = FlightHorizon::new(&config)?;
//! // Sky above, ground below, of a body as wide as the Earth.
//! let data: Vec<u8> = (0..64 * 48).map(|i| if i / 64 < 20 { 5 } else { 200 }).collect();
//! let picture = Grey::try_new(&data, Layout::packed(64, 48, 1, 8))?;
//! let expected = horizon.expect(&Frame::default())?;
//! let report = horizon.process(&picture, &expected);
//! println!("{} at stage {}", report.status, report.stage.name());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Memory
//!
//! | workspace | scalar | border pixels | points fitted | bytes |
//! |---|---|---|---|---|
//! | [`FlightHorizon`] | f32 | 2048 | 2048 | below 96 KiB |
//! | [`HostHorizon`] | f64 | 16384 | 16384 | 1.5 MiB |
//!
//! # Features
//!
//! `std`: the square root from the standard library (the same bits, vectorised). `serde`: [`Config`] to and from files.
//! `dlr`, `zju`, `horace`: the methods of Braun & Barf 2022, Wang et al. 2022 and HORACE, each with its [`Preset`]. `erf`: the most accurate
//! sub-pixel points.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(any(feature = "std", test))]
extern crate std;

// Vocabulary.
mod block;
pub mod body;
pub mod camera;
#[cfg(any(feature = "horace", feature = "zju"))]
mod circle;
pub mod ellipsoid;
pub mod error;
pub mod frames;
pub mod image;
mod limb;
mod linalg;
mod median;
pub mod pixel;
pub mod real;
pub mod region;
mod rng;
#[cfg(feature = "dlr")]
pub mod section;
#[cfg(any(feature = "horace", feature = "zju"))]
mod sort;
pub mod status;
pub mod work;

// Stages, in the order of the data's way.
pub mod binarize;
pub mod candidates;
pub mod contour;
pub mod covariance;
pub mod estimate;
pub mod recover;
pub mod reject;
pub mod select;
mod undistort;

// The whole.
pub mod pipeline;

pub use body::{Expected, Frame};
pub use pipeline::{Config, FlightHorizon, Horizon, HostHorizon, Observer, Preset, Report, Solution};
pub use pipeline::{FlightWorkspace, HostWorkspace, Sensor, Workspace};
