//! The files of a flight.

mod attitudes;
mod columns;
mod cone;
mod directions;
mod fix;
mod gnss;
mod imu;
mod map;
mod mount;
mod nmea;
mod oem;
mod recording;
mod table;

use hzn_nav::frames::Rotation;
use nalgebra::Quaternion;

pub use attitudes::{Attitude, attitudes};
pub use cone::FreeCone;
pub use directions::directions;
pub use fix::{Fix, Receiver};
pub use gnss::gnss;
pub use imu::{Sample, imu};
pub use map::Map;
pub use mount::{is_sensor, mount};
pub use recording::{Body, Centre, Recording, Seen, name_of, recording};

/// Returns the rotation of a quaternion, scalar first; its length if that is not 1.
fn rotation<A, B>(wxyz: [f64; 4]) -> Result<Rotation<A, B>, f64> {
    let [w, x, y, z] = wxyz;
    let length = Quaternion::new(w, x, y, z).norm();
    let is_unit = (length - 1.0).abs() < 0.01;
    Rotation::assume_from_quaternion(wxyz).filter(|_| is_unit).ok_or(length)
}

/// Everything that a flight recorded.
#[derive(Debug, Clone, Default)]
pub struct Inputs {
    /// Samples of the inertial unit, in the order of the file.
    pub imu: Vec<Sample>,
    /// Fixes of the receiver.
    pub gnss: Vec<Fix>,
    /// Attitudes of a star tracker.
    pub attitudes: Vec<Attitude>,
    /// Results of `hzn run`, one of each camera, and the directions of other sensors.
    pub recordings: Vec<Recording>,
}

impl Inputs {
    /// Returns whether there is a receiver. Without one nobody knows the position, and the attitude needs a star
    /// tracker or recordings that know where their directions point.
    pub fn has_receiver(&self) -> bool {
        !self.gnss.is_empty()
    }
}
