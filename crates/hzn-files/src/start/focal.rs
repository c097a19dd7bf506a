//! A focal length with its uncertainty, and the field of view of the two ideal lenses.

use hzn_core::camera::Model;

pub(super) const SQRT_3: f64 = 1.732_050_807_568_877_2;
/// 1-sigma of a series lens's focal length, in percent: uniform within ± 5 %.
const STATED_PERCENT: f64 = 5.0 / SQRT_3;

/// A focal length in pixels with its 1-sigma in percent and its source.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Focal {
    pub(super) px: f64,
    pub(super) percent: f64,
    pub(super) from: String,
    /// Where the 1-sigma comes from.
    pub(super) sigma_from: &'static str,
    /// Whether the angle at the edge of the picture is known. Otherwise the focal length is that of the lens's middle.
    pub(super) is_at_edge: bool,
}

impl Focal {
    /// Returns the focal length of an ideal lens with a stated field of view. `None` if the lens cannot have it.
    pub(super) fn from_stated(lens: Model, width: f64, fov_deg: f64) -> Option<Self> {
        let from = format!("the field of view, {fov_deg} degrees wide");
        let sigma_from = "a stated field of view (makers: 5 % at most)";
        Some(Self { px: focal_px(lens, width, fov_deg)?, percent: STATED_PERCENT, from, sigma_from, is_at_edge: true })
    }
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
pub fn fov_deg(lens: Model, width: f64, focal_px: f64) -> f64 {
    let radius = 0.5 * width / focal_px;
    let half = if lens == Model::Pinhole { radius.atan() } else { radius };
    2.0 * half.to_degrees()
}
