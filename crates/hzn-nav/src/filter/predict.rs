//! Prediction: the nominal state by the strapdown equations, the covariance by their linearisation.
//!
//! The measured rate is ω̃ = ω + b + S ω + m × ω + noise, so that the estimate ω̂ = ω̃ − b − S ω̃ − m × ω̃ has the
//! error δω = −δb − diag(ω̃) δs + [ω̃×] δm − noise; the same holds for the specific force. With ψ in ECEF, ψ̇ = −ω_ie ×
//! ψ + R δω, δv̇ = −[R f̂×] ψ + R δf + ∂g/∂x δx − 2 ω_ie × δv, δẋ = δv.

use nalgebra::{Matrix3, SMatrix};

use super::blocks::{put, scale_column, scale_row, set, three_columns, three_rows};
use super::{Corrections, Filter};
use crate::frames::{Rotation, Vector, Vehicle};
use crate::gravity::{earth_rate, gradient};
use crate::layout::Layout;
use crate::strapdown::Imu;

/// Longest time during which an unknown rate or force is taken to be the same, s. The sigma of the attitude is then
/// that of the rate times one second, for any number of samples a second, and grows on with the square root of the
/// time.
const LONGEST_SAME_S: f64 = 1.0;
/// Number of vehicle components.
const V: usize = Layout::VEHICLE;

/// What became of an inertial sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// The first sample; the state is at its time.
    First,
    /// The state is at the time of the sample.
    Taken,
    /// The same, and the time since the last sample was too long, or the sample was saturated.
    TakenWithGap,
    /// The sample has the time of the last one, and is ignored.
    Duplicate,
    /// The sample is older than the last one, and is ignored.
    OutOfOrder,
    /// A number of the sample is not finite, and it is ignored.
    NotFinite,
}

impl Corrections {
    /// Returns the sample without the estimated errors.
    pub fn correct(&self, imu: &Imu) -> Imu {
        let (gyro, accel) = (&imu.gyro_rad_s, &imu.accel_m_s2);
        Imu {
            time_s: imu.time_s,
            gyro_rad_s: *gyro
                - self.gyro_bias
                - self.gyro_scale.component_mul(gyro)
                - self.gyro_misalignment.cross(gyro),
            accel_m_s2: *accel
                - self.accel_bias
                - self.accel_scale.component_mul(accel)
                - self.accel_misalignment.cross(accel),
        }
    }
}

impl<const N: usize> Filter<N> {
    /// Moves the state to the time of a sample of the inertial unit. `saturated` says that a channel was at its limit.
    pub fn predict(&mut self, imu: &Imu, saturated: bool) -> Step {
        self.predict_into(imu, saturated, None)
    }

    /// Moves the state back to the time of an earlier sample, for the time before a filter began. The covariance grows
    /// as it does on the way forwards. A sample that is not older than the state is [`Step::OutOfOrder`].
    pub fn predict_back(&mut self, imu: &Imu, saturated: bool) -> Step {
        if !imu.is_finite() {
            return Step::NotFinite;
        }
        let Some(last) = self.last_imu else { return self.predict(imu, saturated) };
        if !(imu.time_s < self.nominal.time_s) {
            return if imu.time_s == last.time_s { Step::Duplicate } else { Step::OutOfOrder };
        }
        self.move_to(imu, &last, saturated, None)
    }

    pub(super) fn predict_into(
        &mut self,
        imu: &Imu,
        saturated: bool,
        transition: Option<&mut SMatrix<f64, N, N>>,
    ) -> Step {
        if !imu.is_finite() {
            return Step::NotFinite;
        }
        let Some(last) = self.last_imu else {
            self.nominal.time_s = imu.time_s;
            self.last_imu = Some(*imu);
            return Step::First;
        };
        let dt = imu.time_s - self.nominal.time_s;
        if !(dt > 0.0) {
            return if imu.time_s == last.time_s { Step::Duplicate } else { Step::OutOfOrder };
        }
        self.move_to(imu, &last, saturated, transition)
    }

