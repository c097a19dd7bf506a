//! Updates: gates, gain with considered errors, Joseph's form.
//!
//! Joseph's form holds for any gain, and the gain here is not the optimal one: the rows of considered errors are 0. The
//! shorter (I − K H) P holds for the optimal gain only, and with this gain the covariance would be too small.

use nalgebra::{SMatrix, SVector, Vector3};

use super::Filter;
use super::blocks::{scale_row, set};
use super::chi2::chi2_limit;
use super::unusable::Unusable;
use crate::frames::{Fixed, Rotation, Vector, Vehicle};
use crate::layout::Layout;

/// An innovation: measured minus predicted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Innovation<const M: usize> {
    /// The innovation.
    pub value: SVector<f64, M>,
    /// Its covariance.
    pub covariance: SMatrix<f64, M, M>,
    /// The square of the innovation over its covariance: chi-square with M degrees of freedom.
    pub nis: f64,
    /// Whether it passed the gate and moved the state.
    pub taken: bool,
}

impl<const N: usize> Filter<N> {
    /// Takes a measurement of M numbers with an innovation, its derivative by the errors, and its noise.
    ///
    /// # Errors
    /// The covariance of the innovation is not positive definite, or a number is not finite.
    pub(super) fn update<const M: usize>(
        &mut self,
        value: SVector<f64, M>,
        by_errors: &SMatrix<f64, M, N>,
        noise: &SMatrix<f64, M, M>,
    ) -> Result<Innovation<M>, Unusable> {
        if !value.iter().all(|x| x.is_finite()) {
            return Err(Unusable::NotFinite);
        }
        let cross: SMatrix<f64, N, M> = self.covariance * by_errors.transpose();
        let covariance = by_errors * cross + noise;
        // Cholesky's factor exists only for a positive definite matrix, so that the inverse is checked without a
        // further test.
        let inverse = covariance.cholesky().ok_or(Unusable::Innovation)?.inverse();
        let nis = value.dot(&(inverse * value));
        if !nis.is_finite() {
            return Err(Unusable::Innovation);
        }
        // The covariance has the considered errors, too. Without them, right measurements would be refused more often
        // than the probability says, because these errors are never corrected.
        let taken = nis <= chi2_limit(M, self.options.gate_probability);
        if taken {
            // The gain comes from the full covariance, so that the considered errors count as uncertainty of the
            // others.
            let mut gain: SMatrix<f64, N, M> = cross * inverse;
            for i in (0..self.layout.len).filter(|i| self.layout.is_considered(*i)) {
                scale_row(&mut gain, i, 0.0);
            }
            self.apply(&(gain * value));
            self.reduce_covariance(&gain, &cross, by_errors, noise);
        }
        Ok(Innovation { value, covariance, nis, taken })
    }

    /// P ← (I − K H) P (I − K H)ᵀ + K R Kᵀ, factor by factor and in place: a copy of P would not fit the stack of a
    /// flight computer.
    fn reduce_covariance<const M: usize>(
        &mut self,
        gain: &SMatrix<f64, N, M>,
        cross: &SMatrix<f64, N, M>,
        by_errors: &SMatrix<f64, M, N>,
        noise: &SMatrix<f64, M, M>,
    ) {
        for (mut column, cross) in self.covariance.column_iter_mut().zip(cross.row_iter()) {
            column -= gain * cross.transpose();
        }
        let right: SMatrix<f64, N, M> = gain * noise - self.covariance * by_errors.transpose();
        for (mut column, gain) in self.covariance.column_iter_mut().zip(gain.row_iter()) {
            column += right * gain.transpose();
        }
        // Rounding makes the triangles differ. With their mean, the covariance stays symmetric and positive definite
        // over 150 000 updates (`tests/nav/monte_carlo.rs`).
        for i in 0..N {
            for j in 0..i {
                let at = |a: usize, b: usize| self.covariance.get((a, b)).copied().unwrap_or(0.0);
                let mean = 0.5 * (at(i, j) + at(j, i));
                set(&mut self.covariance, (i, j), mean);
                set(&mut self.covariance, (j, i), mean);
            }
        }
    }

    /// Takes a position (m) with the 1-sigma of each component.
    ///
    /// # Errors
    /// See [`Unusable`].
    pub fn update_position(&mut self, position_m: &Vector<Fixed>, sigma_m: f64) -> Result<Innovation<3>, Unusable> {
        self.update_three((*position_m - self.nominal.position_m).into_inner(), Layout::POSITION, sigma_m)
    }

    /// Takes a velocity relative to the Earth (m/s) with the 1-sigma of each component.
    ///
    /// # Errors
    /// See [`Unusable`].
    pub fn update_velocity(&mut self, velocity_m_s: &Vector<Fixed>, sigma_m_s: f64) -> Result<Innovation<3>, Unusable> {
        self.update_three((*velocity_m_s - self.nominal.velocity_m_s).into_inner(), Layout::VELOCITY, sigma_m_s)
    }

    /// Takes an attitude, for example of a star tracker, with the 1-sigma about each axis.
    ///
    /// # Errors
    /// See [`Unusable`].
    pub fn update_attitude(
        &mut self,
        attitude: &Rotation<Vehicle, Fixed>,
        sigma_rad: f64,
    ) -> Result<Innovation<3>, Unusable> {
        // The error is in ECEF, as that of the state is, so that its derivative is the identity.
        let error = (*attitude * self.nominal.attitude.inverse()).scaled_axis();
        self.update_three(error.into_inner(), Layout::ATTITUDE, sigma_rad)
    }

    fn update_three(&mut self, value: Vector3<f64>, first: usize, sigma: f64) -> Result<Innovation<3>, Unusable> {
        let mut by_errors = SMatrix::<f64, 3, N>::zeros();
        for i in 0..3 {
            set(&mut by_errors, (i, first + i), 1.0);
        }
        self.update(value, &by_errors, &(SMatrix::<f64, 3, 3>::identity() * (sigma * sigma)))
    }
}
