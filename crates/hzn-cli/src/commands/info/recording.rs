//! What wrote a recording of hzn, and what to do with it.

use hzn_mcap::Reader;

/// What wrote a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Writer {
    Run,
    Fly,
    Telemetry,
    Python,
}

impl Writer {
    /// Finds the writer of a recording that was read to its end.
    pub(super) fn of(reader: &Reader) -> Self {
        let program = reader.metadata().get("program").map(String::as_str).unwrap_or_default();
        let has_sensor = reader.sensor_toml().is_some() || is_of_rig(reader);
        match program {
            _ if program.starts_with("hzn fly") => Self::Fly,
            _ if program.starts_with("hzn telemetry") => Self::Telemetry,
            _ if program.starts_with("hzn in Python") => Self::Python,
            // Versions before the name of the command was written. A packet has no sensor.toml, and a run always does.
            _ if program.starts_with("hzn ") && !has_sensor && reader.is_complete() => Self::Telemetry,
            _ => Self::Run,
        }
    }

    /// Returns the name for programs.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Run => "run",
            Self::Fly => "fly",
            Self::Telemetry => "telemetry",
            Self::Python => "python",
        }
    }

    /// Says what the recording is.
    pub(super) fn describe(self, is_rig: bool, has_pictures: bool) -> String {
        let what = match self {
            Self::Run => "recording of hzn run",
            Self::Fly if has_pictures => {
                return format!("pictures that hzn fly kept, with their answers{}", rig(is_rig));
            }
            Self::Fly => "recording of hzn fly",
            Self::Telemetry => return "answers of a flight computer, decoded by hzn telemetry".to_owned(),
            Self::Python => "recording of a Python program with hzn",
        };
        let pictures = if has_pictures { "" } else { ", without pictures" };
        format!("{what}{}{pictures}", rig(is_rig))
    }
}

fn rig(is_rig: bool) -> &'static str {
    if is_rig { " with a rig" } else { "" }
}

/// Returns whether several cameras were one sensor.
pub(super) fn is_of_rig(reader: &Reader) -> bool {
    reader.file("rig.toml").is_some()
}

/// Says what to do with a recording.
pub(super) fn next_steps(is_rig: bool, has_pictures: bool) -> String {
    let mut steps = vec!["hzn view FILE shows it", "hzn export FILE -o rows.csv writes its rows"];
    match (has_pictures, is_rig) {
        (true, false) => steps.push("hzn run FILE -o again.mcap processes its pictures again"),
        (true, true) => steps.push("hzn export FILE --images DIR writes its pictures"),
        (false, _) => {}
    }
    steps.join(", ")
}
