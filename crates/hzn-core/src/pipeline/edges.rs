//! The stages one at a time, with the parts between them in the open: for comparing methods on simulated points, and
//! for trying a step of one's own in place of one of these (the Python package's `hzn.consensus` and its neighbours).
//! Feature `_edges`.
//!
//! ```text
//! Sensor::level → Sensor::borders → Edges::pick → reject → fit → fuse
//! ```

use super::found_limb::FoundLimb;
use super::sensor::Sensor;
use super::workspace::{HOST_POINTS, HOST_WORDS, Lists};
use crate::base::linalg::basis;
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES, Lit};
use crate::geometry::camera::Camera;
use crate::geometry::frames::{Cam, Cov3, UnitVec3};
use crate::geometry::pixel::{ImagePoint, Pixel};
use crate::image::Pixels;
use crate::model::body::Expected;
use crate::model::observer::{Observer, Unobserved};
use crate::model::report::Report;
use crate::model::status::Status;
use crate::model::work::WorkBudget;
use crate::stages::consensus;
use crate::stages::contour::BinaryPicture;
use crate::stages::covariance;
use crate::stages::edge_points;
use crate::stages::fit;
use crate::stages::rays;
use crate::stages::threshold::{self, Level};
use std::cell::RefCell;
use std::vec;
use std::vec::Vec;

/// Edge points with their rays.
#[derive(Debug, Clone)]
pub struct Edges<T> {
    pub(crate) blocks: Vec<Block<T>>,
    points: Vec<(ImagePoint<T>, Lit)>,
    focal_px: T,
    /// The part of the points whose lit side is clipped, where they were picked from a picture.
    clipped: T,
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
    /// No point is to be left out.
    pub all: bool,
}

/// A cone that was fitted, with its normal equations.
#[derive(Debug, Clone, Copy)]
pub struct Fitted<T>(fit::Fit<T>);

impl<T: Real> Fitted<T> {
    /// Axis of the cone, towards the body.
    pub fn axis(&self) -> UnitVec3<Cam, T> {
        UnitVec3::assume_unit(self.0.e)
    }
    /// cos of its half-angle.
    pub fn cos_half_angle(&self) -> T {
        self.0.c
    }
    /// Weighted RMS distance of the points from the limb, pixels.
    pub fn rms_px(&self) -> T {
        self.0.rms_px
    }
    /// Points with a weight.
    pub fn inliers(&self) -> u32 {
        self.0.inliers
    }
}

/// The answer: a fit with the expected half-angle fused.
#[derive(Debug, Clone, Copy)]
pub struct Fused<T> {
    /// Axis, towards the body.
    pub axis: UnitVec3<Cam, T>,
    /// Its covariance, rad².
    pub covariance: Cov3<Cam, T>,
    /// cos of the half-angle.
    pub cos_half_angle: T,
}

impl<T: Real> Sensor<T> {
    /// The level between dark and lit, of the body's own method.
    ///
    /// # Errors
    /// `too-dark`, `too-bright`, or `no-limb` when there are no two sides.
    pub fn level<P: Pixels>(&self, picture: &P, expected: &Expected<T>) -> Result<Level<T>, Status> {
        let config = self.config();
        let levels = config.levels_of(expected.which);
        let seed = config.reject.seed;
        threshold::split(picture, self.region(), &config.gate, levels, expected.level, seed, &Unobserved)
    }

    /// Border pixels of every edge of a picture at a level, in order along each; the edges in the order in which the
    /// pipeline looks at them. It stops at none, whatever `[limits]` say.
    pub fn borders<P: Pixels>(&self, picture: &P, level: u16, expected: &Expected<T>) -> Vec<Vec<Pixel>> {
        let (mut border, mut marks) = (vec![Pixel { x: 0, y: 0 }; HOST_POINTS], vec![0; HOST_WORDS]);
        let lists = Lists { border: &mut border, blocks: &mut [], marks: &mut marks };
        let borders = Borders::default();
        let binary = BinaryPicture::new(picture, &self.region, level, &borders).blooming(expected.blooms());
        self.search(lists, &binary, WorkBudget::unlimited(), expected, &[], &mut Report::of_nothing());
        borders.0.into_inner()
    }
}

