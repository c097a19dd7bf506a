//! The field of view of an unknown camera, from the limb in some of its pictures at a known altitude.
//!
//! The curvature of the limb in pixels and the expected half-angle say how long the focal length is. Each picture is
//! tried from several focal lengths: a cone of any half-angle is fitted, the focal length with which it has the
//! expected half-angle replaces the one that was tried, and this repeats until both agree. The pictures are then
//! combined.
//!
//! One picture may have two solutions: the projection of the lens bends a limb away from the middle of the picture,
//! too, so that the curvature is a quadratic equation in the focal length. The true solution is the same in all
//! pictures. The other one changes with the place of the limb.
//!
//! Edge noise differs from picture to picture. The shape of the lens, its principal point, and the expected half-angle
//! (altitude and limb height) are wrong by the same amount in all pictures, so that their effects do not average out.

use hzn_core::Config;
use hzn_core::camera::{Camera, Config as CameraConfig, Covariance, Intrinsic, Model};
use hzn_files::FrameData;
use hzn_files::start::{self, CameraFacts, Exif, MeasuredFov};

use super::any_cone::AnyCone;
use super::implied::{cos_change, fit_facts};
use crate::source::Picture;

/// Fields of view that a search starts from, in degrees. One step of a search changes a focal length by a factor of 3
/// at most.
const STARTS_DEG: [f64; 5] = [15.0, 35.0, 65.0, 100.0, 150.0];
/// Most steps of a search, and the relative change of the focal length that ends it.
const MAX_STEPS: usize = 6;
const CONVERGED: f64 = 0.005;
/// Largest 1-sigma of the focal length of a picture that counts, as a fraction: with more, the picture says nothing.
const MAX_SIGMA: f64 = 0.3;
/// Largest 1-sigma of the common focal length, as a fraction: a field of view is found if it is within 10 % at two
/// sigmas. Near the Earth the limb is almost straight, and the shape of an unknown lens bends it as much as the body
/// does; several focal lengths then fit.
const MAX_COMMON_SIGMA: f64 = 0.05;
/// Solutions closer than this in ln f are the same.
const SAME: f64 = 0.02;
/// A kind of lens remains possible if at least this part of the pictures agrees that agrees with the other kind. With
/// the wrong kind, the field of view changes with the place of the limb, so that few pictures agree. One picture never
/// tells the kind.
const AS_MANY: f64 = 0.75;
/// Pictures farther than this from the common solution, in their 1-sigmas, show something else than the limb.
const MAX_DISTANCE: f64 = 3.0;

/// The field of view that pictures say for one kind of lens.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldOfView {
    /// Ideal lens that fits the pictures best: [`Model::Pinhole`] or [`Model::Equidistant`].
    pub lens: Model,
    /// The field of view over the width with its 1-sigma.
    pub measured: MeasuredFov,
    /// Number of pictures with a limb that says so, and the number of pictures that were looked at.
    pub pictures: [usize; 2],
}

impl FieldOfView {
    /// Returns whether this is enough for a sensor to start from.
    pub fn is_certain(&self) -> bool {
        0.01 * self.measured.focal_sigma_percent <= MAX_COMMON_SIGMA
    }

    /// Returns the field of view with its 1-sigma and the kind of lens as a text, for pictures of this width.
    pub fn describe(&self, width_px: u32) -> String {
        let Self { lens, measured, .. } = self;
        let kind = if *lens == Model::Pinhole { "pinhole" } else { "fisheye" };
        let part = 0.01 * measured.focal_sigma_percent;
        if part >= MAX_SIGMA {
            return format!("no certain width as a {kind}");
        }
        let width_px = f64::from(width_px);
        let focal_px = start::focal_px(*lens, width_px, measured.fov_deg).unwrap_or(f64::NAN);
        let at = |factor: f64| start::fov_deg(*lens, width_px, focal_px * factor);
        let sigma_deg = 0.5 * (at(1.0 - part) - at(1.0 + part));
        format!("{:.1} +- {sigma_deg:.1} degrees wide, as a {kind}", measured.fov_deg)
    }
}

