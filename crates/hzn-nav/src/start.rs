//! The start of a filter: an attitude from two directions, and the way back to an earlier time.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::filter::Filter;
use crate::layout::Layout;
use crate::options::CameraOptions;
use crate::strapdown::{Imu, Nominal};
use crate::vectors::{Direction, Wahba, davenport};

/// A direction that a camera measures at the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen<'a> {
    /// The camera.
    pub camera: &'a CameraOptions,
    /// Unit vector in the camera frame.
    pub measured: Vector3<f64>,
    /// The same direction in ECEF, a unit vector.
    pub reference: Vector3<f64>,
    /// 1-sigma of the direction across it, rad, without the error of the mount.
    pub sigma_rad: f64,
}

/// Returns the attitude of the body from at least two directions. The error of each mount widens the sigma of its
/// direction. `None` if the directions do not determine the attitude.
pub fn first_attitude(seen: &[Seen<'_>; 2]) -> Option<Wahba> {
    let direction = |s: &Seen<'_>| Direction {
        body: s.camera.mount * s.measured,
        reference: s.reference,
        sigma_rad: libm::hypot(libm::hypot(s.sigma_rad, s.camera.misalignment.sigma), s.camera.white_rad),
    };
    let [first, second] = seen;
    davenport(&[direction(first), direction(second)])
}

/// Integrates a state back to the time of the first of these samples, which are in the order of time. The state must be
/// at the time of the last one.
///
/// A rocket knows its attitude from the first picture with limb and Sun on. Integration back to lift-off shows where
/// the unaided solution went from there.
#[must_use]
pub fn propagate_back(state: &Nominal, samples: &[Imu]) -> Nominal {
    let mut state = *state;
    for pair in samples.windows(2).rev() {
        if let [earlier, later] = pair {
            state = state.step(later, earlier);
        }
    }
    state
}

impl<const N: usize> Filter<N> {
    /// Sets the attitude and its covariance (rotation vector in ECEF, rad²). It becomes independent of all other
    /// errors.
    pub fn set_attitude(&mut self, attitude: &UnitQuaternion<f64>, covariance_rad2: &Matrix3<f64>) {
        let (nominal, covariance) = self.parts_mut();
        nominal.attitude = *attitude;
        for i in Layout::ATTITUDE..Layout::ATTITUDE + 3 {
            covariance.row_mut(i).fill(0.0);
            covariance.column_mut(i).fill(0.0);
        }
        let symmetric = (covariance_rad2 + covariance_rad2.transpose()) * 0.5;
        covariance.fixed_view_mut::<3, 3>(Layout::ATTITUDE, Layout::ATTITUDE).copy_from(&symmetric);
    }
}
