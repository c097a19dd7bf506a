//! The times of a video's frames, from ffprobe, which runs in parallel with ffmpeg.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::Stdio;

use super::tool::{Running, add_input, cannot_start, tool};
use crate::error::Error;
use crate::source::item::TimeSource;

/// If this many frames at the beginning of a container have no time, the container has no times.
const MAX_FRAMES_WITHOUT_TIME: usize = 32;

pub(super) struct Times {
    lines: BufReader<Box<dyn Read + Send>>,
    /// Times that were read early, to find out whether the container has times.
    ahead: VecDeque<Option<f64>>,
    in_container: bool,
    _probe: Running,
}

impl Times {
    pub(super) fn start(path: &Path) -> Result<Self, Error> {
        let mut command = tool("ffprobe");
        command
            .args([
                "-select_streams",
                "v:0",
                "-show_entries",
                "frame=best_effort_timestamp_time",
                "-of",
                "default=nw=1",
            ])
            // ffmpeg reports the same errors.
            .stderr(Stdio::null());
        add_input(&mut command, path).map_err(|e| cannot_start("ffprobe", &e))?;
        let (probe, lines) = Running::start("ffprobe", &mut command)?;
        let lines = BufReader::new(Box::new(lines) as Box<dyn Read + Send>);
        let mut times = Self { lines, ahead: VecDeque::new(), in_container: false, _probe: probe };
        while !times.in_container && times.ahead.len() < MAX_FRAMES_WITHOUT_TIME {
            let Some(time_s) = next_time_s(&mut times.lines) else { break };
            times.in_container = time_s.is_some();
            times.ahead.push_back(time_s);
        }
        Ok(times)
    }

    /// Returns the origin of the next frame's time.
    pub(super) fn next(&mut self) -> TimeSource {
        if !self.in_container {
            return TimeSource::Count;
        }
        TimeSource::Container(self.ahead.pop_front().or_else(|| next_time_s(&mut self.lines)).flatten())
    }
}

/// Returns the time of the next frame that ffprobe lists; a frame may have none. Returns `None` at the end of the list.
/// All other lines are ignored.
fn next_time_s(lines: &mut impl BufRead) -> Option<Option<f64>> {
    let mut line = String::new();
    while lines.read_line(&mut line).ok()? > 0 {
        if let Some(value) = line.trim().strip_prefix("best_effort_timestamp_time=") {
            return Some(value.parse().ok().filter(|t: &f64| t.is_finite()));
        }
        line.clear();
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_lines_with_a_time_are_frames() {
        let text = "best_effort_timestamp_time=0.1\n\nside_data_type=x\nbest_effort_timestamp_time=N/A\r\n0.2\n";
        let mut lines = text.as_bytes();
        assert_eq!(next_time_s(&mut lines), Some(Some(0.1)));
        assert_eq!(next_time_s(&mut lines), Some(None));
        assert_eq!(next_time_s(&mut lines), None);
    }
}