/// Collects the edges and lets none go on.
#[derive(Default)]
struct Borders(RefCell<Vec<Vec<Pixel>>>);

impl<T> Observer<T> for Borders {
    fn edge(&self, _: u32, border: impl Iterator<Item = Pixel>, _: u32) {
        self.0.borrow_mut().push(border.collect());
    }
    fn wants(&self, _: u32) -> bool {
        false
    }
}

impl<T: Real> Edges<T> {
    /// Points as the candidates stage leaves them, in the order of the list; on each the light is on the side of `lit`.
    pub fn new(camera: &Camera<T>, points: &[ImagePoint<T>], lit: &UnitVec3<Cam, T>) -> Self {
        let side = |p: &ImagePoint<T>| {
            camera.ray(*p).map_or(Lit::Below, |ray| {
                let j = ray.jacobian();
                let e = lit.xyz();
                let g: [T; 2] = core::array::from_fn(|k| (0..3).map(|r| j[r][k] * e[r]).fold(T::ZERO, |a, b| a + b));
                Lit::towards(g)
            })
        };
        Self::from_points(camera, points.iter().map(|p| (*p, side(p))).collect())
    }

    /// As [`Self::new`], with the direction of the light in the picture, (u, v), for each point.
    pub fn towards(camera: &Camera<T>, points: &[(ImagePoint<T>, [T; 2])]) -> Self {
        Self::from_points(camera, points.iter().map(|(p, lit)| (*p, Lit::towards(*lit))).collect())
    }

    /// The points that the candidates stage makes of a border.
    pub fn pick<P: Pixels>(sensor: &Sensor<T>, picture: &P, level: u16, border: &[Pixel]) -> Self {
        let binary =
            BinaryPicture::new(picture, sensor.region(), level, &Unobserved).blooming(sensor.config().body.blooms());
        let mut blocks = vec![Block::<T>::default(); border.len().div_ceil(LANES)];
        let made = edge_points::pick(&binary, &sensor.config().candidates, border, 0, &mut blocks, u32::MAX);
        let point = |i: usize| (blocks[i / LANES].point(i % LANES), blocks[i / LANES].lit(i % LANES));
        let clipped = T::from_i32(made.clipped as i32) / T::from_i32(made.count.max(1) as i32);
        Self { clipped, ..Self::from_points(sensor.camera(), (0..made.count as usize).map(point).collect()) }
    }

    fn from_points(camera: &Camera<T>, points: Vec<(ImagePoint<T>, Lit)>) -> Self {
        let mut blocks = vec![Block::<T>::default(); points.len().div_ceil(LANES)];
        for (i, &(point, lit)) in points.iter().enumerate() {
            blocks[i / LANES].set_point(i % LANES, point, lit);
        }
        rays::to_rays(camera, &mut blocks);
        let (fx, fy) = camera.focal_px();
        Self { blocks, points, focal_px: (fx + fy) * T::from_f64(0.5), clipped: T::ZERO }
    }