    /// Moves the state to the time of a sample, in either direction.
    fn move_to(&mut self, imu: &Imu, last: &Imu, saturated: bool, transition: Option<&mut SMatrix<f64, N, N>>) -> Step {
        let dt = imu.time_s - self.nominal.time_s;
        // A channel at its limit says only that the rate is at least as large. It is as unknown as in a gap, because
        // the turn that is integrated may be far too small.
        let gap = saturated || libm::fabs(dt) > self.options.imu.max_step_s;
        // The covariance goes first, because its derivatives need the attitude and the corrections at the begin of the
        // step.
        self.propagate_covariance(last, imu, dt, gap, transition);
        let (from, to) = (self.corrections.correct(last), self.corrections.correct(imu));
        self.nominal = self.nominal.step(&from, &to);
        self.last_imu = Some(*imu);
        if gap { Step::TakenWithGap } else { Step::Taken }
    }

    fn propagate_covariance(
        &mut self,
        last: &Imu,
        imu: &Imu,
        dt: f64,
        gap: bool,
        mut recorded: Option<&mut SMatrix<f64, N, N>>,
    ) {
        // Besides the slow errors, only those of the vehicle change between measurements. Nine rows of the transition
        // therefore differ from the identity, and the product takes 9 N² multiplications instead of N³.
        let (own, others) = self.linearise(last, imu);
        // Of second order, because an error of the force would otherwise reach the position only in the next step.
        let half = own * (0.5 * dt);
        let mean = SMatrix::<f64, V, V>::identity() * dt + half * dt;
        let mut rows: SMatrix<f64, V, N> = mean * others;
        let transition = SMatrix::<f64, V, V>::identity() + own * dt + half * own * dt;
        rows.fixed_view_mut::<V, V>(0, 0).copy_from(&transition);
        let moved: SMatrix<f64, V, N> = rows * self.covariance;
        if let Some(recorded) = &mut recorded {
            let vehicle: SMatrix<f64, V, N> = rows * **recorded;
            recorded.fixed_view_mut::<V, N>(0, 0).copy_from(&vehicle);
        }
        // The errors grow in both directions of time.
        let noise = self.process_noise(libm::fabs(dt), gap);
        self.gap_s = if gap { (self.gap_s + libm::fabs(dt)).min(LONGEST_SAME_S) } else { 0.0 };
        // The noise enters during the step: half before it, half after it.
        let noise = (transition * noise * transition.transpose() + noise) * 0.5;
        let vehicle = moved * rows.transpose() + noise;
        self.covariance.fixed_view_mut::<V, N>(0, 0).copy_from(&moved);
        for i in 0..V {
            for j in V..N {
                set(&mut self.covariance, (j, i), moved.get((i, j)).copied().unwrap_or(0.0));
            }
            for j in 0..V {
                // Rounding makes the triangles of the product differ, so that the covariance would lose its symmetry;
                // with their mean it stays symmetric and positive over a million predictions
                // (`tests/nav/monte_carlo.rs`).
                self.covariance[(i, j)] = 0.5 * (vehicle[(i, j)] + vehicle[(j, i)]);
            }
        }
        self.fade_slow_errors(libm::fabs(dt), recorded);
    }

