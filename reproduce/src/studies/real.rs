//! Measures every photograph of the public suite, with the sensor.toml next to it, against what is known of it.

use std::path::{Path, PathBuf};

use anyhow::Context;
use hzn_core::frames::{Cam, UnitVec3};
use hzn_core::image::{Channel, ImageView, Layout};
use hzn_core::{HostHorizon, Prior, Report};
use serde::Deserialize;

use super::setup::Effort;
use crate::section::Section;

/// A row of truth.csv.
#[derive(Deserialize)]
struct Truth {
    file: String,
    quantity: String,
    value_1: f64,
    value_2: Option<f64>,
    value_3: Option<f64>,
    sigma: f64,
}

/// Measures the suite.
pub(super) fn suite(_: &Effort) -> anyhow::Result<Section> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/real");
    let truths: Vec<Truth> =
        csv::Reader::from_path(root.join("truth.csv"))?.deserialize().collect::<Result<_, _>>().context("truth.csv")?;
    let mut rows = Vec::new();
    for file in pictures(&root)? {
        let report = process(&root.join(&file)).with_context(|| file.clone())?;
        let truth = |quantity: &str| truths.iter().find(|t| t.file == file && t.quantity == quantity);
        rows.push(cells(&file, &report, truth("axis"), truth("range")));
    }
    let mut s = Section::default();
    s.text(
        "Every photograph of tests/data/real through the sensor.toml next to it, with the frames.csv of its folder. \
         `truth.csv` holds what is known of them, its uncertainty, credit and licence, and `score.py` scores the \
         results of any program. Errors are given where there is a truth. Their sigmas contain the uncertainty of the \
         truth: 0.02° for the pointing of Cassini, 0.05° for the stars, 0.1 % for the distance, because the height of \
         the visible limb is not known better. The night limb shows no limb of the surface; without an answer it is \
         right.",
    );
    s.table(["picture", "status", "inliers", "RMS", "σ of the axis", "axis error", "range error ± σ"], rows);
    Ok(s)
}

/// Returns the pictures of a folder and of its subfolders, relative to it.
fn pictures(root: &Path) -> anyhow::Result<Vec<String>> {
    let (mut found, mut folders) = (Vec::new(), vec![PathBuf::new()]);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(root.join(&folder))? {
            let entry = entry?;
            let path = folder.join(entry.file_name());
            if entry.file_type()?.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "jpg" || e == "png") {
                found.push(path.to_string_lossy().replace('\\', "/"));
            }
        }
    }
    found.sort();
    Ok(found)
}

/// Processes a picture with the .toml of its name, or else with the sensor.toml of its folder.
fn process(path: &Path) -> anyhow::Result<Report<f64>> {
    let own = path.with_extension("toml");
    let toml = if own.exists() { own } else { path.with_file_name("sensor.toml") };
    let config = hzn_calib::sensor::load(&toml)?.config;
    let frames = path.with_file_name("frames.csv");
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let prior = if frames.exists() {
        let frames = hzn_calib::frames::load(&frames)?;
        frames.get(&name).context("frames.csv has no row of the picture")?.to_prior(None)
    } else {
        Prior::default()
    };
    let rgb = image::open(path)?.into_rgb8();
    let mut horizon = HostHorizon::boxed(&config)?;
    let layout = Layout::packed(rgb.width(), rgb.height(), 3, 8);
    let view = ImageView::from_bytes(rgb.as_raw(), layout, Channel::Mean)?;
    let expected = horizon.expect(&prior)?;
    Ok(horizon.process(&view, &expected))
}

fn cells(file: &str, report: &Report<f64>, axis: Option<&Truth>, range: Option<&Truth>) -> Vec<String> {
    let none = || "–".to_owned();
    let Some(found) = &report.solution else {
        return [file.to_owned(), report.status.to_string()].into_iter().chain((0..5).map(|_| none())).collect();
    };
    let sigma_deg = found.covariance.sigma_max_rad().to_degrees();
    let axis_error = axis.and_then(|t| {
        let off_deg = found.axis.angle_rad(&truth_axis(t)?).to_degrees();
        Some(format!("{off_deg:.4}°, {:.1}σ", off_deg / sigma_deg.hypot(t.sigma)))
    });
    let range_error = range.zip(found.position.as_ref()).map(|(t, position)| {
        let (found_m, sigma_m) = position.free_range_m;
        let percent = 1e2 / t.value_1;
        let off = found_m * 1e-3 - t.value_1;
        let sigma_km = (sigma_m * 1e-3).hypot(t.sigma);
        format!("{:+.3} % ± {:.3} %, {:+.1}σ", off * percent, sigma_m * 1e-3 * percent, off / sigma_km)
    });
    vec![
        file.to_owned(),
        report.status.to_string(),
        found.inliers.to_string(),
        format!("{:.2} px", found.rms_px),
        format!("{sigma_deg:.4}°"),
        axis_error.unwrap_or_else(none),
        range_error.unwrap_or_else(none),
    ]
}

fn truth_axis(t: &Truth) -> Option<UnitVec3<Cam, f64>> {
    UnitVec3::try_new([t.value_1, t.value_2?, t.value_3?])
}
