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

use hzn_core::camera::Model;

/// 1-sigma of a series lens's focal length, in percent: uniform within ± 5 %.
const STATED_PERCENT: f64 = 5.0 / SQRT_3;
/// 1-sigma of the focal length in EXIF, in percent: uniform within ± 10 %.
const EXIF_PERCENT: f64 = 10.0 / SQRT_3;
const SQRT_3: f64 = 1.732_050_807_568_877_2;
/// 1-sigma of the principal point, as a fraction of the width.
const CENTRE_FRACTION: f64 = 0.015;
/// 1-sigma of an altitude that is given once for all pictures, as a fraction of it. Orbits are not circular.
const ALTITUDE_FRACTION: f64 = 0.02;
/// Sides of the 35 mm film, in millimetres.
const FILM_MM: [f64; 2] = [36.0, 24.0];
/// Largest stated field of view, in degrees, for which a pinhole is assumed if the lens is not given.
const MAX_PINHOLE_DEFAULT_DEG: f64 = 90.0;

/// EXIF data of a picture about the lens; every field may be missing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Exif {
    /// Maker's name of the camera.
    pub camera: Option<String>,
    /// `FocalLength`, in millimetres.
    pub focal_mm: Option<f64>,
    /// `FocalLengthIn35mmFilm`, in millimetres.
    pub focal_35mm_mm: Option<f64>,
    /// `FocalPlaneXResolution`, converted to pixels per millimetre on the sensor.
    pub plane_px_per_mm: Option<f64>,
    /// `PixelXDimension`: columns of the picture as the camera wrote it. A picture with another width was scaled later.
    pub columns: Option<f64>,
    /// `DigitalZoomRatio`, if the camera enlarged its picture.
    pub digital_zoom: Option<f64>,
    /// Whether a viewer turns the picture by 90 degrees (`Orientation` 5 to 8).
    pub turned: bool,
}

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

/// A focal length in pixels with its 1-sigma in percent and its source.
#[derive(Debug, Clone, PartialEq)]
struct Focal {
    px: f64,
    percent: f64,
    from: String,
}

impl Exif {
    /// Returns the focal length from EXIF for a picture of this size (pixels).
    fn focal(&self, [width, height]: [f64; 2]) -> Option<Focal> {
        let sound = |x: Option<f64>| x.filter(|x| x.is_finite() && *x > 0.0);
        if let (Some(mm), Some(px_per_mm)) = (sound(self.focal_mm), sound(self.plane_px_per_mm)) {
            let scale =
                sound(self.columns).map_or(1.0, |columns| width / columns) * sound(self.digital_zoom).unwrap_or(1.0);
            let px = mm * px_per_mm * scale;
            let pitch_um = 1e3 / (px_per_mm * scale);
            // Some programs write wrong values there. No sensor has pixels below half a micrometre or above 0.1 mm.
            if (0.5..100.0).contains(&pitch_um) {
                return Some(Focal {
                    px,
                    percent: EXIF_PERCENT,
                    from: format!("EXIF: {mm} mm, pixels of {pitch_um:.2} um"),
                });
            }
        }
        let mm = sound(self.focal_35mm_mm)?;
        // The 35 mm equivalent compares diagonals. A picture wider than the film is cropped in height and keeps its
        // width.
        let [film_width, film_height] = FILM_MM;
        let px = if width * film_height > height * film_width {
            mm * width / film_width
        } else {
            mm * width.hypot(height) / film_width.hypot(film_height)
        };
        let rounded = 100.0 * 0.5 / mm / SQRT_3;
        Some(Focal {
            px,
            percent: EXIF_PERCENT.hypot(rounded),
            from: format!("EXIF: equivalent to {mm} mm on 35 mm film"),
        })
    }
}

/// Writes a sensor.toml that works at once. Values that are not measured have a sigma.
///
/// # Errors
/// There is no focal length, the lens cannot have the field of view, or the field of view is so wide that the lens must
/// be given.
pub fn write_sensor_toml(facts: &CameraFacts) -> Result<StartConfig, String> {
    let [width, height] = facts.size_px.map(f64::from);
    if let Some(fov) = facts.fov_deg.filter(|f| !(*f > 0.1 && *f <= 300.0)) {
        return Err(format!("--fov {fov}: must lie between 0.1 and 300 degrees"));
    }
    let lens = match (facts.lens, facts.fov_deg) {
        (Some(lens), _) => lens,
        (None, Some(fov)) if fov > MAX_PINHOLE_DEFAULT_DEG => {
            return Err(format!(
                "--fov {fov}: a lens of this width may be a fisheye or a pinhole; add --lens fisheye or --lens pinhole"
            ));
        }
        (None, _) => Model::Pinhole,
    };
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

/// The chosen focal length, warnings, and a note about the other focal length.
type Chosen = (Focal, Vec<String>, Option<String>);

/// Chooses the focal length: a stated field of view overrides EXIF, which is only compared with it.
fn choose_focal(stated: Option<Focal>, exif: Option<Focal>, lens: Model, width: f64) -> Result<Chosen, String> {
    match (stated, exif) {
        (Some(stated), Some(exif)) => {
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
        (Some(stated), None) => Ok((stated, Vec::new(), None)),
        (None, Some(exif)) => Ok((exif, Vec::new(), None)),
        (None, None) => {
            Err("the picture has no focal length (EXIF); add the field of view over the whole width, for example \
                 --fov 60, and --lens fisheye or --lens pinhole"
                .into())
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
    text += &write_body(facts.altitude_km);
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
fn write_body(altitude_km: Option<f64>) -> String {
    let mut t = String::from(
        "\n[body]\nkind = \"earth\"                 # earth (WGS-84) | earth-sphere | sun | moon | sphere\n",
    );
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
        CameraFacts { size_px: [4928, 2768], fov_deg, lens, exif, altitude_km: Some(418.0) }
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
        assert!(refused(Some(180.0), Some(Model::Pinhole), Exif::default()).contains("below 180"));
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
