//! Directions: the limb axis, the Sun, the Moon.
//!
//! With the reference direction d in ECEF the camera sees ê = R_bcᵀ R_ebᵀ d. Its derivatives are R_bcᵀ R_ebᵀ [d×] by
//! the attitude error, [ê×] by the misalignment, and 1 by the slow error. The common part of the direction's covariance
//! belongs to the slow error, and the rest to the white noise, or a part would count twice. The innovation has the two
//! components across ê, because the covariance of three is singular along ê when there is no white noise. The
//! derivative by the position is left out: the 30 m of a receiver turn nadir by 4·10⁻⁶ rad.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::blocks::{put, three_columns, three_rows};
use super::predict::rate_of;
use super::spectrum::Spectrum;
use super::unusable::Unusable;
use super::update::Innovation;
use super::{Camera, Filter};
use crate::frames::{Cam, Covariance, Fixed, Rotation, Vector, Vehicle};
use crate::gravity::earth_rate;
use crate::layout::{CameraPlaces, Layout};

/// A direction that a camera measures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionMeasurement {
    /// Number of the camera, from 0.
    pub camera: usize,
    /// Number of the body among those that the camera sees, from 0: each has a slow error of its own.
    pub body: usize,
    /// Unit vector.
    pub measured: Vector<Cam>,
    /// The same direction from outside, a unit vector.
    pub reference: Vector<Fixed>,
    /// Covariance of the measured direction, rad², of rank 2. Rounding to single precision does no harm.
    pub covariance_rad2: Covariance<Cam>,
    /// The part of the covariance whose error is the same in the next picture, rad². It belongs to the slow error, and
    /// the rest is white noise. `None` if it is not known: the whole covariance then belongs to the slow error, because
    /// the other way is over-confident. Over 40 simulated flights with all errors taken as white, the NEES of the
    /// attitude is 5.4 instead of 2.4 (3 is ideal).
    pub common_rad2: Option<Covariance<Cam>>,
    /// Derivative of the measured direction by the limb height, per km; zero for the Sun.
    pub by_limb_height: Vector<Cam>,
    /// Whether it is the axis of the Earth's limb. A limb height that changes with the latitude
    /// ([`Options::limb_latitude`](crate::options::Options::limb_latitude)) moves such a direction alone.
    pub is_limb: bool,
}

/// A direction whose covariance is repaired and divided.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UsableDirection {
    /// Unit vector.
    pub measured: Vector<Cam>,
    /// Symmetric root of the covariance of the slow error, rad.
    pub slow_root_rad: Matrix3<f64>,
    /// Covariance of the white noise that the direction brings, rad².
    pub white_rad2: Matrix3<f64>,
}

/// Returns the predicted direction with its derivatives by the attitude error (columns in ECEF) and by the misalignment
/// (columns in the camera frame). Their rows are in the camera frame.
pub fn predict_direction(
    attitude: &Rotation<Vehicle, Fixed>,
    mount: &Rotation<Cam, Vehicle>,
    reference: &Vector<Fixed>,
) -> (Vector<Cam>, Matrix3<f64>, Matrix3<f64>) {
    let to_camera = (*attitude * *mount).inverse().to_matrix();
    let predicted = to_camera * reference.as_inner();
    (predicted.into(), to_camera * reference.as_inner().cross_matrix(), predicted.cross_matrix())
}

impl DirectionMeasurement {
    /// Returns whether all numbers are finite.
    pub fn is_finite(&self) -> bool {
        self.measured.is_finite()
            && self.reference.is_finite()
            && self.covariance_rad2.is_finite()
            && self.common_rad2.is_none_or(|common| common.is_finite())
            && self.by_limb_height.is_finite()
    }

    /// Returns the direction without the effects of rounding.
    ///
    /// # Errors
    /// See [`Unusable`].
    pub fn usable(&self) -> Result<UsableDirection, Unusable> {
        let (measured, slow, white_rad2) = self.checked()?;
        Ok(UsableDirection { measured, slow_root_rad: slow.root(), white_rad2 })
    }

