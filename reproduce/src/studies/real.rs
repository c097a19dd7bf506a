//! Processes every photograph of the public suite with the sensor.toml next to it. Compares the answers with the truth,
//! where there is one.

use std::path::{Path, PathBuf};

use anyhow::Context;
use hzn_core::frames::{Cam, UnitVec3};
use hzn_core::image::{Channel, ImageView, Layout};
use hzn_core::{HostHorizon, Prior, Report, Solution};
use hzn_host::Compiled;
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
    let (mut rows, mut wrong) = (Vec::new(), Vec::new());
    for file in pictures(&root)? {
        let report = process(&root.join(&file)).with_context(|| file.clone())?;
        let truth = |quantity: &str| truths.iter().find(|t| t.file == file && t.quantity == quantity);
        let errors = Errors::new(&report, truth("axis"), truth("range"));
        if errors.are_beyond(3.0) {
            wrong.push(format!("`{file}`"));
        }
        rows.push(cells(&file, &report, &errors));
    }
    let mut s = Section::default();
    s.text(
        "The sensor processes every photograph of tests/data/real with the sensor.toml next to it and the frames.csv \
         of its folder. `truth.csv` has the known quantities with their uncertainty, credit and licence. `score.py` \
         scores the results of any program. Errors are given where there is a truth. Their sigmas contain the \
         uncertainty of the truth: 0.02° for the pointing of Cassini, 0.05° for the stars, 0.1 % for the distance, \
         because the height of the visible limb is not known better. The night pictures show airglow and hardly any \
         limb of the surface: they should be refused, or answered within 3σ. The residuals on the limb of Jupiter are \
         not noise: both pictures have the same profile by latitude, about 40 km high, so that the closer picture has \
         the larger RMS (test `the_residuals_are_the_limb_of_jupiter`).",
    );
    s.table(["picture", "status", "inliers", "RMS", "σ of the axis", "axis error", "range error ± σ"], rows);
    s.text(match wrong.as_slice() {
        [] => "No answer is more than 3σ off.".to_owned(),
        wrong => format!("Answers that are more than 3σ off: {}.", wrong.join(", ")),
    });
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
    let config = hzn_files::sensor::load(&toml)?.config;
    let frames = path.with_file_name("frames.csv");
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let prior = if frames.exists() {
        let frames = hzn_files::frames::load(&frames)?;
        frames.get(&name).context("frames.csv has no row of the picture")?.to_prior(None)
    } else {
        Prior::default()
    };
    let rgb = image::open(path)?.into_rgb8();
    let mut horizon = HostHorizon::boxed(&config)?;
    let layout = Layout::packed(rgb.width(), rgb.height(), 3, 8);
    let view = ImageView::from_bytes(rgb.as_raw(), layout, Channel::Mean)?;
    let expected = horizon.expect(&prior)?;
    Ok(horizon.find(view, &expected))
}

/// Errors of an answer where there is a truth.
struct Errors {
    /// Error of the axis, degrees and sigmas.
    axis: Option<[f64; 2]>,
    /// Error of the range and its reported 1-sigma, percent of the range, and the error in sigmas.
    range: Option<[f64; 3]>,
}

impl Errors {
    fn new(report: &Report<f64>, axis: Option<&Truth>, range: Option<&Truth>) -> Self {
        let solution = report.solution.as_ref();
        let axis = axis.zip(solution).and_then(|(t, found)| {
            let true_axis = UnitVec3::<Cam, f64>::try_new([t.value_1, t.value_2?, t.value_3?])?;
            let off_deg = found.axis.angle_rad(&true_axis).to_degrees();
            Some([off_deg, off_deg / sigma_deg(found).hypot(t.sigma)])
        });
        let range = range.zip(solution.and_then(|s| s.position.as_ref())).map(|(t, position)| {
            let (found_km, sigma_km) = (position.free_range_m.0 * 1e-3, position.free_range_m.1 * 1e-3);
            let off_km = found_km - t.value_1;
            [1e2 * off_km / t.value_1, 1e2 * sigma_km / t.value_1, off_km / sigma_km.hypot(t.sigma)]
        });
        Self { axis, range }
    }

    fn are_beyond(&self, sigmas: f64) -> bool {
        self.axis.is_some_and(|[_, s]| s > sigmas) || self.range.is_some_and(|[_, _, s]| s.abs() > sigmas)
    }
}

fn sigma_deg(found: &Solution<f64>) -> f64 {
    found.covariance.sigma_max_rad().to_degrees()
}

fn cells(file: &str, report: &Report<f64>, errors: &Errors) -> Vec<String> {
    let or_dash = |text: Option<String>| text.unwrap_or_else(|| "–".to_owned());
    let found = report.solution.as_ref();
    vec![
        file.to_owned(),
        report.status.to_string(),
        or_dash(found.map(|s| s.inliers.to_string())),
        or_dash(found.map(|s| format!("{:.2} px", s.rms_px))),
        or_dash(found.map(|s| format!("{:.4}°", sigma_deg(s)))),
        or_dash(errors.axis.map(|[deg, sigmas]| format!("{deg:.4}°, {sigmas:.1}σ"))),
        or_dash(errors.range.map(|[off, sigma, sigmas]| format!("{off:+.3} % ± {sigma:.3} %, {sigmas:+.1}σ"))),
    ]
}
