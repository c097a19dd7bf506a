//! Writes a sensor.toml for a camera without a calibration. It needs the size of the pictures and either a stated field
//! of view or the EXIF data of a picture.
//!
//! Unknown properties of the lens are written as sigmas, so that the covariance of the answers includes them:
//!
//! - **Scale.** Makers state the focal length of a series lens, and thus its field of view, to ± 5 %. With a uniform
//!   distribution in this range 1-sigma is 5 %/√3. EXIF has the nominal focal length: ± 10 %. A zoom lens gives it in
//!   steps, and it does not include the change by focusing. The 35 mm equivalent is also rounded to a millimetre.
//! - **Shape.** The ideal lens (pinhole or equidistant) is exact at the picture's edges, where the field of view is
//!   stated; in the middle the real lens differs. An equisolid lens, 2 sin (θ/2), lies θ²/24 below the equidistant
//!   lens. A pinhole lens with one eighth of the equidistant lens's barrel distortion, θ²/3, differs by the same
//!   amount.
//! - **Centre.** In published calibrations the distance of the principal point from the picture's centre is, in percent
//!   of the width (x, y): EuRoC 1.1, 1.2; TUM RGB-D fr1 0.1, 2.5; KITTI odometry 1.0, 0.2. Their root mean square is
//!   1.3 %; 1.5 % is written. A picture that is cropped on one side is not covered.
//!
//! No database of sensor sizes is used. LensFun's is maintained, but this project cannot adopt its licence (CC BY-SA;
//! its crate LGPL). openMVG's has not changed since 2019. Cameras that write a focal length mostly also write the pitch
//! of their pixels or the 35 mm equivalent.

use core::fmt::Write as _;

use hzn_core::body::MOON_RADIUS_KM;
use hzn_core::camera::Model;

pub use crate::exif_lens::Exif;
use crate::exif_lens::{EXIF_PERCENT, Focal, SQRT_3};
use crate::plausible::{MAX_PINHOLE_FOV_DEG, airless_limb};

/// 1-sigma of a series lens's focal length, in percent: uniform within ± 5 %.
const STATED_PERCENT: f64 = 5.0 / SQRT_3;
/// 1-sigma of the principal point, as a fraction of the width.
const CENTRE_FRACTION: f64 = 0.015;
/// 1-sigma of an altitude that is given once for all pictures, as a fraction of it. Orbits are not circular.
const ALTITUDE_FRACTION: f64 = 0.02;
/// Largest stated field of view, in degrees, for which a pinhole is assumed if the lens is not given.
const MAX_PINHOLE_DEFAULT_DEG: f64 = 90.0;

/// Known properties of a camera.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraFacts {
    /// Columns and rows of its pictures.
    pub size_px: [u32; 2],
    /// Stated field of view over the whole width, in degrees.
    pub fov_deg: Option<f64>,
    /// [`Model::Pinhole`] or [`Model::Equidistant`]. If it is missing, a pinhole is assumed. A stated field of view
    /// above 90 degrees requires it.
    pub lens: Option<Model>,
    /// EXIF data of a picture.
    pub exif: Exif,
    /// Altitude of all pictures, in kilometres.
    pub altitude_km: Option<f64>,
    /// The body in the pictures.
    pub body: Body,
}

/// The body in the pictures of a camera without a calibration.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Body {
    /// The Earth.
    #[default]
    Earth,
    /// The Moon as an orbiter or a lander sees it.
    Moon,
}

/// A sensor.toml to start from, with its main values.
#[derive(Debug, Clone, PartialEq)]
pub struct StartConfig {
    /// Text of the file.
    pub text: String,
    /// Lens model.
    pub lens: Model,
    /// Focal length, in pixels.
    pub focal_px: f64,
    /// Field of view over the whole width, in degrees.
    pub fov_deg: f64,
    /// 1-sigma of the focal length, in percent.
    pub focal_sigma_percent: f64,
    /// 1-sigma of the principal point, in pixels.
    pub centre_sigma_px: f64,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}

/// Returns the focal length in pixels of an ideal lens that sees `fov_deg` over `width` pixels. The result is `None` if
/// the lens cannot have this field of view: not above 0, above 300 degrees, or from 180 degrees on for a pinhole.
pub fn focal_px(lens: Model, width: f64, fov_deg: f64) -> Option<f64> {
    let half = (0.5 * fov_deg).to_radians();
    let radius = match lens {
        Model::Pinhole => (fov_deg < 180.0).then(|| half.tan())?,
        Model::Equidistant => half,
        _ => return None,
    };
    (radius > 0.0 && fov_deg <= 300.0).then(|| 0.5 * width / radius)
}

