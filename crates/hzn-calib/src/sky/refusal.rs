//! Reasons why a flight does not determine a calibration.

use std::fmt;

use super::conflict::Conflict;
use crate::words::above;

/// What to do if the lens of sensor.toml is probably more wrong than its sigmas.
const OTHER_LENS: &str = "The lens of sensor.toml is probably more wrong than its sigmas, or of another family \
                          (camera.model): make the sensor.toml again with another field of view or family (`hzn init \
                          --fov`, `--lens`), or with `hzn init` without --fov, which finds the field of view in the \
                          pictures";

/// Why a calibration from the sky is refused. It is displayed with the measured number, its limit, and a remedy.
#[derive(Debug, Clone, PartialEq)]
pub enum Refusal {
    /// Too few pictures have an answer.
    TooFew {
        /// Number of pictures with an answer and an altitude.
        answered: usize,
        /// Smallest number of such pictures if the limb height is free.
        min_pictures: usize,
    },
    /// The lens of the sensor.toml is not valid.
    Lens {
        /// The reason.
        why: String,
    },
    /// The lens that the pictures ask for is not possible.
    Impossible {
        /// The reason.
        why: String,
    },
    /// The normal equations have no solution.
    Singular,
    /// The steps of the fit do not end.
    NotConverged {
        /// Number of steps.
        steps: usize,
    },
    /// Too many pictures measure a limb height that disagrees with the others.
    Inconsistent {
        /// Number of pictures that disagree.
        inconsistent: usize,
        /// Number of all pictures.
        pictures: usize,
    },
    /// No parameter is known clearly better than before.
    Undetermined {
        /// 1-sigma of the focal length after the flight, in percent.
        focal_percent: f64,
        /// 1-sigma of the focal length before the flight, in percent.
        before_percent: f64,
        /// 1-sigma of the focal length if the limb height were known exactly, in percent.
        with_known_limb_percent: f64,
    },
    /// The pictures' limb heights scatter more than their errors allow.
    Alarm {
        /// Mean square of the deviations over their variances; 1 is ideal.
        chi2: f64,
        /// Largest value that is consistent.
        max_chi2: f64,
    },
    /// The pictures disagree with what was known of focal length and limb height.
    Conflict {
        /// The shifts against their sigmas.
        conflict: Conflict,
        /// Change of the focal length by the flight, in percent.
        focal_percent: f64,
        /// Limb height before and after the flight, in kilometres.
        height_km: [f64; 2],
    },
    /// Each time that the pictures are processed with the lens that they asked for, they ask for another one.
    NotSettled {
        /// Number of times.
        passes: usize,
    },
    /// The pictures ask for another lens, and lose their answers with it.
    Lost {
        /// Change of the focal length with which the pictures were processed, in percent.
        percent: f64,
        /// Number of pictures with an answer before and with that lens.
        answered: [usize; 2],
        /// What the estimate with that lens says, if it is not the number of answers.
        why: Option<Box<Refusal>>,
    },
}

fn write_undetermined(
    f: &mut fmt::Formatter<'_>,
    focal_percent: f64,
    before_percent: f64,
    with_known_limb_percent: f64,
) -> fmt::Result {
    write!(
        f,
        "the flight gives the focal length to ± {focal_percent:.2} %, and before it was known to ± \
                     {before_percent:.2} %; a value is written if its sigma is at most half of that before, or \
                     0.9 of it if the calibration states the covariance of all parameters. "
    )?;
    if with_known_limb_percent < 0.5 * focal_percent {
        write!(
            f,
            "With the limb height known exactly, it would be ± {with_known_limb_percent:.2} %: reduce \
                         limb_height_sigma_km or altitude_sigma_km of [body], whichever is larger, by a better limb \
                         height or better altitudes; or take pictures from a wider range of altitudes and \
                         directions"
        )
    } else {
        write!(
            f,
            "Even with the limb height known exactly, it would be ± {with_known_limb_percent:.2} %: take \
                         more pictures, or pictures with a longer limb"
        )
    }
}

