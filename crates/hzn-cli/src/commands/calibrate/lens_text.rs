//! A calibrated lens in words and numbers.

use std::collections::BTreeMap;

use hzn_calib::board::{Calibrated, ViewResult};

use crate::tell::one_line;

/// The reason for each picture that was left out before the fit, by the name of the picture.
pub(super) type Reasons = BTreeMap<String, String>;

/// Returns the report: the pictures, the lens with its sigmas, the errors.
pub(super) fn report(calibrated: &Calibrated, reasons: &Reasons) -> String {
    let mut out = String::new();
    for view in &calibrated.views {
        out.push_str(&format!("{:<24} {}\n", one_line(&view.name), one_line(describe_view(view, reasons))));
    }
    out.push('\n');
    for (name, value) in calibrated.lines() {
        out.push_str(&format!("{name:<16} {value}\n"));
    }
    out
}

/// Returns a picture's line.
pub(super) fn describe_view(view: &ViewResult, reasons: &Reasons) -> String {
    if let Some(why) = reasons.get(&view.name) {
        return format!("left out: {why}");
    }
    if let Some(why) = view.dropped {
        return format!("left out: {why}");
    }
    let outliers = view.residuals.iter().filter(|r| !r.counts).count();
    let left_out = if outliers > 0 { format!(", {outliers} outliers left out") } else { String::new() };
    let tilt = view.tilt_deg.map(|deg| format!(", tilt {deg:.0} deg")).unwrap_or_default();
    format!("{} points, RMS {:.3} px{tilt}{left_out}", view.residuals.len(), view.rms_px)
}
