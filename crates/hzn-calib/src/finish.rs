//! From an adjustment to a calibration: covariance, limits of the lens, residuals, doubts.

use hzn_core::camera::{Camera, Config, Covariance};
use nalgebra::{DMatrix, DVector, Vector3};

use crate::adjust::{Adjusted, Block};
use crate::between::between_pictures;
use crate::calibrated::{Calibrated, Dropped, Refusal, Residual, ViewResult, Warning};
use crate::lens_error::{places, sigmas_px};

/// Largest 1-sigma of a focal length, in percent. A covariance describes errors in the linear range of the equations
/// only; beyond this value the lens is not determined.
const MAX_FOCAL_SIGMA_PERCENT: f64 = 5.0;
/// Largest angle off axis beyond the observations, as a part of the covered angle, without a warning: a tenth of the
/// radius is about the width of one square of a board.
const MAX_EXTRAPOLATION: f64 = 0.1;
/// Tilt of a board below which it counts as frontal, degrees: its foreshortening is cos 10° = 0.985.
const FRONTAL_DEG: f64 = 10.0;
/// Ratio of the RMS in pictures that were left out to the RMS of the fit above which there is a warning. With a model
/// that fits, the ratio is 1 + (unknowns of the lens)/(observations) or so.
const MAX_HELD_OUT: f64 = 1.5;
/// Ratio of the 1-sigma of the lens to that of a single observation above which there is a warning. A calibration
/// averages hundreds of observations, so that a larger ratio means that they do not determine some parameter.
const MAX_LENS_SIGMA: f64 = 3.0;
/// Ratio of the 1-sigma of the lens between pictures to that from the corners alone above which there is a warning: the
/// pictures then disagree by more than half of their told error on account of something that is not the corners' noise.
const MAX_BETWEEN: f64 = 2.0;
/// Sigmas of the ratio of the focal lengths from 1 above which there is a warning: one right calibration in 370 has it.
const MAX_ASPECT_SIGMAS: f64 = 3.0;
/// Angle between `theta_max_deg` and the end of monotony that a camera demands, and a little more, in degrees.
const MONOTONE_MARGIN_DEG: f64 = 2.1;

/// A picture of a calibration: its name, and its place among the blocks or the reason why it is not there.
pub(crate) type Named = (String, Result<usize, Dropped>);

/// Makes the calibration; `held_out_rms_px` comes from the caller, who can fit again.
///
/// # Errors
/// The data do not determine the lens, or the lens is not monotone where observations are.
pub(crate) fn finish(adjusted: &Adjusted, views: &[Named]) -> Result<Calibrated, Refusal> {
    let blocks = &adjusted.blocks;
    let counted =
        || blocks.iter().flat_map(|b| b.observations.iter().map(move |o| (b, o))).filter(|(_, o)| o.weight > 0.0);
    let observations = counted().count();
    let not_determined = Refusal::NotDetermined { focal_sigma_percent: f64::INFINITY };
    let (sigma_px, alone) = least_squares(adjusted).ok_or(not_determined)?;
    let between = between_pictures(adjusted, &alone, sigma_px * sigma_px);
    let covariance = between.as_ref().map_or_else(|| alone.clone(), |b| b.covariance.clone());
    let focal_sigma_percent = 100.0 * (covariance[(0, 0)].sqrt() / adjusted.config.fx_px);
    if !(focal_sigma_percent <= MAX_FOCAL_SIGMA_PERCENT) {
        return Err(Refusal::NotDetermined { focal_sigma_percent });
    }
    let off_axis_deg = |direction: Vector3<f64>| direction.z.atan2(direction.xy().norm());
    let covered_deg =
        counted().map(|(block, o)| 90.0 - off_axis_deg(block.direction(&o.place)).to_degrees()).fold(0.0, f64::max);
    let mut warnings = Vec::new();
    let config = Config { covariance: Some(to_covariance(&adjusted.config, &covariance)), ..adjusted.config.clone() };
    let (config, camera) = with_limits(config, covered_deg, &mut warnings)?;
    let places = places(&camera);
    let rms_sigma_px = |covariance: &DMatrix<f64>| {
        let each = sigmas_px(&config, &lens_part(&config, covariance), &places);
        let covered = places.iter().zip(each).filter(|(p, _)| p.off_axis_deg <= covered_deg);
        let squares: Vec<f64> = covered.map(|(_, s)| s * s).collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    };
    let sigmas_px = sigmas_px(&config, &lens_part(&config, &covariance), &places);
    let results = views.iter().map(|(name, place)| view_result(name, place, &config, blocks)).collect();
    let mut calibrated = Calibrated {
        rms_px: (adjusted.cost / observations as f64).sqrt(),
        sigma_px,
        held_out_rms_px: None,
        lens_sigma_px: rms_sigma_px(&covariance),
        alone_sigma_px: rms_sigma_px(&alone),
        between_sigma_px: between.map(|b| rms_sigma_px(&b.scatter)),
        bow: None,
        corner_sigma_px: sigmas_px.iter().copied().fold(0.0, f64::max),
        covered_deg,
        corner_deg: places.iter().map(|p| p.off_axis_deg).fold(0.0, f64::max),
        views: results,
        warnings,
        camera: config,
    };
    calibrated.warnings.extend(find_doubts(&calibrated));
    calibrated.warnings.extend(aspect(&adjusted.config, &covariance).filter(|_| has_board(blocks)));
    Ok(calibrated)
}