/// Returns the field of view in degrees over `width` pixels.
fn fov_deg(lens: Model, width: f64, focal_px: f64) -> f64 {
    let radius = 0.5 * width / focal_px;
    let half = if lens == Model::Pinhole { radius.atan() } else { radius };
    2.0 * half.to_degrees()
}

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
        let px = focal_px(lens, width, fov)
            .ok_or_else(|| format!("--fov {fov}: the field of view of a pinhole must be below 180 degrees"))?;
        Ok::<_, String>(Focal { px, percent: STATED_PERCENT, from: format!("the field of view, {fov} degrees wide") })
    });
    let (focal, warnings, comparison) = choose_focal(stated.transpose()?, exif, lens, width)?;
    let fov = fov_deg(lens, width, focal.px);
    let half_rad = (0.5 * fov).to_radians();
    let shape_percent = 100.0 * half_rad * half_rad / 24.0;
    let focal_sigma_percent = (focal.percent.hypot(shape_percent) * 10.0).ceil() / 10.0;
    let centre_sigma_px = (CENTRE_FRACTION * width).ceil();
    let start = StartConfig {
        text: String::new(),
        lens,
        focal_px: focal.px,
        fov_deg: fov,
        focal_sigma_percent,
        centre_sigma_px,
        warnings,
    };
    let text = write_text(facts, &start, &focal, comparison.as_deref(), shape_percent);
    Ok(StartConfig { text, ..start })
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
                 --lens pinhole"
            ))
        }
    }
}

/// Writes the text of the file; `comparison` is the note about the focal length that is not used.
fn write_text(
    facts: &CameraFacts,
    start: &StartConfig,
    focal: &Focal,
    comparison: Option<&str>,
    shape_percent: f64,
) -> String {
    let mut text = String::from(
        "# A sensor.toml for a camera without a calibration, by `hzn init`. Unknown properties of the lens are\n\
         # sigmas, which the covariance of the answers includes. A calibration reduces them: `hzn camera convert`,\n\
         # with both sigmas smaller or removed.\n\
         # Try it on one picture:  hzn explain PICTURE --sensor sensor.toml --overlay out.png\n\
         # Every other key with its default:  hzn init -o all.toml\n\
         \n\
         preset = \"hzn\"\n\
         \n\
         [camera]\n",
    );
    text += &write_camera_model(facts, start);
    text += &write_focal_and_centre(facts, start, focal, comparison);
    text += &write_camera_sigmas(start, focal, shape_percent);
    text += &write_body(facts.body, facts.altitude_km);
    text
}

/// Writes the size of the pictures and the lens.
fn write_camera_model(facts: &CameraFacts, start: &StartConfig) -> String {
    let [width, height] = facts.size_px;
    let mut t = String::new();
    if let Some(camera) = &facts.exif.camera {
        let _ = writeln!(t, "# {}", camera.replace(['\n', '\r'], " "));
    }
    let _ = write!(
        t,
        "width = {width}\nheight = {height}\nmodel = \"{}\"{}\n",
        start.lens.name(),
        match start.lens {
            Model::Pinhole => "            # an ideal lens without distortion",
            _ => "        # an ideal fisheye: the angle off axis is proportional to the radius",
        }
    );
    t
}

/// Writes the focal length with its source, and the picture's centre as the principal point.
fn write_focal_and_centre(facts: &CameraFacts, start: &StartConfig, focal: &Focal, comparison: Option<&str>) -> String {
    let [cx, cy] = facts.size_px.map(|n| 0.5 * (f64::from(n) - 1.0));
    let mut t = format!("# From {}", focal.from);
    let _ = match comparison {
        Some(comparison) => writeln!(t, "; for comparison, {comparison}."),
        None => writeln!(t, "; {:.1} degrees wide.", start.fov_deg),
    };
    let _ = write!(t, "fx_px = {:.1}\nfy_px = {:.1}\n", start.focal_px, start.focal_px);
    let _ = write!(t, "cx_px = {cx:.1}                 # the picture's centre\ncy_px = {cy:.1}\n");
    t
}

/// Writes the sigmas of the lens, and for a fisheye the key of its image circle.
fn write_camera_sigmas(start: &StartConfig, focal: &Focal, shape_percent: f64) -> String {
    let mut t = format!(
        "# 1-sigma of the focal length: {:.1} % for {}, and {shape_percent:.1} % for the difference\n\
         # of a real lens from an ideal one over this field of view.\n\
         focal_sigma_percent = {:.1}\n\
         # 1-sigma of the principal point, each axis: 1.5 % of the width. It turns all answers by the same angle.\n\
         # Increase it for cropped pictures.\n\
         centre_sigma_px = {:.1}\n",
        focal.percent,
        if focal.percent < EXIF_PERCENT {
            "a stated field of view (makers: 5 % at most)"
        } else {
            "EXIF (10 % at most)"
        },
        start.focal_sigma_percent,
        start.centre_sigma_px,
    );
    if start.lens == Model::Equidistant {
        let _ = writeln!(
            t,
            "# theta_max_deg = {:.0}            # radius of the image circle in degrees off axis, if its rim is in the \
             picture",
            0.5 * start.fov_deg
        );
    }
    t
}

