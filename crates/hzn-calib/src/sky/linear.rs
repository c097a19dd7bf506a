//! The equations of one picture, linearised about a lens and a limb height, with the picture's axis eliminated.
//!
//! An edge point has the ray s(p; θ) for the intrinsic parameters θ. Its distance from the limb in pixels is
//! r = (c − s·e)/g, with c = cos α of the limb, the axis e, and the slope g = |∂(s·e)/∂p|. The image point p stays, so
//! that a change of θ moves the ray: ∂r/∂θ = n·∂p/∂θ, with the unit normal n of the edge and the derivative ∂p/∂θ of
//! the projection of a fixed direction. The columns of the axis are −s·b/g, and that of the limb height is (∂c/∂d)/g.
//!
//! The columns are those of the foot of the point, the nearest point of the limb. There they are the exact derivatives
//! of the distance, and they do not depend on the error of the point. Columns at the point itself change with r by r/f
//! and more. Their products with r then have the mean Σ r²/f, which no number of pictures averages out. Where a common
//! bend of all edges is an unknown, too, that mean makes the focal length too long by more than its sigma.
//!
//! Edge errors are correlated. The variance of a point is therefore raised until the fitted cos α has the variance that
//! the noise models of the picture give it. cos α has the lowest spatial frequency of what is left without the axis. As
//! correlated errors are largest at low frequencies, the variance of every other unknown is not too small.

use hzn_core::body;
use hzn_core::camera::{Camera, Config, Equation};
use hzn_core::pixel::ImagePoint;
use nalgebra::{DMatrix, DVector, Matrix2, Vector2, Vector3};

use super::layout::{LATITUDE, Layout, common_shapes};
use super::unknowns::Unknowns;
use super::view::View;
use crate::noise::bend::{SHAPES, shapes_px};
use crate::noise::cone::{Azimuth, Cone, basis};
use crate::noise::edge;
use crate::noise::sighting::{ATTITUDE_SIGMA_RAD, Geometry, with_useful_attitude};
use crate::noise::slow;

/// Largest number of iterations for the axis of one picture.
const ITERATIONS: usize = 10;
/// Smallest number of points. Fewer points agree with almost any cone.
const MIN_POINTS: usize = 24;

/// A lens with the limb height about which the pictures are linearised.
#[derive(Debug)]
pub(super) struct Model<'a> {
    pub(super) camera: &'a Camera<f64>,
    equation: Equation,
    /// The places of the estimated parameters among those of the lens model.
    places: Vec<usize>,
    pub(super) layout: Layout,
    /// Changes of the parameters from the calibration before the flight.
    values: DVector<f64>,
    pub(super) height_km: f64,
}

impl<'a> Model<'a> {
    /// Creates the model of a checked lens: `config` is its calibration, and `values` is how far it differs from the
    /// calibration before the flight.
    pub(super) fn new(
        camera: &'a Camera<f64>,
        config: &Config,
        unknowns: &Unknowns,
        values: DVector<f64>,
        height_km: f64,
    ) -> Self {
        let list = &unknowns.list;
        let all = config.model.intrinsics();
        let places = list.iter().filter_map(|i| all.iter().position(|a| a == i)).collect();
        Self {
            camera,
            equation: Equation::new(config),
            places,
            layout: Layout { intrinsics: list.len(), sides: unknowns.sides },
            values,
            height_km,
        }
    }
}

/// Variance and shapes of the edge of one picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct EdgeNoise {
    /// Variance that a point would have, if it were independent of the others, in px².
    pub(super) variance_px2: f64,
    /// RMS of the residuals, in pixels.
    pub(super) rms_px: f64,
    /// Variance of the slow part of the residuals, in px²; only its mean over many pictures is an estimate.
    pub(super) slow_px2: f64,
    /// Amplitudes of the next shapes in the residuals, in pixels.
    pub(super) shapes_px: [f64; SHAPES],
}

