//! Differences of states and transitions, for a smoother.

use nalgebra::{SMatrix, SVector, Vector3};

use super::blocks::{put_three, set};
use super::{DirectionMeasurement, Filter, Step, Unusable};
use crate::layout::{Layout, Place};
use crate::strapdown::Imu;

impl<const N: usize> Filter<N> {
    /// Returns the error that leads from another state to this one: the argument of [`Filter::moved`]. Rotations are
    /// therefore on the same side as there: the attitude's on the left, a mount's on the right.
    pub fn minus(&self, other: &Self) -> SVector<f64, N> {
        let mut error = SVector::<f64, N>::zeros();
        let mut put = |first: usize, value: Vector3<f64>| put_three(&mut error, first, &value);
        let (a, b) = (&self.nominal, &other.nominal);
        put(Layout::ATTITUDE, (a.attitude * b.attitude.inverse()).scaled_axis().into_inner());
        put(Layout::VELOCITY, (a.velocity_m_s - b.velocity_m_s).into_inner());
        put(Layout::POSITION, (a.position_m - b.position_m).into_inner());
        let (layout, a, b) = (&self.layout, &self.corrections, &other.corrections);
        let blocks = [
            (layout.accel_bias, a.accel_bias - b.accel_bias),
            (layout.accel_scale, a.accel_scale - b.accel_scale),
            (layout.accel_misalignment, a.accel_misalignment - b.accel_misalignment),
            (layout.gyro_bias, a.gyro_bias - b.gyro_bias),
            (layout.gyro_scale, a.gyro_scale - b.gyro_scale),
            (layout.gyro_misalignment, a.gyro_misalignment - b.gyro_misalignment),
        ];
        let mut put_block = |place: Option<Place>, value| place.into_iter().for_each(|p| put(p.first, value));
        blocks.into_iter().for_each(|(place, value)| put_block(place, value.into_inner()));
        let cameras = || self.cameras.iter().flatten().zip(other.cameras.iter().flatten()).zip(&layout.cameras);
        for ((a, b), places) in cameras() {
            put_block(places.misalignment, (b.mount.inverse() * a.mount).scaled_axis().into_inner());
            for ((a, b), place) in a.slow_errors.iter().zip(b.slow_errors).zip(places.slow_errors) {
                put_block(place, (*a - b).into_inner());
            }
        }
        if let Some(place) = layout.limb_height {
            set(&mut error, (place.first, 0), a.limb_height_km - b.limb_height_km);
        }
        if let Some(place) = layout.limb_latitude {
            for (i, (a, b)) in a.limb_latitude_km.iter().zip(b.limb_latitude_km).enumerate() {
                set(&mut error, (place.first + i, 0), a - b);
            }
        }
        for ((a, b), places) in cameras() {
            if let Some(place) = places.clock {
                set(&mut error, (place.first, 0), a.clock_s - b.clock_s);
            }
        }
        error
    }

    /// Returns the state moved by an error, with another covariance. It is a copy, because a smoother keeps the states
    /// of all measurements; it runs on the ground.
    #[must_use]
    pub fn moved(&self, error: &SVector<f64, N>, covariance: SMatrix<f64, N, N>) -> Self {
        let mut moved = self.clone();
        moved.apply(error);
        moved.covariance = covariance;
        moved
    }

    /// Does the same as [`Filter::predict`], and multiplies the transition of the errors from the left onto
    /// `transition`: a smoother keeps one state for each measurement and not for each sample, so that it needs the
    /// product of all samples between two measurements.
    pub fn predict_recorded(&mut self, imu: &Imu, saturated: bool, transition: &mut SMatrix<f64, N, N>) -> Step {
        self.predict_into(imu, saturated, Some(transition))
    }

    /// Prepares the slow error of the camera for a direction, as [`Filter::update_direction`] does before the update,
    /// and multiplies the change onto `transition`, because the change is a part of the way from one measurement to the
    /// next.
    ///
    /// # Errors
    /// See [`Unusable`].
    pub fn prepare_direction(
        &mut self,
        m: &DirectionMeasurement,
        transition: &mut SMatrix<f64, N, N>,
    ) -> Result<(), Unusable> {
        let (_, covariance, _) = m.checked()?;
        self.set_slow_covariance((m.camera, m.body), &covariance, Some(transition))
    }
}
