//! Limb height and noise from the pictures of a flight themselves, without truth: `hzn calibrate noise`.
//!
//! Each picture's half-angle-free fit measures the height of the limb ([`Sighting`]), with an error that its own
//! residuals tell. [`Calibration::new`] joins them: the height by restricted maximum likelihood with the scatter
//! between pictures, by latitude where the flight spans it; the edge noise of all pictures together. It refuses what
//! the pictures do not tell.
//!
//! ```text
//! points, weights ─► Cone (half-angle free) ─► residuals ─► REML of (σ, L, ν) ─► σ of the height ─┐
//!                            └─► limb height ──────────────────────────────────────────────────────┴─► Calibration
//! ```

mod bend;
mod calibration;
mod cone;
mod edge;
mod height;
mod lag;
mod latitude;
mod points;
mod refusal;
mod sighting;
#[cfg(test)]
mod tests;
mod write;

pub use calibration::{Calibration, Edge, Focal, Height, LEAST_PICTURES, Picture, looks_with};
pub use points::{Points, Weighted};
pub use refusal::Refusal;
pub use sighting::{Sighting, shares};
pub use write::{Written, into_sensor_toml};
