//! Measures what the README's first command costs: a clean clone, an empty target folder, wall time and processor time.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use crate::machine::{root, target};
use crate::steps::{self, Outcome, Trouble, cargo_program, show};
use crate::test_build::build_tests;

/// The first command of the README, without `cargo`.
const FIRST: [&str; 1] = ["demo"];

/// Most processor time of the command, s. The goal on idle cores is half of it; other work on the machine adds to it.
const LIMIT_CPU_S: f64 = 300.0;

/// Measures the command and prints its cost.
pub(crate) fn run() -> Result<(), String> {
    measure_and_compare().map_err(Trouble::into_message)
}

/// Measures the command, and compares its rows with those of the program of the tests.
pub(crate) fn test() -> Outcome {
    build_tests()?;
    measure_and_compare()
}

/// Clones the committed state and runs the command there. What cargo downloads is downloaded before. Fails if it costs
/// too much, or if its rows differ from those of the program of the tests: the profile `first` changes no digit.
fn measure_and_compare() -> Outcome {
    let folder = target().join("xtask").join("first-command");
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    steps::run(Command::new("git").args(["clone", "--quiet"]).arg(root()).arg(&folder))?;
    measure(&folder)?;
    compare_rows(&folder)?;
    Ok(fs::remove_dir_all(&folder)?)
}

fn compare_rows(clone: &Path) -> Outcome {
    let Ok(program) = fs::canonicalize(target().join("debug/hzn")) else {
        println!("the rows are not compared: `cargo xtask test first` builds the other program, too");
        return Ok(());
    };
    let other = clone.join("other-profile");
    fs::create_dir_all(&other)?;
    steps::run(Command::new(program).arg("demo").current_dir(&other))?;
    let mut compare = Command::new("python3");
    compare.arg(root().join("xtask/same_rows.py"));
    steps::run(compare.args([clone, &other].map(|folder| folder.join("hzn-demo/flight.csv"))))
}

fn measure(clone: &Path) -> Outcome {
    let cargo = |args: &[&str]| {
        let mut command = Command::new(cargo_program());
        command.args(args).current_dir(clone).env_remove("CARGO_TARGET_DIR").env_remove("RUSTC_WRAPPER");
        command
    };
    steps::run(&mut cargo(&["fetch", "--locked"]))?;
    let (began, cpu_before_s) = (Instant::now(), children_cpu_s());
    let mut command = cargo(&FIRST);
    show(&command);
    let mut child = command.stdin(Stdio::null()).stderr(Stdio::piped()).spawn()?;
    let mut crates = 0;
    let mut built_s = None;
    for line in child.stderr.take().into_iter().flat_map(|err| BufReader::new(err).lines()) {
        let line = line?;
        crates += u32::from(line.trim_start().starts_with("Compiling "));
        if line.trim_start().starts_with("Finished ") {
            built_s = Some(began.elapsed().as_secs_f64());
        }
        eprintln!("{line}");
    }
    if !child.wait()?.success() {
        return Err(Trouble::Failed("the first command failed, see above".into()));
    }
    let threads = std::thread::available_parallelism().map_or(0, usize::from);
    println!("\n{crates} crates, {threads} hardware threads");
    println!("wall time: {:.0} s, of which {:.0} s build", began.elapsed().as_secs_f64(), built_s.unwrap_or(f64::NAN));
    let Some(used_s) = cpu_before_s.zip(children_cpu_s()).map(|(before_s, after_s)| after_s - before_s) else {
        println!("processor time: unknown, this system has no /proc/self/stat");
        return Ok(());
    };
    println!("processor time: {used_s:.0} s");
    if used_s > LIMIT_CPU_S {
        return Err(Trouble::Failed(format!("the first command takes {used_s:.0} s, more than {LIMIT_CPU_S} s")));
    }
    Ok(())
}

/// Returns the processor time of all processes that this program has started and that have ended, with their children.
fn children_cpu_s() -> Option<f64> {
    parse_children_cpu_s(&fs::read_to_string("/proc/self/stat").ok()?)
}

/// Reads the fields `cutime` and `cstime` (16 and 17, man 5 proc_pid_stat), in ticks of 10 ms. The name of the program
/// is in parentheses and may contain spaces.
fn parse_children_cpu_s(stat: &str) -> Option<f64> {
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(13);
    let mut next = || fields.next()?.parse::<f64>().ok();
    Some((next()? + next()?) / 100.0)
}

#[cfg(test)]
mod tests {
    use super::parse_children_cpu_s;

    #[test]
    fn processor_time_of_children_is_read() {
        let stat = "7 (a (b) c) S 1 7 7 0 -1 4194560 9 8 0 0 11 12 345 55 20 0 1 0 99 1000 20";
        assert_eq!(parse_children_cpu_s(stat), Some(4.0));
        assert_eq!(parse_children_cpu_s("7 (a) S 1"), None);
    }
}
