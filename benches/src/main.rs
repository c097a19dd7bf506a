//! Compares hzn-core with the OpenCV recipe: both process the same frames with the same threshold and take turns in one
//! run.
//!
//! Frames are distinct, and every frame is measured in three states of the caches ([`state::State`]). Total times are
//! measured without an observer; stages and pixels are measured in further runs with one.
//! `cargo xtask bench` prepares Python and starts this program; `--help` lists the options.
#![forbid(unsafe_code)]

mod cases;
mod goals;
mod growth;
mod memory;
mod observers;
mod opencv;
mod results;
mod sensors;
mod state;
mod table;

use std::path::PathBuf;
use std::process::ExitCode;

use cases::{Case, Plan};
use opencv::Recipe;
use results::{CaseResult, ProgramResult, Results};
use sensors::Measured;
use state::State;

const HELP: &str = "usage: cargo xtask bench [OPTION]...
  --frames N   distinct frames per case, at least 8 (default 8)
  --rounds N   times that every frame is measured (default 7)
  --only WORD  only cases whose name contains WORD (clean, cloudy, 640x480, ...); book/results/benchmarks.md is not
               written
  --no-growth  leaves out the time against the size of the picture
  --render     render the frames again even if they exist";

/// Options of the command line.
struct Options {
    python: PathBuf,
    frames: usize,
    rounds: usize,
    only: Option<String>,
    growth: bool,
    render: bool,
}

impl Options {
    fn parse(mut args: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut o = Self { python: "python3".into(), frames: 8, rounds: 7, only: None, growth: true, render: false };
        while let Some(arg) = args.next() {
            let mut value = || args.next().ok_or_else(|| format!("{arg} needs a value"));
            match arg.as_str() {
                "--python" => o.python = value()?.into(),
                "--frames" => o.frames = value()?.parse().map_err(|e| format!("--frames: {e}"))?,
                "--rounds" => o.rounds = value()?.parse().map_err(|e| format!("--rounds: {e}"))?,
                "--only" => o.only = Some(value()?),
                "--no-growth" => o.growth = false,
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
    let wanted = |plan: &Plan| options.only.as_ref().is_none_or(|word| plan.name.contains(word.as_str()));
    for plan in cases::plans(options.frames).into_iter().filter(wanted) {
        let case = plan.prepare(&folder, options.render)?;
        eprintln!("measuring {}", case.title);
        results.cases.push(measure(&case, options.rounds, &mut recipe)?);
    }
    if options.growth {
        for plan in cases::growth_plans().into_iter().filter(wanted) {
            let case = plan.prepare(&folder, options.render)?;
            eprintln!("measuring the growth: {}", case.title);
            results.growth.push(growth::measure(&case, options.rounds, &mut recipe)?);
        }
    }
    let page = table::markdown(&results);
    println!("{page}");
    let json = serde_json::to_string_pretty(&results).map_err(|e| e.to_string())?;
    std::fs::write(folder.join("results.json"), json).map_err(text)?;
    if options.only.is_none() {
        let book = std::path::Path::new("book/results");
        if options.growth {
            std::fs::write(book.join("figures/growth.svg"), growth::chart(&results.growth)?).map_err(text)?;
        }
        std::fs::write(book.join("benchmarks.md"), page).map_err(text)?;
    }
    Ok(())
}

/// Measures one case: in each round and state of the caches, every program processes every frame in turn.
fn measure(case: &Case, rounds: usize, recipe: &mut Recipe) -> Result<CaseResult, String> {
    let mut single = sensors::flight_sensor(&case.sensor)?;
    let mut fewer = sensors::sensor_with_fewer_points(&case.sensor)?;
    let mut sequence = sensors::sensor_in_sequence(case)?;
    let mut double = sensors::host_sensor(&case.sensor)?;
    let names = [
        "hzn f32",
        "hzn f32, fewer points",
        "hzn f32, in a sequence",
        "hzn f64",
        "recipe, lstsq",
        "recipe, normal equations",
        "recipe, every 8th pixel first",
    ];
    let mut result = CaseResult::new(case, names.map(|name| ProgramResult::new(name, case)).into());
    let (hzn, recipes) = result.programs.split_at_mut(results::RECIPE);
    for round in 0..rounds {
        for (i, frame) in case.frames.iter().enumerate() {
            for state in State::ALL {
                let mut level = 1;
                let sensors: [&mut dyn Measured; 4] = [&mut single, &mut fewer, &mut sequence, &mut double];
                for (sensor, program) in sensors.into_iter().zip(hzn.iter_mut()) {
                    let run = sensor.measure(case, i, state)?;
                    program.add_run(i, state, &run);
                    program.add_stages(i, state, sensor.measure_stages(case, i, state)?);
                    level = run.level.max(1);
                    if round == 0 && state == State::AllFlushed {
                        program.add_found(frame, run.points, run.axis);
                    }
                }
                for (solver, program) in opencv::SOLVERS.into_iter().zip(recipes.iter_mut()) {
                    let answer = recipe.measure(&case.name, i, level, solver, state)?;
                    program.add_answer(i, state, &answer);
                    if round == 0 && state == State::AllFlushed {
                        program.add_found(frame, answer.points, answer.axis);
                        result.large_mib[1] = answer.large_pages_mib;
                    }
                }
            }
        }
    }
    for frame in &case.frames {
        result.pixels_percent.push(single.count_distinct_pixels(case, frame)? as f64 * 100.0 / case.pixels() as f64);
    }
    let points = sensors::sensor_with_every_point(&case.sensor)?.measure_ns_a_point(case)?;
    result.ns_a_point = points.iter().map(|turns| results::median(turns)).collect();
    Ok(result)
}
