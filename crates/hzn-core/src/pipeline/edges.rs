//! The single stages, with access to the data between them. They serve to compare methods on simulated points, and to
//! replace one stage by another implementation (`hzn.consensus` and the modules next to it in the Python package).
//! Feature `_edges`.
//!
//! ```text
//! Sensor::level → Sensor::borders → Edges::pick → consensus → fit → fuse
//! ```

use super::look::Look;
use super::sensor::Sensor;
use super::workspace::{HOST_POINTS, HOST_WORDS, Lists};
use crate::base::linalg::basis;
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES, Lit};
use crate::geometry::camera::Camera;
use crate::geometry::frames::{Cam, Cov3, UnitVec3};
use crate::geometry::pixel::{ImagePoint, Pixel};
use crate::image::{Pixels, Profiles};
use crate::model::body::Expected;
use crate::model::found_limb::FoundLimb;
use crate::model::observer::{Border, Observer, Unobserved};
use crate::model::report::{Position, Report};
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
    /// The camera whose rays the points have.
    camera: Camera<T>,
    focal_px: T,
    /// Fraction of the points whose lit side is clipped; 0 unless the points were picked from a picture.
    clipped: T,
    /// Width and contrast along the edge; none unless the points were picked from a picture.
    profiles: Profiles,
}

/// The consensus: the cone that a method of rejection finds.
#[derive(Debug, Clone, Copy)]
pub struct ConsensusCone<T> {
    /// Axis of the cone, towards the body, in the camera frame.
    pub axis: UnitVec3<Cam, T>,
    /// cos of the half-angle.
    pub cos_half_angle: T,
    /// Number of draws.
    pub draws: u32,
    /// Whether no point was rejected, because the method leaves outliers to the weights of the fit.
    pub all: bool,
}

/// A fitted cone with its normal equations.
#[derive(Debug, Clone, Copy)]
pub struct Fitted<T>(pub(super) fit::Fit<T>);

impl<T: Real> Fitted<T> {
    /// Returns the axis of the cone, towards the body, in the camera frame.
    pub fn axis(&self) -> UnitVec3<Cam, T> {
        UnitVec3::assume_unit(self.0.e)
    }
    /// Returns the cos of the half-angle.
    pub fn cos_half_angle(&self) -> T {
        self.0.c
    }
    /// Returns the weighted RMS distance of the points from the limb, in pixels.
    pub fn rms_px(&self) -> T {
        self.0.rms_px
    }
    /// Returns the number of points with a weight above 0.
    pub fn inliers(&self) -> u32 {
        self.0.inliers
    }
}

/// The answer: a fit with the expected half-angle, or the known distance, fused.
#[derive(Debug, Clone, Copy)]
pub struct Fused<T> {
    /// Axis, towards the body, in the camera frame.
    pub axis: UnitVec3<Cam, T>,
    /// Covariance of the axis, rad².
    pub covariance: Cov3<Cam, T>,
    /// cos of the half-angle.
    pub cos_half_angle: T,
    /// The position of the body, if the points are those of [`Edges::for_body`].
    pub position: Option<Position<T>>,
}

impl<T: Real> Sensor<T> {
    /// Finds the threshold between dark and lit, by the method that is configured for the body.
    ///
    /// # Errors
    /// Returns `too-dark`, `too-bright`, or `no-limb` when dark and lit pixels cannot be separated.
    pub fn level<P: Pixels>(&self, picture: &P, expected: &Expected<T>) -> Result<Level<T>, Status> {
        let config = self.config();
        let levels = config.threshold_of(expected.which);
        let seed = config.consensus.seed;
        threshold::split(picture, self.region(), &config.brightness, levels, expected.level, seed, &Unobserved)
    }

    /// Returns the border pixels of every edge of a picture at a threshold, in order along each edge. The edges are in
    /// the order in which the pipeline examines them. `[limits]` does not apply: all edges are returned.
    pub fn borders<P: Pixels>(&self, picture: &P, level: u16, expected: &Expected<T>) -> Vec<Vec<Pixel>> {
        let (mut border, mut marks) = (vec![Pixel { x: 0, y: 0 }; HOST_POINTS], vec![0; HOST_WORDS]);
        // No edge is judged here, so that the blocks of edge points can be empty.
        let lists = Lists { border: &mut border, blocks: &mut [], marks: &mut marks };
        let borders = Borders::default();
        let binary = BinaryPicture::new(picture, &self.region, level, &borders).with_blooming(expected.blooms());
        let report = &mut Report::empty();
        let look = Look { lists, picture, expected, taken: &[], observer: &borders, report };
        self.search(look, &binary, WorkBudget::unlimited());
        borders.0.into_inner()
    }
}

