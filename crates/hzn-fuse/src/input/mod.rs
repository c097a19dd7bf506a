//! The files of a flight.

mod attitudes;
mod gnss;
mod imu;
mod mount;
mod recording;
mod table;

pub use attitudes::{Attitude, attitudes};
pub use gnss::{Fix, gnss};
pub use imu::{Sample, imu};
pub use mount::mount;
pub use recording::{Body, Centre, Recording, Seen, recording};

/// Everything that a flight recorded.
#[derive(Debug, Clone, Default)]
pub struct Inputs {
    /// Samples of the inertial unit, in the order of the file.
    pub imu: Vec<Sample>,
    /// Fixes of the receiver.
    pub gnss: Vec<Fix>,
    /// Attitudes of a star tracker.
    pub attitudes: Vec<Attitude>,
    /// Results of `hzn run`, one of each camera.
    pub recordings: Vec<Recording>,
}
