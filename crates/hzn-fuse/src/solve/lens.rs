//! The focal length and the principal point of a camera as unknowns of the flight.
//!
//! A row of the results has the axis of a limb and no edge points. The points lay on the arc of the limb's cone that
//! the camera sees, so their pixels are predicted. Under another lens the same pixels have other rays, and the cone
//! through these rays is the derivative.

use hzn_core::camera::{Camera, Config, Intrinsic};
use hzn_core::ellipsoid::EARTH_MEAN_RADIUS_M;
use hzn_core::frames::UnitVec3;
use hzn_core::pixel::ImagePoint;
use hzn_nav::filter::{DirectionMeasurement, basis};
use nalgebra::{DMatrix, Matrix2, Matrix3, SMatrix, Vector2, Vector3};

use super::places::LensPlaces;
use crate::error::Error;
use crate::input::{Body, Recording, Seen};
use crate::settings::{self, LensSetting, Settings, Treatment};

/// Number of the unknowns: the focal length as a fraction of itself, and both coordinates of the principal point, px.
const UNKNOWNS: usize = 3;
/// The same parameters as the calibration names them.
const NAMES: [Intrinsic; UNKNOWNS] = [Intrinsic::FxPx, Intrinsic::CxPx, Intrinsic::CyPx];
/// Half of the number of points around the cone at which the camera is asked whether it sees them. They are dense where
/// the cone is nearest to the optical axis.
const AROUND: i32 = 200;
/// Number of parts of a stretch of the cone that the camera sees, and of halvings to find its ends.
const PER_STRETCH: i32 = 48;
const HALVINGS: usize = 20;
/// Fewest of them that the camera must see.
const LEAST_SEEN: usize = 5;
/// Step of the differences, in focal lengths: far below the curvature of a lens, and far above the rounding.
const STEP: f64 = 1e-5;
/// 1-sigma of the derivative as a fraction: the edge points covered a part of the predicted arc, and a row does not say
/// which (`cargo test --test fuse lens::rendered -- --nocapture`).
const UNSURE: f64 = 0.1;
/// The part of the lens in a covariance, as a fraction of it, above which the covariance was made with another lens.
const OTHER_LENS: f64 = 0.5;

/// Mean radius of the Earth, km: a kilometre more moves the predicted limb by 0.01°.
const EARTH_RADIUS_KM: f64 = 1e-3 * EARTH_MEAN_RADIUS_M;
/// Half-angle of the discs of Sun and Moon, rad.
const DISC_RAD: f64 = 0.00465;

/// Derivatives of the axis (three rows) and of the cosine of the half-angle by the unknowns: the focal length as a
/// fraction, and the principal point (x, y), px.
pub type ByLens = SMatrix<f64, 4, UNKNOWNS>;

/// The lens of a camera, with the priors of its errors.
#[derive(Debug, Clone)]
pub struct Lens {
    camera: Camera<f64>,
    /// The lens with each unknown larger and smaller; `None` for one that is no unknown.
    moved: [Option<[Camera<f64>; 2]>; UNKNOWNS],
    /// Half of the differences of these lenses.
    steps: [f64; UNKNOWNS],
    /// The covariance of the unknowns that the covariances of the rows have in them.
    told: Matrix3<f64>,
    /// The covariance that they are known with.
    prior: Matrix3<f64>,
}

impl Lens {
    /// Returns the lens with its unknowns; `None` if it has none.
    pub fn new(config: &Config, settings: &settings::Camera) -> Option<Self> {
        let told = Told::new(config);
        let wanted = [&settings.focal_percent, &settings.centre_px, &settings.centre_px];
        // The settings have percents.
        let units = [0.01, 1.0, 1.0];
        let mut sigmas = [0.0; UNKNOWNS];
        for (((sigma, wanted), unit), own) in sigmas.iter_mut().zip(wanted).zip(units).zip(told.sigmas) {
            *sigma = wanted.sigma_or(own / unit) * unit;
        }
        let follow = told.follow(config, sigmas.map(|sigma| sigma > 0.0));
        let steps = [STEP, STEP * config.fx_px, STEP * config.fy_px];
        let mut moved = [None, None, None];
        for (((moved, sigma), step), changes) in moved.iter_mut().zip(sigmas).zip(steps).zip(&follow) {
            if sigma > 0.0 {
                let with = |sign: f64| Camera::try_new(&changed(config, changes, sign * step)).ok();
                *moved = Some([with(1.0)?, with(-1.0)?]);
            }
        }
        if moved.iter().all(Option::is_none) {
            return None;
        }
        let ratio = |i: usize| if told.sigmas[i] > 0.0 { sigmas[i] / told.sigmas[i] } else { 0.0 };
        let is_unknown = |i: usize| if sigmas[i] > 0.0 { 1.0 } else { 0.0 };
        let part = Matrix3::from_fn(|i, j| told.covariance[(i, j)] * is_unknown(i) * is_unknown(j));
        let mut prior = Matrix3::from_fn(|i, j| part[(i, j)] * ratio(i) * ratio(j));
        for (i, sigma) in sigmas.iter().enumerate() {
            prior[(i, i)] = sigma * sigma;
        }
        Some(Self { camera: Camera::try_new(config).ok()?, moved, steps, told: part, prior })
    }

