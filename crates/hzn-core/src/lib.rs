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
//! | [`binarize`] | [`threshold::Config`], [`threshold::Gate`] | a sparse sample of the picture | the level between dark and lit |
//! | [`contour`] | [`contour::Config`] | pixels at the border, then along the edges | border pixels of one edge after another |
//! | [`candidates`] | [`edge_points::Config`] | border pixels | sub-pixel points at the local mid-level |
//! | undistort | [`camera::Config`] | points | unit rays with their derivatives |
//! | [`reject`] | [`consensus::Config`] | rays | the cone that most agree on |
//! | [`estimate`] | [`fit::Config`] | that cone and the rays | the fitted cone, half-angle free, and weights |
//! | [`covariance`] | [`covariance::Config`] | the fit and the noise model | covariance, and the expected half-angle fused |
//! | [`select`] | [`gates::Config`] | the answer | a verdict; the best of all candidates |
//!
//! Each module begins with its equations and their source; the project's book/theory/math.md has them in one place.
//! They are tested beside the code, and against data of other programs (`golden`).
//!
//! [`pipeline`] knows them all. Frames and units: [`frames`] (camera x right, y down, z forward), [`pixel`] (pixel
//! centres at integers); metres, radians and pixels inside, kilometres and degrees in [`Config`].
//!
//! ```
//! use hzn_core::camera::{self, Model};
//! use hzn_core::image::{Grey, Layout};
//! use hzn_core::{Config, FlightHorizon, Prior};
//!
//! let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 64, 48, 60.0));
//! config.body.altitude_km = Some(230.0);
//! let mut horizon = FlightHorizon::new(&config)?;
//! // Sky above, ground below, of a body as wide as the Earth.
//! let data: Vec<u8> = (0..64 * 48).map(|i| if i / 64 < 20 { 5 } else { 200 }).collect();
//! let picture = Grey::try_new(&data, Layout::packed(64, 48, 1, 8))?;
//! let expected = horizon.expect(&Prior::default())?;
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
//! `dlr`, `zju`, `horace`: the methods of Braun & Barf 2022, Wang et al. 2022 and HORACE, each with its [`Preset`].
//! `erf`: the most accurate sub-pixel points.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(any(feature = "std", test))]
extern crate std;

// Each folder knows those above it in this list and none below it; `tests/architecture.rs` holds that.
mod base;
pub mod config;
mod geometry;
pub mod image;
mod model;
mod papers;
pub mod pipeline;
mod stages;

pub use base::{error, keys, real};
pub use config::retry;
pub use geometry::{camera, ellipsoid, frames, pixel, section};
pub use image::region;
pub use model::{body, edge_noise, error_budget, observer, report, status, verdict, work};
pub use stages::{consensus, contour, covariance, edge_points, fit, gates, threshold};

pub use body::{Expected, Prior};
pub use config::Config;
pub use observer::{Observer, Unobserved};
pub use papers::Preset;
pub use pipeline::{FlightHorizon, FlightWorkspace, Horizon, HostHorizon, HostWorkspace, Sensor, Workspace};
pub use report::{Report, Solution};
