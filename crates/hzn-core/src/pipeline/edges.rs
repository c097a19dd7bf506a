//! The stages after the picture on edge points that were made elsewhere: for comparing methods on simulated points.
//! Not part of the interface that stays (feature `_edges`).

use crate::block::{Block, LANES, Lit};
use crate::body::Expected;
use crate::camera::Camera;
use crate::frames::{Cam, UnitVec3};
use crate::pixel::ImagePoint;
use crate::real::Real;
use crate::{reject, undistort};
use std::vec;
use std::vec::Vec;

/// Edge points with their rays.
#[derive(Debug, Clone)]
pub struct Edges<T> {
    pub(crate) blocks: Vec<Block<T>>,
    count: u32,
    focal_px: T,
}

/// What a method of rejection finds.
#[derive(Debug, Clone, Copy)]
pub struct Agreed<T> {
    /// Axis of the cone, towards the body.
    pub axis: UnitVec3<Cam, T>,
    /// cos of its half-angle.
    pub cos_half_angle: T,
    /// Draws made.
    pub draws: u32,
}

impl<T: Real> Edges<T> {
    /// Points as the candidates stage leaves them, in the order of the list; on each the light is on the side of `lit`.
    pub fn new(camera: &Camera<T>, points: &[ImagePoint<T>], lit: &UnitVec3<Cam, T>) -> Self {
        let mut blocks = vec![Block::<T>::default(); points.len().div_ceil(LANES)];
        for (i, &p) in points.iter().enumerate() {
            let side = camera.ray(p).map_or(Lit::Below, |ray| {
                let j = ray.jacobian();
                let e = lit.xyz();
                let g: [T; 2] = core::array::from_fn(|k| (0..3).map(|r| j[r][k] * e[r]).fold(T::ZERO, |a, b| a + b));
                match (g[0].abs() >= g[1].abs(), g[0] > T::ZERO, g[1] > T::ZERO) {
                    (true, true, _) => Lit::Right,
                    (true, false, _) => Lit::Left,
                    (false, _, true) => Lit::Below,
                    (false, _, false) => Lit::Above,
                }
            });
            blocks[i / LANES].set_point(i % LANES, p, side);
        }
        undistort::to_rays(camera, &mut blocks);
        let (fx, fy) = camera.focal_px();
        Self { blocks, count: points.len() as u32, focal_px: (fx + fy) * T::of(0.5) }
    }

    /// Rejects outliers.
    pub fn reject(&mut self, expected: &Expected<T>, config: &reject::Config) -> Option<Agreed<T>> {
        let found = reject::keep(&mut self.blocks, self.count, expected, self.focal_px, config)?;
        let axis = UnitVec3::assume_unit(found.e);
        Some(Agreed { axis, cos_half_angle: found.c, draws: found.draws })
    }

    /// Points that were not rejected.
    pub fn inliers(&self) -> u32 {
        self.blocks.iter().map(|b| b.weight.iter().filter(|w| **w > T::ZERO).count() as u32).sum()
    }
}