    /// Returns whether the focal length is unknown, and whether the principal point is.
    pub(super) fn is_unknown(&self) -> [bool; 2] {
        let [focal, centre, _] = &self.moved;
        [focal.is_some(), centre.is_some()]
    }

    /// Returns the covariance that the unknowns are known with: a fraction, px, px.
    pub(super) fn prior(&self) -> &Matrix3<f64> {
        &self.prior
    }

    /// Returns a root of the information of the unknowns that have a place; parameters that the calibration ties
    /// together exactly count as independent.
    pub(super) fn information(&self, places: LensPlaces) -> Matrix3<f64> {
        let known: Vec<usize> = places.each().flat_map(|(first, place)| first..first + place.len).collect();
        let is = |i: usize| known.contains(&i);
        let own = Matrix3::from_fn(|i, j| match (is(i) && is(j), i == j) {
            (true, _) => self.prior[(i, j)],
            (false, same) => f64::from(u8::from(same)),
        });
        let root = own.cholesky().and_then(|factor| factor.l().solve_lower_triangular(&Matrix3::identity()));
        root.unwrap_or_else(|| Matrix3::from_diagonal(&own.diagonal().map(|v| 1.0 / v.sqrt())))
    }

    /// Returns the errors of the lens as sums of independent numbers with a sigma of 1, which are the columns. Those
    /// that are considered come first: the others follow from them and from numbers of their own, as far as the
    /// calibration ties both together.
    pub(crate) fn independent(&self, settings: &settings::Camera) -> Vec<Independent> {
        let [focal, centre] =
            [settings.focal_percent, settings.centre_px].map(|setting| setting.mode == Treatment::Considered);
        let is_considered = [focal, centre, centre];
        let mut order: Vec<usize> = (0..UNKNOWNS).filter(|i| self.moved[*i].is_some()).collect();
        order.sort_by_key(|i| !is_considered[*i]);
        let own = DMatrix::from_fn(order.len(), order.len(), |i, j| self.prior[(order[i], order[j])]);
        // Parameters that the calibration ties together exactly count as independent.
        let alone = || DMatrix::from_diagonal(&own.diagonal().map(f64::sqrt));
        let root = own.clone().cholesky().map_or_else(alone, |factor| factor.l());
        let column = |(j, which): (usize, &usize)| {
            let mut by = Vector3::zeros();
            order.iter().enumerate().for_each(|(i, row)| by[*row] = root[(i, j)]);
            Independent { by, is_considered: is_considered[*which] }
        };
        order.iter().enumerate().map(column).collect()
    }

    /// Returns how the measured cone changes with the error of the lens, true minus told. The cone has an axis in the
    /// camera frame and the cosine of its half-angle; `is_free` says that the half-angle was fitted, too. `None` if the
    /// camera sees too little of the cone.
    pub fn by_lens(&self, axis: &Vector3<f64>, cos: f64, is_free: bool) -> Option<ByLens> {
        let points = self.arc(axis, cos);
        if points.len() < LEAST_SEEN {
            return None;
        }
        let b = basis(axis);
        let (mut normal, mut right) = (Matrix3::zeros(), Matrix3::zeros());
        for Point { ray, by_lens, weight } in &points {
            let across = b * ray;
            let row = Vector3::new(across.x, across.y, if is_free { -1.0 } else { 0.0 });
            normal += row * row.transpose() * *weight;
            right += row * (axis.transpose() * by_lens) * -*weight;
        }
        if !is_free {
            normal.m33 = 1.0;
        }
        let solved: Matrix3<f64> = normal.cholesky()?.solve(&right);
        let mut out = ByLens::zeros();
        // The true lens moves the true cone; the measured one, with the told lens, stays behind it.
        out.fixed_view_mut::<3, 3>(0, 0).copy_from(&(-b.transpose() * solved.fixed_rows::<2>(0)));
        out.set_row(3, &-solved.row(2));
        Some(out)
    }

