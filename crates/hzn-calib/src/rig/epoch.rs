//! What the heads see at one epoch.

use hzn_core::report::Free;
use nalgebra::{Matrix3, Rotation3, Vector3};

/// The heads at one epoch, in the order of the rig; `None` for a head without an answer.
pub type Epoch = Vec<Option<Sighting>>;

/// The cone that a head sees, in its own camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Sighting {
    pub(super) axis: Vector3<f64>,
    pub(super) cos: f64,
    /// Tangent basis at `axis`.
    pub(super) basis: [Vector3<f64>; 2],
    /// Inverse covariance of the axis in this basis, and of the cosine.
    pub(super) information: Matrix3<f64>,
    /// Rotation from the axes that the rig has at the time of the picture to those at the epoch.
    pub(super) late: Rotation3<f64>,
}

impl Sighting {
    /// Takes the free fit of a head. `late` is the rotation from the axes that the rig has at the time of its picture
    /// to those at the epoch. `None` if the covariance is not positive definite.
    pub fn new(free: &Free<f64>, late: Rotation3<f64>) -> Option<Self> {
        let axis = Vector3::from(free.axis.xyz());
        let basis = tangent(&axis);
        let rows = free.covariance.rows();
        let p = Matrix3::from_fn(|i, j| rows[i][j]);
        let with_cos = Vector3::from(free.axis_with_cos?);
        let mut covariance = Matrix3::zeros();
        for (i, a) in basis.iter().enumerate() {
            for (j, b) in basis.iter().enumerate() {
                covariance[(i, j)] = a.dot(&(p * b));
            }
            covariance[(i, 2)] = a.dot(&with_cos);
            covariance[(2, i)] = a.dot(&with_cos);
        }
        covariance[(2, 2)] = free.var_cos;
        let information = covariance.cholesky()?.inverse();
        Some(Self { axis, cos: free.cos, basis, information, late })
    }
}

/// Returns a tangent basis at a unit vector.
pub(super) fn tangent(e: &Vector3<f64>) -> [Vector3<f64>; 2] {
    // The axis of the frame that is farthest from the vector.
    let helper = Vector3::ith(e.iamin(), 1.0);
    let first = e.cross(&helper).normalize();
    [first, e.cross(&first)]
}