fn write_conflict(
    f: &mut fmt::Formatter<'_>,
    conflict: &Conflict,
    focal_percent: f64,
    [before_km, height_km]: [f64; 2],
) -> fmt::Result {
    let Conflict { focal_sigmas, height_sigmas, chi2, max_chi2, range_km: [low, high], outside_sigmas } = conflict;
    f.write_str("the pictures disagree with what was known before the flight. ")?;
    if chi2 > max_chi2 {
        let [chi2, max_chi2] = above(*chi2, *max_chi2);
        write!(
            f,
            "The focal length changes by {focal_percent:+.1} %, which is {:.1} of its sigmas, and the limb height from \
             {before_km:.1} km to {height_km:.1} km, {:.1} of its sigmas (with the error of the altitude): the sum of \
             the squares is {chi2}, but at most {max_chi2} is consistent. ",
            focal_sigmas.abs(),
            height_sigmas.abs()
        )?;
    }
    if *outside_sigmas > 0.0 {
        let where_km = if height_km < 0.0 { "below the surface" } else { "above the surface" };
        write!(
            f,
            "A limb {:.1} km {where_km} is not possible: it is expected between {low:.0} km and {high:.0} km. ",
            height_km.abs()
        )?;
    }
    write!(
        f,
        "Both errors look alike in the pictures, so that neither value is sure. {OTHER_LENS}. Or the altitudes \
               are wrong (body.altitude_km, frames.csv): check their unit and their zero"
    )
}

fn write_too_few(f: &mut fmt::Formatter<'_>, answered: usize, min_pictures: usize) -> fmt::Result {
    write!(
        f,
        "{answered} pictures have an answer, but a free limb height needs at least {min_pictures}; take more pictures, \
         or state limb_height_km and limb_height_sigma_km in [body]"
    )
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFew { answered: 0, .. } => {
                f.write_str("no picture has an answer with a limb and an altitude; examine some with `hzn explain`")
            }
            Self::TooFew { answered, min_pictures } => write_too_few(f, *answered, *min_pictures),
            Self::Lens { why } => write!(f, "the lens is not valid: {why}"),
            Self::Impossible { why } => write!(
                f,
                "the lens that the pictures ask for is not possible: {why}. These are numbers of the estimate, and not \
                 of sensor.toml. {OTHER_LENS}"
            ),
            Self::Singular => {
                f.write_str("the equations have no solution; check [camera.covariance] and the altitudes")
            }
            Self::NotConverged { steps } => write!(
                f,
                "the fit does not converge in {steps} steps. The focal length of sensor.toml may be more than 10 % \
                 wrong, its lens may be of another family (camera.model: a fisheye is no pinhole; `hzn init --lens`), \
                 or altitudes belong to other pictures"
            ),
            Self::Inconsistent { inconsistent, pictures } => write!(
                f,
                "{inconsistent} of {pictures} pictures measure limb heights that disagree with the others. Either \
                 edges are wrong, or altitudes belong to other pictures; examine some of them with `hzn explain`"
            ),
            Self::Undetermined { focal_percent, before_percent, with_known_limb_percent } => {
                write_undetermined(f, *focal_percent, *before_percent, *with_known_limb_percent)
            }
            Self::Alarm { chi2, max_chi2 } => {
                let [chi2, max_chi2] = above(*chi2, *max_chi2);
                write!(
                    f,
                    "the limb heights of the pictures scatter more than their errors allow: chi-square is {chi2} per \
                     degree of freedom, but at most {max_chi2} is consistent. Possible reasons that the model does \
                     not have: a rolling shutter (camera.readout_s and rates), altitudes or times of other pictures, \
                     a lens that changes"
                )
            }
            Self::Conflict { conflict, focal_percent, height_km } => {
                write_conflict(f, conflict, *focal_percent, *height_km)
            }
            Self::NotSettled { passes } => write!(
                f,
                "the pictures were processed {passes} times with the lens that they asked for, and asked for another \
                 one each time. {OTHER_LENS}"
            ),
            Self::Lost { percent, answered: [before, after], why } => {
                let why = why.as_ref().map_or_else(String::new, |why| format!("; {why}"));
                write!(
                    f,
                    "the pictures ask for a focal length that differs by {percent:+.1} %. With the lens of \
                     sensor.toml, {before} of them have an answer, and with that lens {after}{why}. {OTHER_LENS}"
                )
            }
        }
    }
}

impl std::error::Error for Refusal {}
