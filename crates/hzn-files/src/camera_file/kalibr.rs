//! Reads Kalibr's camchains and EuRoC's sensor.yaml.

use hzn_core::camera::Model;
use serde_json::Value;

use super::foreign::Foreign;
use super::lens::{Coefficients, Lens};
use super::loaded::Loaded;
use super::omni::Omni;
use super::reader::Reader;
use super::values::numbers;
use crate::Problem;

/// A projection of Kalibr, with its coefficients before the focal lengths.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Projection {
    Pinhole,
    DoubleSphere,
    Eucm,
    Omni,
}

impl Projection {
    fn find(name: &str) -> Option<Self> {
        match name {
            "pinhole" => Some(Self::Pinhole),
            "ds" => Some(Self::DoubleSphere),
            "eucm" => Some(Self::Eucm),
            "omni" => Some(Self::Omni),
            _ => None,
        }
    }

    /// Returns the number of coefficients before the focal lengths, and the text of what is expected.
    fn intrinsics(self) -> (usize, &'static str) {
        match self {
            Self::Pinhole => (0, "four numbers fx, fy, cx, cy are expected"),
            Self::DoubleSphere => (2, "six numbers xi, alpha, fx, fy, cx, cy are expected"),
            Self::Eucm => (2, "six numbers alpha, beta, fx, fy, cx, cy are expected"),
            Self::Omni => (1, "five numbers xi, fx, fy, cx, cy are expected"),
        }
    }
}

/// Reads one camera of a Kalibr camchain, or EuRoC's sensor.yaml, which has no `name`.
pub(super) fn read(reader: &Reader<'_>, camera: &Value, name: &str) -> Result<Loaded, Problem> {
    let field = |key: &str| if name.is_empty() { key.to_owned() } else { format!("{name}.{key}") };
    let word = camera["camera_model"].as_str().unwrap_or("pinhole");
    let projection = Projection::find(word).ok_or_else(|| {
        let what = format!("{word:?} is a projection that hzn does not have; calibrate with pinhole, ds, eucm or omni");
        reader.problem(&field("camera_model"), what)
    })?;
    let (count, expected) = projection.intrinsics();
    let list = numbers(&camera["intrinsics"]).filter(|v| v.len() == 4 + count);
    let Some((own, intrinsics)) = list.and_then(|v| {
        let (own, rest) = v.split_at(count);
        Some((own.to_vec(), <[f64; 4]>::try_from(rest).ok()?))
    }) else {
        return Err(reader.problem(&field("intrinsics"), expected));
    };
    let size = numbers(&camera["resolution"]).and_then(|v| <[f64; 2]>::try_from(v).ok());
    let size =
        size.ok_or_else(|| reader.problem(&field("resolution"), "two numbers, width and height, are expected"))?;
    let other = camera.get("distortion_coefficients").is_some();
    let key = if other { "distortion_coefficients" } else { "distortion_coeffs" };
    let coefficients = Coefficients { values: reader.coefficients(camera.get(key), &field(key))?, field: field(key) };
    let lens = reader.lens(camera.get("distortion_model"), &field("distortion_model"))?.unwrap_or(Lens::None);
    let special = match projection {
        Projection::Pinhole => return reader.loaded(lens, &coefficients, size, intrinsics),
        Projection::Omni => {
            let xi = own.first().copied().unwrap_or(0.0);
            return read_omni(reader, xi, intrinsics, size, lens, &coefficients);
        }
        Projection::DoubleSphere => Model::DoubleSphere,
        Projection::Eucm => Model::Eucm,
    };
    if coefficients.significant_len() > 0 {
        let what = format!("{word} has no further distortion; calibrate with none");
        return Err(reader.problem(&field(key), what));
    }
    Ok(Loaded::Lens(reader.config(special, size, intrinsics, &own)?))
}

/// Reads an `omni` lens. Without distortion it is hzn's `eucm`.
fn read_omni(
    reader: &Reader<'_>,
    xi: f64,
    intrinsics_px: [f64; 4],
    size: [f64; 2],
    lens: Lens,
    coefficients: &Coefficients,
) -> Result<Loaded, Problem> {
    let field = &coefficients.field;
    if !(xi >= 0.0 && xi.is_finite()) {
        return Err(reader.problem("intrinsics", format!("xi = {xi} of an omni lens must be at least 0")));
    }
    if lens == Lens::Fisheye {
        return Err(reader.problem(field, "omni has the distortion radtan or none, not a fisheye's"));
    }
    reader.model(lens, coefficients)?;
    let significant = coefficients.significant_len();
    if significant > 4 {
        return Err(reader.problem(field, "omni has four coefficients, k1, k2, p1, p2"));
    }
    let values = coefficients.values.as_deref().unwrap_or_default();
    let distortion = core::array::from_fn(|i| values.get(i).copied().unwrap_or(0.0));
    let omni = Omni { size_px: reader.size(size)?, xi, intrinsics_px, distortion };
    Ok(omni.to_eucm().map_or(Loaded::Foreign(Foreign::Omni(omni)), Loaded::Lens))
}
