//! Runs named steps, measures their time and prints a complete summary.

use std::ffi::OsString;
use std::fmt;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::beside::Beside;

/// Reason why a step did not succeed.
pub(crate) enum Trouble {
    /// The step ran, and something is wrong.
    Failed(String),
    /// The step cannot run here; the text says what it needs.
    Missing(String),
}

impl Trouble {
    /// Returns the text without the kind.
    pub(crate) fn into_message(self) -> String {
        match self {
            Self::Failed(why) | Self::Missing(why) => why,
        }
    }
}

impl From<std::io::Error> for Trouble {
    fn from(e: std::io::Error) -> Self {
        Self::Failed(e.to_string())
    }
}

pub(crate) type Outcome = Result<(), Trouble>;

/// Step with a name, and when it runs.
pub(crate) struct Step {
    pub(crate) name: &'static str,
    pub(crate) tier: Tier,
    pub(crate) run: fn(&mut Steps) -> Outcome,
}

/// When a step runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Tier {
    /// In every check.
    Every,
    /// Only with `--all`, or if its name is given: before a release, and every night.
    All,
}

/// What the arguments of `cargo xtask test` ask for.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Selection {
    /// Whether each step runs with all that it has, and whether the steps of [`Tier::All`] run, too.
    all: bool,
    /// Words that select steps: a step runs if its name contains one of them. If the list is empty, the tier selects.
    words: Vec<String>,
}

impl Selection {
    /// Reads the arguments. Each word must select one of the steps, so that a misspelt one is not a check that passes.
    pub(crate) fn parse(args: &[String], steps: &[Step]) -> Result<Self, String> {
        let (flags, words): (Vec<_>, Vec<_>) = args.iter().cloned().partition(|arg| arg.starts_with('-'));
        if let Some(unknown) = flags.iter().find(|flag| *flag != "--all") {
            return Err(format!("test: the option {unknown} is unknown; there is only --all"));
        }
        if let Some(word) = words.iter().find(|word| !steps.iter().any(|step| step.name.contains(word.as_str()))) {
            let names: Vec<_> = steps.iter().map(|step| step.name).collect();
            return Err(format!("test: no step has {word:?} in its name; the steps are: {}", names.join(", ")));
        }
        Ok(Self { all: !flags.is_empty(), words })
    }

    /// Returns whether the tier selects the steps, and no word.
    pub(crate) fn is_by_tier(&self) -> bool {
        self.words.is_empty()
    }

    /// Returns whether a step runs.
    fn has(&self, step: &Step) -> bool {
        if self.words.is_empty() {
            return self.all || step.tier == Tier::Every;
        }
        self.words.iter().any(|word| step.name.contains(word.as_str()))
    }
}

/// Runs steps and remembers how they ended.
pub(crate) struct Steps {
    /// Whether each step runs with all that it has, not with a small part of it.
    pub(crate) all: bool,
    /// Build of the images for the boards, which the steps that need them wait for.
    pub(crate) images: Beside,
    /// Whether a step that cannot run counts as a failure.
    strict: bool,
    began: Instant,
    done: Vec<(&'static str, Cost, Outcome)>,
    passed: u64,
    failed: u64,
}

impl Steps {
    /// Runs the selected steps, and prints which of them ran. Returns an error if a step failed, or if a step was left
    /// out with `CI=true`. `images` is a build that goes on beside them.
    pub(crate) fn run(steps: &[Step], selection: &Selection, images: Beside) -> Result<(), String> {
        let mut running = Self {
            all: selection.all,
            images,
            strict: std::env::var("CI").is_ok_and(|v| v == "true"),
            began: Instant::now(),
            done: Vec::new(),
            passed: 0,
            failed: 0,
        };
        steps.iter().filter(|step| selection.has(step)).for_each(|step| running.run_step(step));
        running.conclude()
    }

