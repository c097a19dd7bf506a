//! The unknowns of an orbit.

use hzn_nav::frames::{Cam, Rotation, Vehicle};
use hzn_nav::options::{Block, CameraOptions, Mode, Options};
use nalgebra::{DVector, Matrix3xX, Vector3};

use super::dynamics::Motion;
use crate::settings::{self, Settings};
use crate::solve::Lens;

/// Part of the variance of a slow error that each of its three parts has: one stays the same all flight, one changes
/// with the time of `orbit.slow_error_time_s`, and one changes [`FASTER`] times as fast.
///
/// A covariance does not say for how long an error stays. The told height, the step from ground to air and the shading
/// of the lens are the same in every picture of a camera that keeps its attitude to the horizon. Light and season
/// change on the way around the Earth, and clouds and ground below the limb in a few pictures. One time for all would
/// promise that the others average out. With one half for each, an error of one kind only is larger than told by at
/// most the square root of two; the price is that a mixture is told larger than it is, by less than that.
pub(super) const SHARE: f64 = 0.5;
/// Share of its sigma within which a considered error is held.
const HELD: f64 = 1e-4;
/// How much faster the third part changes.
pub(super) const FASTER: f64 = 10.0;

/// Places of the errors that last the whole flight, with what was known of them before.
#[derive(Debug, Clone, Default)]
pub(super) struct Places {
    pub(super) mounts: Vec<Option<usize>>,
    pub(super) clocks: Vec<Option<usize>>,
    pub(super) height: Option<usize>,
    pub(super) latitude: Option<usize>,
    /// The relative error of the drag.
    pub(super) drag: Option<usize>,
    /// The part of the slow error that stays the same all flight, over its root, of the cameras that have one.
    pub(super) lasting: Vec<Option<usize>>,
    /// The lens of each camera, if it is unknown.
    pub(super) lenses: Vec<Option<LensPlace>>,
    /// 1-sigma of each: rad, s, km, 1.
    pub(super) sigmas: Vec<f64>,
    /// Whether each is considered: it keeps its told value, and its sigma is part of the covariance of the others.
    pub(super) considered: Vec<bool>,
}

/// The unknowns of a lens: independent numbers with a sigma of 1.
#[derive(Debug, Clone)]
pub(super) struct LensPlace {
    pub(super) first: usize,
    /// What they do to the focal length (a fraction of itself) and to the principal point (px).
    pub(super) root: Matrix3xX<f64>,
}

/// A camera with its name and, if that is unknown, its lens.
pub(super) struct OneCamera<'a> {
    pub(super) name: &'a str,
    pub(super) options: CameraOptions,
    pub(super) lens: Option<Lens>,
}

impl Places {
    pub(super) fn new(options: &Options, cameras: &[OneCamera<'_>], settings: &Settings) -> Self {
        let orbit = &settings.orbit;
        let mut out = Self::default();
        for camera in cameras {
            let mount = out.add(&camera.options.misalignment, 3);
            let clock = out.add(&camera.options.clock, 1);
            out.mounts.push(mount);
            out.clocks.push(clock);
        }
        out.height = out.add(&options.limb_height, 1);
        out.latitude = out.add(&options.limb_latitude, 2);
        let drag = if orbit.ballistic_m2_kg > 0.0 { 0.01 * orbit.drag_sigma_percent } else { 0.0 };
        out.drag = out.add(&Block { mode: Mode::Considered, sigma: drag }, 1);
        for camera in cameras {
            let lasting = out.add(&Block { mode: camera.options.slow_error, sigma: SHARE.sqrt() }, 3);
            out.lasting.push(lasting);
        }
        for camera in cameras {
            let lens = camera.lens.as_ref().map(|lens| out.add_lens(lens, settings.camera(camera.name)));
            out.lenses.push(lens);
        }
        out
    }

    fn add_lens(&mut self, lens: &Lens, settings: &settings::Camera) -> LensPlace {
        let all = lens.independent(settings);
        let first = self.sigmas.len();
        self.sigmas.extend(all.iter().map(|_| 1.0));
        self.considered.extend(all.iter().map(|one| one.is_considered));
        let columns: Vec<Vector3<f64>> = all.iter().map(|one| one.by).collect();
        LensPlace { first, root: Matrix3xX::from_columns(&columns) }
    }

    /// Adds an error with this number of components, unless it does not exist or is known exactly.
    fn add(&mut self, block: &Block, components: usize) -> Option<usize> {
        let exists = block.mode != Mode::Off && block.sigma > 0.0;
        let first = self.sigmas.len();
        exists.then(|| {
            self.sigmas.extend(std::iter::repeat_n(block.sigma, components));
            self.considered.extend(std::iter::repeat_n(block.mode == Mode::Considered, components));
            first
        })
    }

    pub(super) fn len(&self) -> usize {
        self.sigmas.len()
    }
    /// Returns the sigmas with which the estimates are held at what was told.
    pub(super) fn holding_sigmas(&self) -> Vec<f64> {
        let all = self.sigmas.iter().zip(&self.considered);
        all.map(|(sigma, is_considered)| if *is_considered { HELD * sigma } else { *sigma }).collect()
    }
    /// Returns the considered errors with their sigmas.
    pub(super) fn considered(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.sigmas.iter().copied().enumerate().zip(&self.considered).filter(|(_, is)| **is).map(|(one, _)| one)
    }
}

/// Estimates of all unknowns.
#[derive(Debug, Clone)]
pub(super) struct Estimates {
    /// Times of the knots, s.
    pub(super) times_s: Vec<f64>,
    pub(super) knots: Vec<Motion>,
    pub(super) shared: DVector<f64>,
    /// The two parts of the slow error that change, of each sight, over their roots.
    pub(super) slow: Vec<Vector3<f64>>,
    /// The error of each attitude of the star tracker, rad in ECEF.
    pub(super) attitudes: Vec<Vector3<f64>>,
}

impl Estimates {
    pub(super) fn shared_block(&self) -> usize {
        self.knots.len()
    }
    pub(super) fn slow_block(&self, index: usize) -> usize {
        self.knots.len() + 1 + index
    }
    pub(super) fn attitude_block(&self, row: usize) -> usize {
        self.knots.len() + 1 + self.slow.len() + row
    }

