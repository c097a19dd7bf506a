//! A calibrated lens in words and numbers.

use hzn_core::camera::Intrinsic;

use crate::calibrated::{Bow, Calibrated};

impl Calibrated {
    /// Returns the lines of the report: name and value.
    pub fn lines(&self) -> Vec<(String, String)> {
        lines(self)
    }
}

fn lines(c: &Calibrated) -> Vec<(String, String)> {
    let camera = &c.camera;
    let used = c.views.iter().filter(|v| v.dropped.is_none()).count();
    let mut lines = vec![
        ("pictures".to_owned(), format!("{used} of {} used", c.views.len())),
        ("model".to_owned(), camera.model.name().to_owned()),
    ];
    for which in camera.model.intrinsics() {
        let value = camera.intrinsic(*which).unwrap_or(0.0);
        lines.push((which.name().to_owned(), with_sigma(value, sigma(c, *which))));
    }
    if let Some(deg) = camera.theta_max_deg {
        lines.push(("theta_max_deg".to_owned(), format!("{deg:.2}")));
    }
    lines.push(("RMS".to_owned(), format!("{:.4} px, 1 sigma of a coordinate {:.4} px", c.rms_px, c.sigma_px)));
    if let Some(rms) = c.held_out_rms_px {
        lines.push(("held out".to_owned(), format!("{rms:.4} px RMS in pictures that are not in the fit")));
    }
    if let Some(Bow { depth_mm: [row, column], sigma_mm: [row_sigma, column_sigma] }) = c.bow {
        let [row, column] = [with_sigma(row, Some(row_sigma)), with_sigma(column, Some(column_sigma))];
        let what = format!("the ends lie behind the middle by {row} mm along a row, {column} mm along a column");
        lines.push(("bow of board".to_owned(), what));
    }
    if let Some(between_px) = c.between_sigma_px {
        let what = "1 sigma of the lens from the corners alone";
        lines.push((
            "agreement".to_owned(),
            format!("{what} {:.4} px, between pictures {between_px:.4} px", c.alone_sigma_px),
        ));
    }
    lines.push((
        "lens".to_owned(),
        format!(
            "1 sigma {:.4} px where points are (up to {:.1} deg off axis), {:.4} px in the worst corner ({:.1} deg)",
            c.lens_sigma_px, c.covered_deg, c.corner_sigma_px, c.corner_deg
        ),
    ));
    lines
}

/// Returns the 1-sigma of a parameter from the covariance.
fn sigma(c: &Calibrated, which: Intrinsic) -> Option<f64> {
    let covariance = c.camera.covariance.as_ref()?;
    let place = covariance.order.iter().position(|i| *i == which)?;
    Some(covariance.rows.get(place)?.get(place)?.sqrt())
}

/// Returns a value with its sigma, both to two digits of the sigma.
fn with_sigma(value: f64, sigma: Option<f64>) -> String {
    let Some(sigma) = sigma.filter(|s| *s > 0.0) else { return format!("{value}") };
    let digits = (1.0 - sigma.log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{value:.digits$} ± {sigma:.digits$}")
}
