//! The core of a horizon sensor. It computes the direction of a body, with a covariance for a navigation filter, from a
//! picture of the body's limb.
//!
//! The crate uses no heap, a fixed amount of memory and no unsafe code. (Where the ABI is `eabihf`, the square root is
//! the one unsafe instruction of the crate `hzn-fpu`.) `process` returns a report for every picture and never reports
//! NaN or infinity. Functions that IEEE 754 does not round correctly come from one library, and every
//! sum has a fixed order. Therefore the answer does not depend on the machine. A picture passes through these stages in
//! order; each stage is one module:
//!
//! ```text
//! image → threshold → contour → edge points → rays → consensus → fit → covariance → gates → Report
//! ```
//!
//! | stage | parameters | input | output |
//! |---|---|---|---|
//! | [`threshold`] | [`threshold::Config`], [`threshold::Brightness`] | a sparse sample of pixels | the level |
//! | [`contour`] | [`contour::Config`] | pixels at the border, then along the edges | border pixels of the edges |
//! | [`edge_points`] | [`edge_points::Config`] | border pixels | sub-pixel points at the local mid-level |
//! | rays | [`camera::Config`] | edge points | unit rays with their derivatives |
//! | [`consensus`] | [`consensus::Config`] | rays | the cone that most of them agree on |
//! | [`fit`] | [`fit::Config`] | that cone and the rays | the fitted cone, half-angle free, and weights |
//! | [`covariance`] | [`covariance::Config`] | the fit, the noise model | the covariance, prior fused |
//! | [`gates`] | [`gates::Config`] | the answer | a verdict; the best of all candidates |
//!
//! The documentation of each module begins with its equations and their source. The page book/theory/math.md of the
//! repository has all equations. Tests compare the equations with data from other programs.
//!
//! [`Horizon`] is a sensor with its memory, and [`Sensor`] in it is a checked configuration. [`frames`] describes the
//! coordinate frames (camera: x right, y down, z forward), [`pixel`] the image coordinates (pixel centres at integers).
//! Inside the crate, lengths are in metres and angles in radians. In [`Config`] they are in kilometres and degrees.
//!
//! ```
//! use hzn_core::camera::{self, Model};
//! use hzn_core::image::{Grey, Layout};
//! use hzn_core::{Config, FlightHorizon, Prior};
//! use static_cell::ConstStaticCell;
//!
//! // The sensor with its lists, 93 KB of zeros. In a static it takes no flash and never passes over the stack.
//! static HORIZON: ConstStaticCell<FlightHorizon> = ConstStaticCell::new(FlightHorizon::empty());
//!
//! let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 64, 48, 60.0));
//! config.body.altitude_km = Some(230.0);
//! let horizon = HORIZON.try_take().ok_or("the sensor is in use")?;
//! horizon.configure(&config)?;
//!
//! // The sky is above, the ground below, of a body as wide as the Earth.
//! let data: Vec<u8> = (0..64 * 48).map(|i| if i / 64 < 20 { 5 } else { 200 }).collect();
//! let picture = Grey::try_new(&data[..], Layout::packed(64, 48, 1, 8))?;
//! // The altitude of this picture, in metres, replaces that of the configuration.
//! let expected = horizon.expect(&Prior { altitude_m: Some(231.5e3), ..Prior::default() })?;
//! let report = horizon.process(&picture, &expected);
//! println!("{} at stage {}", report.status, report.stage.name());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Memory
//!
//! | workspace | scalar | border pixels | points fitted | bytes |
//! |---|---|---|---|---|
//! | [`FlightHorizon`] | f32 | 2048 | 2048 | below 92 KiB |
//! | [`HostHorizon`] | f64 | 16384 | 16384 | below 1.5 MiB |
//!
//! Tests run the example above on an emulated board with 192 KiB of RAM. Several cameras can share one [`Workspace`],
//! with a [`SensorPlace`] for each of them.
//!
//! # Features
//!
//! A feature adds code and never changes a type. `std`: the square root comes from the standard library, which gives
//! the same bits and can be vectorised. `serde`: [`Config`] can be read from files and written to files. `dlr`, `zju`,
//! `horace`: the methods of Braun & Barf 2022, Wang et al. 2022 and HORACE, each with its [`Preset`]. `erf`: the most
//! accurate sub-pixel points. `reml`: edge noise by restricted maximum likelihood.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(any(feature = "std", test))]
extern crate std;

// Each folder imports only from the folders above it in the table of ARCHITECTURE.md; `tests/architecture.rs` checks
// this.
mod base;
pub mod config;
mod geometry;
pub mod image;
mod model;
mod papers;
pub mod pipeline;
pub mod rig;
mod stages;

pub use base::{error, keys, real};
pub use config::{retry, track};
pub use geometry::{camera, ellipsoid, frames, pixel, section};
pub use image::region;
pub use model::{body, edge_noise, error_budget, evidence, observer, report, status, tone, verdict, work};
pub use stages::{consensus, contour, covariance, edge_points, fit, gates, threshold};

pub use body::{Expected, Prior};
pub use config::Config;
pub use observer::{Observer, Unobserved};
pub use papers::Preset;
pub use pipeline::prepared;
pub use pipeline::{
    FlightHorizon, FlightWorkspace, Horizon, HostHorizon, HostWorkspace, Sensor, SensorPlace, Sequence, Step, Tracker,
    Workspace,
};
pub use report::{Report, Solution};
