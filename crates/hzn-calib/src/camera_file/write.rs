//! Writes calibrations in the formats of other tools.

use std::fmt::{self, Write};

use hzn_core::camera::{Config, Covariance, Model, Projection};

/// A format of calibration files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// `[camera]` of a sensor.toml.
    Sensor,
    /// A Kalibr camchain with one camera, `cam0`.
    Kalibr,
    /// OpenCV's YAML, as its calibration sample writes it.
    OpenCv,
    /// A EuRoC `sensor.yaml`, without the camera's pose on its vehicle.
    Euroc,
}

/// Error of a lens that the format cannot express.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnsupportedLens {
    /// The part of the lens that the format cannot express.
    pub what: &'static str,
    /// The format.
    pub format: Format,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Sensor => "sensor.toml",
            Self::Kalibr => "Kalibr camchain",
            Self::OpenCv => "OpenCV YAML",
            Self::Euroc => "EuRoC sensor.yaml",
        })
    }
}

impl fmt::Display for UnsupportedLens {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the format {} cannot express {}", self.format, self.what)
    }
}

impl std::error::Error for UnsupportedLens {}

/// Writes a calibration as text. Only a sensor.toml has `theta_max_deg`, `theta_min_deg` and the
/// covariance; the other formats omit them.
///
/// # Errors
/// The format does not have the lens.
pub fn write(camera: &Config, format: Format) -> Result<String, UnsupportedLens> {
    match format {
        Format::Sensor => Ok(write_sensor(camera)),
        Format::Kalibr => {
            let special = match camera.model {
                Model::DoubleSphere => Some("ds"),
                Model::Eucm => Some("eucm"),
                model if model.projection() == Projection::Own => return Err(unsupported_projection(camera, format)),
                _ => None,
            };
            let mut out = format!("cam0:\n  cam_overlaps: []\n  camera_model: {}\n", special.unwrap_or("pinhole"));
            let k = if special.is_some() { Vec::new() } else { four_coefficients(camera, format)? };
            let model = match camera.model {
                Model::Pinhole => "none",
                model => match model.projection() {
                    Projection::Angle => "equidistant",
                    Projection::Plane => "radtan",
                    Projection::Own => "none",
                },
            };
            let _ = write!(
                out,
                "  distortion_coeffs: {}\n  distortion_model: {model}\n  intrinsics: {}\n  resolution: [{}, {}]\n",
                format_list(&k),
                format_list(&[special.map_or(&[][..], |_| &camera.k), &intrinsics(camera)[..]].concat()),
                camera.width,
                camera.height
            );
            Ok(out)
        }
        Format::Euroc => {
            let k = four_coefficients(camera, format)?;
            let model = if camera.model.is_planar() { "radial-tangential" } else { "equidistant" };
            Ok(format!(
                "sensor_type: camera\nresolution: [{}, {}]\ncamera_model: pinhole\nintrinsics: {}\n\
                 distortion_model: {model}\ndistortion_coefficients: {}\n",
                camera.width,
                camera.height,
                format_list(&intrinsics(camera)),
                format_list(&k)
            ))
        }
        Format::OpenCv => write_opencv(camera),
    }
}

fn write_sensor(c: &Config) -> String {
    let Config { width, height, .. } = c;
    let mut out = format!("[camera]\nwidth = {width}\nheight = {height}\nmodel = \"{}\"\n", c.model.name());
    for (key, value) in [("fx_px", c.fx_px), ("fy_px", c.fy_px), ("cx_px", c.cx_px), ("cy_px", c.cy_px)] {
        let _ = writeln!(out, "{key} = {}", format_number(value));
    }
    if !c.k.is_empty() {
        let _ = writeln!(out, "k = {}", format_list(&c.k));
    }
    if let Some(deg) = c.theta_max_deg {
        let _ = writeln!(out, "theta_max_deg = {}", format_number(deg));
    }
    if let Some(deg) = c.theta_min_deg {
        let _ = writeln!(out, "theta_min_deg = {}", format_number(deg));
    }
    if let Some(covariance) = &c.covariance {
        write_covariance(&mut out, covariance);
    }
    out
}

/// Writes `[camera.covariance]`. It is a table, so it comes after all other keys of `[camera]`.
fn write_covariance(out: &mut String, covariance: &Covariance) {
    let names: Vec<String> = covariance.order.iter().map(|i| format!("\"{}\"", i.name())).collect();
    let _ = writeln!(out, "\n[camera.covariance]\norder = [{}]\nrows = [", names.join(", "));
    for row in &covariance.rows {
        let numbers: Vec<String> = row.iter().map(|x| format!("{x:e}")).collect();
        let _ = writeln!(out, "    [{}],", numbers.join(", "));
    }
    out.push_str("]\n");
}

fn write_opencv(c: &Config) -> Result<String, UnsupportedLens> {
    refuse_own_projection(c, Format::OpenCv)?;
    let fisheye = c.model.projection() == Projection::Angle;
    let count = if fisheye { 4 } else { 5 };
    let k: Vec<f64> = (0..count).map(|i| c.coefficient(i)).collect();
    let [fx, fy, cx, cy] = intrinsics(c);
    let matrix = |rows: usize, cols: usize, data: &[f64]| {
        format!("!!opencv-matrix\n   rows: {rows}\n   cols: {cols}\n   dt: d\n   data: {}", format_list(data))
    };
    Ok(format!(
        "%YAML:1.0\n---\nimage_width: {}\nimage_height: {}\nfisheye_model: {}\ncamera_matrix: {}\n\
         distortion_coefficients: {}\n",
        c.width,
        c.height,
        u8::from(fisheye),
        matrix(3, 3, &[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]),
        matrix(count, 1, &k)
    ))
}

