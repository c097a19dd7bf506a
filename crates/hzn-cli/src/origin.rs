//! The last line below a picture of a recording: version, hash of the sensor, and command.

use std::collections::HashMap;
use std::path::Path;

use hzn_mcap::{Contents, Reader};
use hzn_run::provenance;
use hzn_run::source::ending;

/// The lines of the sensors of a recording; a rig has several.
#[derive(Default)]
pub(crate) struct Origin {
    lines: HashMap<Option<String>, String>,
}

impl Origin {
    /// Returns the line of a picture; `head` is the head of a rig that took it.
    pub(crate) fn of(&mut self, reader: &Reader, head: Option<&str>) -> String {
        let make = || {
            let file = head.map(|head| format!("{head}/sensor.toml"));
            let text = file.map_or_else(|| reader.sensor_toml(), |file| reader.file(&file));
            let hash = text.and_then(provenance::hash_of_text);
            provenance::line(hash.as_deref(), &provenance::command("hzn"))
        };
        self.lines.entry(head.map(str::to_owned)).or_insert_with(make).clone()
    }
}

/// Returns the hashes of the sensors that recordings and sensor.toml files have, each once. Tables have none.
pub(crate) fn sensors<'a>(files: impl IntoIterator<Item = &'a Path>) -> Vec<String> {
    let hash = |file: &Path| match ending(file).as_str() {
        "mcap" => Reader::open(file, Contents::WithoutImages).ok()?.sensor_toml().and_then(provenance::hash_of_text),
        "toml" => provenance::hash(&hzn_files::sensor::load(file).ok()?.config),
        _ => None,
    };
    let mut hashes: Vec<String> = files.into_iter().filter_map(hash).collect();
    hashes.sort();
    hashes.dedup();
    hashes
}