    /// Returns the derivative of the axis of a measurement by the error of the lens.
    ///
    /// The sensor moves the freely fitted axis of a limb by k for each unit of cos α between the fitted half-angle and
    /// the expected one. k follows from the derivative by the limb height; a row without it has a fixed half-angle.
    pub fn by_lens_of(&self, seen: &Seen) -> Option<Matrix3<f64>> {
        if seen.body == Body::Other {
            return None;
        }
        let axis = seen.axis.as_inner();
        let altitude_km = if seen.body == Body::Limb { seen.altitude_km? } else { 0.0 };
        let distance_km = EARTH_RADIUS_KM + altitude_km;
        let sin = if seen.body == Body::Limb { EARTH_RADIUS_KM / distance_km } else { DISC_RAD.sin() };
        let cos = (1.0 - sin * sin).sqrt();
        let gain = seen.by_limb_height.as_inner() * (distance_km * cos / sin);
        let is_free = gain.norm_squared() > 0.0;
        let by = self.by_lens(axis, cos, is_free)?;
        Some(by.fixed_rows::<3>(0) - gain * by.row(3))
    }

    /// Returns the points of a cone that the camera sees.
    fn arc(&self, axis: &Vector3<f64>, cos: f64) -> Vec<Point> {
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        // The part of the cone that is nearest to the optical axis.
        let ahead = Vector3::z() - axis * axis.z;
        let first = ahead.try_normalize(1e-9).unwrap_or_else(|| basis(axis).row(0).transpose());
        let second = axis.cross(&first);
        let ray = |half_turns: f64| {
            let (s, c) = (core::f64::consts::PI * half_turns).sin_cos();
            axis * cos + (first * c + second * s) * sin
        };
        let sees = |t: f64| self.pixel(&ray(t * t * t)).is_some();
        let mut out: Vec<Point> = Vec::new();
        for [from, to] in stretches(sees).into_iter().map(|ends| ends.map(|t| t * t * t)) {
            let place = |i: i32| from + (to - from) * f64::from(i) / f64::from(PER_STRETCH);
            let pixels: Vec<_> = (0..=PER_STRETCH)
                .filter_map(|i| self.pixel(&ray(place(i))).map(|pixel| (ray(place(i)), pixel)))
                .collect();
            for (i, (ray, at)) in pixels.iter().enumerate() {
                // Edge points are as dense as pixels: each point counts for half of the way to both neighbours.
                let both = [i.checked_sub(1), Some(i + 1)].map(|j| j.and_then(|j| pixels.get(j)));
                let half_px = both.map(|b| b.map_or(0.0, |(_, b)| 0.5 * (b.u - at.u).hypot(b.v - at.v)));
                out.extend(
                    self.point(ray, at, axis)
                        .map(|point| Point { weight: point.weight * (half_px[0] + half_px[1]), ..point }),
                );
            }
        }
        out
    }

    /// Returns the pixel of a ray; `None` if the camera does not see it.
    fn pixel(&self, ray: &Vector3<f64>) -> Option<ImagePoint<f64>> {
        let at = self.camera.project(&UnitVec3::try_new((*ray).into())?)?;
        let [width, height] = [self.camera.width(), self.camera.height()].map(f64::from);
        ((-0.5..width - 0.5).contains(&at.u) && (-0.5..height - 0.5).contains(&at.v)).then_some(at)
    }

