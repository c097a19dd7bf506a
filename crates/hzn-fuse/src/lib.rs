#![doc = include_str!("../README.md")]
//!
//! | module | contents |
//! |---|---|
//! | [`input`] | the files: inertial unit, receiver, star tracker, other directions, recordings of `hzn run`, mounts |
//! | [`settings`] | fuse.toml: what the filter estimates, considers, or leaves out |
//! | [`flight`] | the replay of a flight |
//! | [`truth`] | errors against the truth of a simulated flight |
//! | [`start`] | the first attitude from directions in a window of time |
//! | [`smooth`] | the smoothed solution |
//! | [`solve`] | the whole flight at once, instead of the smoother |
//! | [`sparse`] | sparse least squares with covariances |
//! | [`finding`] | the verdict: whether the inputs agree with each other, and the likeliest cause if not |
//! | [`results`] | what comes out |
//! | `simulated` | recordings of simulated flights without pictures, with the feature of this name |
//! | [`sink`] | results as files: CSV, MCAP, AEM, OEM, CK, frames.csv |
//! | [`read_back`] | these files (CSV, MCAP) back into numbers |

#![forbid(unsafe_code)]

mod data;
mod error;
mod events;
pub mod finding;
pub mod flight;
pub mod input;
mod orbit;
mod quantised;
pub mod read_back;
mod reference;
mod repeats;
pub mod results;
pub mod settings;
#[cfg(feature = "simulated")]
pub mod simulated;
pub mod sink;
pub mod smooth;
pub mod solve;
pub mod sparse;
mod standing;
pub mod start;
mod track;
pub mod truth;
mod verdict;

pub use error::Error;
pub use flight::fuse;
pub use results::Fused;
pub use settings::Settings;
