//! Conversion of a lens into another model: a fit over the picture, with its error.
//!
//! The image points of the target model are fitted to those of the source by the Levenberg-Marquardt method, with the
//! derivatives of [`Equation`]. Coefficients are added one after the other, so that no first guess is needed. The error
//! is measured on a denser grid than that of the fit.

use std::fmt;

use hzn_core::camera::{Camera, Config, Equation, Intrinsic, Model};
use hzn_core::pixel::ImagePoint;
use hzn_files::camera_file::{Foreign, Loaded};
use nalgebra::{DMatrix, DVector};

/// Largest angle off axis that a lens of the plane can show usefully, in degrees: there the picture is 57 focal lengths
/// wide.
const MAX_PLANE_DEG: f64 = 89.0;
/// Number of grid cells along a side of the picture. The fit uses every second point.
const CELLS: u32 = 80;
/// Number of azimuths and steps of 1° for a lens that has no inverse in closed form.
const AZIMUTHS: u32 = 144;
const ANGLE_STEP_DEG: f64 = 0.5;
/// Largest number of iterations for each number of coefficients.
const ITERATIONS: usize = 100;

/// A lens of another model that is fitted to a lens.
#[derive(Debug, Clone, PartialEq)]
pub struct Conversion {
    /// The lens.
    pub camera: Config,
    /// RMS distance between the image points of both lenses over the picture, in pixels.
    pub rms_px: f64,
    /// Largest distance between the image points of both lenses, in pixels.
    pub max_px: f64,
    /// Image point of the source where the distance is largest, in pixels.
    pub max_at_px: [f64; 2],
    /// Largest angle off axis that was compared, in degrees.
    pub off_axis_deg: f64,
}

/// Why a lens cannot be converted.
#[derive(Debug, Clone, PartialEq)]
pub enum Refusal {
    /// The source is not a valid lens, or no ray of it meets the picture.
    Source {
        /// The reason.
        why: String,
    },
    /// The picture shows rays that a lens of the plane does not have.
    BeyondPlane {
        /// The model.
        model: Model,
        /// Largest angle off axis in the picture, in degrees.
        off_axis_deg: f64,
    },
    /// The fitted lens is not valid: the model does not have this shape.
    NotALens {
        /// The model.
        model: Model,
        /// The reason.
        why: String,
    },
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Source { why } => write!(f, "the lens is not valid: {why}"),
            Self::BeyondPlane { model, off_axis_deg } => write!(
                f,
                "the picture shows rays up to {off_axis_deg:.1}° off axis, but {} projects on a plane and is useful up \
                 to {MAX_PLANE_DEG}°. Choose kannala-brandt, or limit the picture with theta_max_deg",
                model.name()
            ),
            Self::NotALens { model, why } => {
                write!(f, "no lens {} is close to this one: {why}; choose another model", model.name())
            }
        }
    }
}

impl std::error::Error for Refusal {}

/// A direction with its image point in the source.
#[derive(Debug, Clone, Copy)]
struct Sample {
    direction: [f64; 3],
    point_px: [f64; 2],
    /// The part of the picture that the sample stands for, of any unit.
    weight: f64,
}

/// Fits a lens of `model` to a lens over its picture. A lens that has this model already is returned as it is. The
/// covariance of the parameters is not converted.
///
/// # Errors
/// See [`Refusal`].
///
/// # Example
///
/// ```
/// use hzn_calib::conversion::convert;
/// use hzn_core::camera::{Config, Model};
/// use hzn_files::camera_file::Loaded;
///
/// let mut lens = Config::ideal(Model::DoubleSphere, 1280, 960, 420.0);
/// lens.k = [-0.18, 0.59].into_iter().collect();
/// let fisheye = convert(&Loaded::Lens(lens), Model::KannalaBrandt)?;
/// assert!(fisheye.max_px < 0.1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn convert(source: &Loaded, model: Model) -> Result<Conversion, Refusal> {
    convert_up_to(source, model, 180.0)
}