    /// Returns a point of a cone with its pixel; `None` if one of the lenses does not see it.
    fn point(&self, ray: &Vector3<f64>, at: &ImagePoint<f64>, axis: &Vector3<f64>) -> Option<Point> {
        let jacobian = self.camera.ray(*at)?.jacobian();
        let slope = Vector2::from_fn(|k, _| (0..3).map(|i| axis[i] * jacobian[i][k]).sum::<f64>());
        let mut by_lens = Matrix3::zeros();
        for (i, (moved, step)) in self.moved.iter().zip(self.steps).enumerate() {
            let Some([larger, smaller]) = moved else { continue };
            let [a, b] = [larger.unproject(*at)?, smaller.unproject(*at)?].map(|ray| Vector3::from(ray.xyz()));
            by_lens.set_column(i, &((a - b) / (2.0 * step)));
        }
        let weight = 1.0 / slope.norm_squared().max(1e-30);
        Some(Point { ray: *ray, by_lens, weight })
    }

    /// Takes the part of the lens out of a covariance, `by` being the derivative of its three components. The
    /// covariance stays whole if it was made with another lens.
    pub(super) fn without(&self, covariance: &Matrix3<f64>, by: &Matrix3<f64>) -> Matrix3<f64> {
        let own = by * self.told * by.transpose();
        let mut rest = (covariance - own).symmetric_eigen();
        if rest.eigenvalues.min() < -OTHER_LENS * own.trace() {
            return *covariance;
        }
        rest.eigenvalues.apply(|v| *v = v.max(0.0));
        rest.recompose() + own * (UNSURE * UNSURE)
    }
}

/// A number with a sigma of 1 that errors of a lens depend on.
pub(crate) struct Independent {
    /// What it adds to the focal length (a fraction of itself) and to the principal point (px).
    pub(crate) by: Vector3<f64>,
    /// Whether it is considered.
    pub(crate) is_considered: bool,
}

/// Takes the part of the lens out of the covariances of a direction, and returns the derivative of its axis by the
/// error of the lens; `None` if it does not depend on it.
pub(crate) fn without_lens(measurement: &mut DirectionMeasurement, lens: &Lens, seen: &Seen) -> Option<Matrix3<f64>> {
    let by = lens.by_lens_of(seen)?;
    for covariance in [Some(&mut measurement.covariance_rad2), measurement.common_rad2.as_mut()] {
        covariance.into_iter().for_each(|c| *c = lens.without(c.as_inner(), &by).into());
    }
    Some(by)
}

/// Returns the unknown lenses of recordings, in their order.
///
/// # Errors
/// The settings have a sigma for a lens that is not known.
pub(crate) fn lenses(recordings: &[Recording], settings: &Settings) -> Result<Vec<Option<Lens>>, Error> {
    let lens = |recording: &Recording| {
        let (name, own) = (&recording.name, settings.camera(&recording.name));
        if let Some(config) = &recording.camera {
            return Ok(Lens::new(config, own));
        }
        let keys = [("focal_percent", own.focal_percent), ("centre_px", own.centre_px)];
        let is_told = |setting: &LensSetting| setting.sigma_or(0.0) > 0.0 && !recording.is_table;
        match keys.iter().find(|(_, setting)| is_told(setting)) {
            Some((key, _)) => Err(Error::unusable(format!(
                "{name}: {key} has a sigma in fuse.toml, but the lens is not known; give the recording in MCAP, which \
                 has its sensor.toml, or --mount {name}=sensor.toml, or leave the key out"
            ))),
            None => Ok(None),
        }
    };
    recordings.iter().map(lens).collect()
}

/// Returns the stretches from −1 to 1 in which something is seen.
fn stretches(sees: impl Fn(f64) -> bool) -> Vec<[f64; 2]> {
    let end = |mut inside: f64, mut outside: f64| {
        for _ in 0..HALVINGS {
            let middle = 0.5 * (inside + outside);
            *(if sees(middle) { &mut inside } else { &mut outside }) = middle;
        }
        inside
    };
    let mut out: Vec<[f64; 2]> = Vec::new();
    let mut before: Option<(f64, bool)> = None;
    for t in (-AROUND..=AROUND).map(|i| f64::from(i) / f64::from(AROUND)) {
        let is_seen = sees(t);
        match (before, is_seen) {
            (None | Some((_, false)), true) => {
                let from = before.map_or(t, |(before, _)| end(t, before));
                out.push([from, t]);
            }
            (_, true) => out.last_mut().into_iter().for_each(|[_, to]| *to = t),
            (Some((last, true)), false) => {
                let to = end(last, t);
                out.last_mut().into_iter().for_each(|stretch| stretch[1] = to);
            }
            _ => {}
        }
        before = Some((t, is_seen));
    }
    out
}

