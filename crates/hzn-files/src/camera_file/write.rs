//! Writes calibrations in the formats of other tools, and as `[camera]` of a sensor.toml.

use std::fmt::Write;

use hzn_core::camera::{Config, Covariance, Temperature};

use super::format::{Format, UnsupportedLens};
use super::numbers::{format_list, format_number};
use super::{write_kalibr, write_opencv, write_ros};

/// Writes a calibration as text. Only a sensor.toml has `theta_max_deg`, `theta_min_deg`, the sigmas, the covariance
/// and `readout_s`; the other formats omit them.
///
/// # Errors
/// The format does not have the lens.
pub fn write(camera: &Config, format: Format) -> Result<String, UnsupportedLens> {
    match format {
        Format::Sensor => Ok(write_sensor(camera)),
        Format::Kalibr => write_kalibr::write_kalibr(camera),
        Format::Euroc => write_kalibr::write_euroc(camera),
        Format::OpenCv => write_opencv::write_yaml(camera),
        Format::OpenCvXml => write_opencv::write_xml(camera),
        Format::OpenCvJson => write_opencv::write_json(camera),
        Format::Ros => write_ros::write_ros(camera),
        Format::Foxglove => write_ros::write_foxglove(camera),
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
    let others = [
        ("focal_sigma_percent", c.focal_sigma_percent),
        ("centre_sigma_px", c.centre_sigma_px),
        ("readout_s", c.readout_s),
    ];
    for (key, value) in others.into_iter().filter(|(_, value)| *value != 0.0) {
        let _ = writeln!(out, "{key} = {}", format_number(value));
    }
    if let Some(covariance) = &c.covariance {
        write_covariance(&mut out, covariance);
    }
    if let Some(lens) = &c.temperature {
        write_temperature(&mut out, lens);
    }
    out
}

/// Writes `[camera.temperature]`, which is a table as well.
fn write_temperature(out: &mut String, lens: &Temperature) {
    let _ = writeln!(out, "\n[camera.temperature]\nreference_c = {}", format_number(lens.reference_c));
    let others = [
        ("focal_ppm_per_k", lens.focal_ppm_per_k),
        ("cx_px_per_k", lens.cx_px_per_k),
        ("cy_px_per_k", lens.cy_px_per_k),
        ("untold_sigma_k", lens.untold_sigma_k),
    ];
    for (key, value) in others.into_iter().filter(|(_, value)| *value != 0.0) {
        let _ = writeln!(out, "{key} = {}", format_number(value));
    }
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use hzn_core::camera::Model;

    use super::super::numbers::intrinsics;
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
            let formats = [
                Format::Kalibr,
                Format::OpenCv,
                Format::OpenCvXml,
                Format::OpenCvJson,
                Format::Euroc,
                Format::Ros,
                Format::Foxglove,
            ];
            for format in formats {
                let text = write(&camera, format).unwrap();
                let back = parse(&text, Path::new("c.yaml"), None).unwrap_or_else(|e| panic!("{e} in\n{text}"));
                let k = |c: &Config| [0, 1, 2, 3, 4].map(|i| c.coefficient(i));
                assert_eq!((k(&back), intrinsics(&back)), (k(&camera), intrinsics(&camera)), "{text}");
                assert_eq!((back.width, back.height), (1920, 1080));
                // A lens without distortion may come back as one whose coefficients are 0.
                assert!(back.model == camera.model || k(&camera) == [0.0; 5], "{text}");
            }
            let camera = Config { theta_max_deg: Some(54.0), focal_sigma_percent: 0.1, readout_s: -0.02, ..camera };
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
}
