//! Writes a sensor.toml for a camera without a calibration. It needs the size of the pictures and either a stated field
//! of view or the EXIF data of a picture.
//!
//! Unknown properties of the lens are written as sigmas, so that the covariance of the answers includes them:
//!
//! - **Scale.** Makers state the focal length of a series lens, and thus its field of view, to ± 5 %. With a uniform
//!   distribution in this range 1-sigma is 5 %/√3. EXIF has the nominal focal length: ± 10 %. A zoom lens gives it in
//!   steps, and it does not include the change by focusing. The 35 mm equivalent is also rounded to a millimetre.
//! - **Shape.** The guessed lens is ideal (pinhole or equidistant) and has the coefficients k1 = k2 = 0 with a sigma,
//!   which `guess.rs` derives from the other lenses of the family and from public calibrations. A field of view fixes
//!   the lens at the picture's edges, so that focal length and shape change together there.
//! - **Decentring.** A pinhole has p1 = p2 = 0 with a sigma from public calibrations. The model of a fisheye does not
//!   have these coefficients.
//! - **Centre.** In published calibrations the distance of the principal point from the picture's centre is, in percent
//!   of the width (x, y): EuRoC 1.1, 1.2; TUM RGB-D fr1 0.1, 2.5; KITTI odometry 1.0, 0.2. Their root mean square is
//!   1.3 %; 1.5 % is written. A picture that is cropped on one side is not covered.
//!
//! No database of sensor sizes is used. LensFun's is maintained, but this project cannot adopt its licence (CC BY-SA;
//! its crate LGPL). openMVG's has not changed since 2019. Cameras that write a focal length mostly also write the pitch
//! of their pixels or the 35 mm equivalent.

mod bars;
mod body;
mod circle;
mod exif;
mod facts;
mod focal;
mod guess;
#[cfg(test)]
mod tests;
mod text;

use hzn_core::camera::{Config, Model};

pub use bars::Bars;
pub use body::Body;
pub use circle::ImageCircle;
pub use exif::Exif;
pub use facts::{CameraFacts, MeasuredFov, StartConfig};
pub use focal::{focal_px, fov_deg};

use focal::Focal;
use guess::Guess;

use crate::plausible::MAX_PINHOLE_FOV_DEG;

/// Largest stated field of view, in degrees, for which a pinhole is assumed if the lens is not given.
const MAX_PINHOLE_DEFAULT_DEG: f64 = 90.0;

/// Writes a sensor.toml that works at once. Values that are not measured have a sigma.
///
/// # Errors
/// There is no focal length, the lens cannot have the field of view, or the field of view is so wide that the lens must
/// be given.
pub fn write_sensor_toml(facts: &CameraFacts) -> Result<StartConfig, String> {
    let [width, height] = facts.size_px.map(f64::from);
    let lens = choose_lens(facts.lens, facts.fov_deg)?;
    let exif = facts.exif.focal([width, height]);
    let stated = facts.fov_deg.map(|fov| {
        Focal::from_stated(lens, width, fov)
            .ok_or_else(|| format!("--fov {fov}: the field of view of a pinhole must be below 180 degrees"))
    });
    let measured = facts.measured.and_then(|measured| {
        Some(Focal {
            px: focal_px(lens, width, measured.fov_deg)?,
            percent: measured.focal_sigma_percent,
            from: format!("the limb in {} of the pictures", measured.pictures),
            sigma_from: "the limb (edge noise, shape of the lens, its centre, altitude)",
            is_at_edge: true,
        })
    });
    let known = stated.transpose()?.or(measured.filter(|_| exif.is_err()));
    let (mut focal, mut warnings, comparison) = choose_focal(known, exif, lens, width)?;
    // A telescope that looks at the Sun has such a field of view.
    warnings.extend(facts.fov_deg.filter(|_| facts.body != Body::Sun).and_then(doubt_unit));
    if let Some(percent) = facts.doubt_percent {
        (focal.percent, focal.sigma_from) =
            (focal.percent.hypot(percent), "a stated field of view that the limb contradicts");
    }
    let guess = Guess::new(facts, lens, &focal);
    let fov_deg = fov_deg(lens, width, focal.px);
    let circle = ImageCircle::choose(facts.image_circle_px, &guess.camera, fov_deg);
    Ok(StartConfig {
        text: text::write_text(facts, &guess, &focal, fov_deg, circle, comparison.as_deref()),
        lens,
        focal_px: focal.px,
        fov_deg,
        focal_sigma_percent: guess.focal_sigma_percent,
        k1_sigma: guess.k1_sigma,
        k2_sigma: guess.k2_sigma,
        p_sigma: guess.p_sigma,
        centre_sigma_px: guess.centre_sigma_px,
        image_circle: circle,
        warnings,
    })
}

