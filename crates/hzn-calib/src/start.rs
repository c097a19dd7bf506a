//! A sensor.toml for a camera that nobody calibrated: from the size of its pictures and either a stated field of view
//! or what the camera wrote into EXIF.
//!
//! What is not known is written as a sigma, so that the answers are as uncertain as the lens:
//!
//! - **Scale.** Makers state the focal length of a series lens, and so its field of view, to ± 5 %: evenly within that,
//!   1-sigma is 5 %/√3. EXIF holds the nominal focal length, of a zoom in steps and without the change by focusing: ±
//!   10 %. The 35 mm equivalent is rounded to a millimetre, too.
//! - **Shape.** The ideal lens (pinhole or equidistant) holds at the picture's edges, where the field of view is
//!   stated; in the middle the real one differs. An equisolid lens, 2 sin (θ/2), lies θ²/24 below the equidistant one;
//!   a pinhole lens with an eighth of the equidistant lens's barrel distortion, θ²/3, differs by as much.
//! - **Centre.** Published calibrations put the principal point this far from the picture's centre, in percent of the
//!   width (x, y): EuRoC 1.1, 1.2; TUM RGB-D fr1 0.1, 2.5; KITTI odometry 1.0, 0.2. Their root mean square is 1.3 %;
//!   1.5 % is written. A picture that was cropped on one side is not covered.
//!
//! No data base of sensor sizes is asked: LensFun's is kept up, but under a licence that this project cannot take over
//! (CC BY-SA; its crate LGPL), and openMVG's has stood still since 2019. Cameras that write a focal length mostly write
//! the pitch of their pixels or the 35 mm equivalent with it.

use core::fmt::Write as _;

use hzn_core::camera::Model;

/// Of the focal length of a series lens, percent, 1-sigma: evenly within ± 5 %.
const STATED_PERCENT: f64 = 5.0 / SQRT_3;
/// Of the focal length in EXIF: evenly within ± 10 %.
const EXIF_PERCENT: f64 = 10.0 / SQRT_3;
const SQRT_3: f64 = 1.732_050_807_568_877_2;
/// Of the principal point, as a part of the width.
const CENTRE_PART: f64 = 0.015;
/// Of an altitude that was said once for all pictures, as a part of it: orbits are not round.
const ALTITUDE_PART: f64 = 0.02;
/// Sides of the 35 mm film, millimetres.
const FILM_MM: [f64; 2] = [36.0, 24.0];
/// Above this width nobody's lens is a pinhole unless it is said, degrees.
const PINHOLE_UNSAID_DEG: f64 = 90.0;

/// What the picture's EXIF says of the lens; every field may be missing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Exif {
    /// Maker's name of the camera.
    pub camera: Option<String>,
    /// `FocalLength`, millimetres.
    pub focal_mm: Option<f64>,
    /// `FocalLengthIn35mmFilm`, millimetres.
    pub focal_35mm_mm: Option<f64>,
    /// `FocalPlaneXResolution` in its unit: pixels a millimetre on the sensor.
    pub plane_px_per_mm: Option<f64>,
    /// `PixelXDimension`: columns of the picture as the camera wrote it; another width was scaled since.
    pub columns: Option<f64>,
    /// `DigitalZoomRatio`, where the camera enlarged its picture.
    pub digital_zoom: Option<f64>,
    /// Whether a viewer turns the picture by 90 degrees (`Orientation` 5 to 8).
    pub turned: bool,
}

/// What is known of a camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Known {
    /// Columns and rows of its pictures.
    pub size_px: [u32; 2],
    /// Stated field of view over the whole width, degrees.
    pub fov_deg: Option<f64>,
    /// [`Model::Pinhole`] or [`Model::Equidistant`]; left out: a pinhole, where the field of view allows it.
    pub lens: Option<Model>,
    /// What a picture says.
    pub exif: Exif,
    /// Altitude of all pictures, kilometres.
    pub altitude_km: Option<f64>,
}

/// A sensor.toml to start from.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// The file's text.
    pub text: String,
    /// Its lens.
    pub lens: Model,
    /// Its focal length, pixels.
    pub focal_px: f64,
    /// Field of view over the whole width, degrees.
    pub fov_deg: f64,
    /// 1-sigma of the focal length, percent.
    pub focal_sigma_percent: f64,
    /// 1-sigma of the principal point, pixels.
    pub centre_sigma_px: f64,
    /// What the user should look at.
    pub warnings: Vec<String>,
}

