//! Compares the thresholds on one flight: the controller that Barf 2014, 6, calls the most critical step.

use anyhow::anyhow;
use hzn_core::{Config, HostHorizon, Prior, threshold};
use hzn_host::Compiled;
use hzn_plot::{Chart, Series, Style};
use hzn_sim::{FlightFrame, Picture, Scenario};
use rayon::prelude::*;

use super::setup::Effort;
use crate::fly::deg;
use crate::section::Section;

/// Seed of the flight; no setting was chosen on it.
const SEED: u64 = 6201;

/// Returns the methods with their names. `fixed` and `dynamic` have the values of the papers or of the keys.
fn thresholds() -> [(&'static str, threshold::Config); 4] {
    use threshold::Method::{Dynamic, Fixed, Otsu, Track};
    [("otsu", Otsu), ("track", Track), ("dynamic", Dynamic), ("fixed", Fixed)]
        .map(|(name, method)| (name, threshold::Config { method, ..threshold::Config::default() }))
}

/// Results of one method: levels as parts of full scale by time, errors in degrees, and the pictures without an answer.
#[derive(Default)]
struct Flown {
    levels: Vec<(f64, f64)>,
    errors_deg: Vec<f64>,
    lost: usize,
}

fn look(
    frame: &FlightFrame,
    picture: &Picture,
    horizon: &mut HostHorizon,
    next: &mut Option<u16>,
    flown: &mut Flown,
) -> anyhow::Result<()> {
    let view = picture.view();
    let prior = Prior { level: *next, ..frame.prior() };
    let expected = horizon.expect(&prior)?;
    let report = horizon.find(view, &expected);
    *next = report.next_level;
    let full = f64::from(hzn_core::image::Pixels::full_scale(&view));
    flown.levels.push((frame.time_s, f64::from(report.level) / full));
    let truth = frame.truth()?;
    match &report.solution {
        Some(solution) => {
            let [a, b] = [solution.axis.xyz(), [truth.axis_x, truth.axis_y, truth.axis_z]].map(nalgebra::Vector3::from);
            flown.errors_deg.push(a.cross(&b).norm().atan2(a.dot(&b)).to_degrees());
        }
        None if truth.has_limb() => flown.lost += 1,
        None => {}
    }
    Ok(())
}

pub(super) fn thresholds_of_a_flight(effort: &Effort) -> anyhow::Result<Section> {
    let count = effort.frames(48);
    let mut scenario = Scenario::builtin("rocket").ok_or_else(|| anyhow!("there is no built-in scene rocket"))?;
    scenario.seed = SEED;
    scenario.capture.frames = u32::try_from(count)?;
    let flight = scenario.flight()?;
    let mut s = Section::default();
    s.text(format!(
        "{count} pictures of `hzn simulate rocket` (seed {SEED}), one after the other. The sensor is that of the scene \
         with another `threshold.method`, and one look at a picture. `dynamic` is 0.75 times the mean (HORACE); \
         `fixed` has its default level. `track` begins with `otsu`, and then takes the middle of the brightness on \
         both sides of the limb in the picture before: it is the controller that [B14], 6, proposes."
    ));
    let pictures: Vec<Picture> = flight.frames.par_iter().map(FlightFrame::render).collect::<Result<_, _>>()?;
    let all: Vec<(&str, Flown)> = thresholds()
        .into_par_iter()
        .map(|(name, threshold)| {
            let mut config = Config { threshold, ..flight.sensor.clone() };
            config.retry.levels.clear();
            let mut horizon = HostHorizon::boxed(&config)?;
            let (mut flown, mut next) = (Flown::default(), None);
            for (frame, picture) in flight.frames.iter().zip(&pictures) {
                look(frame, picture, &mut horizon, &mut next, &mut flown)?;
            }
            anyhow::Ok((name, flown))
        })
        .collect::<Result<_, _>>()?;
    let rows = all.iter().map(|(name, flown)| {
        let n = flown.errors_deg.len().max(1) as f64;
        let rms = (flown.errors_deg.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
        let worst = flown.errors_deg.iter().copied().fold(0.0, f64::max);
        let steps: Vec<f64> = flown.levels.windows(2).map(|w| (w[1].1 - w[0].1).abs()).collect();
        let mean = steps.iter().sum::<f64>() / steps.len().max(1) as f64;
        let cells = [flown.errors_deg.len().to_string(), flown.lost.to_string(), deg(rms), deg(worst)];
        std::iter::once(format!("`{name}`")).chain(cells).chain([format!("{mean:.3}")]).collect::<Vec<_>>()
    });
    s.table(["threshold", "answered", "lost", "RMS", "worst", "mean change, of full scale"], rows);
    let chart = Chart::new("Threshold by time", "time [s]", "part of full scale");
    let series = all.iter().map(|(name, flown)| Series::new(*name, Style::Line, flown.levels.clone()));
    s.figure("thresholds", &series.fold(chart, Chart::with_series))?;
    Ok(s)
}