    /// Returns the measured direction as a unit vector, the covariance of its slow error without the effects of
    /// rounding, and that of its white noise.
    pub(super) fn checked(&self) -> Result<(Vector<Cam>, Spectrum, Matrix3<f64>), Unusable> {
        if !self.is_finite() {
            return Err(Unusable::NotFinite);
        }
        let measured = self.measured.try_normalize(1e-6).ok_or(Unusable::NoDirection)?;
        let spectrum =
            |covariance: &Covariance<Cam>| Spectrum::of_direction(covariance.as_inner(), measured.as_inner());
        let whole = spectrum(&self.covariance_rad2)?;
        let Some(common) = &self.common_rad2 else { return Ok((measured, whole, Matrix3::zeros())) };
        let slow = spectrum(common)?;
        // Only the difference is white, because the common part would otherwise count twice.
        let white = Spectrum::positive_part(&(whole.matrix() - slow.matrix()));
        Ok((measured, slow, white))
    }
}

impl<const N: usize> Filter<N> {
    /// Takes a direction at the time of the state.
    ///
    /// # Errors
    /// See [`Unusable`].
    pub fn update_direction(&mut self, m: &DirectionMeasurement) -> Result<Innovation<2>, Unusable> {
        let (measured, covariance, rest) = m.checked()?;
        let reference = m.reference.try_normalize(1e-6).ok_or(Unusable::NoDirection)?;
        // Before the prediction, because a direction elsewhere in the picture turns and scales the slow error that it
        // is predicted with.
        self.set_slow_covariance((m.camera, m.body), &covariance, None)?;
        let (camera, places) = self.camera_places(m.camera)?;
        let slow_place = places.slow_errors.get(m.body).copied().flatten();
        let (rate, attitude) = self.at_clock(&camera);
        let (predicted, by_attitude, by_mount) = predict_direction(&attitude, &camera.mount, &reference);
        let mut by_errors = SMatrix::<f64, 3, N>::zeros();
        put(&mut by_errors, (0, Layout::ATTITUDE), &by_attitude);
        if let Some(place) = places.misalignment {
            put(&mut by_errors, (0, place.first), &by_mount);
        }
        let mut slow = Vector::zeros();
        if let Some(place) = slow_place {
            put(&mut by_errors, (0, place.first), &Matrix3::identity());
            slow = camera.slow_errors.get(m.body).copied().unwrap_or_default();
        }
        if let Some(place) = places.clock {
            let on_vehicle = attitude.inverse() * reference;
            let by_clock = camera.mount.inverse() * rate_of(&on_vehicle, &rate);
            put(&mut by_errors, (0, place.first), by_clock.as_inner());
        }
        let mut height = Vector::zeros();
        if let Some(place) = self.layout.limb_height {
            put(&mut by_errors, (0, place.first), m.by_limb_height.as_inner());
            height = m.by_limb_height * self.corrections.limb_height_km;
        }
        if let Some((place, terms)) = self.limb_latitude().filter(|_| m.is_limb) {
            let to_camera = (attitude * camera.mount).inverse();
            for (i, (term, coefficient)) in terms.iter().zip(self.corrections.limb_latitude_km).enumerate() {
                let by_coefficient = m.by_limb_height * term.height + to_camera * term.tilt;
                put(&mut by_errors, (0, place.first + i), by_coefficient.as_inner());
                height += by_coefficient * coefficient;
            }
        }
        // Across the predicted direction and not the measured one, because the derivatives by attitude and mount lie in
        // that plane. Equations that are linear in the errors hold up to a sigma of about 15°; a caller therefore
        // begins again with two directions above it, as `hzn fuse` does.
        let across = basis(predicted.as_inner());
        let value = across * (measured - predicted - slow - height).into_inner();
        let white = camera.options.white_rad;
        let mut noise = SMatrix::<f64, 2, 2>::identity() * (white * white) + across * rest * across.transpose();
        if slow_place.is_none() {
            // Without a slow error, the whole covariance is noise of each direction.
            noise += across * covariance.matrix() * across.transpose();
        }
        self.update(value, &(across * by_errors), &noise)
    }

    /// Returns the rate relative to the Earth and the attitude at the time of the camera's clock. The attitude turns by
    /// the whole angle and not only to first order, because a spin makes the angle large.
    fn at_clock(&self, camera: &Camera) -> (Vector<Vehicle>, Rotation<Vehicle, Fixed>) {
        let inertial = self.last_imu.map_or_else(Vector::zeros, |imu| self.corrections.correct(&imu).gyro_rad_s);
        // Relative to the Earth, because the reference is fixed in ECEF and turns with it.
        let rate = inertial - self.nominal.attitude.inverse() * earth_rate();
        (rate, self.nominal.attitude * Rotation::from_scaled_axis(rate * camera.clock_s))
    }