/// The normal equations of one picture for the unknowns of [`Layout`]: the cost is xᵀ N x − 2 bᵀ x + a constant.
#[derive(Debug, Clone)]
pub(super) struct Reduced {
    pub(super) information: DMatrix<f64>,
    pub(super) right: DVector<f64>,
    pub(super) constant: f64,
    /// Axis of the limb in the camera frame.
    pub(super) axis: Vector3<f64>,
    /// The side of the Sun, from 0.
    pub(super) side: usize,
    /// RMS distance of the points from the limb of this lens and limb height, in pixels.
    pub(super) rms_px: f64,
}

/// A point of the picture with its ray in the model's lens.
struct Place {
    image: ImagePoint<f64>,
    ray: Vector3<f64>,
    derivatives: [Vector3<f64>; 2],
}

impl Place {
    fn new(camera: &Camera<f64>, image: ImagePoint<f64>) -> Option<Self> {
        let ray = camera.ray(image)?;
        let j = ray.jacobian();
        let derivatives = [0, 1].map(|k| Vector3::new(j[0][k], j[1][k], j[2][k]));
        Some(Self { image, ray: Vector3::from(ray.direction().xyz()), derivatives })
    }
}

/// An edge point in the picture of the model's lens.
struct Located {
    place: Place,
    weight: f64,
    along: f64,
}

/// Returns the geometry of a picture; `None` without an altitude.
pub(super) fn geometry(body: &body::Config, view: &View) -> Option<Geometry> {
    Geometry::new(body, &view.prior)
}

/// Measures the edge noise of a picture with a free half-angle; `None` if the points do not determine a cone.
pub(super) fn measure_noise(model: &Model, geometry: &Geometry, view: &View) -> Option<EdgeNoise> {
    let camera = &model.camera.with_rate(view.prior.rate_rad_s).with_temperature(view.prior.camera_temperature_c);
    let azimuth = azimuth(geometry, view);
    let cone = Cone::fit(camera, &view.points, view.axis, view.half_angle_rad.cos(), azimuth.as_ref())?;
    let scores = edge::score_models(&cone)?;
    let sigma = view.prior.attitude_sigma_rad.unwrap_or(ATTITUDE_SIGMA_RAD);
    let harmonic = geometry.variance_of_harmonic(&cone, azimuth.as_ref().map(|_| sigma));
    let variance = edge::variance_of_cos(&cone, &scores) + harmonic;
    let per_px2 = cone.to_cos.dot(&(cone.inverse * cone.to_cos));
    let floor = edge::MIN_SIGMA_PX * edge::MIN_SIGMA_PX;
    let noise = EdgeNoise {
        variance_px2: (variance / per_px2).max(floor),
        rms_px: cone.rms_px(),
        slow_px2: slow::variance_px2(&cone),
        shapes_px: shapes_px(&cone),
    };
    noise.variance_px2.is_finite().then_some(noise)
}

/// Linearises a picture and eliminates its axis. `latitude` is the change of its limb height by each coefficient of the
/// latitude. The result is `None` if the points have no limb in this lens.
pub(super) fn reduce(
    model: &Model,
    geometry: &Geometry,
    latitude: [f64; LATITUDE],
    view: &View,
    noise: EdgeNoise,
) -> Option<Reduced> {
    let still = &model.camera.clone().with_temperature(view.prior.camera_temperature_c);
    let camera = &still.with_rate(view.prior.rate_rad_s);
    let points = locate(camera, view);
    if points.len() < MIN_POINTS {
        return None;
    }
    // The height as straight rays see it, which changes with the height of the limb and with the air before it.
    let apparent_km = |km: f64| km + geometry.kind.raised_by_air_km(km, geometry.altitude_m / 1e3);
    let apparent_m = apparent_km(model.height_km) * 1e3;
    let slope = apparent_km(model.height_km + 0.5) - apparent_km(model.height_km - 0.5);
    let sin = geometry.sin_expected + (apparent_m - geometry.limb_m) / geometry.distance_m;
    if !(sin > 0.0 && sin < 1.0) {
        return None;
    }
    let cos = (1.0 - sin * sin).sqrt();
    let by_height_km = -sin / cos * 1e3 / geometry.distance_m * slope;
    let limb = Limb { cos, by_height_km, azimuth: azimuth(geometry, view) };
    let axis = fit_axis(&points, Vector3::from(view.axis), &limb)?;
    let side = side_of_sun(view, &points);
    let columns = Columns { model, still, camera, geometry, latitude, limb: &limb, axis, side };
    Some(eliminate_axis(&columns, &points, noise))
}