/// Focal length in pixels of an ideal lens that sees `fov_deg` over `width` pixels; `None` where it cannot.
pub fn focal_px(lens: Model, width: f64, fov_deg: f64) -> Option<f64> {
    let half = (0.5 * fov_deg).to_radians();
    let radius = match lens {
        Model::Pinhole => (fov_deg < 180.0).then(|| half.tan())?,
        Model::Equidistant => half,
        _ => return None,
    };
    (radius > 0.0 && fov_deg <= 300.0).then(|| 0.5 * width / radius)
}

/// Field of view in degrees over `width` pixels.
fn fov_deg(lens: Model, width: f64, focal_px: f64) -> f64 {
    let radius = 0.5 * width / focal_px;
    let half = if lens == Model::Pinhole { radius.atan() } else { radius };
    2.0 * half.to_degrees()
}

/// A focal length in pixels with its 1-sigma in percent, and where it comes from.
#[derive(Debug, Clone, PartialEq)]
struct Focal {
    px: f64,
    percent: f64,
    from: String,
}

impl Exif {
    /// What EXIF says of the focal length of a picture of this size.
    fn focal(&self, [width, height]: [f64; 2]) -> Option<Focal> {
        let sound = |x: Option<f64>| x.filter(|x| x.is_finite() && *x > 0.0);
        if let (Some(mm), Some(px_per_mm)) = (sound(self.focal_mm), sound(self.plane_px_per_mm)) {
            let scale =
                sound(self.columns).map_or(1.0, |columns| width / columns) * sound(self.digital_zoom).unwrap_or(1.0);
            let px = mm * px_per_mm * scale;
            let pitch_um = 1e3 / (px_per_mm * scale);
            // Some programs write nonsense there: no sensor has pixels of less than half a micrometre or more than 0.1
            // mm.
            if (0.5..100.0).contains(&pitch_um) {
                return Some(Focal {
                    px,
                    percent: EXIF_PERCENT,
                    from: format!("EXIF: {mm} mm, pixels of {pitch_um:.2} um"),
                });
            }
        }
        let mm = sound(self.focal_35mm_mm)?;
        // The equivalent compares diagonals; a picture wider than the film was cropped in height, and keeps its width.
        let [film_width, film_height] = FILM_MM;
        let px = if width * film_height > height * film_width {
            mm * width / film_width
        } else {
            mm * width.hypot(height) / film_width.hypot(film_height)
        };
        let rounded = 100.0 * 0.5 / mm / SQRT_3;
        Some(Focal { px, percent: EXIF_PERCENT.hypot(rounded), from: format!("EXIF: as {mm} mm on 35 mm film") })
    }
}

/// Writes a sensor.toml that works at once, with what nobody measured as a sigma.
///
/// # Errors
/// Nothing gives a focal length; a field of view that the lens cannot have; a width at which the lens must be said.
pub fn sensor_toml(known: &Known) -> Result<Start, String> {
    let [width, height] = known.size_px.map(f64::from);
    if let Some(fov) = known.fov_deg.filter(|f| !(*f > 0.1 && *f <= 300.0)) {
        return Err(format!("--fov {fov}: must lie between 0.1 and 300 degrees"));
    }
    let lens = match (known.lens, known.fov_deg) {
        (Some(lens), _) => lens,
        (None, Some(fov)) if fov > PINHOLE_UNSAID_DEG => {
            return Err(format!("--fov {fov}: a lens so wide may be either; say --lens fisheye or --lens pinhole"));
        }
        (None, _) => Model::Pinhole,
    };
    let exif = known.exif.focal([width, height]);
    let stated = known.fov_deg.map(|fov| {
        let px =
            focal_px(lens, width, fov).ok_or_else(|| format!("--fov {fov}: a pinhole sees less than 180 degrees"))?;
        Ok::<_, String>(Focal { px, percent: STATED_PERCENT, from: format!("the field of view, {fov} degrees wide") })
    });
    let (focal, warnings, beside) = choose(stated.transpose()?, exif, lens, width)?;
    let fov = fov_deg(lens, width, focal.px);
    let half_rad = (0.5 * fov).to_radians();
    let shape_percent = 100.0 * half_rad * half_rad / 24.0;
    let focal_sigma_percent = (focal.percent.hypot(shape_percent) * 10.0).ceil() / 10.0;
    let centre_sigma_px = (CENTRE_PART * width).ceil();
    let start = Start {
        text: String::new(),
        lens,
        focal_px: focal.px,
        fov_deg: fov,
        focal_sigma_percent,
        centre_sigma_px,
        warnings,
    };
    let text = written(known, &start, &focal, beside.as_deref(), shape_percent);
    Ok(Start { text, ..start })
}