    /// Returns the derivatives of the vehicle's errors by themselves and by all others.
    fn linearise(&self, last: &Imu, imu: &Imu) -> (SMatrix<f64, V, V>, SMatrix<f64, V, N>) {
        let (a, v, x) = (Layout::ATTITUDE, Layout::VELOCITY, Layout::POSITION);
        let layout = &self.layout;
        let (gyro, accel) = ((last.gyro_rad_s + imu.gyro_rad_s) * 0.5, (last.accel_m_s2 + imu.accel_m_s2) * 0.5);
        let middle = Imu { time_s: imu.time_s, gyro_rad_s: gyro, accel_m_s2: accel };
        let corrected = self.corrections.correct(&middle);
        // The attitude in the middle of the step: that at its begin would err to first order while the vehicle turns.
        let dt = imu.time_s - self.nominal.time_s;
        let turn = Rotation::from_scaled_axis(corrected.gyro_rad_s * (0.5 * dt));
        let rotation = (self.nominal.attitude * turn).to_matrix();
        let (gyro, accel) = (gyro.as_inner(), accel.as_inner());
        let spin = earth_rate().as_inner().cross_matrix();
        let mut own = SMatrix::<f64, V, V>::zeros();
        own.fixed_view_mut::<3, 3>(a, a).copy_from(&-spin);
        own.fixed_view_mut::<3, 3>(v, a).copy_from(&-(rotation * corrected.accel_m_s2.as_inner()).cross_matrix());
        own.fixed_view_mut::<3, 3>(v, v).copy_from(&(spin * -2.0));
        own.fixed_view_mut::<3, 3>(v, x).copy_from(&gradient(&self.nominal.position_m));
        own.fixed_view_mut::<3, 3>(x, v).copy_from(&Matrix3::identity());
        let mut others = SMatrix::<f64, V, N>::zeros();
        let mut put = |row: usize, place: Option<crate::layout::Place>, block: Matrix3<f64>| {
            if let Some(place) = place {
                super::blocks::put(&mut others, (row, place.first), &block);
            }
        };
        // The derivatives have the measured rate and force, because the errors are shares of what is measured.
        put(a, layout.gyro_bias, -rotation);
        put(a, layout.gyro_scale, -rotation * Matrix3::from_diagonal(gyro));
        put(a, layout.gyro_misalignment, rotation * gyro.cross_matrix());
        put(v, layout.accel_bias, -rotation);
        put(v, layout.accel_scale, -rotation * Matrix3::from_diagonal(accel));
        put(v, layout.accel_misalignment, rotation * accel.cross_matrix());
        (own, others)
    }

    /// Returns the covariance that the noise of the instruments adds in a step.
    fn process_noise(&self, dt: f64, gap: bool) -> SMatrix<f64, V, V> {
        let imu = &self.options.imu;
        let sum = |[white, tuning]: [f64; 2]| (white * white + tuning * tuning) * dt;
        // A wrong rate is the same from sample to sample: its angle grows with the time, and not with its root. With
        // the root, attitudes were 80° off at a sigma of 11°, so that the gate refused right ones for the rest of a
        // flight.
        let constant = |sigma: f64| if gap { sigma * sigma * dt * (dt + 2.0 * self.gap_s) } else { 0.0 };
        let (turn, speed) =
            (sum(imu.gyro_noise) + constant(imu.gap_rate_rad_s), sum(imu.accel_noise) + constant(imu.gap_accel_m_s2));
        let mut noise = SMatrix::<f64, V, V>::zeros();
        for i in 0..3 {
            noise[(Layout::ATTITUDE + i, Layout::ATTITUDE + i)] = turn;
            noise[(Layout::VELOCITY + i, Layout::VELOCITY + i)] = speed;
        }
        noise
    }

    /// Lets the slow errors of the cameras forget: Φ = exp(−Δt/T), Q = (1 − Φ²) P_c.
    fn fade_slow_errors(&mut self, dt: f64, mut recorded: Option<&mut SMatrix<f64, N, N>>) {
        for (camera, places) in self.cameras.iter_mut().flatten().zip(&self.layout.cameras) {
            // Q follows from Φ, so that the covariance stays P_c, however many samples lie between two directions.
            let keep = libm::exp(-dt / camera.options.slow_error_time_s);
            let errors = camera.slow_errors.iter_mut().zip(camera.slow_covariances).zip(places.slow_errors);
            for ((error, target), place) in errors {
                // Before its first direction a slow error has no covariance, so there is nothing to fade.
                let (Some(place), Some(target)) = (place, target) else { continue };
                *error *= keep;
                for i in place.first..place.first + place.len {
                    scale_row(&mut self.covariance, i, keep);
                    scale_column(&mut self.covariance, i, keep);
                    if let Some(recorded) = &mut recorded {
                        scale_row(recorded, i, keep);
                    }
                }
                let own = three_rows(&three_columns(&self.covariance, place.first), place.first);
                put(&mut self.covariance, (place.first, place.first), &(own + target * (1.0 - keep * keep)));
            }
        }
    }
}

/// Returns the derivative of a vector that is fixed in ECEF, as the vehicle sees it, for the clock offset.
pub(super) fn rate_of(seen: &Vector<Vehicle>, rate_rad_s: &Vector<Vehicle>) -> Vector<Vehicle> {
    -rate_rad_s.cross(seen)
}
