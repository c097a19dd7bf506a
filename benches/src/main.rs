//! Compares hzn-core with the OpenCV recipe: both process the same frames with the same threshold and take turns in one
//! run.
//!
//! Frames are distinct and the caches are flushed before each, because a sensor sees every picture for the first time.
//! Total times are measured without an observer; stages and pixels are measured in further runs with one.
//! `cargo xtask bench` prepares Python and starts this program; `--help` lists the options.
#![forbid(unsafe_code)]

mod cases;
mod goals;
mod observers;
mod opencv;
mod results;
mod sensors;
mod table;

use std::path::PathBuf;
use std::process::ExitCode;

use cases::Case;
use opencv::Recipe;
use results::{CaseResult, Results};
use sensors::Timed;

const HELP: &str = "usage: cargo xtask bench [OPTION]...
  --frames N   distinct frames per case, at least 8 (default 8)
  --rounds N   times that every frame is measured (default 7)
  --only WORD  only cases whose name contains WORD (clean, cloudy, 640x480, ...); book/results/benchmarks.md is not
               written
  --render     render the frames again even if they exist";

/// Options of the command line.
struct Options {
    python: PathBuf,
    frames: usize,
    rounds: usize,
    only: Option<String>,
    render: bool,
}

impl Options {
    fn parse(mut args: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut o = Self { python: "python3".into(), frames: 8, rounds: 7, only: None, render: false };
        while let Some(arg) = args.next() {
            let mut value = || args.next().ok_or_else(|| format!("{arg} needs a value"));
            match arg.as_str() {
                "--python" => o.python = value()?.into(),
                "--frames" => o.frames = value()?.parse().map_err(|e| format!("--frames: {e}"))?,
                "--rounds" => o.rounds = value()?.parse().map_err(|e| format!("--rounds: {e}"))?,
                "--only" => o.only = Some(value()?),
                "--render" => o.render = true,
                _ => return Err(HELP.into()),
            }
        }
        if o.frames < 8 || o.rounds == 0 {
            return Err("--frames must be at least 8 and --rounds at least 1".into());
        }
        Ok(o)
    }
}

fn main() -> ExitCode {
    match Options::parse(std::env::args().skip(1)).and_then(|options| run(&options)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("{e}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Result<(), String> {
    let text = |e: std::io::Error| e.to_string();
    let folder = PathBuf::from(std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into())).join("bench");
    let mut recipe = Recipe::start(&options.python, &folder)?;
    let mut results = Results::new(&recipe, options.frames, options.rounds);
    for plan in cases::plans(options.frames) {
        if options.only.as_ref().is_some_and(|word| !plan.name.contains(word.as_str())) {
            continue;
        }
        let case = plan.prepare(&folder, options.render)?;
        eprintln!("measuring {}", case.name);
        results.push(measure(&case, options.rounds, &mut recipe)?);
    }
    println!("{}", table::markdown(&results));
    let json = serde_json::to_string_pretty(&results).map_err(|e| e.to_string())?;
    std::fs::write(folder.join("results.json"), json).map_err(text)?;
    if options.only.is_none() {
        std::fs::write("book/results/benchmarks.md", table::markdown(&results)).map_err(text)?;
    }
    Ok(())
}

/// Measures one case: in each round, every program processes every frame in turn.
fn measure(case: &Case, rounds: usize, recipe: &mut Recipe) -> Result<CaseResult, String> {
    let mut single = sensors::flight_sensor(&case.sensor)?;
    let mut fewer = sensors::sensor_with_fewer_points(&case.sensor)?;
    let mut double = sensors::host_sensor(&case.sensor)?;
    let mut result = CaseResult::new(case);
    for round in 0..rounds {
        for (i, frame) in case.frames.iter().enumerate() {
            let f32_run = single.measure_cold(case, frame)?;
            let fewer_run = fewer.measure_cold(case, frame)?;
            let f64_run = double.measure_cold(case, frame)?;
            let theirs = recipe.measure(&case.name, i, f32_run.level.max(1))?;
            if round == 0 {
                result.add_answers(frame, [&f32_run, &fewer_run, &f64_run], &theirs);
            }
            result.f32.add_total(i, f32_run.elapsed_us);
            result.fewer.add_total(i, fewer_run.elapsed_us);
            result.f64.add_total(i, f64_run.elapsed_us);
            result.opencv.add_total(i, theirs.total_us);
            for (name, us) in theirs.stages_us {
                result.opencv.add_stage(&name, i, us);
            }
            for (stage, us) in single.measure_stages(case, frame)? {
                result.f32.add_stage(stage, i, us);
            }
            for (stage, us) in double.measure_stages(case, frame)? {
                result.f64.add_stage(stage, i, us);
            }
            result.warm.add_total(i, single.measure_warm(case, frame)?);
        }
    }
    let mut every = sensors::sensor_with_every_point(&case.sensor)?;
    for frame in &case.frames {
        result.add_pixels(single.count_distinct_pixels(case, frame)?, case.pixels());
        let Timed { elapsed_us, points, .. } = every.measure_warm_run(case, frame)?;
        if points > 0 {
            result.ns_a_point.push(elapsed_us * 1e3 / f64::from(points));
        }
    }
    Ok(result)
}
