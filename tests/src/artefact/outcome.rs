//! A sensor's result for a trial, and whether it is false.

use hzn_core::body::Expected;
use hzn_core::status::Status;
use hzn_core::{Config, HostHorizon};
use hzn_core::{observer::Observer, report::Candidate};
use hzn_evaluate::Miss;
use hzn_host::Compiled;
use hzn_sim::error::SceneError;
use hzn_sim::globe::Globe;
use hzn_sim::picture::Picture;

use super::trial::Trial;

/// Error in degrees above which an answer on a limb is false, for every covariance.
pub const GROSS_DEG: f64 = 2.0;
/// Error in sigmas of the answer above which it is false.
pub const FALSE_SIGMAS: f64 = 5.0;

/// Prior of a picture besides the position.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PriorKnowledge {
    /// Error of the attitude, 1σ about each axis in degrees; `None` for a prior without attitude.
    pub attitude_sigma_deg: Option<f64>,
}

/// An answer, compared with the truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// Error of the answer.
    pub miss: Miss,
    /// Unit direction in the camera frame.
    pub axis: [f64; 3],
    /// Half-angle of the answer, radians.
    pub half_angle_rad: f64,
    /// RMS of the inliers, pixels.
    pub rms_px: f64,
    /// Number of inliers.
    pub inliers: u32,
    /// Length of the edge that the inliers cover, pixels.
    pub arc_px: f64,
}

/// A sensor's result for a trial.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// Status of the picture.
    pub status: Status,
    /// The answer, if the status is `ok`.
    pub found: Option<Detection>,
    /// The candidates with their verdicts.
    pub candidates: Vec<Candidate<f64>>,
    /// True if one of the picture's discs has the expected half-angle within three of its sigmas.
    pub matching_disc: bool,
    /// True if a limb is in the picture.
    pub limb: bool,
}

impl Outcome {
    /// Returns true for a false answer: there is no limb, or the answer is more than 5σ or 2° away from it.
    pub fn is_false(&self) -> bool {
        self.found.is_some_and(|f| !self.limb || !is_right(&f.miss))
    }
    /// Returns true if the limb in the picture was answered correctly.
    pub fn is_right(&self) -> bool {
        self.limb && self.found.is_some_and(|f| is_right(&f.miss))
    }
}

fn is_right(miss: &Miss) -> bool {
    let sigmas2 = miss.nees.unwrap_or(f64::INFINITY);
    miss.angle_deg <= GROSS_DEG && sigmas2 <= FALSE_SIGMAS * FALSE_SIGMAS
}

/// Processes the picture of a trial with a sensor of this configuration.
///
/// # Errors
/// Fails if the configuration is refused, or if the position is invalid.
pub fn process_trial(
    horizon: &mut HostHorizon,
    config: &Config,
    trial: &Trial,
    picture: &Picture,
    prior: PriorKnowledge,
    observer: &dyn Observer<f64>,
) -> Result<Outcome, SceneError> {
    horizon.configure(config)?;
    let prior = trial.prior(prior.attitude_sigma_deg);
    let expected = horizon.expect(&prior).map_err(|_| SceneError::Pose)?;
    let report = horizon.find_observed(&picture.view(), &expected, observer);
    let truth = &trial.truth;
    let found = report.solution.as_ref().and_then(|s| {
        Some(Detection {
            miss: Miss::new(&s.into(), [truth.axis_x, truth.axis_y, truth.axis_z], truth.half_angle_deg)?,
            axis: s.axis.xyz(),
            half_angle_rad: s.fused_half_angle_rad,
            rms_px: s.rms_px,
            inliers: s.inliers,
            arc_px: s.arc_px,
        })
    });
    Ok(Outcome {
        status: report.status,
        found,
        candidates: report.candidates.iter().copied().collect(),
        matching_disc: has_matching_disc(trial, config, &expected),
        limb: trial.limb,
    })
}

/// Returns the sigma of the prior half-angle: sin α = (R + d)/(R + H), so cos α dα = (dd − sin α dH)/(R + H).
fn half_angle_sigma_rad(trial: &Trial, config: &Config, expected: &Expected<f64>) -> f64 {
    let (sin, cos) = libm::sincos(expected.half_angle_rad());
    let globe = Globe::new(&config.body);
    let distance_km = (globe.a_m + globe.altitude_m(trial.scene.pose.position_m)) * 1e-3;
    let (limb, altitude) = (config.body.limb_height_sigma_km, sin * config.body.altitude_sigma_km);
    libm::hypot(limb, altitude) / (distance_km * cos)
}

fn has_matching_disc(trial: &Trial, config: &Config, expected: &Expected<f64>) -> bool {
    let sigma = half_angle_sigma_rad(trial, config, expected);
    trial.disc_half_angles_rad.iter().any(|a| (a - expected.half_angle_rad()).abs() <= 3.0 * sigma)
}
