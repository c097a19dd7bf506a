//! Calibrates a horizon sensor from pictures.
//!
//! | module | calibrates from |
//! |---|---|
//! | [`board`] | pictures of a calibration board, whose corners [`corners`] finds |
//! | [`points`] | pixels with known directions |
//! | [`sky`] | the limb in the pictures of a flight: mount and lens |
//! | [`noise`] | the pictures of a flight: limb height and noise |
//! | [`rig`] | the limbs that several heads see together: their mounts |
//!
//! [`conversion`] changes a lens into another model, and [`lens_error`] says how well it is known. [`residual_table`]
//! reads and writes residuals.csv, the residuals of a lens calibration.

mod adjust;
mod between;
pub mod board;
mod calibrated;
pub mod conversion;
pub mod corners;
#[cfg(test)]
mod draws;
mod finish;
mod ideal;
pub mod lens_error;
mod lens_words;
mod limb_prior;
pub mod noise;
mod other_model;
pub mod points;
mod quantile;
pub mod residual_table;
pub mod rig;
mod robust;
pub mod sky;
mod staged;
mod words;