/// Fits a lens as [`convert`] does, but only to the rays up to `end_deg` off axis.
///
/// # Errors
/// See [`Refusal`].
pub fn convert_up_to(source: &Loaded, model: Model, end_deg: f64) -> Result<Conversion, Refusal> {
    let (start, samples, ends_inside) = match source {
        Loaded::Lens(config) => {
            let limit_deg = config.theta_max_deg.unwrap_or(f64::INFINITY).min(end_deg);
            let config = Config { theta_max_deg: Some(limit_deg).filter(|deg| *deg < 180.0), ..config.clone() };
            let samples = samples_of_camera(&config)?;
            (config, samples, false)
        }
        Loaded::Foreign(lens) => {
            let (samples, ends_inside) = samples_of_foreign(lens, end_deg);
            (start_of_foreign(lens), samples, ends_inside)
        }
    };
    let off_axis = |s: &Sample| s.direction[0].hypot(s.direction[1]).atan2(s.direction[2]).to_degrees();
    let off_axis_deg = samples.iter().map(off_axis).fold(0.0, f64::max);
    if samples.len() < 100 {
        return Err(Refusal::Source { why: "hardly any ray of it meets the picture".into() });
    }
    let mut camera = if start.model == model && matches!(source, Loaded::Lens(_)) {
        start
    } else {
        if model.is_planar() && off_axis_deg > MAX_PLANE_DEG {
            return Err(Refusal::BeyondPlane { model, off_axis_deg });
        }
        fit(first_guess(&start, model), &samples)
    };
    if ends_inside || Camera::<f64>::try_new(&camera).is_err() {
        // The lens may turn back beyond the rays that were compared.
        camera.theta_max_deg = Some((off_axis_deg * 1e3).ceil() / 1e3);
        Camera::<f64>::try_new(&camera).map_err(|e| Refusal::NotALens { model, why: e.to_string() })?;
    }
    let (rms_px, max_px, max_at_px) = compare(&camera, &samples);
    Ok(Conversion { camera, rms_px, max_px, max_at_px, off_axis_deg })
}

/// Returns the rays of a grid of pixels, from border to border.
fn samples_of_camera(config: &Config) -> Result<Vec<Sample>, Refusal> {
    let camera = Camera::<f64>::try_new(config).map_err(|e| Refusal::Source { why: e.to_string() })?;
    let side = |size: u16, i: u32| f64::from(i) / f64::from(CELLS) * (f64::from(size) - 1.0);
    let mut samples = Vec::new();
    for (row, column) in (0..=CELLS).flat_map(|row| (0..=CELLS).map(move |column| (row, column))) {
        let point_px = [side(config.width, column), side(config.height, row)];
        let ray = camera.unproject(ImagePoint { u: point_px[0], v: point_px[1] });
        samples.extend(ray.map(|ray| Sample { direction: ray.xyz(), point_px, weight: 1.0 }));
    }
    Ok(samples)
}

/// Returns the directions that a foreign lens shows in the picture, up to where it turns back or to `end_deg` off axis,
/// and whether it ends inside the picture.
fn samples_of_foreign(lens: &Foreign, end_deg: f64) -> (Vec<Sample>, bool) {
    let [width, height] = lens.size_px().map(f64::from);
    let centre = lens.centre_px();
    let focal_px = lens.focal_px()[0].abs().max(1.0);
    // A narrow lens needs smaller steps, so that as many points are between its centre and its border.
    let step_deg = ANGLE_STEP_DEG.min((width.max(height) / f64::from(2 * CELLS) / focal_px).to_degrees());
    let (mut samples, mut ends_inside) = (Vec::new(), false);
    for azimuth in 0..AZIMUTHS {
        let (sin_a, cos_a) = (core::f64::consts::TAU * f64::from(azimuth) / f64::from(AZIMUTHS)).sin_cos();
        let mut before_px = -1.0;
        for step in 0..=(end_deg.min(180.0) / step_deg) as u32 {
            let (sin, cos) = (step_deg * f64::from(step)).to_radians().sin_cos();
            let direction = [sin * cos_a, sin * sin_a, cos];
            let point_px = lens.project(direction).unwrap_or(centre);
            let radius_px = (point_px[0] - centre[0]).hypot(point_px[1] - centre[1]);
            let inside = (-0.5..=width - 0.5).contains(&point_px[0]) && (-0.5..=height - 0.5).contains(&point_px[1]);
            if radius_px <= before_px || !inside {
                ends_inside |= inside;
                break;
            }
            // The samples are closer together near the centre.
            let weight = (radius_px + 1.0) * (radius_px - before_px).max(0.0);
            before_px = radius_px;
            samples.push(Sample { direction, point_px, weight });
        }
    }
    (samples, ends_inside || end_deg < 180.0)
}

