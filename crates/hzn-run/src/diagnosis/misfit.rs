//! A limb of another size than the expected one, in one picture.

use hzn_core::Config;
use hzn_core::camera::Camera;
use hzn_core::image::Pixels;
use hzn_files::FrameData;

use super::any_cone::AnyCone;
use super::facts::FitFacts;
use super::implied::fit_facts;
use crate::record::altitude_km;

/// Looks for a limb of any size, and returns what it says if its half-angle differs from the expected one by more than
/// `gates.max_half_angle_sigma`. `trial` is made from `config`.
pub fn find_misfit<P: Pixels>(
    trial: &mut AnyCone,
    config: &Config,
    picture: &P,
    data: Option<&FrameData>,
) -> Option<FitFacts> {
    find_any_fit(trial, config, picture, data).filter(|fit| is_misfit(fit, config))
}

/// Returns whether the half-angle of a fit differs from the expected one by more than `gates.max_half_angle_sigma`.
pub fn is_misfit(fit: &FitFacts, config: &Config) -> bool {
    fit.sigmas.abs() > config.gates.max_half_angle_sigma
}

/// Looks for a limb of any size, and returns what it says. `trial` is made from `config`.
pub fn find_any_fit<P: Pixels>(
    trial: &mut AnyCone,
    config: &Config,
    picture: &P,
    data: Option<&FrameData>,
) -> Option<FitFacts> {
    let edge = trial.find(picture, data)?;
    let altitude_km = altitude_km(data, config.each_body().first()?);
    let camera = Camera::<f64>::try_new(&config.camera).ok()?;
    fit_facts(&edge, edge.fitted.as_ref()?, &camera, altitude_km, true)
}
