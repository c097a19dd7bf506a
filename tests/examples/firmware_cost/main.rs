//! Measures what the firmware costs in QEMU: instructions by stage, and memory. It prints
//! book/results/firmware-cost.md. `--check FILE` compares the result with an earlier one and fails if instructions,
//! flash, static RAM or stack grew by more than 5 %; `--check-sizes FILE` does so for flash and static RAM of the
//! images that are built in every check. `--search FROM TO` prints the most expensive of the pictures made with these
//! seeds. `--hostile FROM TO` does the same with sensors that vary, too, on both boards, and fails if one of the
//! pictures takes more than 20 million instructions, or a unit of work more than its share of them.

mod hostile;
mod pictures;
mod report;

use std::process::ExitCode;

use hzn_tests::emulated::{Board, measure};

use hostile::hostile_pictures;
use pictures::{Sensors, largest_mask, moon, paint_expensive_pictures, usual_sensors};
use report::{Line, lines, read_figures, report, sizes_of_every_check};

/// Prints the most expensive of many pictures, on the M7.
fn search(seeds: std::ops::Range<u32>, sensors: &Sensors) {
    let mut found = Vec::new();
    for from in seeds.clone().step_by(16) {
        let cases = paint_expensive_pictures(from..(from + 16).min(seeds.end), sensors);
        found.extend(lines(&cases, &measure(Board::An500, &cases)));
    }
    found.sort_by(|a, b| b.total.total_cmp(&a.total));
    for line in found.iter().take(20) {
        let stages: Vec<String> = line.stages.iter().map(|n| format!("{n:.0}")).collect();
        println!("{:8.0} {:6.0} {}: {}", line.total, line.work, line.name, stages.join(" "));
    }
}

/// Most instructions of a picture.
const MOST: f64 = 20e6;
/// Most instructions for a unit of work: a flight computer stops a picture after 245 760 units.
const MOST_FOR_A_UNIT: f64 = MOST / 245_760.0;
/// Instructions below which a picture is cheap, so that the parts without units decide what a unit costs.
const CHEAP: f64 = 5e6;

/// Returns the instructions for a unit of work.
fn per_unit(line: &Line) -> f64 {
    line.total / line.work.max(1.0)
}

/// Prints the most expensive hostile pictures of both boards. Returns whether all of them keep the limit.
fn search_hostile(seeds: std::ops::Range<u32>) -> bool {
    let mut keeps = true;
    for board in Board::with_pictures() {
        let mut found = Vec::new();
        for from in seeds.clone().step_by(16) {
            let cases = hostile_pictures(from..(from + 16).min(seeds.end));
            found.extend(lines(&cases, &measure(board, &cases)));
        }
        found.sort_by(|a, b| b.total.total_cmp(&a.total));
        println!("{}: {} pictures", board.core(), found.len());
        for line in found.iter().take(10) {
            let per_unit = per_unit(line);
            let stages: Vec<String> = line.stages.iter().map(|n| format!("{n:.0}")).collect();
            println!("{:8.0} {:6.0} {per_unit:6.1} {}: {}", line.total, line.work, line.name, stages.join(" "));
        }
        let is_true = |line: &Line| line.total * 1e3 <= CHEAP || per_unit(line) <= MOST_FOR_A_UNIT;
        keeps &= found.iter().all(|line| line.total * 1e3 <= MOST && is_true(line));
    }
    keeps
}

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    if let [flag, from, to] = &args[..]
        && let ("--hostile", Ok(from), Ok(to)) = (flag.as_str(), from.parse(), to.parse())
    {
        return if search_hostile(from..to) { ExitCode::SUCCESS } else { ExitCode::FAILURE };
    }
    if let [flag, from, to] = &args[..]
        && let ("--search", Ok(from), Ok(to)) = (flag.as_str(), from.parse(), to.parse())
    {
        for sensors in [usual_sensors(), largest_mask(), moon()] {
            search(from..to, &sensors);
        }
        return ExitCode::SUCCESS;
    }
    match measure_or_check(&args.iter().map(String::as_str).collect::<Vec<_>>()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("{e}");
            ExitCode::FAILURE
        }
    }
}

/// Prints the report and writes it or compares it, or compares only the sizes.
fn measure_or_check(args: &[&str]) -> Result<(), String> {
    if let ["--check-sizes", path] = args {
        return compare(&sizes_of_every_check()?, path);
    }
    let text = report()?;
    print!("{text}");
    match args {
        ["--write", path] => std::fs::write(path, text).map_err(|e| format!("{path}: {e}")),
        ["--check", path] => compare(&read_figures(&text), path),
        _ => Ok(()),
    }
}

/// Compares figures with those of an earlier report. None may have grown by more than 5 %.
fn compare(figures: &[(String, f64)], path: &str) -> Result<(), String> {
    let before = read_figures(&std::fs::read_to_string(path).map_err(|e| format!("{path}: {e}"))?);
    let mut wrong = Vec::new();
    for (name, now) in figures {
        let is_worst = ["worst found", "searches, worst"].iter().any(|part| name.contains(part));
        if is_worst && now * 1e3 > MOST {
            wrong.push(format!("{name}: {now} thousand instructions"));
        }
        match before.iter().find(|(n, _)| n == name) {
            Some((_, then)) if *now > then * 1.05 => wrong.push(format!("{name}: {now}, but {then} in {path}")),
            Some(_) => {}
            None => wrong.push(format!("{name}: {now}, which is not in {path}")),
        }
    }
    if wrong.is_empty() {
        println!("{} figures are at most 5 % above those of {path}", figures.len());
        return Ok(());
    }
    Err(format!("{}\nif this is intended, run cargo xtask firmware --write", wrong.join("\n")))
}