/// Number of errors that all pictures share: two of the shape of the lens, two of its centre, and the altitude.
const SHARED: usize = 5;

/// What one picture says.
#[derive(Debug, Clone, Copy)]
struct Said {
    ln_focal: f64,
    /// 1-sigma from the edge noise.
    noise: f64,
    /// Changes of `ln_focal` by one sigma of what all pictures share: two of the shape, two coordinates of the
    /// principal point, expected half-angle.
    shared: [f64; SHARED],
}

impl Said {
    fn variance(&self) -> f64 {
        self.noise * self.noise + self.shared.iter().map(|s| s * s).sum::<f64>()
    }
}

/// Finds the field of view. The altitude that is `known` is that of pictures without one in their data. If the lens is
/// not known, both kinds are tried.
///
/// Returns one field of view, one for each kind of lens if the pictures do not tell the kind and the kinds disagree, or
/// none if no picture shows a limb whose curvature says something. A single one may be uncertain
/// ([`FieldOfView::is_certain`]).
pub fn find_field_of_view(pictures: &[(Picture, Option<FrameData>)], known: &CameraFacts) -> Vec<FieldOfView> {
    let lenses = known.lens.map_or(vec![Model::Equidistant, Model::Pinhole], |lens| vec![lens]);
    let width_px = f64::from(known.size_px[0]);
    let one = |lens: Model| {
        let said = pictures.iter().map(|(picture, data)| solutions(picture, data.as_ref(), known, lens));
        Some((lens, combine(&said.collect::<Vec<_>>())?))
    };
    let mut found: Vec<(Model, Combined)> = lenses.into_iter().filter_map(one).collect();
    // With the right kind of lens, more pictures agree, and each is more certain.
    found.sort_by(|(_, a), (_, b)| b.density.total_cmp(&a.density));
    let described = |(lens, c): &(Model, Combined)| FieldOfView {
        lens: *lens,
        measured: MeasuredFov {
            fov_deg: start::fov_deg(*lens, width_px, c.ln_focal.exp()),
            focal_sigma_percent: 100.0 * c.sigma,
            pictures: c.kept,
        },
        pictures: [c.kept, pictures.len()],
    };
    let each: Vec<FieldOfView> = found.iter().map(described).collect();
    // A kind of lens that fits every picture from a few focal lengths on says nothing, but it may be the right one.
    if let [(lens, best), (other_lens, other)] = found.as_mut_slice()
        && other.possible as f64 >= AS_MANY * best.kept as f64
    {
        let other_fov_deg = start::fov_deg(*other_lens, width_px, other.ln_focal.exp());
        match start::focal_px(*lens, width_px, other_fov_deg) {
            Some(focal_px) => best.allow(focal_px.ln(), other.sigma),
            None => best.sigma = f64::INFINITY,
        }
    }
    match found.as_slice() {
        [best, ..] if described(best).is_certain() => vec![described(best)],
        // With two kinds of lens, each is the answer to whoever says the kind.
        _ => each,
    }
}

/// Returns the solutions of a picture for an ideal lens.
fn solutions(picture: &Picture, data: Option<&FrameData>, known: &CameraFacts, lens: Model) -> Vec<Said> {
    let mut found: Vec<Said> = Vec::new();
    for start_deg in STARTS_DEG {
        let new = search(picture, data, known, lens, start_deg);
        found.extend(new.filter(|new| found.iter().all(|s| (s.ln_focal - new.ln_focal).abs() > SAME)));
    }
    found
}