    /// Gives the slow error the covariance of a new direction: ζ' = T ζ with T = √P_new √P_old⁻¹. The roots are the
    /// symmetric ones. Those of Cholesky turn the error within the plane across the direction when the direction moves
    /// through the picture, and the innovations are then larger than their covariance: over 40 simulated flights their
    /// mean square is 2.50 instead of 2.06 (2 is ideal), and the NEES of the attitude 3.6 instead of 2.4 (3 is ideal).
    /// A ratio of standard deviations alone makes the whole covariance indefinite, in 98 % of 500 trials. The error
    /// begins independent of all others.
    pub(super) fn set_slow_covariance(
        &mut self,
        (which, body): (usize, usize),
        covariance: &Spectrum,
        recorded: Option<&mut SMatrix<f64, N, N>>,
    ) -> Result<(), Unusable> {
        let (own, places) = self.camera_places(which)?;
        if body >= own.options.bodies {
            return Err(Unusable::NoBody);
        }
        let camera = self.cameras.get_mut(which).and_then(Option::as_mut).ok_or(Unusable::NoCamera)?;
        let place = places.slow_errors.get(body).copied().flatten();
        let errors = camera.slow_errors.get_mut(body).zip(camera.slow_covariances.get_mut(body));
        let (Some(place), Some((slow_error, slow_covariance))) = (place, errors) else { return Ok(()) };
        let new = covariance.matrix();
        match *slow_covariance {
            None => put(&mut self.covariance, (place.first, place.first), &new),
            Some(old) => {
                let change = covariance.root() * Spectrum::of(&old).inverse_root();
                *slow_error = (change * slow_error.as_inner()).into();
                if let Some(recorded) = recorded {
                    let rows = change * three_rows(recorded, place.first);
                    put(recorded, (place.first, 0), &rows);
                }
                let rows = change * three_rows(&self.covariance, place.first);
                put(&mut self.covariance, (place.first, 0), &rows);
                let columns = three_columns(&self.covariance, place.first) * change.transpose();
                put(&mut self.covariance, (0, place.first), &columns);
            }
        }
        *slow_covariance = Some(new);
        Ok(())
    }

    /// Returns a camera, and the places of its errors.
    pub(super) fn camera_places(&self, which: usize) -> Result<(Camera, CameraPlaces), Unusable> {
        let camera = self.cameras.get(which).and_then(Option::as_ref).ok_or(Unusable::NoCamera)?;
        Ok((*camera, self.layout.cameras.get(which).copied().unwrap_or_default()))
    }
}

/// Returns two unit vectors across a direction, as rows.
pub fn basis(direction: &Vector3<f64>) -> SMatrix<f64, 2, 3> {
    // An axis that is at least 37° away, so that the product is not short.
    let helper = if libm::fabs(direction.x) < 0.6 { Vector3::x() } else { Vector3::y() };
    let first = direction.cross(&helper).normalize();
    let second = direction.cross(&first);
    SMatrix::<f64, 2, 3>::from_rows(&[first.transpose(), second.transpose()])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_error_and_white_noise_are_the_whole_covariance() {
        let measured = Vector::new(0.0, 0.6, 0.8);
        let across = |variance: f64| Covariance::across(&measured, variance);
        let parts = |common_rad2: Option<Covariance<Cam>>| {
            let direction = DirectionMeasurement {
                camera: 0,
                body: 0,
                measured,
                reference: Vector::new(0.0, 0.0, 1.0),
                covariance_rad2: across(4e-6),
                common_rad2,
                by_limb_height: Vector::zeros(),
                is_limb: true,
            };
            direction.usable().map(|usable| (usable.slow_root_rad * usable.slow_root_rad, usable.white_rad2))
        };
        let is = |found: &Matrix3<f64>, variance: f64| (found - across(variance).as_inner()).norm() < 1e-13;
        for (common, slow, white) in [
            (None, 4e-6, 0.0),
            (Some(4e-6), 4e-6, 0.0),
            (Some(3e-6), 3e-6, 1e-6),
            // A common part that is too large leaves no noise that is negative.
            (Some(5e-6), 5e-6, 0.0),
        ] {
            let found = parts(common.map(across)).unwrap();
            assert!(is(&found.0, slow) && is(&found.1, white), "{common:?}: {found:?}");
        }
        assert_eq!(parts(Some(Covariance::isotropic(f64::NAN))).err(), Some(Unusable::NotFinite));
        assert_eq!(parts(Some(across(-1e-6))).err(), Some(Unusable::NegativeVariance));
    }
}
