//! Reasons why a flight does not determine limb height and noise.

use std::fmt;

/// Why a calibration is refused. It is displayed with the measured number, its limit, and a remedy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Refusal {
    /// Too few pictures have an answer.
    TooFew {
        /// Number of pictures with an answer and an altitude.
        answered: usize,
        /// Smallest number of such pictures.
        least: usize,
    },
    /// The limb heights of the pictures have too large errors: the field of view or the arcs are too small.
    TooVague {
        /// 1-sigma of the limb height from the flight, in kilometres.
        sigma_km: f64,
        /// Largest 1-sigma, in kilometres.
        most_km: f64,
        /// Number of pictures.
        pictures: usize,
    },
    /// Too many pictures measure a limb height that disagrees with the others.
    Apart {
        /// Number of pictures that disagree.
        apart: usize,
        /// Number of all pictures.
        pictures: usize,
    },
    /// The pictures' limb heights scatter more than their errors allow.
    Alarm {
        /// Mean square of the residuals over their variances; 1 is ideal.
        chi2: f64,
        /// Largest value that is consistent.
        most: f64,
    },
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFew { answered, least } => write!(
                f,
                "{answered} pictures were answered, but at least {least} are needed: the scatter between pictures \
                 cannot be told from fewer; take more pictures of the flight"
            ),
            Self::TooVague { sigma_km, most_km, pictures } => write!(
                f,
                "the limb height comes out to ± {sigma_km:.1} km from {pictures} pictures, but ± {most_km:.1} km is \
                 needed to say more than the default: sigma falls with the root of the number of pictures and with the \
                 square of the field of view; take more pictures, or ones with a longer limb"
            ),
            Self::Apart { apart, pictures } => write!(
                f,
                "{apart} of {pictures} pictures measure limb heights that do not belong to those of the others: wrong \
                 edges, or altitudes that belong to other pictures; look at some with `hzn explain`"
            ),
            Self::Alarm { chi2, most } => write!(
                f,
                "the limb heights of the pictures scatter more than their errors allow: chi-square is {chi2:.1} a \
                 degree of freedom, at most {most:.1} is consistent. Something moves from picture to picture that the \
                 model does not have: a rolling shutter (camera.readout_s and rates), altitudes or times of other \
                 pictures, the lens"
            ),
        }
    }
}

impl std::error::Error for Refusal {}