fn start_of_foreign(lens: &Foreign) -> Config {
    let [[width, height], [fx, fy], [cx, cy]] = [lens.size_px().map(f64::from), lens.focal_px(), lens.centre_px()];
    let ideal = Config::ideal(Model::Eucm, width as u16, height as u16, fx);
    Config { fy_px: fy, cx_px: cx, cy_px: cy, ..ideal }
}

/// Returns a lens of the model with the focal length and the limits of the source.
fn first_guess(source: &Config, model: Model) -> Config {
    let mut guess = Config::ideal(model, source.width, source.height, source.fx_px);
    (guess.fy_px, guess.cx_px, guess.cy_px) = (source.fy_px, source.cx_px, source.cy_px);
    (guess.theta_max_deg, guess.theta_min_deg) = (source.theta_max_deg, source.theta_min_deg);
    (guess.focal_sigma_percent, guess.centre_sigma_px) = (source.focal_sigma_percent, source.centre_sigma_px);
    (guess.readout_s, guess.temperature) = (source.readout_s, source.temperature);
    // Near to an equidistant lens for both.
    guess.k = match model {
        Model::DoubleSphere => [0.0, 0.5].into_iter().collect(),
        Model::Eucm => [0.5, 1.0].into_iter().collect(),
        _ => model.coefficients().iter().map(|_| 0.0).collect(),
    };
    guess
}

/// Fits focal lengths and principal point, then with one coefficient, then with two, and so on.
fn fit(mut camera: Config, samples: &[Sample]) -> Config {
    let used: Vec<Sample> = samples.iter().step_by(2).copied().collect();
    let all = camera.model.intrinsics();
    for count in 4..=all.len() {
        adjust(&mut camera, &all[..count], &used);
    }
    camera
}

/// Adjusts the first parameters of the model by the Levenberg-Marquardt method.
fn adjust(camera: &mut Config, free: &[Intrinsic], samples: &[Sample]) {
    let Some(mut system) = System::new(camera, free.len(), samples) else { return };
    let mut damping = 1e-3;
    for _ in 0..ITERATIONS {
        let mut damped = system.normal.clone();
        for i in 0..free.len() {
            damped[(i, i)] *= 1.0 + damping;
        }
        let Some(step) = damped.cholesky().map(|c| c.solve(&system.right)) else { return };
        let mut next = camera.clone();
        for (which, change) in free.iter().zip(step.iter()) {
            next.set_intrinsic(*which, camera.intrinsic(*which).unwrap_or(0.0) + change);
        }
        match System::new(&next, free.len(), samples).filter(|s| s.square < system.square) {
            Some(better) => {
                let gain = (system.square - better.square) / system.square;
                (*camera, system, damping) = (next, better, damping * 0.1);
                if gain < 1e-12 {
                    return;
                }
            }
            None if damping < 1e12 => damping *= 10.0,
            None => return,
        }
    }
}

/// Normal equations of the image points.
struct System {
    normal: DMatrix<f64>,
    right: DVector<f64>,
    square: f64,
}

impl System {
    /// Sums the equations. `None` if the lens has no image point for a direction.
    fn new(camera: &Config, free: usize, samples: &[Sample]) -> Option<Self> {
        let equation = Equation::new(camera);
        let (mut normal, mut right, mut square) = (DMatrix::zeros(free, free), DVector::zeros(free), 0.0);
        for sample in samples {
            let projected = equation.project(sample.direction)?;
            let error = [sample.point_px[0] - projected.point.u, sample.point_px[1] - projected.point.v];
            for (by, error) in projected.by_intrinsics.iter().zip(error) {
                let row = DVector::from_column_slice(by.get(..free)?);
                normal.syger(sample.weight, &row, &row, 1.0);
                right.axpy(sample.weight * error, &row, 1.0);
                square += sample.weight * error * error;
            }
        }
        normal.fill_upper_triangle_with_lower_triangle();
        f64::is_finite(square).then_some(Self { normal, right, square })
    }
}