/// Returns 1 if the Sun is on the side of the edge's end, else 0, also if nobody knows where the Sun is.
fn side_of_sun(view: &View, points: &[Located]) -> usize {
    let Some((sun, (first, last))) = view.prior.sun.zip(points.first().zip(points.last())) else { return 0 };
    usize::from(Vector3::from(sun.xyz()).dot(&(last.place.ray - first.place.ray)) > 0.0)
}

/// The expected limb of a picture.
struct Limb {
    cos: f64,
    by_height_km: f64,
    azimuth: Option<Azimuth>,
}

impl Limb {
    /// Returns the distance of a point from the limb in pixels, and the slope.
    fn distance(&self, point: &Place, axis: &Vector3<f64>) -> (f64, [f64; 2], f64) {
        let slopes = [axis.dot(&point.derivatives[0]), axis.dot(&point.derivatives[1])];
        let g = slopes[0].hypot(slopes[1]).max(1e-12);
        let offset = self.azimuth.as_ref().map_or(0.0, |a| a.offset(&point.ray, axis));
        ((self.cos + offset - point.ray.dot(axis)) / g, slopes.map(|s| s / g), g)
    }
}

fn azimuth(geometry: &Geometry, view: &View) -> Option<Azimuth> {
    geometry.cone.as_ref().and_then(|cone| Azimuth::new(cone, &with_useful_attitude(&view.prior)))
}

/// Fits the axis with the expected half-angle.
fn fit_axis(points: &[Located], start: Vector3<f64>, limb: &Limb) -> Option<Vector3<f64>> {
    let mut e = start;
    for _ in 0..ITERATIONS {
        let (b1, b2) = basis(&e);
        let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
        for p in points {
            let (r, _, g) = limb.distance(&p.place, &e);
            let h = Vector2::new(p.place.ray.dot(&b1), p.place.ray.dot(&b2)) / g;
            normal += h * h.transpose() * p.weight;
            right += h * (r * p.weight);
        }
        let step = normal.try_inverse()? * right;
        e = (e + b1 * step.x + b2 * step.y).try_normalize(1e-12)?;
        if step.norm() < 1e-12 {
            break;
        }
    }
    e.iter().all(|x| x.is_finite()).then_some(e)
}

/// What the columns of a picture's equations are made of.
struct Columns<'a> {
    model: &'a Model<'a>,
    /// The model's camera at the temperature of the picture, and turned by its rate.
    still: &'a Camera<f64>,
    camera: &'a Camera<f64>,
    geometry: &'a Geometry,
    latitude: [f64; LATITUDE],
    limb: &'a Limb,
    axis: Vector3<f64>,
    side: usize,
}

impl Columns<'_> {
    /// Writes the row of an edge point, and returns its distance from the limb in pixels. The result is `None` if the
    /// foot of the point is outside the lens.
    fn fill(&self, row: &mut DVector<f64>, point: &Located) -> Option<f64> {
        let Self { model, geometry, limb, axis, .. } = self;
        let (r, edge, _) = limb.distance(&point.place, axis);
        let ImagePoint { u, v } = point.place.image;
        let foot = Place::new(self.camera, ImagePoint { u: u + r * edge[0], v: v + r * edge[1] })?;
        // One more step of Newton: the distance of the foot is the error of the first.
        let (rest, edge, g) = limb.distance(&foot, axis);
        let projected = model.equation.project(self.still.ray(foot.image)?.direction().xyz())?;
        let layout = model.layout;
        let n = layout.len();
        row.fill(0.0);
        row[Layout::HEIGHT] = limb.by_height_km / g;
        // The local radius acts as a limb height of its own sigma.
        row[layout.radius()] = row[Layout::HEIGHT] * geometry.radius_sigma_m / 1e3;
        for (i, by_coefficient) in self.latitude.into_iter().enumerate() {
            row[layout.latitude() + i] = row[Layout::HEIGHT] * by_coefficient;
        }
        for (i, place) in model.places.iter().enumerate() {
            let by = |axis: usize| projected.by_intrinsics[axis].get(*place).copied().unwrap_or(0.0);
            row[layout.first_intrinsic() + i] = edge[0] * by(0) + edge[1] * by(1);
        }
        for (place, shape) in layout.shapes(self.side).into_iter().zip(common_shapes(point.along)) {
            row[place] = -shape;
        }
        let (b1, b2) = basis(axis);
        (row[n], row[n + 1]) = (-foot.ray.dot(&b1) / g, -foot.ray.dot(&b2) / g);
        Some(r + rest)
    }
}

