//! Writes Kalibr's camchains and EuRoC's sensor.yaml.

use hzn_core::camera::{Config, Model, Projection};

use super::format::{Format, UnsupportedLens, refuse_own_projection};
use super::numbers::{format_list, intrinsics};

/// Writes a camchain with one camera.
pub(super) fn write_kalibr(camera: &Config) -> Result<String, UnsupportedLens> {
    let special = match camera.model {
        Model::DoubleSphere => Some("ds"),
        Model::Eucm => Some("eucm"),
        _ => None,
    };
    let k = if special.is_some() { Vec::new() } else { four_coefficients(camera, Format::Kalibr)? };
    let model = match camera.model {
        Model::Pinhole => "none",
        model => match model.projection() {
            Projection::Angle => "equidistant",
            Projection::Plane => "radtan",
            Projection::Own => "none",
        },
    };
    let own = special.map_or(&[][..], |_| &camera.k);
    Ok(format!(
        "cam0:\n  cam_overlaps: []\n  camera_model: {}\n  distortion_coeffs: {}\n  distortion_model: {model}\n  \
         intrinsics: {}\n  resolution: [{}, {}]\n",
        special.unwrap_or("pinhole"),
        format_list(&k),
        format_list(&[own, &intrinsics(camera)[..]].concat()),
        camera.width,
        camera.height
    ))
}

/// Writes a sensor.yaml.
pub(super) fn write_euroc(camera: &Config) -> Result<String, UnsupportedLens> {
    let k = four_coefficients(camera, Format::Euroc)?;
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
