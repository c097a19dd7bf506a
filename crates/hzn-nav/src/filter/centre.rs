//! The position of the Earth's centre in the camera frame, from its limb.
//!
//! The camera sees r = −R_bcᵀ R_ebᵀ x. Its derivatives are R_bcᵀ R_ebᵀ [−x×] by the attitude error, [r×] by the
//! misalignment, and −R_bcᵀ R_ebᵀ by the position. A limb that is higher by δ than the told one makes the distance too
//! short by the share δ/a.

use nalgebra::{Matrix3, SMatrix};

use super::blocks::put;
use super::limb_latitude::RADIUS_KM;
use super::spectrum::Spectrum;
use super::unusable::Unusable;
use super::update::Innovation;
use super::{Filter, predict_direction};
use crate::frames::{Cam, Covariance, Vector};
use crate::layout::Layout;

impl<const N: usize> Filter<N> {
    /// Takes the position of the Earth's centre as a camera sees it (m) with its covariance (m²), without the part of
    /// the limb height. The axis of the same picture must not be taken too, because it has the errors of the same edge
    /// points, and they would count twice.
    ///
    /// # Errors
    /// See [`Unusable`].
    pub fn update_centre(
        &mut self,
        camera: usize,
        centre_m: &Vector<Cam>,
        covariance_m2: &Covariance<Cam>,
    ) -> Result<Innovation<3>, Unusable> {
        if !(centre_m.is_finite() && covariance_m2.is_finite()) {
            return Err(Unusable::NotFinite);
        }
        let (own, places) = self.camera_places(camera)?;
        let covariance = Spectrum::of_position(covariance_m2.as_inner())?.matrix();
        let to_centre = -self.nominal.position_m;
        let (predicted, by_attitude, by_mount) = predict_direction(&self.nominal.attitude, &own.mount, &to_centre);
        let to_camera = (self.nominal.attitude * own.mount).inverse().to_matrix();
        let mut by_errors = SMatrix::<f64, 3, N>::zeros();
        put(&mut by_errors, (0, Layout::ATTITUDE), &by_attitude);
        put(&mut by_errors, (0, Layout::POSITION), &-to_camera);
        if let Some(place) = places.misalignment {
            put(&mut by_errors, (0, place.first), &by_mount);
        }
        let mut height = Vector::zeros();
        if let Some(place) = self.layout.limb_height {
            let by_height = predicted * (-1.0 / RADIUS_KM);
            put(&mut by_errors, (0, place.first), by_height.as_inner());
            height = by_height * self.corrections.limb_height_km;
        }
        if let Some((place, terms)) = self.limb_latitude() {
            // A tilt is an angle, so that it moves the centre by more the farther away the centre is.
            let range_m = predicted.norm();
            for (i, (term, coefficient)) in terms.iter().zip(self.corrections.limb_latitude_km).enumerate() {
                let by_coefficient =
                    predicted * (-term.height / RADIUS_KM) + Vector::from(to_camera * term.tilt.as_inner()) * range_m;
                put(&mut by_errors, (0, place.first + i), by_coefficient.as_inner());
                height += by_coefficient * coefficient;
            }
        }
        // The white noise of a camera is an angle, so it grows with the distance.
        let white = own.options.white_rad * predicted.norm();
        let noise = covariance + Matrix3::identity() * (white * white);
        // All three components count, instead of the two across as for a direction: the distance has a variance of its
        // own.
        self.update((*centre_m - predicted - height).into_inner(), &by_errors, &noise)
    }
}
