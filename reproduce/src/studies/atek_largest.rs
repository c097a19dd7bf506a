//! The angles of figures 37 to 44 as the paper states them: the largest of a flight, and 3σ.

use anyhow::anyhow;
use hzn_core::body::Kind;
use hzn_core::{Config, HostHorizon, Preset};
use hzn_fuse::input::{Body, Recording};
use hzn_fuse::results::Kind as Measured;
use hzn_fuse::{Fused, Settings, simulated};
use hzn_host::Compiled;
use hzn_mcap::Row;
use hzn_sim::{FlightFrame, Scenario};

use super::atek::{fly, scene};
use super::recordings::{process_each, untold};
use super::setup::Effort;
use crate::section::Section;

/// Seeds of the flights: two of those of the study `atek`, in which limb and Sun come into view early and late.
const SEEDS: [u64; 2] = [5101, 5104];
/// Pictures of a camera in a flight: one every six seconds.
const PICTURES: usize = 62;
/// Pictures from which the fixed threshold of `dlr-2022` is set.
const THRESHOLD_PICTURES: usize = 9;

/// Returns the sensor of a camera with the chain of `dlr-2022` for the limb. The Sun is that of `hzn`.
fn dlr(one: &Scenario) -> anyhow::Result<Config> {
    let own = untold(one);
    let preset = Config::preset(Preset::Dlr2022, own.camera.clone());
    let body = own.each_body().iter().find(|b| b.kind == Kind::Earth).cloned().unwrap_or_default();
    let mut config = Config { body, mask: own.mask.clone(), mount: own.mount, ..preset };
    let otsu = Config { body: config.body.clone(), ..own };
    let mut horizon = HostHorizon::boxed(&Config { bodies: Default::default(), ..otsu })?;
    let flight = one.flight()?;
    let mut levels = Vec::new();
    for frame in flight.frames.iter().step_by(flight.frames.len().div_ceil(THRESHOLD_PICTURES).max(1)) {
        let picture = frame.render()?;
        let expected = horizon.expect(&frame.prior())?;
        let view = picture.view();
        let full = f64::from(hzn_core::image::Pixels::full_scale(&view));
        levels.push(f64::from(horizon.find(view, &expected).level) / full);
    }
    levels.sort_by(f64::total_cmp);
    config.threshold.level = levels.get(levels.len() / 2).copied().ok_or_else(|| anyhow!("no pictures"))?;
    Ok(config)
}

/// Returns the largest angle in degrees.
fn largest(values: impl Iterator<Item = f64>) -> String {
    format!("{:.2}°", values.fold(0.0, f64::max).to_degrees())
}

/// Returns the cells of a flight: largest angles of directions and of TRIAD from the unaided and the aided solution,
/// and the largest 3σ of the limb.
fn cells(fused: &Fused) -> Vec<String> {
    let directions = || fused.innovations.iter().filter(|i| matches!(i.kind, Measured::Direction(_)));
    let limbs = || fused.innovations.iter().filter(|i| i.kind == Measured::Direction(Body::Limb));
    vec![
        largest(directions().filter_map(|i| i.unaided_rad)),
        largest(directions().filter_map(|i| i.angle_rad)),
        largest(fused.triads.iter().map(|t| t.unaided_rad)),
        largest(fused.triads.iter().map(|t| t.angle_rad)),
        largest(limbs().filter_map(|i| i.sensor_sigma_rad).map(|sigma| 3.0 * sigma)),
    ]
}

/// Returns the errors of limb directions against the truth in a span of time, degrees.
fn errors_deg(frames: &[FlightFrame], rows: &[Row], span_s: [f64; 2]) -> anyhow::Result<Vec<f64>> {
    let mut errors = Vec::new();
    for row in rows.iter().filter(|row| row.body == Kind::Earth.name()) {
        let Some((frame, axis)) = frames.get(row.index as usize).zip(row.axis()) else { continue };
        if frame.time_s < span_s[0] || frame.time_s > span_s[1] {
            continue;
        }
        let truth = frame.scene.body_truth(Kind::Earth, &frame.file, frame.time_s)?;
        let [a, b] = [axis, [truth.axis_x, truth.axis_y, truth.axis_z]].map(nalgebra::Vector3::from);
        errors.push(a.cross(&b).norm().atan2(a.dot(&b)).to_degrees());
    }
    Ok(errors)
}

/// Times of the paper's flight between which its figures have directions, s.
const SPAN_S: [f64; 2] = [171.0, 300.0];

pub(super) fn statistics(effort: &Effort) -> anyhow::Result<Section> {
    let count = effort.frames(PICTURES);
    let mut section = Section::default();
    section.text(format!(
        "{} flights of `hzn simulate atek` with {count} pictures of each camera, through the filter with table 3. The \
         angles are the largest of the flight: between the directions of limb and Sun and the solution, and between \
         the attitude of two directions alone (TRIAD) and the solution, without and with aid. `dlr-2022` has the \
         median of the thresholds that `otsu` finds on {THRESHOLD_PICTURES} pictures of the camera (in-sample), and \
         the Sun of `hzn`; `hzn` has default values. The last column has the error of the limb against the truth from \
         T+{:.0} s to T+{:.0} s.",
        SEEDS.len(),
        SPAN_S[0],
        SPAN_S[1]
    ));
    let mut rows = Vec::new();
    for seed in SEEDS {
        let scene = scene(seed, count)?;
        let mut inputs = [simulated::instruments(&scene)?, simulated::instruments(&scene)?];
        let mut errors: [Vec<f64>; 2] = Default::default();
        for one in scene.by_camera() {
            let (own, printed) = (untold(&one), dlr(&one)?);
            let [all, limbs] = process_each(&one, [&own, &printed], None)?;
            let frames = one.flight()?.frames;
            errors[0].extend(errors_deg(&frames, &all, SPAN_S)?);
            errors[1].extend(errors_deg(&frames, &limbs, SPAN_S)?);
            let mixed = limbs.into_iter().chain(all.iter().filter(|r| r.body == Kind::Sun.name()).cloned());
            let mut mixed: Vec<Row> = mixed.collect();
            mixed.sort_by_key(|row| row.index);
            for (inputs, rows) in inputs.iter_mut().zip([all, mixed]) {
                inputs.recordings.push(Recording::new(one.name.clone(), rows, Some(&own))?);
            }
        }
        for ((name, inputs), errors) in ["hzn", "dlr-2022"].into_iter().zip(&inputs).zip(&errors) {
            let head = vec![seed.to_string(), format!("`{name}`")];
            let angles =
                fly(inputs, &Settings::default()).map_or_else(|| vec!["no limb with Sun".into()], |f| cells(&f));
            let n = errors.len().max(1) as f64;
            let rms = (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
            let worst = errors.iter().copied().fold(0.0, f64::max);
            let last = format!("{rms:.3}° RMS, {worst:.2}° at worst, {} limbs", errors.len());
            rows.push([head, angles, vec![last]].concat());
        }
    }
    let paper = ["[BB]", "table 3", "4.2°", "0.6°", "3.4°", "0.6°", "0.9°", "below 0.6° (against the aided solution)"];
    rows.push(paper.map(str::to_owned).to_vec());
    section.table(
        [
            "seed",
            "directions",
            "limb and Sun, unaided",
            "aided",
            "TRIAD, unaided",
            "aided",
            "3σ of the limb",
            "limb against the truth",
        ],
        rows,
    );
    Ok(section)
}