    fn run_step(&mut self, Step { name, run, .. }: &Step) {
        println!("\n== {name}");
        let (start, used) = (Instant::now(), processor_seconds());
        let outcome = run(self);
        let cost =
            Cost { time: start.elapsed(), processor_s: processor_seconds().zip(used).map(|(now, then)| now - then) };
        let word = match &outcome {
            Ok(()) => "ok",
            Err(Trouble::Failed(_)) => "FAILED",
            Err(Trouble::Missing(_)) => "left out",
        };
        println!("== {name}: {word} ({cost})");
        if let Err(Trouble::Failed(why) | Trouble::Missing(why)) = &outcome {
            println!("   {why}");
        }
        self.done.push((name, cost, outcome));
    }

    /// Runs `cargo test` with arguments and adds up its result lines.
    pub(crate) fn cargo_test(&mut self, args: &[&str]) -> Outcome {
        self.count_tests(cargo(&["test", "--no-fail-fast"]).args(args))
    }

    /// Runs a call of `cargo test` and adds up its result lines.
    pub(crate) fn count_tests(&mut self, command: &mut Command) -> Outcome {
        command.stdout(Stdio::piped());
        show(command);
        let mut child = command.spawn()?;
        let out = child.stdout.take().ok_or_else(|| Trouble::Failed("cargo test has no standard output".into()))?;
        for line in BufReader::new(out).lines() {
            let line = line?;
            if let Some((passed, failed)) = parse_counts(&line) {
                self.passed += passed;
                self.failed += failed;
            }
            println!("{line}");
        }
        if child.wait()?.success() {
            Ok(())
        } else {
            Err(Trouble::Failed("a test failed or did not build, see above".into()))
        }
    }

    fn conclude(self) -> Result<(), String> {
        let mut wrong = 0;
        println!("\nsummary, {:.0} s in all", self.began.elapsed().as_secs_f64());
        for (name, cost, outcome) in &self.done {
            let (word, why) = match outcome {
                Ok(()) => ("ok      ", ""),
                Err(Trouble::Failed(why)) => ("FAILED  ", why.as_str()),
                Err(Trouble::Missing(why)) => ("left out", why.as_str()),
            };
            println!("  {word} {cost}  {name}{}{why}", if why.is_empty() { "" } else { ": " });
            let counts = match outcome {
                Ok(()) => false,
                Err(Trouble::Failed(_)) => true,
                Err(Trouble::Missing(_)) => self.strict,
            };
            wrong += u32::from(counts);
        }
        if self.strict && self.done.iter().any(|(_, _, o)| matches!(o, Err(Trouble::Missing(_)))) {
            println!("  CI=true: a step that was left out counts as a failure");
        }
        println!("{} passed, {} failed", self.passed, self.failed);
        match wrong {
            0 => Ok(()),
            n => Err(format!("{n} of {} steps did not succeed", self.done.len())),
        }
    }
}

/// What a step took.
struct Cost {
    time: Duration,
    /// Time of all processors together, s, where the system tells it: it says what a step costs on a busy machine, too.
    processor_s: Option<f64>,
}

impl fmt::Display for Cost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:7.1} s", self.time.as_secs_f64())?;
        self.processor_s.map_or(Ok(()), |used| write!(f, ", {used:7.1} s of processors"))
    }
}

/// Returns the processor time of all programs that this one has run to their end, s. Linux tells it in hundredths.
pub(crate) fn processor_seconds() -> Option<f64> {
    let line = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name of the program, in brackets, may contain spaces. Fields 16 and 17 of proc(5) are user and system time.
    let fields: Vec<_> = line.rsplit(')').next()?.split_whitespace().collect();
    let ticks = |at: usize| fields.get(at)?.parse::<f64>().ok();
    Some((ticks(13)? + ticks(14)?) / 100.0)
}

/// Returns the numbers of passed and failed tests in a line like `test result: ok. 12 passed; 0 failed; ...`.
fn parse_counts(line: &str) -> Option<(u64, u64)> {
    let rest = line.trim_start().strip_prefix("test result: ")?;
    let number = |word: &str| {
        let before = rest.split(word).next()?.trim_end();
        before.rsplit([' ', ';']).next()?.parse().ok()
    };
    Some((number("passed")?, number("failed")?))
}