/// Returns the 1-sigma of a coordinate from the residuals and their degrees of freedom, px, and the covariance of least
/// squares of the shared unknowns. `None` if the observations do not determine them.
pub(crate) fn least_squares(adjusted: &Adjusted) -> Option<(f64, DMatrix<f64>)> {
    let blocks = &adjusted.blocks;
    let observations = blocks.iter().flat_map(|b| &b.observations).filter(|o| o.weight > 0.0).count();
    let pose_unknowns: usize = blocks.iter().map(|b| if b.translation.is_some() { 6 } else { 3 }).sum();
    let unknowns = pose_unknowns + adjusted.information.nrows();
    let freedom = (2 * observations).checked_sub(unknowns).filter(|n| *n > 0)?;
    let variance = adjusted.cost / freedom as f64;
    Some((variance.sqrt(), invert(&adjusted.information)? * variance))
}

/// Adds the RMS of pictures that were left out of the fit, with a warning if it is far above that of the fit.
pub(crate) fn add_held_out(calibrated: &mut Calibrated, held_out_rms_px: Option<f64>) {
    calibrated.held_out_rms_px = held_out_rms_px;
    if let Some(held_out_rms_px) = held_out_rms_px
        && held_out_rms_px > MAX_HELD_OUT * calibrated.rms_px
    {
        calibrated.warnings.push(Warning::Overfitted { held_out_rms_px, rms_px: calibrated.rms_px });
    }
}

/// Inverts the information matrix after scaling its diagonal to 1; `None` if it is singular to rounding.
fn invert(information: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = DVector::from_iterator(information.nrows(), information.diagonal().iter().map(|d| 1.0 / d.sqrt()));
    let scale = DMatrix::from_diagonal(&scale);
    let scaled = &scale * information * &scale;
    let smallest = scaled.clone().symmetric_eigenvalues().min();
    let is_regular = smallest > 1e-12;
    is_regular.then(|| scaled.cholesky().map(|c| &scale * c.inverse() * &scale)).flatten()
}

/// Returns the part of a covariance that belongs to the lens. The bow of the board comes after it.
fn lens_part(config: &Config, covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let n = config.model.intrinsics().len();
    covariance.view((0, 0), (n, n)).into()
}

fn to_covariance(config: &Config, covariance: &DMatrix<f64>) -> Covariance {
    Covariance {
        order: config.model.intrinsics().iter().copied().collect(),
        rows: lens_part(config, covariance).row_iter().map(|row| row.iter().copied().collect()).collect(),
    }
}

/// Returns the lens with an image circle, if it is not monotone up to the picture's corner without one.
fn with_limits(
    config: Config,
    covered_deg: f64,
    warnings: &mut Vec<Warning>,
) -> Result<(Config, Camera<f64>), Refusal> {
    if let Ok(camera) = Camera::try_new(&config) {
        return Ok((config, camera));
    }
    let limited = Config { theta_max_deg: Some(covered_deg), ..config };
    if let Ok(camera) = Camera::try_new(&limited) {
        warnings.push(Warning::CircleSet { theta_max_deg: covered_deg });
        return Ok((limited, camera));
    }
    // A camera keeps a distance from the end of monotony. The last degrees that were covered may lie in it.
    let theta_max_deg = covered_deg - MONOTONE_MARGIN_DEG;
    let limited = Config { theta_max_deg: Some(theta_max_deg), ..limited };
    let camera = Camera::try_new(&limited).map_err(|_| Refusal::NotMonotone { covered_deg })?;
    warnings.push(Warning::CircleSet { theta_max_deg });
    Ok((limited, camera))
}