/// Sums the normal equations of the points and eliminates the two unknowns of the axis.
fn eliminate_axis(columns: &Columns, points: &[Located], noise: EdgeNoise) -> Reduced {
    let (model, axis, side) = (columns.model, columns.axis, columns.side);
    let layout = model.layout;
    let n = layout.len();
    let mut normal = DMatrix::<f64>::zeros(n + 2, n + 2);
    let mut right = DVector::<f64>::zeros(n + 2);
    let (mut square, mut total) = (0.0, 0.0);
    let mut row = DVector::<f64>::zeros(n + 2);
    for p in points {
        let Some(r) = columns.fill(&mut row, p) else { continue };
        let weight = p.weight / noise.variance_px2;
        normal.syger(weight, &row, &row, 1.0);
        right.axpy(-weight * r, &row, 1.0);
        square += weight * r * r;
        total += p.weight;
    }
    normal.fill_upper_triangle_with_lower_triangle();
    let rms_px = (square * noise.variance_px2 / total.max(1e-12)).sqrt();
    let (information, right, square) = without_last_two(&normal, &right, square);
    // From the change of the unknowns to the unknowns themselves.
    let mut at = DVector::zeros(n);
    at[Layout::HEIGHT] = model.height_km;
    at.rows_mut(layout.first_intrinsic(), layout.intrinsics).copy_from(&model.values);
    let moved = &information * &at;
    let constant = square + 2.0 * right.dot(&at) + at.dot(&moved);
    Reduced { right: right + moved, information, constant, axis, side, rms_px }
}

/// Eliminates the last two unknowns.
fn without_last_two(normal: &DMatrix<f64>, right: &DVector<f64>, square: f64) -> (DMatrix<f64>, DVector<f64>, f64) {
    let n = normal.nrows() - 2;
    let axis: Matrix2<f64> = normal.fixed_view::<2, 2>(n, n).into_owned();
    let Some(inverse) = axis.try_inverse() else {
        return (normal.view((0, 0), (n, n)).into_owned(), right.rows(0, n).into_owned(), square);
    };
    let (cross, own) = (normal.view((0, n), (n, 2)), Vector2::new(right[n], right[n + 1]));
    let information = normal.view((0, 0), (n, n)) - cross * inverse * cross.transpose();
    (information, right.rows(0, n) - cross * (inverse * own), square - own.dot(&(inverse * own)))
}

/// Returns the points that have a weight and a ray in the camera.
fn locate(camera: &Camera<f64>, view: &View) -> Vec<Located> {
    let mut located: Vec<Located> = Vec::with_capacity(view.points.len());
    let (mut passed_px, mut last) = (0.0, None::<[f64; 2]>);
    for &([u, v], weight) in view.points.iter().filter(|p| p.1 > 0.0) {
        let Some(place) = Place::new(camera, ImagePoint { u, v }) else { continue };
        passed_px += last.map_or(0.0, |[a, b]| (u - a).hypot(v - b));
        last = Some([u, v]);
        located.push(Located { place, weight, along: passed_px });
    }
    for point in &mut located {
        point.along = 2.0 * point.along / passed_px.max(1e-12) - 1.0;
    }
    located
}
