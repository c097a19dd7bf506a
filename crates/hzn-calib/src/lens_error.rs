//! Differences and errors of a lens over the picture, with a rotation of the camera left out.
//!
//! A rotation of the camera and a shift of the principal point move the picture in nearly the same way. A calibration
//! determines them together, but the pose takes the rotation up. An error of the lens therefore counts only as far as
//! no rotation explains it.

use hzn_core::camera::{Camera, Config, Equation};
use hzn_core::pixel::ImagePoint;
use nalgebra::{DMatrix, Matrix3, Vector3};

/// Number of places along each side of the picture.
const PLACES: u16 = 21;

/// A place in the picture with its direction.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    /// Unit vector in the camera frame.
    pub(crate) ray: [f64; 3],
    /// Angle off axis, degrees.
    pub(crate) off_axis_deg: f64,
}

/// Returns places all over the picture, corners included, as far as the lens reaches.
pub(crate) fn places(camera: &Camera<f64>) -> Vec<Place> {
    let at = |i: u16, length: u16| (f64::from(length) - 1.0) * f64::from(i) / f64::from(PLACES - 1);
    let grid = (0..PLACES).flat_map(|j| (0..PLACES).map(move |i| (i, j)));
    let place = |(i, j)| {
        let ray = camera.unproject(ImagePoint { u: at(i, camera.width()), v: at(j, camera.height()) })?.xyz();
        Some(Place { ray, off_axis_deg: ray[2].clamp(-1.0, 1.0).acos().to_degrees() })
    };
    grid.filter_map(place).collect()
}

/// Returns the 1-sigma of the lens at each place, px, from the covariance of its parameters in the order of
/// `Model::intrinsics`.
pub(crate) fn sigmas_px(config: &Config, covariance: &DMatrix<f64>, places: &[Place]) -> Vec<f64> {
    let lens = Equation::new(config);
    let parameters = covariance.nrows();
    let mut by_lens = DMatrix::zeros(2 * places.len(), parameters);
    let mut by_turn = DMatrix::zeros(2 * places.len(), 3);
    for (n, place) in places.iter().enumerate() {
        let Some(projected) = lens.project(place.ray) else { continue };
        let turned = -Vector3::from(place.ray).cross_matrix();
        for axis in 0..2 {
            for (parameter, by) in projected.by_intrinsics[axis].iter().take(parameters).enumerate() {
                by_lens[(2 * n + axis, parameter)] = *by;
            }
            let row = Vector3::from(projected.by_direction[axis]).transpose() * turned;
            by_turn.row_mut(2 * n + axis).copy_from(&row);
        }
    }
    remove_turn(&mut by_lens, &by_turn);
    let variance = |row: usize| {
        let by = by_lens.row(row);
        (by * covariance * by.transpose())[(0, 0)].max(0.0)
    };
    (0..places.len()).map(|n| (variance(2 * n) + variance(2 * n + 1)).sqrt()).collect()
}

/// Returns the distances between the image points of two lenses, px, in the picture of the first one, after the best
/// rotation between them.
pub fn differences_px(first: &Camera<f64>, second: &Config) -> Vec<f64> {
    let lens = Equation::new(second);
    let mut turn = Matrix3::identity();
    let places: Vec<(Place, [f64; 2])> = places(first)
        .into_iter()
        .filter_map(|place| {
            let p = first.project(&hzn_core::frames::UnitVec3::try_new(place.ray)?)?;
            Some((place, [p.u, p.v]))
        })
        .collect();
    let mut distances = Vec::new();
    // The difference is small, so that a few steps of Gauss and Newton reach the best rotation.
    for _ in 0..4 {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        distances.clear();
        for (place, at) in &places {
            let ray = turn * Vector3::from(place.ray);
            let Some(projected) = lens.project(ray.into()) else { continue };
            let error = [at[0] - projected.point.u, at[1] - projected.point.v];
            distances.push(error[0].hypot(error[1]));
            for axis in 0..2 {
                let row = -ray.cross_matrix().transpose() * Vector3::from(projected.by_direction[axis]);
                normal += row * row.transpose();
                right += row * error[axis];
            }
        }
        let step = normal.cholesky().map_or(Vector3::zeros(), |c| c.solve(&right));
        turn = nalgebra::Rotation3::new(step).into_inner() * turn;
    }
    distances
}

/// Subtracts from each column the motion that a rotation explains.
fn remove_turn(columns: &mut DMatrix<f64>, by_turn: &DMatrix<f64>) {
    let Some(normal) = (by_turn.transpose() * by_turn).cholesky() else { return };
    let explained = by_turn * normal.solve(&(by_turn.transpose() * &*columns));
    *columns -= explained;
}
