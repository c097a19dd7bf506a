//! A calibration in words and numbers.

use hzn_core::camera::{Config, Covariance, Intrinsic};

use super::calibration::{Calibration, MAX_CHI2};
use crate::words::above;

/// 1-sigma from which on a focal length is not determined: it could as well be nothing.
const UNKNOWN_PERCENT: f64 = 100.0;

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
        ("", format!("{:.2} km for a common shift of all edges by their correlated RMS, at least 0.1 px", h.shift_km)),
        ("", format!("{:.2} km for a bend that all edges share", h.bend_km)),
    ];
    if h.lens_km > 0.0 {
        lines.push(("", format!("{:.2} km for the lens, whose sigmas are in sensor.toml", h.lens_km)));
    }
    if h.radius_km > 0.0 {
        lines.push(("", format!("{:.2} km for the local radius, which is unknown without a position", h.radius_km)));
    }
    for [deg, km, sigma] in &h.by_latitude {
        lines.push(("by latitude", format!("{deg:.0}°: {km:.2} km ± {sigma:.2} km")));
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
    let [chi2, _] = above(calibration.chi2, MAX_CHI2);
    lines.push(("chi-square", format!("{chi2} a degree of freedom; 1 is ideal, a value above 2 is an alarm")));
    if let Some(f) = &calibration.focal {
        let sure = f.percent.abs() > 3.0 * f.sigma_percent;
        // Another shape of the lens changes the half-angle as another focal length does.
        let hint = match camera.covariance.as_ref().is_some_and(has_shape) {
            true => {
                "; its sigma is for the shape of the lens in sensor.toml, which is not certain: `hzn calibrate sky` \
                     estimates both"
            }
            false if sure => "; check the camera's calibration",
            false => "",
        };
        let what = "from that of sensor.toml, with a free limb height; not applied";
        let told = if f.sigma_percent < UNKNOWN_PERCENT {
            format!("{:+.2} % ± {:.2} % {what}{hint}", f.percent, f.sigma_percent)
        } else {
            "not determined: the pictures do not separate it from the limb height".to_owned()
        };
        lines.push(("focal length", told));
        lines.push(("", format!("0.1 % of it is {:.2} km of limb height", f.km_per_permille.abs())));
    }
    lines
}

/// Returns whether a coefficient of the lens has a sigma.
fn has_shape(covariance: &Covariance) -> bool {
    use Intrinsic::{CxPx, CyPx, FxPx, FyPx};
    covariance.order.iter().any(|which| !matches!(which, FxPx | FyPx | CxPx | CyPx))
}