/// A point of an edge.
struct Point {
    ray: Vector3<f64>,
    /// Derivative of the ray of its pixel by each unknown.
    by_lens: Matrix3<f64>,
    weight: f64,
}

/// Returns the lens with changes of its parameters, each times a step.
fn changed(config: &Config, changes: &[(Intrinsic, f64)], step: f64) -> Config {
    let mut out = config.clone();
    for (name, by) in changes {
        let value = config.intrinsic(*name).unwrap_or(0.0);
        out.set_intrinsic(*name, value + by * step);
    }
    out
}

/// What the calibration says about all parameters.
struct Told {
    order: Vec<Intrinsic>,
    rows: DMatrix<f64>,
    /// Covariance of the unknowns (a fraction, px, px), and its sigmas.
    covariance: Matrix3<f64>,
    sigmas: [f64; UNKNOWNS],
}

impl Told {
    fn new(config: &Config) -> Self {
        let (order, rows): (Vec<Intrinsic>, DMatrix<f64>) = match &config.covariance {
            Some(given) => {
                let cell = |i: usize, j: usize| given.rows.get(i).and_then(|row| row.get(j)).copied().unwrap_or(0.0);
                let n = given.order.len();
                (given.order.iter().copied().collect(), DMatrix::from_fn(n, n, cell))
            }
            None => {
                let focal = 0.01 * config.focal_sigma_percent;
                let mut rows = DMatrix::zeros(4, 4);
                let both = Vector2::new(config.fx_px, config.fy_px) * focal;
                rows.view_mut((0, 0), (2, 2)).copy_from(&(both * both.transpose()));
                rows.view_mut((2, 2), (2, 2)).copy_from(&(Matrix2::identity() * config.centre_sigma_px.powi(2)));
                (vec![Intrinsic::FxPx, Intrinsic::FyPx, Intrinsic::CxPx, Intrinsic::CyPx], rows)
            }
        };
        let mut told = Self { order, rows, covariance: Matrix3::zeros(), sigmas: [0.0; UNKNOWNS] };
        let units = [config.fx_px, 1.0, 1.0];
        told.covariance = Matrix3::from_fn(|i, j| told.of(NAMES[i], NAMES[j]) / (units[i] * units[j]));
        told.sigmas = [0, 1, 2].map(|i| told.covariance[(i, i)].max(0.0).sqrt());
        told
    }

    /// Returns the covariance of two parameters; 0 if the calibration counts one as exact.
    fn of(&self, a: Intrinsic, b: Intrinsic) -> f64 {
        let place = |name: Intrinsic| self.order.iter().position(|other| *other == name);
        place(a).zip(place(b)).map_or(0.0, |place| self.rows[place])
    }

    /// Returns the change of each parameter for a change of each unknown by 1: what the calibration ties to the
    /// unknowns follows them, so that the rest of its covariance is independent of them.
    fn follow(&self, config: &Config, is_unknown: [bool; UNKNOWNS]) -> [Vec<(Intrinsic, f64)>; UNKNOWNS] {
        let units = [config.fx_px, 1.0, 1.0];
        let scale = |i: usize| if is_unknown[i] && self.sigmas[i] > 0.0 { 1.0 / self.sigmas[i] } else { 0.0 };
        let correlation = Matrix3::from_fn(|i, j| self.covariance[(i, j)] * scale(i) * scale(j));
        let inverse = correlation.pseudo_inverse(1e-9).unwrap_or_else(|_| Matrix3::zeros());
        core::array::from_fn(|i| {
            let mut changes = vec![(NAMES[i], units[i])];
            let is_one = |name: Intrinsic| NAMES.iter().zip(is_unknown).any(|(own, is)| *own == name && is);
            for name in self.order.iter().copied().filter(|name| !is_one(*name)) {
                let with = |j: usize| self.of(name, NAMES[j]) / units[j] * scale(j) * inverse[(j, i)] * scale(i);
                changes.push((name, (0..UNKNOWNS).map(with).sum()));
            }
            // Without a told sigma both focal lengths change by the same factor, as with a distance.
            if i == 0 && self.sigmas[0] == 0.0 {
                changes.retain(|(name, _)| *name != Intrinsic::FyPx);
                changes.push((Intrinsic::FyPx, config.fy_px));
            }
            changes
        })
    }
}
