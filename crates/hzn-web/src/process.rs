//! The answer to one picture: its row, the drawing over it, and the explanation.

use std::path::Path;

use hzn_core::Config;
use hzn_mcap::Annotations;
use hzn_run::engine::{self, AnySensor, Finished, Plan, Turns};
use hzn_run::explained::{PictureToExplain, Work};
use hzn_run::record::rows;
use hzn_run::source::{OnePicture, Payload, Source, with_key};
use hzn_run::{explain, open};
use serde_json::{Value, json};

use crate::request::Settings;

/// Processes a picture as `hzn run` does, and explains it as `hzn explain` does.
pub(crate) fn process(settings: &Settings, bytes: &[u8]) -> Result<Value, String> {
    let said = |e: hzn_run::Error| e.to_string();
    let text = match settings.threshold {
        Some(part) => {
            with_key(&with_key(&settings.sensor_toml, "threshold", "method", "fixed"), "threshold", "level", part)
        }
        None => settings.sensor_toml.clone(),
    };
    let mut sensor = hzn_files::sensor::parse(&text, Path::new("sensor.toml")).map_err(|e| e.to_string())?;
    let mut source = OnePicture::new(&settings.name, bytes);
    let mut notes: Vec<String> = sensor.warnings.iter().map(ToString::to_string).collect();
    notes.extend(open::complete(&mut source, &mut sensor).map_err(said)?);
    open::check_size(&source, &sensor.config).map_err(said)?;
    open::check_altitude(&source, &sensor.config, None).map_err(said)?;
    let plan = plan(sensor.config);
    let item = source.next().transpose().map_err(said)?.ok_or("there is no picture")?;
    let finished = engine::process_alone(&plan, item).map_err(said)?;
    notes.extend(finished.tip.clone());
    let config = &plan.config;
    let drawing = &finished.drawing;
    let level = finished.traces.as_ref().and_then(|t| t.each.first()?.level()).map(|(level, ..)| level);
    let sigmas = finished.outcomes.first().and_then(|o| o.report.as_ref().ok()?.solution.as_ref());
    let sigmas = sigmas.map(explain::principal_sigmas);
    Ok(json!({
        "notes": notes,
        "rows": rows(&finished, config),
        "meaning": finished.outcomes.iter().map(|o| explain::status_text(o.status())).collect::<Vec<_>>(),
        "drawing": drawing_as_json(drawing),
        "size": [config.camera.width, config.camera.height],
        "level": level,
        "bits": config.input.bits.unwrap_or(8),
        "sigma_deg": sigmas.map(|(sigma, _)| sigma.map(f64::to_degrees)),
        "sigma_angle_deg": sigmas.map(|(_, angle)| angle.to_degrees()),
        "explained": explained(&settings.name, config, bytes, &finished)?,
    }))
}

/// Returns the settings of a run over one picture, which keeps what the pipeline shows of its work.
fn plan(config: Config) -> Plan {
    Plan {
        config,
        flight: false,
        threads: 1,
        frames: None,
        fps: 1.0,
        trace: true,
        keep_traces: true,
        keep_picture: false,
        overlay: None,
        masks: None,
        last: Vec::new(),
        turns: Turns::default(),
    }
}

fn drawing_as_json(drawing: &Annotations) -> Value {
    let Annotations { edges, inliers, rejected, limb, axes } = drawing;
    json!({ "edges": edges, "inliers": inliers, "rejected": rejected, "limb": limb, "axes": axes })
}

/// Returns the text of `hzn explain`, without times.
fn explained(name: &str, config: &Config, bytes: &[u8], finished: &Finished) -> Result<String, String> {
    let (picture, _) = Payload::Encoded(bytes.to_vec()).decode(Some(config))?;
    let picture = PictureToExplain { name, config, data: None, picture: &picture, flight: false };
    let mut sensor = AnySensor::new(config, false).map_err(|e| e.to_string())?;
    let half_angles = sensor.expected_half_angles_rad(None);
    let traces = finished.traces.iter().flat_map(|traces| &traces.each);
    let mut texts = Vec::new();
    for (which, ((outcome, trace), half_angle)) in finished.outcomes.iter().zip(traces).zip(half_angles).enumerate() {
        match (&outcome.report, half_angle) {
            (Ok(report), Ok(half_angle_rad)) => {
                let work = Work { which, trace, report, half_angle_rad, times: None };
                texts.extend(picture.explain(&mut sensor, &work).map_err(|e| e.to_string())?);
            }
            (Err(refused), _) => texts.push(format!("{name}: {}: {}\n", refused.status, refused.why)),
            (_, Err(why)) => texts.push(format!("{name}: {why}\n")),
        }
    }
    Ok(texts.join("\n"))
}
