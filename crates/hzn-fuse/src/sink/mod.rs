//! Results as files.

mod aem;
mod ck;
mod csv;
mod frames;
mod mcap;
mod oem;
mod record;
mod utc;

pub use aem::{AemOptions, AemVersion, write_aem};
pub use ck::{CkOptions, write_ck};
pub use csv::{write_innovations, write_states};
pub use frames::write_frames;
pub use mcap::write_mcap;
pub use oem::write_oem;
pub use record::{CameraRecord, InnovationRecord, Phase, StateRecord, innovations, states};
pub use utc::Utc;
