//! The outputs of a lens calibration: report, camera, page.

use std::path::PathBuf;

use hzn_calib::board::Calibrated;
use hzn_calib::residual_table;
use hzn_files::camera_file::{self, Format};
use hzn_run::disk;
use hzn_run::source::ending;

use super::lens_text::Reasons;
use super::{lens_page, lens_text};
use crate::exit::{Stop, failed, usage};
use crate::tell;

/// Refuses outputs of another kind.
pub(super) fn check_endings(outputs: &[PathBuf]) -> Result<(), Stop> {
    for path in outputs {
        match ending(path).as_str() {
            "toml" | "html" | "csv" => {}
            _ => {
                let endings = "a camera ends in .toml, a report in .html, a table of residuals in .csv";
                return Err(usage(format!("{}: {endings}", path.display())));
            }
        }
    }
    Ok(())
}

/// Prints the report and writes the outputs. `reasons` says why pictures were left out before the fit.
pub(super) fn write_all(
    calibrated: &Calibrated,
    reasons: &Reasons,
    outputs: &[PathBuf],
    name: &str,
    quiet: bool,
) -> Result<(), Stop> {
    // All texts exist before the first file is written.
    let mut files = Vec::new();
    for path in outputs {
        let text = match ending(path).as_str() {
            "html" => lens_page::html(calibrated, reasons, name)?,
            "csv" => residual_table::write(calibrated).map_err(failed)?,
            _ => camera_file::write(&calibrated.camera, Format::Sensor).map_err(failed)?,
        };
        files.push((path, text));
    }
    tell::report(lens_text::report(calibrated, reasons))?;
    calibrated.warnings.iter().for_each(tell::warning);
    for (path, text) in files {
        disk::write_whole(path, &text)?;
    }
    if outputs.is_empty() && !quiet {
        tell::line("note: -o camera.toml writes the camera, -o report.html plots, -o residuals.csv all residuals");
    }
    Ok(())
}