    /// Returns the sizes of all blocks.
    pub(super) fn sizes(&self) -> Vec<usize> {
        let mut sizes = vec![6; self.knots.len()];
        sizes.push(self.shared.len());
        sizes.resize(sizes.len() + self.slow.len() + self.attitudes.len(), 3);
        sizes
    }

    /// Returns the number of the last knot at or before a time.
    pub(super) fn knot_before(&self, time_s: f64) -> usize {
        self.times_s.partition_point(|t| *t <= time_s).saturating_sub(1)
    }

    /// Returns the estimates after a step, whose parts `part` gives.
    pub(super) fn moved(&self, part: impl Fn(usize) -> DVector<f64>) -> Self {
        let mut out = self.clone();
        for (i, knot) in out.knots.iter_mut().enumerate() {
            *knot += part(i).fixed_rows::<6>(0);
        }
        out.shared += part(self.shared_block());
        for (i, slow) in out.slow.iter_mut().enumerate() {
            *slow += part(self.slow_block(i)).fixed_rows::<3>(0);
        }
        for (i, attitude) in out.attitudes.iter_mut().enumerate() {
            *attitude += part(self.attitude_block(i)).fixed_rows::<3>(0);
        }
        out
    }

    fn three(&self, place: Option<usize>) -> Vector3<f64> {
        place.map_or_else(Vector3::zeros, |first| self.shared.fixed_rows::<3>(first).into_owned())
    }
    fn one(&self, place: Option<usize>) -> f64 {
        place.and_then(|i| self.shared.get(i)).copied().unwrap_or(0.0)
    }

    /// Returns the estimated mount of a camera whose told one is given.
    pub(super) fn mount(
        &self,
        places: &Places,
        camera: usize,
        told: &Rotation<Cam, Vehicle>,
    ) -> Rotation<Cam, Vehicle> {
        let place = places.mounts.get(camera).copied().flatten();
        *told * Rotation::from_scaled_axis(self.three(place).into())
    }
    pub(super) fn clock_s(&self, places: &Places, camera: usize) -> f64 {
        self.one(places.clocks.get(camera).copied().flatten())
    }
    pub(super) fn height_km(&self, places: &Places) -> f64 {
        self.one(places.height)
    }
    /// Returns the slow error of a sight over its root: the sum of its three parts. `index` is the first of the two
    /// that change.
    pub(super) fn slow(&self, places: &Places, camera: usize, index: usize) -> Vector3<f64> {
        let changing: Vector3<f64> = self.slow.iter().skip(index).take(2).sum();
        self.three(places.lasting.get(camera).copied().flatten()) + changing * SHARE.sqrt()
    }
    /// Returns the error of a lens: of the focal length, as a fraction of itself, and of the principal point, px.
    pub(super) fn lens(&self, place: &LensPlace) -> Vector3<f64> {
        &place.root * self.shared.rows(place.first, place.root.ncols())
    }
    /// Returns the relative error of the drag.
    pub(super) fn drag(&self, places: &Places) -> f64 {
        self.one(places.drag)
    }
    pub(super) fn latitude_km(&self, places: &Places) -> [f64; 2] {
        [self.one(places.latitude), self.one(places.latitude.map(|first| first + 1))]
    }
}