/// Collects the edges and skips the later stages, so that the search reaches every edge.
#[derive(Default)]
struct Borders(RefCell<Vec<Vec<Pixel>>>);

impl<T> Observer<T> for Borders {
    fn edge(&self, _: u32, border: Border<'_>) {
        self.0.borrow_mut().push(border.pixels().collect());
    }
    fn wants(&self, _: u32) -> bool {
        false
    }
}

impl<T: Real> Edges<T> {
    /// Makes edge points in the order of the list, as the stage `edge_points` does. The lit side of each point is the
    /// side of the direction `lit`.
    pub fn new(camera: &Camera<T>, points: &[ImagePoint<T>], lit: &UnitVec3<Cam, T>) -> Self {
        let side = |p: &ImagePoint<T>| {
            camera.ray(*p).map_or(Lit::Below, |ray| {
                let j = ray.jacobian();
                let e = lit.xyz();
                let g: [T; 2] = core::array::from_fn(|k| (0..3).map(|r| j[r][k] * e[r]).fold(T::ZERO, |a, b| a + b));
                Lit::from_gradient(g)
            })
        };
        Self::from_points(camera, points.iter().map(|p| (*p, side(p))).collect())
    }

    /// Does the same as [`Self::new`], with the direction towards the light in the picture, (u, v), for each point.
    pub fn towards(camera: &Camera<T>, points: &[(ImagePoint<T>, [T; 2])]) -> Self {
        Self::from_points(camera, points.iter().map(|(p, lit)| (*p, Lit::from_gradient(*lit))).collect())
    }

    /// Locates the edge points of a border, as the stage `edge_points` does.
    pub fn pick<P: Pixels>(sensor: &Sensor<T>, picture: &P, level: u16, border: &[Pixel]) -> Self {
        let binary = BinaryPicture::new(picture, sensor.region(), level, &Unobserved)
            .with_blooming(sensor.config().body.blooms())
            .with_tone(sensor.config().input.tone);
        let mut blocks = vec![Block::<T>::default(); border.len().div_ceil(LANES)];
        let made =
            edge_points::locate_edge_points(&binary, &sensor.config().edge_points, border, 0, &mut blocks, u32::MAX);
        let point = |i: usize| (blocks[i / LANES].point(i % LANES), blocks[i / LANES].lit(i % LANES));
        let clipped = T::from_i32(made.clipped as i32) / T::from_i32(made.count.max(1) as i32);
        let profiles = made.profiles;
        Self { clipped, profiles, ..Self::from_points(sensor.camera(), (0..made.count as usize).map(point).collect()) }
    }

    pub(super) fn from_points(camera: &Camera<T>, points: Vec<(ImagePoint<T>, Lit)>) -> Self {
        let mut blocks = vec![Block::<T>::default(); points.len().div_ceil(LANES)];
        for (i, &(point, lit)) in points.iter().enumerate() {
            blocks[i / LANES].set_point(i % LANES, point, lit);
        }
        rays::to_rays(camera, &mut blocks);
        let (fx, fy) = camera.focal_px();
        Self {
            blocks,
            points,
            camera: camera.clone(),
            focal_px: (fx + fy) * T::from_f64(0.5),
            clipped: T::ZERO,
            profiles: Profiles::default(),
        }
    }

    /// Returns the points in the picture, and the lit side of each as a step of ±1 along u or v.
    pub fn points(&self) -> impl ExactSizeIterator<Item = (ImagePoint<T>, [i8; 2])> {
        self.points.iter().map(|(p, lit)| (*p, lit.step()))
    }
    /// Returns the unit ray of each point, in the camera frame.
    pub fn rays(&self) -> impl Iterator<Item = [T; 3]> {
        (0..self.points.len()).map(|i| self.blocks[i / LANES].ray(i % LANES).into())
    }
    /// Returns the weight of each point: 0 for a point that does not count; after the fit, the weight in the fit.
    pub fn weights(&self) -> impl Iterator<Item = T> {
        (0..self.points.len()).map(|i| self.blocks[i / LANES].weight[i % LANES])
    }
    /// Sets the weights of the first points, from 0 to 1. The weight of a point outside the lens's field of view stays
    /// 0.
    pub fn set_weights(&mut self, weights: &[T]) {
        for (i, &weight) in weights.iter().enumerate().take(self.points.len()) {
            let block = &mut self.blocks[i / LANES];
            // A point without a ray has no derivative. A weight would let it take part in the fit with a distance that
            // is not finite.
            let seen = block.m.iter().any(|m| m[i % LANES] != T::ZERO);
            block.weight[i % LANES] = if seen { weight } else { T::ZERO };
        }
    }
    /// Returns the number of points that were not rejected.
    pub fn inliers(&self) -> u32 {
        self.weights().filter(|w| *w > T::ZERO).count() as u32
    }

