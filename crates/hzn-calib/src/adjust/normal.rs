//! The normal equations of an adjustment, and their solution with the poses eliminated.

use hzn_core::camera::{Config, Equation};
use nalgebra::{SMatrix, SVector};

use super::block::{Block, POSE};
use super::free::{Free, MAX_FREE};

type Lens = SMatrix<f64, MAX_FREE, MAX_FREE>;
type Cross = SMatrix<f64, MAX_FREE, POSE>;
type Pose = SMatrix<f64, POSE, POSE>;

/// The parts of the normal equations that belong to one block: Jᵀ W J and Jᵀ W r.
struct Part {
    lens: Lens,
    lens_right: SVector<f64, MAX_FREE>,
    cross: Cross,
    pose: Pose,
    right: SVector<f64, POSE>,
}

/// The normal equations of all blocks at one place.
pub(super) struct Normal {
    lens: Lens,
    right: SVector<f64, MAX_FREE>,
    parts: Vec<Part>,
    /// Weighted sum of the squared residuals, px².
    pub(super) cost: f64,
}

/// A step of all unknowns.
pub(super) struct Step {
    pub(super) lens: SVector<f64, MAX_FREE>,
    pub(super) poses: Vec<SVector<f64, POSE>>,
    /// Decrease of the cost that the linear model predicts, px².
    pub(super) predicted: f64,
}

/// Returns the weighted sum of the squared residuals, px²; infinite if an observation that counts has no image point.
pub(super) fn cost(config: &Config, blocks: &[Block]) -> f64 {
    let lens = Equation::new(config);
    let of_block = |block: &Block| {
        let squares = block
            .residuals_px(&lens)
            .into_iter()
            .zip(&block.observations)
            .map(|([u, v], o)| if o.weight > 0.0 { o.weight * (u * u + v * v) } else { 0.0 });
        squares.sum::<f64>()
    };
    let sum = blocks.iter().map(of_block).sum::<f64>();
    if sum.is_finite() { sum } else { f64::INFINITY }
}

impl Normal {
    /// Makes the normal equations; `None` if an observation that counts has no image point.
    pub(super) fn new(config: &Config, blocks: &[Block], free: &Free) -> Option<Self> {
        let lens = Equation::new(config);
        let mut normal =
            Self { lens: Lens::zeros(), right: SVector::zeros(), parts: Vec::with_capacity(blocks.len()), cost: 0.0 };
        for block in blocks {
            let part = normal.add(block, &lens, free)?;
            normal.lens += part.lens;
            normal.right += part.lens_right;
            normal.parts.push(part);
        }
        for unused in free.len()..MAX_FREE {
            normal.lens[(unused, unused)] = 1.0;
        }
        Some(normal)
    }

    /// Adds the cost of a block and returns its part of the equations.
    fn add(&mut self, block: &Block, lens: &Equation, free: &Free) -> Option<Part> {
        let mut part = Part {
            lens: Lens::zeros(),
            lens_right: SVector::zeros(),
            cross: Cross::zeros(),
            pose: Pose::zeros(),
            right: SVector::zeros(),
        };
        for o in block.observations.iter().filter(|o| o.weight > 0.0) {
            let projected = block.project(lens, &o.place)?;
            let by_pose = block.by_pose(&o.place);
            let by_bow = block.by_bow(o);
            let residual = [o.at_px[0] - projected.point.u, o.at_px[1] - projected.point.v];
            for axis in 0..2 {
                let by_direction = SMatrix::<f64, 1, 3>::from(projected.by_direction[axis]);
                let by_bow = by_bow.map(|by| (by_direction * by)[0]);
                let by_lens = SVector::from(free.gather(&projected.by_intrinsics[axis], by_bow));
                let pose_row = (by_direction * by_pose).transpose();
                part.lens += by_lens * by_lens.transpose() * o.weight;
                part.lens_right += by_lens * (o.weight * residual[axis]);
                part.cross += by_lens * pose_row.transpose() * o.weight;
                part.pose += pose_row * pose_row.transpose() * o.weight;
                part.right += pose_row * (o.weight * residual[axis]);
                self.cost += o.weight * residual[axis] * residual[axis];
            }
        }
        if block.translation.is_none() {
            (3..POSE).for_each(|unused| part.pose[(unused, unused)] = 1.0);
        }
        self.cost.is_finite().then_some(part)
    }

    /// Solves for the step with the diagonal enlarged by the factor 1 + `damping`; `None` if the equations are
    /// singular.
    pub(super) fn step(&self, damping: f64) -> Option<Step> {
        let mut lens = self.lens;
        (0..MAX_FREE).for_each(|i| lens[(i, i)] *= 1.0 + damping);
        let mut right = self.right;
        let mut inverses = Vec::with_capacity(self.parts.len());
        for part in &self.parts {
            let mut pose = part.pose;
            (0..POSE).for_each(|i| pose[(i, i)] *= 1.0 + damping);
            let inverse = pose.cholesky()?.inverse();
            lens -= part.cross * inverse * part.cross.transpose();
            right -= part.cross * inverse * part.right;
            inverses.push(inverse);
        }
        let lens_step = lens.cholesky()?.solve(&right);
        let back = |(part, inverse): (&Part, &Pose)| inverse * (part.right - part.cross.transpose() * lens_step);
        let poses: Vec<_> = self.parts.iter().zip(&inverses).map(back).collect();
        let along =
            lens_step.dot(&self.right) + poses.iter().zip(&self.parts).map(|(s, p)| s.dot(&p.right)).sum::<f64>();
        Some(Step { lens: lens_step, poses, predicted: along })
    }

    /// Returns for each block the information matrix of the shared unknowns with an unknown pose, for observations of
    /// 1 px, and the gradient of the block's cost with the pose eliminated.
    pub(super) fn reduced(&self) -> Option<Vec<(Lens, SVector<f64, MAX_FREE>)>> {
        let each = self.parts.iter().map(|part| {
            let by_pose = part.cross * part.pose.cholesky()?.inverse();
            Some((part.lens - by_pose * part.cross.transpose(), part.lens_right - by_pose * part.right))
        });
        each.collect()
    }
}