/// Writes a sensor.toml for a camera with a calibration; `from` says where that comes from.
///
/// # Errors
/// A number of the calibration is not TOML.
pub fn write_calibrated(facts: &CameraFacts, camera: &Config, from: &str) -> Result<String, toml::ser::Error> {
    text::write_calibrated(facts, camera, from)
}

/// Chooses the lens: a pinhole, unless it is given.
fn choose_lens(given: Option<Model>, fov_deg: Option<f64>) -> Result<Model, String> {
    let Some(fov) = fov_deg else { return Ok(given.unwrap_or(Model::Pinhole)) };
    if !(fov > 0.1 && fov <= 300.0) {
        return Err(format!("--fov {fov}: must lie between 0.1 and 300 degrees"));
    }
    match given {
        Some(Model::Pinhole) if fov > MAX_PINHOLE_FOV_DEG => Err(format!(
            "--fov {fov}: a pinhole lens sees at most {MAX_PINHOLE_FOV_DEG} degrees; a lens of this width is a \
             fisheye: --lens fisheye"
        )),
        None if fov > MAX_PINHOLE_FOV_DEG => {
            Err(format!("--fov {fov}: a lens of this width is a fisheye; add --lens fisheye"))
        }
        None if fov > MAX_PINHOLE_DEFAULT_DEG => Err(format!(
            "--fov {fov}: a lens of this width may be a fisheye or a pinhole; add --lens fisheye or --lens pinhole"
        )),
        given => Ok(given.unwrap_or(Model::Pinhole)),
    }
}

/// Asks for the unit of a narrow field of view that would be that of a usual camera in radians.
fn doubt_unit(fov_deg: f64) -> Option<String> {
    let if_radians = fov_deg.to_degrees();
    (20.0..180.0)
        .contains(&if_radians)
        .then(|| format!("--fov {fov_deg} is in degrees; if it is in radians, write --fov {if_radians:.1}"))
}

/// The chosen focal length, warnings, and a note about the other focal length.
type Chosen = (Focal, Vec<String>, Option<String>);

/// Chooses the focal length: a stated field of view overrides EXIF, which is only compared with it.
fn choose_focal(
    stated: Option<Focal>,
    exif: Result<Focal, Option<String>>,
    lens: Model,
    width: f64,
) -> Result<Chosen, String> {
    match (stated, exif) {
        (Some(stated), Ok(exif)) => {
            let off_percent = 100.0 * (exif.px / stated.px - 1.0);
            let other = fov_deg(lens, width, exif.px);
            let comparison = format!("{}: {:.1} px, {other:.1} degrees wide ({off_percent:+.1} %)", exif.from, exif.px);
            let warnings = if off_percent.abs() > 3.0 * stated.percent.hypot(exif.percent) {
                vec![format!(
                    "the picture's {comparison} contradicts the field of view, which is over the whole width; was it \
                     stated for the diagonal, another lens, or another mode of the camera?"
                )]
            } else {
                Vec::new()
            };
            Ok((stated, warnings, Some(comparison)))
        }
        (Some(stated), Err(_)) => Ok((stated, Vec::new(), None)),
        (None, Ok(exif)) => Ok((exif, Vec::new(), None)),
        (None, Err(why)) => {
            let why = why.unwrap_or_else(|| "the picture has no focal length (EXIF)".to_owned());
            Err(format!(
                "{why}; add the field of view over the whole width, for example --fov 60, and --lens fisheye or \
                 --lens pinhole; or an altitude, --altitude 400, so that the limb in the pictures gives the field of \
                 view"
            ))
        }
    }
}
