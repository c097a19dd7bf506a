//! Inputs and results that are no pictures and no results of `hzn run`: bags, rigs, and files of `hzn fuse`.

use std::path::Path;

use hzn_files::rig::Rig;
use hzn_fuse::read_back::Solution;
use hzn_run::source::{self, TimeSource};
use serde_json::json;

use super::facts::Facts;
use crate::exit::{Stop, failed};

/// Describes the folder of a bag of ROS 2. The second part names what cannot be read.
pub(super) fn bag(folder: &Path) -> Result<(Facts, Option<String>), Stop> {
    let mut pictures = source::open(&[folder.to_owned()], None, None)?;
    let (mut count, mut span) = (0u64, None);
    while let Some(item) = pictures.next() {
        if let TimeSource::Container(Some(t)) = item?.time {
            span = widened(span, t);
        }
        count += 1;
    }
    let mut out = Facts::new("bag", "bag of ROS 2, for `hzn run FOLDER`");
    out.fact("pictures", count.to_string(), "pictures", count);
    span.into_iter().for_each(|(a, b)| out.time(a, b));
    let notes = pictures.notes();
    notes.iter().for_each(|note| out.line("note", note.clone()));
    out.key("notes", json!(notes));
    Ok((out, pictures.describe_loss()))
}

/// Describes a folder of pictures, and the files beside them that `hzn run FOLDER` reads.
pub(super) fn folder(folder: &Path) -> Result<Facts, Stop> {
    let pictures = source::open(&[folder.to_owned()], None, None)?;
    let mut out = Facts::new("folder", "folder of pictures, for `hzn run FOLDER`");
    let total = pictures.total();
    total.into_iter().for_each(|n| out.fact("pictures", n.to_string(), "pictures", n));
    if let Some((name, (width, height))) = pictures.sizes().next() {
        out.fact("size", format!("{width} x {height} px ({name})"), "width_px", width);
        out.key("height_px", height);
    }
    for (name, missing) in [
        ("sensor.toml", "not here; `hzn init FOLDER` writes one, and --sensor names one elsewhere"),
        ("frames.csv", "not here; times, altitudes and attitudes of the pictures would be in it"),
    ] {
        let has = folder.join(name).is_file();
        out.line(name, if has { "here" } else { missing }.to_owned());
        out.key(&format!("has_{}", name.replace('.', "_")), has);
    }
    let notes = pictures.notes();
    notes.iter().for_each(|note| out.line("note", note.clone()));
    Ok(out)
}

/// Number of frames of a video that give its rate.
const RATE_FRAMES: usize = 100;

/// Describes a video. The second part names what cannot be read.
pub(super) fn video(file: &Path) -> Result<(Facts, Option<String>), Stop> {
    let mut frames = source::open(&[file.to_owned()], None, None)?;
    let mut out = Facts::new("video", "video, for `hzn run FILE` and `hzn init FILE`");
    if let Some((_, (width, height))) = frames.sizes().next() {
        out.fact("size", format!("{width} x {height} px"), "width_px", width);
        out.key("height_px", height);
    }
    match frames.total() {
        Some(n) => out.fact("frames", n.to_string(), "frames", n),
        None => out.line("frames", "their number is not in the container".to_owned()),
    }
    let aspect = frames.pixel_aspect();
    if aspect != 1.0 {
        let text = format!("{aspect:.4} times as wide as high; `hzn init` writes fx_px and fy_px for them");
        out.line("pixels", text);
    }
    out.key("pixel_aspect", aspect);
    let mut times: Vec<f64> = Vec::new();
    while times.len() < RATE_FRAMES {
        let Some(item) = frames.next() else { break };
        let TimeSource::Container(Some(t)) = item?.time else { break };
        times.push(t);
    }
    let mut steps: Vec<f64> = times.windows(2).filter_map(|w| Some(w.last()? - w.first()?)).collect();
    steps.sort_by(f64::total_cmp);
    if let Some(step_s) = steps.get(steps.len() / 2).filter(|step| **step > 0.0) {
        let text = format!("{:.3} frames a second (the median of the first {} steps)", 1.0 / step_s, steps.len());
        out.fact("rate", text, "rate_hz", 1.0 / step_s);
    }
    let notes = frames.notes();
    notes.iter().for_each(|note| out.line("note", note.clone()));
    out.key("notes", json!(notes));
    Ok((out, frames.describe_loss()))
}

/// Describes the results of `hzn fuse`.
pub(super) fn solution(read: &Solution) -> Facts {
    let mut out = Facts::new("navigation", "results of hzn fuse, for `hzn view`");
    out.fact("solutions", read.states.len().to_string(), "solutions", read.states.len());
    let taken = read.innovations.iter().filter(|innovation| innovation.taken).count();
    let text = format!("{}, of which {taken} were taken", read.innovations.len());
    out.fact("measurements", text, "measurements", read.innovations.len());
    out.key("measurements_taken", taken);
    let span = read.states.iter().fold(None, |span, state| widened(span, state.time_s));
    span.into_iter().for_each(|(a, b)| out.time(a, b));
    out
}

fn widened(span: Option<(f64, f64)>, t: f64) -> Option<(f64, f64)> {
    Some(span.map_or((t, t), |(a, b)| (a.min(t), b.max(t))))
}

/// Describes a rig.toml.
pub(super) fn rig(rig: &Rig) -> Facts {
    let mut out = Facts::new("rig", "rig.toml, several cameras for `hzn run FILE`");
    for head in &rig.heads {
        out.line("head", format!("{}, pictures {}", head.name, head.pictures.display()));
    }
    out.key("heads", rig.heads.iter().map(|head| head.name.clone()).collect::<Vec<_>>());
    out
}

/// Describes the settings of `hzn fuse` if the table has only their keys, and at least one of them.
pub(super) fn settings(table: &toml::Table, file: &Path) -> Result<Option<Facts>, Stop> {
    let defaults = serde_json::to_value(hzn_fuse::Settings::default()).map_err(failed)?;
    if table.is_empty() || !table.keys().all(|key| defaults.get(key).is_some()) {
        return Ok(None);
    }
    hzn_fuse::Settings::load(file)?;
    let mut out = Facts::new("fuse", "fuse.toml, for `hzn fuse --config FILE`");
    let keys: Vec<&String> = table.keys().collect();
    out.fact("settings", keys.iter().map(|key| key.as_str()).collect::<Vec<_>>().join(", "), "settings", json!(keys));
    Ok(Some(out))
}
