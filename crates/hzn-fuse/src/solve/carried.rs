//! The inertial samples between two knots: the state that they predict, its derivatives and its noise.
//!
//! The filter of `hzn-nav` takes the samples from the first knot on, with a covariance of zero. Its state at the second
//! knot is then the prediction, its transition the derivatives, and its covariance the noise, so that the solve and the
//! filter have the same equations and the same noise.

use hzn_nav::filter::{Corrections, Filter, FilterError};
use hzn_nav::frames::Vector;
use hzn_nav::gravity::gravity;
use hzn_nav::layout::Layout;
use hzn_nav::options::{Block, Options, StartSigmas};
use hzn_nav::strapdown::{Imu, Nominal};
use nalgebra::{DMatrix, DVector, SMatrix};

use super::estimates::left_inverse;
use crate::error::Error;
use crate::events::mix;
use crate::input::Sample;
use crate::sparse::Linear;

/// State, biases, scales and axes.
const STATES: usize = 27;
/// Smallest 1-sigma of a step: attitude (rad), velocity (m/s), position (m). An inertial unit without noise would make
/// the knots equal, and the equations could not be factored.
const LEAST: [f64; 3] = [1e-8, 1e-6, 1e-5];
/// 1-sigma of the force without a receiver, m/s²/√Hz: the position is not known, so the force says nothing.
const ANY_FORCE: f64 = 1e3;

/// What carries states from knot to knot.
#[derive(Debug, Clone)]
pub(super) struct Carrier {
    options: Options,
    has_receiver: bool,
    pub(super) samples: Vec<Sample>,
}

/// A block that the filter knows exactly.
fn exact(block: Block) -> Block {
    Block { sigma: 0.0, ..block }
}

/// Returns the errors of the inertial unit that the filter estimates or considers.
pub(super) fn errors_of_unit(options: &mut Options) -> [&mut Block; 6] {
    let imu = &mut options.imu;
    [
        &mut imu.accel_bias,
        &mut imu.accel_scale,
        &mut imu.accel_misalignment,
        &mut imu.gyro_bias,
        &mut imu.gyro_scale,
        &mut imu.gyro_misalignment,
    ]
}

impl Carrier {
    pub(super) fn new(options: &Options, samples: &[Sample], has_receiver: bool) -> Self {
        let mut options = *options;
        for block in errors_of_unit(&mut options) {
            *block = exact(*block);
        }
        if !has_receiver {
            options.imu.accel_noise = [0.0, ANY_FORCE];
        }
        (options.limb_height, options.limb_latitude) = (Block::OFF, Block::OFF);
        options.start = StartSigmas { attitude_rad: 0.0, velocity_m_s: 0.0, position_m: 0.0 };
        Self { options, has_receiver, samples: samples.to_vec() }
    }

    /// Returns a sample as the filter takes it: without a receiver a force holds the vehicle where it is.
    fn usable(&self, imu: &Imu, state: &Nominal) -> Imu {
        if self.has_receiver {
            return *imu;
        }
        Imu { accel_m_s2: state.attitude.inverse() * -gravity(&state.position_m), ..*imu }
    }

    /// Returns the sample at a time.
    fn at(&self, time_s: f64) -> Option<Imu> {
        let next = self.samples.partition_point(|s| s.imu.time_s < time_s);
        match (next.checked_sub(1).and_then(|i| self.samples.get(i)), self.samples.get(next)) {
            (Some(a), Some(b)) => Some(mix(&a.imu, &b.imu, time_s)),
            (Some(one), None) | (None, Some(one)) => Some(Imu { time_s, ..one.imu }),
            (None, None) => None,
        }
    }

