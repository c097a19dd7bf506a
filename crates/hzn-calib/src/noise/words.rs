//! A calibration in words and numbers.

use hzn_core::camera::{Config, Covariance, Intrinsic};

use super::calibration::{Calibration, Focal};
use crate::words::above;

/// Largest difference of the focal length, and its largest 1-sigma, in percent. The heights are linear in it, with the
/// slope at the told focal length. That slope itself changes by a few times the relative difference, so that beyond a
/// tenth a percentage would mean nothing.
const LINEAR_PERCENT: f64 = 10.0;

/// Returns the lines of a report: name and value. `pictures` is the number of all pictures in words.
pub fn lines(calibration: &Calibration, pictures: &str, camera: &Config) -> Vec<(&'static str, String)> {
    let (h, e) = (&calibration.height, &calibration.edge);
    let outliers: Vec<&str> = calibration.pictures.iter().filter(|p| !p.counts).map(|p| p.name.as_str()).collect();
    let answered = calibration.pictures.len();
    let left_out = match outliers.as_slice() {
        [] => String::new(),
        several => format!(", {} outliers left out: {}", several.len(), several.join(", ")),
    };
    let mut lines = vec![
        ("pictures", format!("{pictures}, {answered} answered{left_out}")),
        ("limb height", format!("{:.2} km ± {:.2} km", h.km, h.sigma_km)),
        ("", format!("{:.2} km from edge noise over all pictures", h.statistical_km)),
        ("", format!("{:.2} km of scatter between pictures beyond it", h.scatter_km)),
        (
            "",
            format!(
                "{:.2} km for a common shift of all edges by the slow part of their errors, at least 0.1 px",
                h.shift_km
            ),
        ),
        ("", format!("{:.2} km for a bend that all edges share", h.bend_km)),
    ];
    if h.clipped_km.is_some() {
        lines.push(("", format!("{:.2} km for the height that clipping at full scale adds", h.clipping_km)));
    }
    if h.lens_km > 0.0 {
        lines.push(("", format!("{:.2} km for the lens, whose sigmas are in sensor.toml", h.lens_km)));
    }
    if h.radius_km > 0.0 {
        lines.push(("", format!("{:.2} km for the local radius, which is unknown without a position", h.radius_km)));
    }
    for [deg, km, sigma] in &h.by_latitude {
        lines.push(("by latitude", format!("{deg:.0}°: {km:.2} km ± {sigma:.2} km")));
    }
    if let Some([km, sigma_km]) = h.clipped_km {
        lines.push(("clipping", format!("{km:.2} km ± {sigma_km:.2} km where all of the limb is at full scale")));
    }
    lines.push(("edge noise", format!("{:.3} px, correlation length {:.0} px", e.sigma_px, e.correlation_px)));
    let white = 100.0 * e.white;
    lines.push((
        "",
        format!(
            "most likely for all residuals: {white:.0} % white, the rest with a correlation length of {:.0} px",
            e.length_px
        ),
    ));
    let [chi2, limit] = above(calibration.chi2, calibration.max_chi2);
    lines.push(("chi-square", format!("{chi2} a degree of freedom; 1 is ideal, a value above {limit} is an alarm")));
    if let Some(f) = &calibration.focal {
        lines.push(("focal length", focal(f, camera)));
        lines.push(("", format!("0.1 % of it is {:.2} km of limb height", f.km_per_permille.abs())));
    }
    lines
}

/// Says by how much the focal length differs, if the estimate can mean that.
fn focal(f: &Focal, camera: &Config) -> String {
    if !(f.sigma_percent < LINEAR_PERCENT) {
        return "not determined: the pictures do not separate it from the limb height".to_owned();
    }
    if f.percent.abs() > LINEAR_PERCENT {
        return format!(
            "not determined: the pictures ask for a difference of more than {LINEAR_PERCENT:.0} %, which this estimate \
             cannot measure; `hzn calibrate check` compares the focal length with the flight"
        );
    }
    // Another shape of the lens changes the half-angle as another focal length does.
    let hint = if camera.covariance.as_ref().is_some_and(has_shape) {
        "; its sigma is for the shape of the lens in sensor.toml, which is not certain: `hzn calibrate sky` estimates \
         both"
    } else if f.percent.abs() > 3.0 * f.sigma_percent {
        "; check the camera's calibration"
    } else {
        ""
    };
    let what = "from that of sensor.toml, with a free limb height; not applied";
    format!("{:+.2} % ± {:.2} % {what}{hint}", f.percent, f.sigma_percent)
}

/// Returns whether a coefficient of the lens has a sigma.
fn has_shape(covariance: &Covariance) -> bool {
    use Intrinsic::{CxPx, CyPx, FxPx, FyPx};
    covariance.order.iter().any(|which| !matches!(which, FxPx | FyPx | CxPx | CyPx))
}
