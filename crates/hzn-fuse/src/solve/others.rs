//! Errors of receiver, star tracker and of what was known before.

use hzn_nav::frames::{Fixed, Rotation, Vehicle};
use hzn_nav::layout::Layout;
use hzn_nav::strapdown::Nominal;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::estimates::left_inverse;
use crate::sparse::Linear;

/// Returns an error of three numbers with its derivatives by parts of a state.
pub(super) fn of_state(error: Vector3<f64>, sigma: f64, block: usize, parts: &[(usize, Matrix3<f64>)]) -> Linear {
    let mut derivative = DMatrix::zeros(3, Layout::VEHICLE);
    for (first, matrix) in parts {
        derivative.view_mut((0, *first), (3, 3)).copy_from(&(matrix / sigma));
    }
    Linear { error: DVector::from_column_slice((error / sigma).as_slice()), derivatives: vec![(block, derivative)] }
}

/// Returns the error of an attitude against that of a knot, turned to the time of the measurement.
pub(super) fn attitude(
    predicted: &Rotation<Vehicle, Fixed>,
    measured: &Rotation<Vehicle, Fixed>,
    sigma_rad: f64,
    block: usize,
) -> Linear {
    let error = (*predicted * measured.inverse()).scaled_axis().into_inner();
    of_state(error, sigma_rad, block, &[(Layout::ATTITUDE, left_inverse(&error))])
}

/// Returns what is known about the first knot: its attitude comes from the directions.
pub(super) fn first(knot: &Nominal, begin: &Nominal, sigmas: [f64; 3]) -> [Linear; 3] {
    let turn = (knot.attitude * begin.attitude.inverse()).scaled_axis().into_inner();
    let [attitude, velocity, position] = sigmas;
    let one = Matrix3::identity();
    let moved =
        [(knot.velocity_m_s - begin.velocity_m_s).into_inner(), (knot.position_m - begin.position_m).into_inner()];
    [
        of_state(turn, attitude, 0, &[(Layout::ATTITUDE, left_inverse(&turn))]),
        of_state(moved[0], velocity, 0, &[(Layout::VELOCITY, one)]),
        of_state(moved[1], position, 0, &[(Layout::POSITION, one)]),
    ]
}

/// Returns what was known about the shared errors before.
pub(super) fn known(since: &DVector<f64>, root: &DMatrix<f64>, block: usize) -> Linear {
    Linear { error: root * since, derivatives: vec![(block, root.clone())] }
}