/// Writes `[body]` with the altitude, or with a comment that says where altitudes belong.
fn write_body(body: Body, altitude_km: Option<f64>) -> String {
    let mut t = match body {
        Body::Earth => {
            "\n[body]\nkind = \"earth\"                 # earth (WGS-84) | earth-sphere | sun | moon | sphere\n"
                .to_owned()
        }
        // `kind = "moon"` is the disc in the sky of the Earth.
        Body::Moon => format!(
            "\n[body]\nkind = \"sphere\"                # the Moon, from near it\nradius_km = {MOON_RADIUS_KM}\n\
             # There is no air: the limb is as high as its hills, and overexposure does not raise it.\n{}",
            airless_limb(MOON_RADIUS_KM)
        ),
    };
    let _ = match altitude_km {
        Some(km) => write!(
            t,
            "altitude_km = {km}\naltitude_sigma_km = {:.1}        # 1-sigma: 2 % of the altitude, for all pictures; \
             frames.csv can give each picture its altitude\n",
            (ALTITUDE_FRACTION * km).max(0.5)
        ),
        None => write!(
            t,
            "# Every picture needs an altitude in kilometres. Write it into the columns file, altitude_km (or x_km, \
             y_km, z_km)\n\
             # of a frames.csv next to the pictures, or here for all pictures:\n# altitude_km = 400.0\n"
        ),
    };
    t
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn known(fov_deg: Option<f64>, lens: Option<Model>, exif: Exif) -> CameraFacts {
        CameraFacts { size_px: [4928, 2768], fov_deg, lens, exif, altitude_km: Some(418.0), body: Body::Earth }
    }

    /// The Nikon D4 on the ISS, 20 November 2020.
    fn d4() -> Exif {
        Exif {
            camera: Some("NIKON D4".into()),
            focal_mm: Some(56.0),
            focal_35mm_mm: Some(56.0),
            plane_px_per_mm: Some(44_855_751.0 / 32_768.0 / 10.0),
            columns: Some(4928.0),
            ..Exif::default()
        }
    }

    #[test]
    fn what_is_written_loads_and_is_the_camera_of_the_facts() {
        for (fov, lens) in [(92.0, Model::Pinhole), (92.0, Model::Equidistant), (180.0, Model::Equidistant)] {
            let start = write_sensor_toml(&known(Some(fov), Some(lens), Exif::default())).unwrap();
            let config = crate::sensor::parse(&start.text, Path::new("s.toml")).unwrap().config;
            let camera = hzn_core::camera::Camera::<f64>::try_new(&config.camera).unwrap();
            // The middle of the right edge, half a pixel beyond the centre of the last column.
            let edge = camera.unproject(hzn_core::pixel::ImagePoint { u: 4927.5, v: 1383.5 }).unwrap();
            let off_axis = edge.xyz()[0].atan2(edge.xyz()[2]).to_degrees();
            assert!((off_axis - 0.5 * fov).abs() < 0.01, "{} {off_axis}", start.text);
            assert_eq!(config.body.altitude_km, Some(418.0));
            assert!((config.camera.focal_sigma_percent - start.focal_sigma_percent).abs() < 1e-9);
            assert!((config.camera.centre_sigma_px - 74.0).abs() < 1e-9);
        }
    }

    #[test]
    fn the_moon_has_no_air() {
        let moon = CameraFacts { body: Body::Moon, ..known(Some(40.0), None, Exif::default()) };
        let start = write_sensor_toml(&moon).unwrap();
        let sensor = crate::sensor::parse(&start.text, Path::new("s.toml")).unwrap();
        let body = &sensor.config.body;
        assert_eq!((body.mean_radius_km(), body.limb_height_km, body.clipped_height_km), (1737.4, 0.0, 0.0));
        assert!(sensor.warnings.is_empty(), "{:?}", sensor.warnings);
    }

    #[test]
    fn exif_gives_the_nominal_focal_length_by_either_way() {
        let start = write_sensor_toml(&known(None, None, d4())).unwrap();
        assert!((start.focal_px - 7666.0).abs() < 1.0, "{}", start.focal_px);
        // The limb gives 7100 px, which is within two sigmas.
        assert!((start.focal_px / 7100.0 - 1.0) < 0.02 * start.focal_sigma_percent, "{start:?}");
        let film = write_sensor_toml(&known(None, None, Exif { plane_px_per_mm: None, ..d4() })).unwrap();
        assert!((film.focal_px - 7666.0).abs() < 1.0, "{}", film.focal_px);
        assert!(film.focal_sigma_percent >= start.focal_sigma_percent);
        // A third of the size: the number of columns in EXIF shows the scale.
        let small = CameraFacts { size_px: [1600, 899], ..known(None, None, d4()) };
        assert!((write_sensor_toml(&small).unwrap().focal_px - 7666.0 * 1600.0 / 4928.0).abs() < 1.0);
        // A wrong EXIF value: pixels of 10 nm.
        let odd = Exif { plane_px_per_mm: Some(1e5), ..d4() };
        assert!((write_sensor_toml(&known(None, None, odd)).unwrap().focal_px - 7666.0).abs() < 1.0);
        // A telephone: its 4:3 picture is compared by the diagonal.
        let phone = Exif { focal_35mm_mm: Some(26.0), ..Exif::default() };
        let phone = write_sensor_toml(&CameraFacts { size_px: [4000, 3000], ..known(None, None, phone) }).unwrap();
        assert!((phone.focal_px - 26.0 * 5000.0 / 43.267).abs() < 1.0, "{}", phone.focal_px);
    }

    #[test]
    fn the_pitch_of_a_picture_that_was_made_smaller_is_refused() {
        // 5.8 mm and pixels of 1.55 um, over 960 px instead of 4608.
        let small = Exif { focal_mm: Some(5.8), plane_px_per_mm: Some(645.0), columns: Some(960.0), ..Exif::default() };
        let start = |exif| write_sensor_toml(&CameraFacts { size_px: [960, 720], ..known(None, None, exif) });
        let refused = start(small.clone()).unwrap_err();
        assert!(refused.contains("would be a sensor of 1.5 mm") && refused.contains("--fov 60"), "{refused}");
        // The equivalent on film contradicts the pitch, and does not depend on the size of the picture.
        let film = start(Exif { focal_35mm_mm: Some(28.0), ..small.clone() }).unwrap();
        assert!((film.focal_px - 28.0 * 1200.0 / 43.267).abs() < 1.0, "{}", film.focal_px);
        // A small sensor that is confirmed.
        let confirmed = start(Exif { focal_35mm_mm: Some(135.0), ..small }).unwrap();
        assert!((confirmed.focal_px - 5.8 * 645.0).abs() < 1.0, "{}", confirmed.focal_px);
    }

    #[test]
    fn a_contradiction_is_reported_and_agreement_is_not() {
        let both = |fov| write_sensor_toml(&known(Some(fov), None, d4())).unwrap();
        // EXIF: 35.6 degrees over the width.
        let agreed = both(37.0);
        assert!(agreed.warnings.is_empty() && agreed.text.contains("for comparison, EXIF"), "{}", agreed.text);
        assert!((agreed.fov_deg - 37.0).abs() < 1e-9);
        assert!(both(60.0).warnings[0].contains("contradicts"));
        // The stated value overrides EXIF.
        assert!(agreed.focal_sigma_percent < write_sensor_toml(&known(None, None, d4())).unwrap().focal_sigma_percent);
    }

    #[test]
    fn impossible_facts_are_refused_with_a_remedy() {
        let refused = |fov, lens, exif| write_sensor_toml(&known(fov, lens, exif)).unwrap_err();
        assert!(refused(None, None, Exif::default()).contains("--fov"));
        assert!(refused(Some(92.0), None, Exif::default()).contains("--lens"));
        assert!(refused(Some(179.9), Some(Model::Pinhole), Exif::default()).contains("at most 150 degrees"));
        assert!(refused(Some(190.0), None, Exif::default()).ends_with("is a fisheye; add --lens fisheye"));
        assert!(refused(Some(f64::NAN), None, Exif::default()).contains("between"));
        assert!(refused(Some(0.0), None, Exif::default()).contains("between"));
    }

    #[test]
    fn a_wider_lens_is_less_certain() {
        let sigma = |fov| {
            write_sensor_toml(&known(Some(fov), Some(Model::Equidistant), Exif::default())).unwrap().focal_sigma_percent
        };
        assert!(
            sigma(40.0) < sigma(92.0) && sigma(92.0) < sigma(180.0),
            "{} {} {}",
            sigma(40.0),
            sigma(92.0),
            sigma(180.0)
        );
        assert!((sigma(40.0) - 3.0).abs() < 0.11 && (sigma(180.0) - 10.7).abs() < 0.11);
    }

    #[test]
    fn without_an_altitude_the_file_says_what_to_do() {
        let start = write_sensor_toml(&CameraFacts { altitude_km: None, ..known(None, None, d4()) }).unwrap();
        assert!(start.text.contains("frames.csv") && !start.text.contains("\naltitude_km"), "{}", start.text);
        let config = crate::sensor::parse(&start.text, Path::new("s.toml")).unwrap().config;
        assert_eq!(config.body.altitude_km, None);
    }
}
