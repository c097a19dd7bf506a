//! Reasons why a flight does not determine limb height and noise.

use std::fmt;

use crate::limb_prior::TWO_SIDED;
use crate::words::above;

/// Usual causes of an impossible limb height.
const CAUSES: &str = "Usual causes are wrong altitudes (body.altitude_km, frames.csv: check their unit and their \
                      zero), a wrong lens (`hzn calibrate check` compares it with the flight), and clouds or light \
                      that bend all edges alike: take pictures of other places, and with the vehicle turned";

/// Why a calibration is refused. It is displayed with the measured number, its limit, and a remedy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Refusal {
    /// Too few pictures have an answer.
    TooFew {
        /// Number of pictures with an answer and an altitude.
        answered: usize,
        /// Smallest number of such pictures.
        min_pictures: usize,
    },
    /// The limb heights of the pictures have too large errors: the field of view or the arcs are too small.
    TooVague {
        /// 1-sigma of the limb height from the flight, in kilometres.
        sigma_km: f64,
        /// Largest 1-sigma, in kilometres.
        max_km: f64,
        /// Number of pictures.
        pictures: usize,
    },
    /// The lens is so uncertain that it moves the limb height of all pictures too much.
    Lens {
        /// 1-sigma of the limb height from the sigmas of the lens in sensor.toml, in kilometres.
        lens_km: f64,
        /// Largest 1-sigma, in kilometres.
        max_km: f64,
    },
    /// The limb height is less certain than that of a sensor without a calibration.
    NoBetter {
        /// Its 1-sigma, in kilometres.
        sigma_km: f64,
        /// The largest part of it with its name, in kilometres.
        largest: (&'static str, f64),
        /// 1-sigma without a calibration, in kilometres.
        max_km: f64,
    },
    /// Too many pictures measure a limb height that disagrees with the others.
    Inconsistent {
        /// Number of pictures that disagree.
        inconsistent: usize,
        /// Number of all pictures.
        pictures: usize,
    },
    /// The limb height is below the surface of a body with air.
    BelowSurface {
        /// The limb height, in kilometres.
        km: f64,
        /// Its 1-sigma, in kilometres.
        sigma_km: f64,
        /// Highest limb height that is expected, in kilometres.
        high_km: f64,
    },
    /// The limb height disagrees with that of sensor.toml.
    Told {
        /// Limb height of the pictures and its 1-sigma, in kilometres.
        km: [f64; 2],
        /// Limb height of sensor.toml and its 1-sigma with the error of the altitude, in kilometres.
        told_km: [f64; 2],
        /// Their difference in sigmas of both together.
        sigmas: f64,
    },
    /// The pictures' limb heights scatter more than their errors allow.
    Alarm {
        /// Mean square of the residuals over their variances; 1 is ideal.
        chi2: f64,
        /// Largest value that is consistent.
        max_chi2: f64,
    },
}

/// Writes that the height of the pictures is not the told one; each height has its sigma.
fn write_told(
    f: &mut fmt::Formatter<'_>,
    [km, sigma_km]: [f64; 2],
    [told_km, told_sigma_km]: [f64; 2],
    sigmas: f64,
) -> fmt::Result {
    write!(
        f,
        "the pictures measure a limb height of {km:.1} km ± {sigma_km:.1} km, but sensor.toml tells {told_km:.1} km ± \
         {told_sigma_km:.1} km (with the error of the altitude): they differ by {sigmas:.1} sigmas, and at most \
         {TWO_SIDED} are consistent. {CAUSES}. If the told height is not that of this camera's wavelengths, tell a \
         limb_height_km with a limb_height_sigma_km in [body] that includes the right one"
    )
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFew { answered, min_pictures } => write!(
                f,
                "{answered} pictures have an answer, but at least {min_pictures} are needed to determine the scatter \
                 between pictures; take more pictures of the flight"
            ),
            Self::TooVague { sigma_km, max_km, pictures } => write!(
                f,
                "{pictures} pictures give the limb height to ± {sigma_km:.1} km, but ± {max_km:.1} km is needed to \
                 improve on the default. Sigma falls with the root of the number of pictures and with the square of \
                 the field of view; take more pictures, or pictures with a longer limb"
            ),
            Self::Lens { lens_km, max_km } => write!(
                f,
                "the lens in sensor.toml is not known well enough: its sigmas move the limb height of all pictures by \
                 {lens_km:.1} km, but at most {max_km:.1} km is useful. Calibrate the lens first, with a board \
                 (`hzn calibrate board`), or in flight (`hzn calibrate sky`). If its sigmas are from sky already, it \
                 needs about {:.0} times as many pictures, or turns that bring the limb to other parts of the picture \
                 and other altitudes; the same pictures do not tell more",
                (lens_km / max_km).powi(2).ceil()
            ),
            Self::NoBetter { sigma_km, largest: (name, km), max_km } => {
                let [sigma_km, max_km] = above(*sigma_km, *max_km);
                write!(
                    f,
                    "the limb height would have a sigma of {sigma_km} km, most of it ({km:.1} km) from {name}: the \
                     {max_km} km of a sensor without a calibration are not worse"
                )
            }
            Self::Inconsistent { inconsistent, pictures } => write!(
                f,
                "{inconsistent} of {pictures} pictures measure limb heights that disagree with the others. Either \
                 edges are wrong, or altitudes belong to other pictures; examine some of them with `hzn explain`"
            ),
            Self::BelowSurface { km, sigma_km, high_km } => write!(
                f,
                "the pictures measure a limb height of {km:.1} km ± {sigma_km:.1} km. A limb {:.1} km below the \
                 surface is not possible: it is expected between 0 km and {high_km:.0} km. {CAUSES}",
                km.abs()
            ),
            Self::Told { km, told_km, sigmas } => write_told(f, *km, *told_km, *sigmas),
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
        }
    }
}

impl std::error::Error for Refusal {}