    /// Returns the samples after a time up to another one, and one at that time.
    fn between(&self, from_s: f64, to_s: f64) -> impl Iterator<Item = (Imu, bool)> + '_ {
        let first = self.samples.partition_point(|s| s.imu.time_s <= from_s);
        let inside = self.samples.iter().skip(first).take_while(move |s| s.imu.time_s < to_s);
        let end = self.samples.partition_point(|s| s.imu.time_s < to_s);
        let is_saturated = self.samples.get(end).is_some_and(|s| s.saturated);
        let last = self.at(to_s).map(|imu| (imu, is_saturated));
        inside.map(|s| (s.imu, s.saturated)).chain(last)
    }

    /// Returns the state at an earlier time.
    pub(super) fn back(&self, state: &Nominal, corrections: &Corrections, to_s: f64) -> Nominal {
        let first = self.samples.partition_point(|s| s.imu.time_s <= to_s);
        let end = self.samples.partition_point(|s| s.imu.time_s < state.time_s);
        let inside = self.samples.get(first..end).unwrap_or_default().iter().rev().map(|s| s.imu);
        let mut state = *state;
        let mut last = self.at(state.time_s);
        for imu in inside.chain(self.at(to_s)) {
            if let Some(last) = last {
                let [from, to] = [last, imu].map(|imu| corrections.correct(&self.usable(&imu, &state)));
                state = state.step(&from, &to);
            }
            last = Some(imu);
        }
        state
    }

    /// Carries a state to a time.
    fn carried(&self, from: &Nominal, corrections: &Corrections, to_s: f64) -> Result<Carried, FilterError> {
        let mut filter = Filter::<STATES>::new(*from, &self.options, &[])?;
        filter.set_corrections(corrections);
        let mut transition = SMatrix::<f64, STATES, STATES>::identity();
        if let Some(imu) = self.at(from.time_s) {
            filter.predict(&self.usable(&imu, from), false);
        }
        for (imu, saturated) in self.between(from.time_s, to_s) {
            let imu = self.usable(&imu, filter.nominal());
            filter.predict_recorded(&imu, saturated, &mut transition);
        }
        let mut noise = filter.covariance().fixed_view::<9, 9>(0, 0).into_owned();
        for (i, least) in LEAST.iter().enumerate() {
            for j in 3 * i..3 * i + 3 {
                noise[(j, j)] += least * least;
            }
        }
        Ok(Carried { state: *filter.nominal(), transition, noise, columns: filter.layout().len - Layout::VEHICLE })
    }

    /// Returns the error between two knots, with its derivatives by both and by the shared errors.
    pub(super) fn error(
        &self,
        (from, to): (&Nominal, &Nominal),
        corrections: &Corrections,
        blocks: [usize; 3],
        shared: usize,
    ) -> Result<Linear, Error> {
        let carried = self.carried(from, corrections, to.time_s).map_err(Error::failed)?;
        let turn = (to.attitude * carried.state.attitude.inverse()).scaled_axis().into_inner();
        let moved = |a: Vector<_>, b: Vector<_>| (a - b).into_inner();
        let mut error = SMatrix::<f64, 9, 1>::zeros();
        error.fixed_rows_mut::<3>(Layout::ATTITUDE).copy_from(&turn);
        error.fixed_rows_mut::<3>(Layout::VELOCITY).copy_from(&moved(to.velocity_m_s, carried.state.velocity_m_s));
        error.fixed_rows_mut::<3>(Layout::POSITION).copy_from(&moved(to.position_m, carried.state.position_m));
        let mut by_to = SMatrix::<f64, 9, 9>::identity();
        by_to.fixed_view_mut::<3, 3>(0, 0).copy_from(&left_inverse(&turn));
        // A rotation of the prediction acts from the other side.
        let mut by_prediction = -SMatrix::<f64, 9, 9>::identity();
        by_prediction.fixed_view_mut::<3, 3>(0, 0).copy_from(&-left_inverse(&-turn));
        let by_from = by_prediction * carried.transition.fixed_view::<9, 9>(0, 0);
        let mut by_shared = DMatrix::zeros(9, shared);
        let columns = carried.columns;
        let of_unit = carried.transition.view((0, Layout::VEHICLE), (9, columns));
        by_shared.view_mut((0, 0), (9, columns)).copy_from(&(by_prediction * of_unit));
        let root = carried.noise.cholesky().ok_or_else(|| Error::failed("the noise of a step is not positive"))?;
        let whole =
            |matrix: DMatrix<f64>| -> DMatrix<f64> { root.l().solve_lower_triangular(&matrix).unwrap_or(matrix) };
        let dense = |matrix: &SMatrix<f64, 9, 9>| DMatrix::from_column_slice(9, 9, matrix.as_slice());
        let [from_block, to_block, shared_block] = blocks;
        Ok(Linear {
            error: DVector::from_column_slice(root.l().solve_lower_triangular(&error).unwrap_or(error).as_slice()),
            derivatives: vec![
                (from_block, whole(dense(&by_from))),
                (to_block, whole(dense(&by_to))),
                (shared_block, whole(by_shared)),
            ],
        })
    }
}

/// A state that was carried to a time.
struct Carried {
    state: Nominal,
    transition: SMatrix<f64, STATES, STATES>,
    noise: SMatrix<f64, 9, 9>,
    /// Number of the errors of the inertial unit.
    columns: usize,
}
