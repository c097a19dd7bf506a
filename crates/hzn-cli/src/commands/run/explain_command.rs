//! The command that explains a picture of a run.

use std::path::{Path, PathBuf};

use hzn_run::source::Source;

use super::Args;
use crate::refusals::{quoted, quoted_path};

/// Returns the command that explains a picture of this run, ready to be typed.
pub(super) fn explain_command(args: &Args, source: &dyn Source, frame: u64) -> String {
    let mut words = vec!["hzn".to_owned(), "explain".to_owned()];
    match (source.path(frame), args.input.first()) {
        (Some(path), _) => words.push(quoted_path(&path)),
        (None, input) => {
            words.extend(input.map(|input| quoted_path(input)));
            words.extend(["--index".to_owned(), frame.to_string()]);
        }
    }
    let mut option = |name: &str, value: Option<String>| {
        if let Some(value) = value {
            words.extend([name.to_owned(), quoted(Path::new(&value))]);
        }
    };
    let path = |path: &PathBuf| path.to_string_lossy().into_owned();
    option("--sensor", args.sensor.sensor.as_ref().map(path));
    option("--altitude-km", args.sensor.altitude_km.map(|km| km.to_string()));
    option("--frames", args.source.frames.as_ref().map(path));
    option("--raw", args.source.raw.map(|raw| raw.to_string()));
    option("--topic", args.source.topic.clone());
    if args.sensor.flight {
        words.push("--flight".to_owned());
    }
    words.join(" ")
}