/// Returns the cargo that runs this program.
pub(crate) fn cargo_program() -> OsString {
    std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into())
}

/// Returns a call of the cargo that runs this program, with the committed versions and without input. Nothing is
/// compiled incrementally: that takes longer the first time, and makes slower programs.
pub(crate) fn cargo(args: &[&str]) -> Command {
    // What follows `--` is for the program that cargo runs.
    let (own, rest) = args.split_at(args.iter().position(|word| *word == "--").unwrap_or(args.len()));
    let mut command = Command::new(cargo_program());
    command.args(own).arg("--locked").args(rest).env("CARGO_INCREMENTAL", "0").stdin(Stdio::null());
    command
}

/// Prints a command as a user would type it.
pub(crate) fn show(command: &Command) {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    let line: Vec<_> = words.map(|w| w.to_string_lossy()).collect();
    println!("$ {}", line.join(" "));
}

/// Runs a command to its end.
pub(crate) fn run(command: &mut Command) -> Outcome {
    command.stdin(Stdio::null());
    show(command);
    let program = Path::new(command.get_program()).file_name().unwrap_or_default().to_string_lossy().into_owned();
    let first = command.get_args().next().unwrap_or_default().to_string_lossy().into_owned();
    let failed = |what: String| Err(Trouble::Failed(format!("`{program} {first}` {what}, see above")));
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => failed(format!("ended with {status}")),
        Err(e) => failed(format!("could not be started: {e}")),
    }
}

/// Fails if two files that were built in different folders differ.
pub(crate) fn compare_bytes(name: &str, here: &Path, there: &Path) -> Outcome {
    if std::fs::read(here)? != std::fs::read(there)? {
        return Err(Trouble::Failed(format!("{name} differs; is everything committed?")));
    }
    println!("{name}: the same bytes");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{Selection, Step, Tier, parse_counts};

    const STEPS: [Step; 3] = [
        Step { name: "lints", tier: Tier::Every, run: |_| Ok(()) },
        Step { name: "tests", tier: Tier::Every, run: |_| Ok(()) },
        Step { name: "killed runs", tier: Tier::All, run: |_| Ok(()) },
    ];

    /// Returns whether each of the steps is selected by the arguments.
    fn selected(args: &[&str]) -> Result<(bool, [bool; 3]), String> {
        let args: Vec<String> = args.iter().map(|&arg| arg.to_owned()).collect();
        let selection = Selection::parse(&args, &STEPS)?;
        Ok((selection.all, STEPS.each_ref().map(|step| selection.has(step))))
    }

    #[test]
    fn a_word_selects_steps_of_every_tier_and_all_is_everything() {
        assert_eq!(selected(&[]), Ok((false, [true, true, false])));
        assert_eq!(selected(&["--all"]), Ok((true, [true, true, true])));
        assert_eq!(selected(&["lint", "run"]), Ok((false, [true, false, true])));
        assert_eq!(selected(&["tests", "--all"]), Ok((true, [false, true, false])));
    }

    #[test]
    fn unknown_words_and_options_are_refused() {
        let refused = selected(&["lints", "wheels"]).unwrap_err();
        assert!(refused.contains("\"wheels\"") && refused.contains("lints, tests, killed runs"), "{refused}");
        let refused = selected(&["--al"]).unwrap_err();
        assert!(refused.contains("--al is unknown"), "{refused}");
    }

    #[test]
    fn result_lines_are_read() {
        let line = "test result: FAILED. 9 passed; 1 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.06s";
        assert_eq!(parse_counts(line), Some((9, 1)));
        assert_eq!(parse_counts("test result: ok. 12 passed; 0 failed; 0 ignored"), Some((12, 0)));
        assert_eq!(parse_counts("test results are fine"), None);
    }
}