/// Searches from one field of view.
fn search(
    picture: &Picture,
    data: Option<&FrameData>,
    known: &CameraFacts,
    lens: Model,
    start_deg: f64,
) -> Option<Said> {
    let width = f64::from(known.size_px[0]);
    let mut fov_deg = start_deg;
    let mut trial: Option<AnyCone> = None;
    for _ in 0..MAX_STEPS {
        let guess = guess(known, fov_deg, lens)?;
        // The lens is varied below; within the fit it counts as exact.
        let exact = Config { camera: CameraConfig { covariance: None, ..guess.camera.clone() }, ..guess.clone() };
        match &mut trial {
            Some(trial) => trial.reconfigure(&exact).ok()?,
            none => *none = Some(AnyCone::new(&exact, false).ok()?),
        }
        let view = picture.view(exact.input.channel).ok()?;
        let edge = trial.as_mut()?.find(&view, data)?;
        let fitted = edge.fitted.as_ref()?;
        let camera = Camera::<f64>::try_new(&exact.camera).ok()?;
        let factor = fit_facts(&edge, fitted, &camera, None, true)?.focal_factor?;
        let focal = exact.camera.fx_px * factor.value;
        if (factor.value - 1.0).abs() > CONVERGED {
            fov_deg = start::fov_deg(lens, width, focal);
            continue;
        }
        let free = fitted.solution.free?;
        // ∂cos/∂ln f from the sigma of the factor, which is that of the cosine over this slope.
        let slope = free.var_cos.max(0.0).sqrt() / factor.sigma;
        let (shapes, centre) = sigmas(guess.camera.covariance.as_ref()?)?;
        let by = |changed: CameraConfig| {
            let other = Camera::try_new(&changed).ok()?;
            Some(cos_change(&edge, free.axis.xyz(), &camera, &other)? / slope)
        };
        let edge_radius = 0.5 * width / exact.camera.fx_px;
        let shared = [
            by(with_shape(&exact.camera, shapes[0], edge_radius))?,
            by(with_shape(&exact.camera, shapes[1], edge_radius))?,
            by(CameraConfig { cx_px: exact.camera.cx_px + centre, ..exact.camera.clone() })?,
            by(CameraConfig { cy_px: exact.camera.cy_px + centre, ..exact.camera.clone() })?,
            fitted.expected_sigma_cos / slope,
        ];
        let said = Said { ln_focal: focal.ln(), noise: factor.sigma, shared };
        return Some(said);
    }
    None
}

/// Returns the sensor that `hzn init` writes for a field of view.
fn guess(known: &CameraFacts, fov_deg: f64, lens: Model) -> Option<Config> {
    let (fov_deg, lens) = (Some(fov_deg), Some(lens));
    let facts = CameraFacts { fov_deg, lens, exif: Exif::default(), measured: None, ..known.clone() };
    let text = start::write_sensor_toml(&facts).ok()?.text;
    Some(hzn_files::sensor::parse(&text, std::path::Path::new("sensor.toml")).ok()?.config)
}

/// Returns the two independent 1-sigma changes of the shape, as k1 and k2, and the 1-sigma of the principal point.
fn sigmas(covariance: &Covariance) -> Option<([[f64; 2]; 2], f64)> {
    let at = |one: Intrinsic, other: Intrinsic| {
        let place = |which| covariance.order.iter().position(|i| *i == which);
        covariance.rows.get(place(one)?)?.get(place(other)?).copied()
    };
    use Intrinsic::{CxPx, K1, K2};
    let k2 = at(K2, K2)?.sqrt();
    let by_k2 = at(K1, K2)? / k2;
    let k1 = (at(K1, K1)? - by_k2 * by_k2).max(0.0).sqrt();
    Some(([[k1, 0.0], [by_k2, k2]], at(CxPx, CxPx)?.sqrt()))
}

/// Returns the lens with the coefficients k1 and k2 and the same angle at the edge of the picture, `edge_radius` focal
/// lengths from the middle.
fn with_shape(camera: &CameraConfig, [k1, k2]: [f64; 2], edge_radius: f64) -> CameraConfig {
    let edge2 = edge_radius * edge_radius;
    let scale = 1.0 / (1.0 + edge2 * (k1 + k2 * edge2));
    let mut camera = CameraConfig { fx_px: camera.fx_px * scale, fy_px: camera.fy_px * scale, ..camera.clone() };
    camera.set_intrinsic(Intrinsic::K1, k1);
    camera.set_intrinsic(Intrinsic::K2, k2);
    camera
}