/// Refuses the lenses that only Kalibr can express: the projections with coefficients of their own.
fn refuse_own_projection(c: &Config, format: Format) -> Result<(), UnsupportedLens> {
    match c.model.projection() {
        Projection::Angle | Projection::Plane => Ok(()),
        Projection::Own => Err(unsupported_projection(c, format)),
    }
}

fn unsupported_projection(c: &Config, format: Format) -> UnsupportedLens {
    let what = match c.model {
        Model::DoubleSphere => "the double sphere lens",
        Model::Eucm => "the enhanced unified camera model",
        other => other.name(),
    };
    UnsupportedLens { what, format }
}

fn intrinsics(c: &Config) -> [f64; 4] {
    [c.fx_px, c.fy_px, c.cx_px, c.cy_px]
}

/// Returns the four coefficients that Kalibr and EuRoC have.
fn four_coefficients(c: &Config, format: Format) -> Result<Vec<f64>, UnsupportedLens> {
    refuse_own_projection(c, format)?;
    if c.model == Model::BrownConrady && c.coefficient(4) != 0.0 {
        return Err(UnsupportedLens { what: "k3, the fifth coefficient of brown-conrady", format });
    }
    Ok(match (c.model, format) {
        (Model::Pinhole, Format::Kalibr) => Vec::new(),
        _ => (0..4).map(|i| c.coefficient(i)).collect(),
    })
}

fn format_list(numbers: &[f64]) -> String {
    format!("[{}]", numbers.iter().map(|&x| format_number(x)).collect::<Vec<_>>().join(", "))
}

/// Formats a number so that it is read back to the last bit. YAML 1.1 and OpenCV read `1e-5` as a word, so a decimal
/// point is added.
fn format_number(x: f64) -> String {
    let text = format!("{x:?}");
    match text.split_once('e') {
        Some((digits, exponent)) if !digits.contains('.') => format!("{digits}.0e{exponent}"),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::camera_file::parse;

    fn cameras() -> Vec<Config> {
        let with = |model, k: &[f64]| Config {
            k: k.iter().copied().collect(),
            fy_px: 1231.0 + 1.0 / 3.0,
            cx_px: 963.2,
            ..Config::ideal(model, 1920, 1080, 1235.0)
        };
        vec![
            with(Model::KannalaBrandt, &[-0.055, 0.011, -3.5e-3, 2e-5]),
            with(Model::BrownConrady, &[-0.28, 0.074, 1.9e-4, 1.76187114e-05]),
            with(Model::Pinhole, &[]),
        ]
    }

    #[test]
    fn what_is_written_is_read() {
        for camera in cameras() {
            for format in [Format::Kalibr, Format::OpenCv, Format::Euroc] {
                let text = write(&camera, format).unwrap();
                let back = parse(&text, Path::new("c.yaml"), None).unwrap_or_else(|e| panic!("{e} in\n{text}"));
                let k = |c: &Config| [0, 1, 2, 3, 4].map(|i| c.coefficient(i));
                assert_eq!((k(&back), intrinsics(&back)), (k(&camera), intrinsics(&camera)), "{text}");
                assert_eq!((back.width, back.height), (1920, 1080));
                // A lens without distortion may come back as one whose coefficients are 0.
                assert!(back.model == camera.model || k(&camera) == [0.0; 5], "{text}");
            }
            let camera = Config { theta_max_deg: Some(54.0), ..camera };
            let text = write(&camera, Format::Sensor).unwrap();
            assert_eq!(crate::sensor::parse(&text, Path::new("s.toml")).unwrap().config.camera, camera);
        }
    }

    #[test]
    fn a_fifth_coefficient_is_not_lost() {
        let mut camera = cameras().remove(1);
        camera.k.push(0.01).unwrap();
        let refused = write(&camera, Format::Kalibr).unwrap_err().to_string();
        assert_eq!(refused, "the format Kalibr camchain cannot express k3, the fifth coefficient of brown-conrady");
        let text = write(&camera, Format::OpenCv).unwrap();
        assert_eq!(parse(&text, Path::new("c.yaml"), None).unwrap(), camera);
    }

    #[test]
    fn only_kalibr_has_the_double_sphere() {
        let mut camera = cameras().remove(0);
        camera.model = Model::DoubleSphere;
        camera.k = [-0.18, 0.59].into_iter().collect();
        let refused = write(&camera, Format::OpenCv).unwrap_err().to_string();
        assert_eq!(refused, "the format OpenCV YAML cannot express the double sphere lens");
        assert!(write(&camera, Format::Euroc).is_err() && write(&camera, Format::Kalibr).is_ok());
    }

    #[test]
    fn numbers_have_a_point() {
        assert_eq!(
            (format_number(1e-7), format_number(300.0), format_number(1.5e-9)),
            ("1.0e-7".into(), "300.0".into(), "1.5e-9".into())
        );
    }
}
