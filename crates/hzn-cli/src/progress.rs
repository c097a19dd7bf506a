//! Progress on stderr: a bar on a terminal, otherwise a line every few seconds.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use hzn_core::status::Status;
use indicatif::{ProgressBar, ProgressStyle};

use crate::tell;

/// Time between two progress lines without a terminal.
const LINE_EVERY: Duration = Duration::from_secs(5);

/// Number of pictures for each status.
pub(crate) type Counts = [u64; Status::ALL.len()];

/// Counts pictures and shows the progress of the run.
pub(crate) struct Progress {
    bar: Option<ProgressBar>,
    quiet: bool,
    total: Option<u64>,
    start: Instant,
    last_line: Instant,
    frames: u64,
    /// Counts for each body, in the order of the sensor.toml.
    bodies: Vec<Counts>,
    /// Number of pictures that were finished before this run.
    before: u64,
}

impl Progress {
    pub(crate) fn new(total: Option<u64>, before: u64, quiet: bool) -> Self {
        let bar = (!quiet && std::io::stderr().is_terminal()).then(|| {
            let bar = match total {
                Some(n) => ProgressBar::new(n),
                None => ProgressBar::no_length(),
            };
            let form = if total.is_some() {
                "{bar:30} {pos}/{len} pictures, {per_sec}, {eta} left  {msg}"
            } else {
                "{spinner} {pos} pictures, {per_sec}  {msg}"
            };
            if let Ok(style) = ProgressStyle::with_template(form) {
                bar.set_style(style);
            }
            bar.set_position(before);
            bar.reset_eta();
            bar
        });
        let now = Instant::now();
        Self { bar, quiet, total, start: now, last_line: now, frames: 0, bodies: Vec::new(), before }
    }

    /// Counts a finished picture; `statuses` are those of its bodies.
    pub(crate) fn count(&mut self, statuses: impl IntoIterator<Item = Status>) {
        self.frames += 1;
        for (i, status) in statuses.into_iter().enumerate() {
            if i == self.bodies.len() {
                self.bodies.push(Counts::default());
            }
            self.bodies[i][status as usize] += 1;
        }
        if let Some(bar) = &self.bar {
            bar.inc(1);
        } else if !self.quiet && self.last_line.elapsed() >= LINE_EVERY {
            self.last_line = Instant::now();
            let done = self.before + self.frames;
            let of = self.total.map(|n| format!(" of {n}")).unwrap_or_default();
            tell::line(format_args!("{done}{of} pictures, {}{}", self.speed(), self.time_left(done)));
        }
    }

    /// Prints a message above the bar.
    pub(crate) fn say(&self, message: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| tell::line(message)),
            None => tell::line(message),
        }
    }

    pub(crate) fn frames(&self) -> u64 {
        self.frames
    }
    /// Returns whether any picture was answered.
    pub(crate) fn any_answered(&self) -> bool {
        self.bodies.iter().any(|counts| counts[Status::Ok as usize] > 0)
    }
    /// Returns whether any picture could not be processed.
    pub(crate) fn any_unprocessed(&self) -> bool {
        let unprocessed = [Status::Unreadable, Status::NoAltitude];
        self.bodies.iter().any(|counts| unprocessed.iter().any(|s| counts[*s as usize] > 0))
    }
    /// Returns the speed: pictures a second, or seconds a picture if they take longer than one.
    fn speed(&self) -> String {
        let rate = self.rate();
        if rate >= 1.0 { format!("{rate:.1} a second") } else { format!("{:.1} s each", 1.0 / rate.max(1e-9)) }
    }
    /// Returns the time that is left, if the number of pictures is known.
    fn time_left(&self, done: u64) -> String {
        let Some(left) = self.total.and_then(|n| n.checked_sub(done)) else { return String::new() };
        let left_s = left as f64 / self.rate().max(1e-9);
        if left_s < 90.0 { format!(", {left_s:.0} s left") } else { format!(", {:.0} min left", left_s / 60.0) }
    }
    fn rate(&self) -> f64 {
        self.frames as f64 / self.start.elapsed().as_secs_f64().max(1e-9)
    }

    /// Removes the bar and returns a summary: `123 pictures: 120 ok, 2 no-limb, 1 unreadable; 85.2 pictures a second`.
    /// With several bodies it is `4 pictures: sun 3 ok, 1 rejected; moon 4 no-limb; 85.2 pictures a second`.
    pub(crate) fn summary(&self, bodies: &[&str]) -> String {
        self.finish();
        let frames = match self.frames {
            0 => return "no pictures".to_owned(),
            1 => "1 picture".to_owned(),
            n => format!("{n} pictures"),
        };
        let parts: Vec<String> = self.bodies.iter().map(count_text).collect();
        let found = match parts.as_slice() {
            [one] => one.clone(),
            several => {
                let named: Vec<String> =
                    bodies.iter().zip(several).map(|(name, part)| format!("{name} {part}")).collect();
                named.join("; ")
            }
        };
        format!("{frames}: {found}; {:.1} pictures a second", self.rate())
    }

    /// Removes the bar.
    pub(crate) fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Returns the counts in words, for example `120 ok, 2 no-limb`.
pub(crate) fn count_text(counts: &Counts) -> String {
    let present = Status::ALL.iter().zip(counts).filter(|(_, n)| **n > 0);
    let parts: Vec<String> = present.map(|(status, n)| format!("{n} {}", status.name())).collect();
    parts.join(", ")
}