/// The focal length that counts, with warnings, and what the other says of it.
type Chosen = (Focal, Vec<String>, Option<String>);

/// A stated field of view counts for more than EXIF, which is compared with it.
fn choose(stated: Option<Focal>, exif: Option<Focal>, lens: Model, width: f64) -> Result<Chosen, String> {
    match (stated, exif) {
        (Some(stated), Some(exif)) => {
            let off_percent = 100.0 * (exif.px / stated.px - 1.0);
            let other = fov_deg(lens, width, exif.px);
            let beside = format!("{}: {:.1} px, {other:.1} degrees wide ({off_percent:+.1} %)", exif.from, exif.px);
            let warnings = if off_percent.abs() > 3.0 * stated.percent.hypot(exif.percent) {
                vec![format!(
                    "the picture's {beside}, which the field of view contradicts: it counts over the whole width; was \
                     it stated for the diagonal, another lens, or another mode of the camera?"
                )]
            } else {
                Vec::new()
            };
            Ok((stated, warnings, Some(beside)))
        }
        (Some(stated), None) => Ok((stated, Vec::new(), None)),
        (None, Some(exif)) => Ok((exif, Vec::new(), None)),
        (None, None) => {
            Err("the picture does not say its focal length (EXIF): give the field of view over the whole width, \
                             such as --fov 60, and --lens fisheye or pinhole"
                .into())
        }
    }
}

