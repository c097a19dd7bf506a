//! A way through a sequence: a program that is started as a process of its own and measured.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use crate::flight::Sequence;

/// One way through the sequence with its best times in seconds.
pub(crate) struct Way {
    pub(crate) name: &'static str,
    /// Goal for the wall time, as a multiple of the time of decoding alone.
    pub(crate) goal: Option<f64>,
    command: Command,
    output: Option<PathBuf>,
    pub(crate) wall_s: f64,
    pub(crate) processor_s: f64,
}

impl Way {
    /// Returns the ways through `sequence`: decoding alone first, then `hzn run` with several kinds of results.
    pub(crate) fn all(sequence: &Sequence, hzn: &Path) -> Result<Vec<Self>, String> {
        let raw = sequence.raw.map(|raw| raw.to_string());
        let own_program = std::env::current_exe().map_err(|e| e.to_string())?;
        let mut decode = Self::new("decoding alone", None, &own_program);
        decode.command.arg("decode").arg(&sequence.folder).args(&raw);
        let mut ways = vec![decode];
        for (name, goal, file, more) in [
            ("`hzn run -o out.csv`", Some(1.05), "out.csv", &[][..]),
            ("`hzn run -o out.mcap --no-images`", None, "results.mcap", &["--no-images"]),
            ("`hzn run -o out.mcap`", Some(1.2), "out.mcap", &[]),
        ] {
            // Without a header, a file costs next to nothing to decode, and the ratio says little.
            let mut way = Self::new(name, goal.filter(|_| raw.is_none()), hzn);
            let output = sequence.folder.with_extension(file);
            way.command.args(["run", "--quiet", "--force"]).args(more).arg("-o").arg(&output);
            way.command.arg(&sequence.folder);
            if let Some(raw) = &raw {
                way.command.args(["--raw", raw]);
            }
            way.output = Some(output);
            ways.push(way);
        }
        Ok(ways)
    }

    fn new(name: &'static str, goal: Option<f64>, program: &Path) -> Self {
        let mut command = Command::new(program);
        command.stdin(Stdio::null());
        Self { name, goal, command, output: None, wall_s: f64::INFINITY, processor_s: f64::INFINITY }
    }

    /// Runs the way once and keeps the least times.
    pub(crate) fn measure(&mut self) -> Result<(), String> {
        if let Some(output) = &self.output {
            // Overwriting an old file does not cost the same as writing a new one.
            let _ = fs::remove_file(output);
        }
        let before = processor_time_of_children_s()?;
        let start = Instant::now();
        let status = self.command.status().map_err(|e| format!("{}: {e}", self.name))?;
        self.wall_s = self.wall_s.min(start.elapsed().as_secs_f64());
        self.processor_s = self.processor_s.min(processor_time_of_children_s()? - before);
        if status.success() { Ok(()) } else { Err(format!("{}: {status}", self.name)) }
    }
}

/// Returns the processor time of all children that have ended, in seconds: fields 16 and 17 of /proc/self/stat.
fn processor_time_of_children_s() -> Result<f64, String> {
    const TICKS_PER_SECOND: f64 = 100.0;
    let stat = fs::read_to_string("/proc/self/stat")
        .map_err(|e| format!("/proc/self/stat cannot be read (Linux only): {e}"))?;
    // The program's name, in brackets, may contain spaces.
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let ticks = |i: usize| fields.get(i).and_then(|f| f.parse::<f64>().ok()).ok_or("/proc/self/stat is too short");
    Ok((ticks(13)? + ticks(14)?) / TICKS_PER_SECOND)
}