    /// The points in the picture, and on which side of each the light is: a step along u or v.
    pub fn points(&self) -> impl ExactSizeIterator<Item = (ImagePoint<T>, [i8; 2])> {
        self.points.iter().map(|(p, lit)| (*p, lit.step()))
    }
    /// Their unit rays.
    pub fn rays(&self) -> impl Iterator<Item = [T; 3]> {
        (0..self.points.len()).map(|i| self.blocks[i / LANES].ray(i % LANES).into())
    }
    /// Their weights: 0 for a point that may not count, after the fit the one that it had.
    pub fn weights(&self) -> impl Iterator<Item = T> {
        (0..self.points.len()).map(|i| self.blocks[i / LANES].weight[i % LANES])
    }
    /// Sets the weights of the first points, from 0 to 1. A point that the lens does not see stays at 0.
    pub fn set_weights(&mut self, weights: &[T]) {
        for (i, &weight) in weights.iter().enumerate().take(self.points.len()) {
            let block = &mut self.blocks[i / LANES];
            let seen = block.m.iter().any(|m| m[i % LANES] != T::ZERO);
            block.weight[i % LANES] = if seen { weight } else { T::ZERO };
        }
    }
    /// Points that were not rejected.
    pub fn inliers(&self) -> u32 {
        self.weights().filter(|w| *w > T::ZERO).count() as u32
    }

    /// Takes out the points on the limb of another body, which was found before; how many there were. The pipeline
    /// tries an edge no further that has more than half of its points there.
    pub fn withdraw(&mut self, axis: &UnitVec3<Cam, T>, cos_half_angle: T, config: &consensus::Config) -> u32 {
        let taken = FoundLimb { e: *axis.v(), c: cos_half_angle };
        taken.withdraw(&mut self.blocks, T::from_f64(config.threshold_px))
    }

    /// The distance from the limb up to which a point can be an inlier: by the noise from point to point, whatever the
    /// weights are.
    fn threshold(&self, expected: &Expected<T>, config: &consensus::Config) -> consensus::Threshold<T> {
        consensus::Threshold::new(&self.blocks, self.points.len() as u32, expected, self.focal_px, config)
    }

    /// Rejects outliers.
    pub fn reject(&mut self, expected: &Expected<T>, config: &consensus::Config) -> Option<Agreed<T>> {
        let (count, mut work) = (self.points.len() as u32, WorkBudget::unlimited());
        let expected = &expected.clipped(self.clipped);
        let threshold = self.threshold(expected, config);
        let found = consensus::keep(&mut self.blocks, count, expected, self.focal_px, threshold, config, &mut work)?;
        let axis = UnitVec3::assume_unit(found.e);
        Some(Agreed { axis, cos_half_angle: found.c, draws: found.draws, all: found.all })
    }

    /// Fits the cone, from what a method of rejection has found. Leaves in each point the weight that it had.
    pub fn fit(&mut self, sensor: &Sensor<T>, start: &Agreed<T>, expected: &Expected<T>) -> Option<Fitted<T>> {
        let config = sensor.config();
        let expected = &expected.clipped(self.clipped);
        let start =
            consensus::Consensus { e: *start.axis.v(), c: start.cos_half_angle, draws: start.draws, all: start.all };
        let threshold = self.threshold(expected, &config.reject).px;
        let noise = sensor.config.noise_of(expected.which);
        fit::fit(&mut self.blocks, &start, expected, sensor.camera(), threshold, &config.estimate, noise).map(Fitted)
    }

    /// The cone that somebody else has fitted, with the normal equations of the points at it, by their weights.
    pub fn given(&mut self, axis: &UnitVec3<Cam, T>, cos_half_angle: T) -> Option<Fitted<T>> {
        fit::given(&mut self.blocks, *axis.v(), cos_half_angle).map(Fitted)
    }

    /// The covariance of a fit, and the expected half-angle fused with it.
    pub fn fuse(&self, sensor: &Sensor<T>, fit: &Fitted<T>, expected: &Expected<T>) -> Option<Fused<T>> {
        let noise = sensor.config.noise_of(expected.which);
        let expected = &expected.clipped(self.clipped);
        let fused =
            covariance::fuse(&self.blocks, &fit.0, expected, noise, &sensor.config().estimate, sensor.camera(), None)?;
        let (b1, b2) = basis(&fused.e);
        Some(Fused {
            axis: UnitVec3::assume_unit(fused.e),
            covariance: Cov3::from_tangent(&b1, &b2, fused.p),
            cos_half_angle: fused.c,
        })
    }
}