/// What all pictures say together.
struct Combined {
    /// How many pictures agree, each counted with its certainty.
    density: f64,
    ln_focal: f64,
    /// 1-sigma of `ln_focal`.
    sigma: f64,
    /// Number of pictures that agree.
    kept: usize,
    /// The same with the pictures that say nothing, because several focal lengths fit them.
    possible: usize,
}

impl Combined {
    /// Makes the sigma larger by another solution that is as probable: that of the mean of both probability densities.
    fn allow(&mut self, ln_focal: f64, sigma: f64) {
        let other = (ln_focal - self.ln_focal).powi(2) + sigma * sigma;
        self.sigma = (0.5 * (self.sigma * self.sigma + other)).sqrt();
    }
}

/// Combines the pictures: finds the solution that most pictures share, and averages the pictures that have it. `None`
/// if there is no solution.
fn combine(all: &[Vec<Said>]) -> Option<Combined> {
    let is_certain = |s: &&Said| s.variance().sqrt() < MAX_SIGMA;
    let silent = all.iter().filter(|said| !said.is_empty() && !said.iter().any(|s| is_certain(&s))).count();
    let said: Vec<Vec<Said>> = all.iter().map(|said| said.iter().filter(is_certain).copied().collect()).collect();
    if said.iter().all(Vec::is_empty) {
        let ln_focal = all.iter().flatten().next()?.ln_focal;
        return Some(Combined { density: 0.0, ln_focal, sigma: f64::INFINITY, kept: 0, possible: silent });
    }
    let distance = |s: &Said, x: f64| (s.ln_focal - x).abs() / s.variance().sqrt();
    // The density of the solutions at x: a picture counts with its most probable one.
    let one = |all: &Vec<Said>, x: f64| {
        let each = all.iter().map(|s| (-0.5 * distance(s, x).powi(2)).exp() / s.variance().sqrt());
        each.fold(0.0, f64::max)
    };
    let density = |x: f64| said.iter().map(|all| one(all, x)).sum::<f64>();
    let peak = said.iter().flatten().map(|s| s.ln_focal).max_by(|a, b| density(*a).total_cmp(&density(*b)))?;
    let nearest = |all: &'_ Vec<Said>| {
        let each = all.iter().copied().filter(|s| distance(s, peak) <= MAX_DISTANCE);
        each.min_by(|a, b| distance(a, peak).total_cmp(&distance(b, peak)))
    };
    let kept: Vec<Said> = said.iter().filter_map(nearest).collect();
    let total: f64 = kept.iter().map(|s| 1.0 / s.variance()).sum();
    let mean = |value: &dyn Fn(&Said) -> f64| kept.iter().map(|s| value(s) / s.variance()).sum::<f64>() / total;
    let ln_focal = mean(&|s| s.ln_focal);
    let shared: f64 = (0..SHARED).map(|i| mean(&|s| s.shared[i]).powi(2)).sum();
    // The scatter of the pictures contains their noise, and what nobody thought of.
    let spread = mean(&|s| (s.ln_focal - ln_focal).powi(2)).max(mean(&|s| s.noise * s.noise));
    let sigma = (shared + spread / kept.len().max(1) as f64).sqrt();
    Some(Combined { density: density(peak), ln_focal, sigma, kept: kept.len(), possible: kept.len() + silent })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each picture has the true solution and another one that scatters, which is found first.
    #[test]
    fn the_solution_that_all_pictures_share_wins() {
        let said = |ln_focal: f64, noise: f64| Said { ln_focal, noise, shared: [0.0, 0.0, 0.0, 0.0, 0.01] };
        let all: Vec<Vec<Said>> = (0..8)
            .map(|i| {
                let i = f64::from(i);
                vec![said(6.9 + 0.05 * i, 0.02), said(6.0 + 0.01 * (i - 3.5), 0.02)]
            })
            .collect();
        let found = combine(&all).unwrap();
        assert!((found.ln_focal - 6.0).abs() < 1e-9 && found.kept == 8, "{}", found.ln_focal);
        // The error that all pictures share does not average out.
        assert!(found.sigma > 0.01 && found.sigma < 0.015, "{}", found.sigma);
        assert!(combine(&[Vec::new(), Vec::new()]).is_none());
    }
}
