//! Limb height and noise from the pictures of a flight, without truth: `hzn calibrate noise`.
//!
//! For each picture the fit with a free half-angle measures the height of the limb ([`Sighting`]). The residuals of the
//! picture give the error of this height. [`Calibration::new`] combines the pictures. It estimates the height by
//! restricted maximum likelihood (REML), with the scatter between pictures, and by latitude if the flight covers enough
//! latitudes. It also estimates the edge noise of all pictures together. It refuses a flight that does not determine
//! these values.
//!
//! ```text
//! points, weights ─► Cone (half-angle free) ─► residuals ─► REML of (σ, L, ν) ─► σ of the height ─┐
//!                            └─► limb height ──────────────────────────────────────────────────────┴─► Calibration
//! ```

pub(crate) mod bend;
mod calibration;
pub(crate) mod cone;
pub(crate) mod edge;
mod height;
mod lag;
mod latitude;
mod points;
mod refusal;
pub(crate) mod sighting;
pub(crate) mod slow;
#[cfg(test)]
pub(crate) mod tests;
mod words;
mod write;

pub use calibration::{Calibration, Edge, Focal, Height, MIN_PICTURES, Picture, config_for_calibration};
pub use points::{PointRecorder, WeightedPoints};
pub use refusal::Refusal;
pub use sighting::{Sighting, shares};
pub use words::lines;
pub use write::{Written, into_sensor_toml};
