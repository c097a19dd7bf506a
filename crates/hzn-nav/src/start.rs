//! The start of a filter: an attitude from two directions, and the way back to an earlier time.

use crate::filter::{Corrections, Filter};
use crate::frames::{Cam, Covariance, Fixed, Rotation, Vector, Vehicle};
use crate::layout::Layout;
use crate::options::CameraOptions;
use crate::strapdown::{Imu, Nominal};
use crate::vectors::{Direction, Wahba, davenport};

/// A direction that a camera measures at the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen<'a> {
    /// The camera.
    pub camera: &'a CameraOptions,
    /// Unit vector.
    pub measured: Vector<Cam>,
    /// The same direction from outside, a unit vector.
    pub reference: Vector<Fixed>,
    /// 1-sigma of the direction across it, rad, without the error of the mount.
    pub sigma_rad: f64,
}

/// Returns the attitude of the vehicle from at least two directions. The error of each mount widens the sigma of its
/// direction, because a camera may be mounted a degree off, which is more than the error of the direction itself.
/// `None` if the directions do not determine the attitude.
///
/// ```
/// use hzn_nav::frames::Vector;
/// use hzn_nav::options::CameraOptions;
/// use hzn_nav::start::{Seen, first_attitude};
///
/// let camera = CameraOptions::default();
/// let [nadir, sun] = [Vector::new(-1.0, 0.0, 0.0), Vector::new(0.0, 0.0, 1.0)];
/// let limb = Seen { camera: &camera, measured: Vector::new(0.0, 0.0, 1.0), reference: nadir, sigma_rad: 1e-3 };
/// let seen = [limb, Seen { measured: Vector::new(1.0, 0.0, 0.0), reference: sun, ..limb }];
/// let first = first_attitude(&seen).ok_or("the directions are too close")?;
/// // The mount is known to 1°, and the white noise is 0.29°.
/// let sigma_deg = first.covariance_rad2.as_inner().diagonal().max().sqrt().to_degrees();
/// assert!((sigma_deg - 1.04).abs() < 0.005);
/// # Ok::<(), &str>(())
/// ```
pub fn first_attitude(seen: &[Seen<'_>; 2]) -> Option<Wahba> {
    let direction = |s: &Seen<'_>| Direction {
        vehicle: s.camera.mount * s.measured,
        reference: s.reference,
        sigma_rad: libm::hypot(libm::hypot(s.sigma_rad, s.camera.misalignment.sigma), s.camera.white_rad),
    };
    // Davenport's method instead of TRIAD, because it has a covariance and a χ². TRIAD meets the first direction
    // exactly, so two directions that contradict each other would look right.
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
    /// Sets the estimated errors of the instruments, for a way back with what was found out later.
    pub fn set_corrections(&mut self, corrections: &Corrections) {
        *self.corrections_mut() = *corrections;
    }

    /// Sets the attitude and the covariance of its error, a rotation vector (rad²). It becomes independent of all other
    /// errors.
    pub fn set_attitude(&mut self, attitude: &Rotation<Vehicle, Fixed>, covariance_rad2: &Covariance<Fixed>) {
        let (nominal, covariance) = self.parts_mut();
        nominal.attitude = *attitude;
        // The correlations are those of the attitude that is given up, so they go with it.
        for i in Layout::ATTITUDE..Layout::ATTITUDE + 3 {
            covariance.row_mut(i).fill(0.0);
            covariance.column_mut(i).fill(0.0);
        }
        let covariance_rad2 = covariance_rad2.as_inner();
        let symmetric = (covariance_rad2 + covariance_rad2.transpose()) * 0.5;
        covariance.fixed_view_mut::<3, 3>(Layout::ATTITUDE, Layout::ATTITUDE).copy_from(&symmetric);
    }
}