/// Returns RMS and maximum distance of the image points, and the place of the maximum.
fn compare(camera: &Config, samples: &[Sample]) -> (f64, f64, [f64; 2]) {
    let equation = Equation::new(camera);
    let (mut square, mut total, mut max_px, mut at) = (0.0, 0.0, 0.0, [f64::NAN; 2]);
    for sample in samples {
        let p = equation.project(sample.direction).map_or([f64::INFINITY; 2], |p| [p.point.u, p.point.v]);
        let distance = (p[0] - sample.point_px[0]).hypot(p[1] - sample.point_px[1]);
        square += sample.weight * distance * distance;
        total += sample.weight;
        if !(distance <= max_px) {
            (max_px, at) = (distance, sample.point_px);
        }
    }
    ((square / f64::max(total, 1e-12)).sqrt(), max_px, at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_files::camera_file::Omni;

    fn lens(model: Model, k: &[f64], focal_px: f64) -> Loaded {
        let mut config = Config::ideal(model, 1280, 960, focal_px);
        (config.fy_px, config.cx_px) = (focal_px * 1.002, 645.25);
        config.k = k.iter().copied().collect();
        Loaded::Lens(config)
    }

    #[test]
    fn a_lens_comes_back_from_another_model() {
        let source = lens(Model::DoubleSphere, &[-0.18, 0.59], 420.0);
        let there = convert(&source, Model::KannalaBrandt).unwrap();
        assert!(there.max_px < 0.1 && there.rms_px <= there.max_px, "{there:?}");
        let back = convert(&Loaded::Lens(there.camera), Model::DoubleSphere).unwrap();
        let Loaded::Lens(config) = source else { unreachable!() };
        assert!((back.camera.fx_px - config.fx_px).abs() < 0.2, "{back:?}");
        assert!((back.camera.cx_px - config.cx_px).abs() < 0.02, "{back:?}");
    }

    #[test]
    fn the_same_model_is_not_changed() {
        let source = lens(Model::BrownConrady, &[-0.2, 0.05, 1e-3, -5e-4, 0.0], 1100.0);
        let same = convert(&source, Model::BrownConrady).unwrap();
        assert_eq!(Loaded::Lens(same.camera.clone()), source);
        assert!(same.max_px < 1e-9, "{same:?}");
        let fisheye = convert(&source, Model::KannalaBrandt).unwrap();
        // The tangential part has no counterpart: p1 = 1e-3 moves the corner by about a pixel.
        assert!(fisheye.max_px > 0.1 && fisheye.max_px < 3.0, "{fisheye:?}");
    }

    #[test]
    fn a_plane_does_not_show_a_wide_lens() {
        let wide = lens(Model::Equidistant, &[], 420.0);
        let refused = convert(&wide, Model::BrownConrady).unwrap_err();
        assert!(refused.to_string().contains("rays up to 109.6° off axis"), "{refused}");
        let Loaded::Lens(config) = wide else { unreachable!() };
        let limited = Loaded::Lens(Config { theta_max_deg: Some(50.0), ..config });
        let plane = convert(&limited, Model::BrownConrady).unwrap();
        assert!(plane.max_px < 0.5 && plane.off_axis_deg <= 50.0, "{plane:?}");
    }

    #[test]
    fn kalibrs_omni_is_fitted() {
        // The example of Kalibr's documentation.
        let omni = Foreign::Omni(Omni {
            size_px: [752, 480],
            xi: 0.80065662,
            intrinsics_px: [833.006, 830.345, 373.850, 253.749],
            distortion: [-0.33518750, 0.13211436, 0.00055967, 0.00057686],
        });
        for (model, limit_px) in [(Model::KannalaBrandt, 1.0), (Model::Eucm, 2.0)] {
            let fitted = convert(&Loaded::Foreign(omni.clone()), model).unwrap();
            assert!(fitted.max_px < limit_px && fitted.off_axis_deg > 40.0, "{fitted:?}");
        }
    }
}