    /// Removes the points on the limb of another body that was found before, and returns their number. The pipeline
    /// drops an edge if more than half of its points are removed.
    pub fn withdraw(&mut self, axis: &UnitVec3<Cam, T>, cos_half_angle: T, config: &consensus::Config) -> u32 {
        let taken = FoundLimb::circular(*axis.v(), cos_half_angle);
        taken.withdraw(&mut self.blocks, &self.camera, T::from_f64(config.threshold_px))
    }

    /// Returns the largest distance of an inlier from the limb. The distance comes from the noise between neighbouring
    /// points and does not depend on the weights.
    fn threshold(&self, expected: &Expected<T>, config: &consensus::Config) -> consensus::Threshold<T> {
        let uneven_px = expected.uneven_px(&self.camera);
        consensus::Threshold::new(&self.blocks, self.points.len() as u32, expected, self.focal_px, uneven_px, config)
    }

    /// Rejects outliers and returns the consensus; `None` if there is none.
    pub fn consensus(&mut self, expected: &Expected<T>, config: &consensus::Config) -> Option<ConsensusCone<T>> {
        let (count, mut work) = (self.points.len() as u32, WorkBudget::unlimited());
        let expected = &expected.clipped(self.clipped);
        let threshold = self.threshold(expected, config);
        let found = consensus::find(&mut self.blocks, count, expected, self.focal_px, threshold, config, &mut work)?;
        let axis = UnitVec3::assume_unit(found.e);
        Some(ConsensusCone { axis, cos_half_angle: found.c, draws: found.draws, all: found.all })
    }

    /// Fits the cone, beginning at the consensus. Stores in each point its weight in the fit.
    pub fn fit(&mut self, sensor: &Sensor<T>, start: &ConsensusCone<T>, expected: &Expected<T>) -> Option<Fitted<T>> {
        let config = sensor.config();
        let expected = &expected.clipped(self.clipped);
        let start =
            consensus::Consensus { e: *start.axis.v(), c: start.cos_half_angle, draws: start.draws, all: start.all };
        let threshold = self.threshold(expected, &config.consensus).px;
        let noise = sensor.config.noise_model_of(expected.which);
        fit::fit(&mut self.blocks, &start, expected, &self.camera, threshold, &config.fit, noise).map(Fitted)
    }

    /// Makes a fit of a cone that was fitted elsewhere: computes the normal equations of the weighted points at this
    /// cone.
    pub fn fit_at(&mut self, axis: &UnitVec3<Cam, T>, cos_half_angle: T) -> Option<Fitted<T>> {
        fit::fit_at(&mut self.blocks, *axis.v(), cos_half_angle).map(Fitted)
    }

    /// Computes the covariance of a fit and fuses the fit with the expected half-angle.
    pub fn fuse(&self, sensor: &Sensor<T>, fit: &Fitted<T>, expected: &Expected<T>) -> Option<Fused<T>> {
        let noise = sensor.config.noise_model_of(expected.which);
        let expected = &expected.clipped(self.clipped);
        // The expected size depends on the direction, which is known only after the fit.
        let expected = &expected.seen_along(&fit.0.e);
        let fit = fit::Fit { profiles: self.profiles, tone: sensor.config.input.tone, ..fit.0 };
        let fused = covariance::fuse(&self.blocks, &fit, expected, noise, &sensor.config().fit, &self.camera, None)?;
        let answer = Fused {
            axis: UnitVec3::assume_unit(fused.e),
            covariance: Cov3::from_tangent(&basis(&fused.e).0, &basis(&fused.e).1, fused.p),
            cos_half_angle: fused.c,
            position: None,
        };
        if let Some(target) = expected.target() {
            let placed = covariance::place(&fused, target, expected.radius_m)?;
            let (b1, b2) = basis(&placed.axis);
            return Some(Fused {
                axis: UnitVec3::assume_unit(placed.axis),
                covariance: Cov3::from_tangent(&b1, &b2, placed.p),
                cos_half_angle: placed.half_angles_rad[1].sin_cos().1,
                position: placed.position,
            });
        }
        Some(answer)
    }
}
