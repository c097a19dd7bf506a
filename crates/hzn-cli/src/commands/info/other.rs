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