fn written(known: &Known, start: &Start, focal: &Focal, beside: Option<&str>, shape_percent: f64) -> String {
    let [width, height] = known.size_px;
    let [cx, cy] = [width, height].map(|n| 0.5 * (f64::from(n) - 1.0));
    let mut t = String::new();
    let _ = write!(
        t,
        "# A start for a camera that nobody calibrated, by `hzn init`. What is not known stands as a sigma: answers \
         are as uncertain as\n\
         # the lens. A calibration makes them sharper: `hzn camera convert`, and both sigmas smaller or away.\n\
         # Try it on one picture:  hzn explain PICTURE --sensor sensor.toml --overlay out.png\n\
         # Every other key with its default:  hzn init -o all.toml\n\
         \n\
         preset = \"hzn\"\n\
         \n\
         [camera]\n"
    );
    if let Some(camera) = &known.exif.camera {
        let _ = writeln!(t, "# {}", camera.replace(['\n', '\r'], " "));
    }
    let _ = write!(
        t,
        "width = {width}\nheight = {height}\nmodel = \"{}\"{}\n",
        start.lens.name(),
        match start.lens {
            Model::Pinhole => "            # an ideal lens without distortion",
            _ => "        # an ideal fisheye: the angle off axis grows evenly with the radius",
        }
    );
    let _ = write!(t, "# From {}", focal.from);
    let _ = match beside {
        Some(beside) => writeln!(t, "; beside it {beside}."),
        None => writeln!(t, "; {:.1} degrees wide.", start.fov_deg),
    };
    let _ = write!(t, "fx_px = {:.1}\nfy_px = {:.1}\n", start.focal_px, start.focal_px);
    let _ = write!(t, "cx_px = {cx:.1}                 # the picture's centre\ncy_px = {cy:.1}\n");
    let _ = write!(
        t,
        "# 1-sigma of the focal length: {:.1} % for {}, and {shape_percent:.1} % for what a real lens differs\n\
         # from an ideal one over this field.\n\
         focal_sigma_percent = {:.1}\n\
         # 1-sigma of the principal point, each axis: 1.5 % of the width. It turns every answer alike. More where \
         pictures were cropped.\n\
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
            "# theta_max_deg = {:.0}            # where the image circle ends within the picture: its radius in \
             degrees off axis",
            0.5 * start.fov_deg
        );
    }
    let _ =
        write!(t, "\n[body]\nkind = \"earth\"                 # earth (WGS-84) | earth-sphere | sun | moon | sphere\n");
    let _ = match known.altitude_km {
        Some(km) => write!(
            t,
            "altitude_km = {km}\naltitude_sigma_km = {:.1}        # 1-sigma: 2 % of it, for all pictures; frames.csv \
             gives each its own\n",
            (ALTITUDE_PART * km).max(0.5)
        ),
        None => write!(
            t,
            "# Every picture needs an altitude in kilometres: the columns file, altitude_km of a frames.csv beside the \
             pictures (or x_km,\n\
             # y_km, z_km), or for all of them\n# altitude_km = 400.0\n"
        ),
    };
    t
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn known(fov_deg: Option<f64>, lens: Option<Model>, exif: Exif) -> Known {
        Known { size_px: [4928, 2768], fov_deg, lens, exif, altitude_km: Some(418.0) }
    }

    /// The ISS's Nikon D4 of 20 November 2020.
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
    fn what_is_written_loads_and_is_the_camera_that_was_told() {
        for (fov, lens) in [(92.0, Model::Pinhole), (92.0, Model::Equidistant), (180.0, Model::Equidistant)] {
            let start = sensor_toml(&known(Some(fov), Some(lens), Exif::default())).unwrap();
            let config = crate::sensor::parse(&start.text, Path::new("s.toml")).unwrap().config;
            let camera = hzn_core::camera::Camera::<f64>::try_new(&config.camera).unwrap();
            // The middle of the right edge, half a pixel beyond the last centre.
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
        let start = sensor_toml(&known(None, None, d4())).unwrap();
        assert!((start.focal_px - 7666.0).abs() < 1.0, "{}", start.focal_px);
        // The limb says 7100 px: within two sigmas.
        assert!((start.focal_px / 7100.0 - 1.0) < 0.02 * start.focal_sigma_percent, "{start:?}");
        let film = sensor_toml(&known(None, None, Exif { plane_px_per_mm: None, ..d4() })).unwrap();
        assert!((film.focal_px - 7666.0).abs() < 1.0, "{}", film.focal_px);
        assert!(film.focal_sigma_percent >= start.focal_sigma_percent);
        // A third of the size: the columns that the camera wrote tell so.
        let small = Known { size_px: [1600, 899], ..known(None, None, d4()) };
        assert!((sensor_toml(&small).unwrap().focal_px - 7666.0 * 1600.0 / 4928.0).abs() < 1.0);
        // Nonsense: pixels of 10 nm.
        let odd = Exif { plane_px_per_mm: Some(1e5), ..d4() };
        assert!((sensor_toml(&known(None, None, odd)).unwrap().focal_px - 7666.0).abs() < 1.0);
        // A telephone: 4:3, compared by the diagonal.
        let phone = Exif { focal_35mm_mm: Some(26.0), ..Exif::default() };
        let phone = sensor_toml(&Known { size_px: [4000, 3000], ..known(None, None, phone) }).unwrap();
        assert!((phone.focal_px - 26.0 * 5000.0 / 43.267).abs() < 1.0, "{}", phone.focal_px);
    }

    #[test]
    fn a_contradiction_is_told_and_agreement_is_not() {
        let both = |fov| sensor_toml(&known(Some(fov), None, d4())).unwrap();
        // EXIF: 35.6 degrees over the width.
        let agreed = both(37.0);
        assert!(agreed.warnings.is_empty() && agreed.text.contains("beside it EXIF"), "{}", agreed.text);
        assert!((agreed.fov_deg - 37.0).abs() < 1e-9);
        assert!(both(60.0).warnings[0].contains("contradicts"));
        // What is stated counts for more.
        assert!(agreed.focal_sigma_percent < sensor_toml(&known(None, None, d4())).unwrap().focal_sigma_percent);
    }

    #[test]
    fn what_cannot_be_is_refused_with_what_to_say() {
        let refused = |fov, lens, exif| sensor_toml(&known(fov, lens, exif)).unwrap_err();
        assert!(refused(None, None, Exif::default()).contains("--fov"));
        assert!(refused(Some(92.0), None, Exif::default()).contains("--lens"));
        assert!(refused(Some(180.0), Some(Model::Pinhole), Exif::default()).contains("less than 180"));
        assert!(refused(Some(f64::NAN), None, Exif::default()).contains("between"));
        assert!(refused(Some(0.0), None, Exif::default()).contains("between"));
    }

    #[test]
    fn a_wider_lens_is_less_certain() {
        let sigma = |fov| {
            sensor_toml(&known(Some(fov), Some(Model::Equidistant), Exif::default())).unwrap().focal_sigma_percent
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
        let start = sensor_toml(&Known { altitude_km: None, ..known(None, None, d4()) }).unwrap();
        assert!(start.text.contains("frames.csv") && !start.text.contains("\naltitude_km"), "{}", start.text);
        let config = crate::sensor::parse(&start.text, Path::new("s.toml")).unwrap().config;
        assert_eq!(config.body.altitude_km, None);
    }
}
