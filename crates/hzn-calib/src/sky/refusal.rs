//! Reasons why a flight does not determine a calibration.

use std::fmt;

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
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFew { answered: 0, .. } => write!(
                f,
                "no picture has an answer with a limb and an altitude; examine some pictures with `hzn explain`"
            ),
            Self::TooFew { answered, min_pictures } => write!(
                f,
                "{answered} pictures have an answer, but a free limb height needs at least {min_pictures}; take more \
                 pictures, or state limb_height_km and limb_height_sigma_km in [body]"
            ),
            Self::Lens { why } => write!(f, "the lens is not valid: {why}"),
            Self::Singular => f.write_str(
                "the equations have no solution; check [camera.covariance] and the altitudes of the pictures",
            ),
            Self::NotConverged { steps } => write!(
                f,
                "the fit does not converge in {steps} steps. The focal length of sensor.toml may be more than 10 % \
                 wrong, or altitudes belong to other pictures"
            ),
            Self::Inconsistent { inconsistent, pictures } => write!(
                f,
                "{inconsistent} of {pictures} pictures measure limb heights that disagree with the others. Either \
                 edges are wrong, or altitudes belong to other pictures; examine some of them with `hzn explain`"
            ),
            Self::Undetermined { focal_percent, before_percent, with_known_limb_percent } => {
                write!(
                    f,
                    "the flight gives the focal length to ± {focal_percent:.2} %, and before it was known to ± \
                     {before_percent:.2} %; a value is written if its sigma is at most half of that before. "
                )?;
                if *with_known_limb_percent < 0.5 * focal_percent {
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
            Self::Alarm { chi2, max_chi2 } => write!(
                f,
                "the limb heights of the pictures scatter more than their errors allow: chi-square is {chi2:.2} per \
                 degree of freedom, but at most {max_chi2:.2} is consistent. Possible reasons that the model does not \
                 have: a rolling shutter (camera.readout_s and rates), altitudes or times of other pictures, a lens \
                 that changes"
            ),
        }
    }
}

impl std::error::Error for Refusal {}