fn view_result(name: &str, place: &Result<usize, Dropped>, config: &Config, blocks: &[Block]) -> ViewResult {
    let none = |dropped| ViewResult {
        name: name.to_owned(),
        rms_px: f64::NAN,
        tilt_deg: None,
        residuals: Vec::new(),
        dropped: Some(dropped),
    };
    let block = match place {
        Ok(index) => blocks.get(*index),
        Err(dropped) => return none(*dropped),
    };
    let Some(block) = block else { return none(Dropped::NoPose) };
    let errors = block.residuals_px(&hzn_core::camera::Equation::new(config));
    let residual = |(o, error_px): (&crate::adjust::Observation, &[f64; 2])| Residual {
        at_px: o.at_px,
        error_px: *error_px,
        counts: o.weight > 0.0,
        corner: None,
    };
    let residuals: Vec<Residual> = block.observations.iter().zip(&errors).map(residual).collect();
    let counting = || residuals.iter().filter(|r| r.counts);
    let squares: f64 = counting().map(|r| r.error_px[0].powi(2) + r.error_px[1].powi(2)).sum();
    let rms_px = (squares / counting().count() as f64).sqrt();
    ViewResult { name: name.to_owned(), rms_px, tilt_deg: tilt_deg(block), residuals, dropped: None }
}

/// Returns the angle between the board's normal and the line of sight to the middle of its points.
fn tilt_deg(block: &Block) -> Option<f64> {
    block.translation?;
    let n = block.observations.len() as f64;
    let middle = block.observations.iter().map(|o| o.place).sum::<Vector3<f64>>() / n;
    Some((block.rotation * Vector3::z()).angle(&block.direction(&middle)).to_degrees())
}

/// Returns whether the points are those of a target, whose sides are known only by its print.
fn has_board(blocks: &[Block]) -> bool {
    blocks.iter().any(|block| block.translation.is_some())
}

/// Returns the warning if the focal lengths differ by more than their errors. Their places are the first two of every
/// model.
fn aspect(config: &Config, covariance: &DMatrix<f64>) -> Option<Warning> {
    let ratio = config.fy_px / config.fx_px;
    let (fx, fy) = (1.0 / config.fx_px, 1.0 / config.fy_px);
    let relative = covariance[(0, 0)] * fx * fx + covariance[(1, 1)] * fy * fy - 2.0 * covariance[(0, 1)] * fx * fy;
    let sigma = ratio * relative.max(0.0).sqrt();
    ((ratio - 1.0).abs() > MAX_ASPECT_SIGMAS * sigma).then_some(Warning::Aspect { ratio, sigma })
}

fn find_doubts(c: &Calibrated) -> Vec<Warning> {
    let mut doubts = Vec::new();
    if c.corner_deg > c.covered_deg * (1.0 + MAX_EXTRAPOLATION) {
        let (covered_deg, corner_deg, corner_sigma_px) = (c.covered_deg, c.corner_deg, c.corner_sigma_px);
        doubts.push(Warning::Extrapolated { covered_deg, corner_deg, corner_sigma_px });
    }
    let max_tilt_deg = c.views.iter().filter_map(|v| v.tilt_deg).fold(f64::NAN, f64::max);
    if max_tilt_deg < FRONTAL_DEG {
        doubts.push(Warning::Frontal { max_tilt_deg });
    }
    if let Some(between_px) = c.between_sigma_px
        && between_px > MAX_BETWEEN * c.alone_sigma_px
    {
        doubts.push(Warning::Between { between_px, alone_px: c.alone_sigma_px });
    }
    if c.lens_sigma_px > MAX_LENS_SIGMA * c.sigma_px {
        doubts.push(Warning::Uncertain { lens_sigma_px: c.lens_sigma_px, sigma_px: c.sigma_px });
    }
    doubts
}
