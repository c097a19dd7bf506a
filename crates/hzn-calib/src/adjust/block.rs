//! A picture in the adjustment: its observations, and its pose.

use hzn_core::camera::{Equation, Projected};
use nalgebra::{Rotation3, SMatrix, Vector3};

/// Number of unknowns of a pose.
pub(super) const POSE: usize = 6;
/// Number of unknowns of the bow of a board.
pub(crate) const BOW: usize = 2;

/// Derivatives of a direction in the camera frame by rotation (3) and translation (3).
type ByPose = SMatrix<f64, 3, POSE>;

/// A known point or direction with its place in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Observation {
    /// The point in the frame of the board, in millimetres; for a block without translation, a direction.
    pub(crate) place: Vector3<f64>,
    /// Measured image point (u, v), in pixels.
    pub(crate) at_px: [f64; 2],
    /// Weight from 0 to 1; an observation with weight 0 does not count.
    pub(crate) weight: f64,
    /// Depth of the place behind a flat board for each unknown of the bow, mm per mm; 0 for directions.
    pub(crate) by_bow: [f64; BOW],
}

/// The observations of a picture with the pose that projects them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Block {
    /// Rotation from the frame of the places to the camera frame.
    pub(crate) rotation: Rotation3<f64>,
    /// Origin of the frame of the places in the camera frame, in millimetres; `None` for directions at infinity.
    pub(crate) translation: Option<Vector3<f64>>,
    /// The observations.
    pub(crate) observations: Vec<Observation>,
}

impl Block {
    /// Returns the direction of a place in the camera frame, of any length.
    pub(crate) fn direction(&self, place: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * place + self.translation.unwrap_or_default()
    }

    /// Projects a place; `None` if the lens has no image point for it.
    pub(super) fn project(&self, lens: &Equation, place: &Vector3<f64>) -> Option<Projected> {
        lens.project(self.direction(place).into())
    }

    /// Returns the derivative of [`Self::direction`] by a small rotation after the pose's own, in radians, and by the
    /// translation, in millimetres.
    pub(super) fn by_pose(&self, place: &Vector3<f64>) -> ByPose {
        let turned = self.rotation * place;
        let mut by = ByPose::zeros();
        // A small rotation δ moves the vector p by δ × p = −p × δ.
        by.fixed_view_mut::<3, 3>(0, 0).copy_from(&-turned.cross_matrix());
        if self.translation.is_some() {
            by.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
        }
        by
    }

    /// Returns the derivatives of [`Self::direction`] by the unknowns of the bow, mm per mm.
    pub(super) fn by_bow(&self, o: &Observation) -> [Vector3<f64>; BOW] {
        o.by_bow.map(|depth| self.rotation * Vector3::z() * depth)
    }

    /// Returns the block with a board that is bent by so many millimetres more.
    pub(crate) fn bent(&self, bow_mm: [f64; BOW]) -> Self {
        let mut bent = self.clone();
        for o in &mut bent.observations {
            o.place.z += o.by_bow[0] * bow_mm[0] + o.by_bow[1] * bow_mm[1];
        }
        bent
    }

    /// Returns the block after a step of its pose.
    pub(super) fn moved(&self, step: &SMatrix<f64, POSE, 1>) -> Self {
        let turn = Rotation3::new(Vector3::new(step[0], step[1], step[2]));
        let shift = Vector3::new(step[3], step[4], step[5]);
        let mut rotation = turn * self.rotation;
        // Rounding of many steps would leave a matrix that is no rotation.
        rotation.renormalize();
        Self { rotation, translation: self.translation.map(|t| t + shift), observations: self.observations.clone() }
    }

    /// Returns the residuals measured − projected, in pixels; NaN where the lens has no image point.
    pub(crate) fn residuals_px(&self, lens: &Equation) -> Vec<[f64; 2]> {
        let residual = |o: &Observation| {
            let projected = self.project(lens, &o.place);
            projected.map_or([f64::NAN; 2], |p| [o.at_px[0] - p.point.u, o.at_px[1] - p.point.v])
        };
        self.observations.iter().map(residual).collect()
    }
}
