//! Compares `hzn run` on a sequence of PNGs with decoding alone. Both use the same files, the same decoder and all
//! cores, and take turns in one run.
//!
//! `cargo xtask bench run` builds `hzn` and starts this program. Each way is a separate process, so its start and end
//! count too. The table shows the least wall time and the least processor time of all rounds.
#![forbid(unsafe_code)]

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use hzn_run::source;

const HELP: &str = "usage: cargo xtask bench run [OPTION]...
  --frames N   distinct rendered frames of 1920x1080 (default 100)
  --rounds N   times that every way is measured (default 7)";

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let result = match args.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["decode", folder] => decode(Path::new(folder)),
        _ => Options::parse(args).and_then(|options| run(&options)),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("{e}");
            ExitCode::FAILURE
        }
    }
}

struct Options {
    hzn: PathBuf,
    frames: usize,
    rounds: usize,
}

impl Options {
    fn parse(args: Vec<String>) -> Result<Self, String> {
        let mut o = Self { hzn: "hzn".into(), frames: 100, rounds: 7 };
        let mut args = args.into_iter();
        while let Some(arg) = args.next() {
            let mut value = || args.next().ok_or_else(|| format!("{arg} needs a value"));
            match arg.as_str() {
                "--hzn" => o.hzn = value()?.into(),
                "--frames" => o.frames = value()?.parse().map_err(|e| format!("--frames: {e}"))?,
                "--rounds" => o.rounds = value()?.parse().map_err(|e| format!("--rounds: {e}"))?,
                _ => return Err(HELP.into()),
            }
        }
        if o.frames == 0 || o.rounds == 0 { Err(HELP.into()) } else { Ok(o) }
    }
}

/// Decodes every picture of a folder on all cores, and does nothing else.
fn decode(folder: &Path) -> Result<(), String> {
    let mut source = source::open(&[folder.to_owned()], None, None).map_err(|e| e.to_string())?;
    let mut items = Vec::new();
    while let Some(item) = source.next() {
        items.push(Mutex::new(Some(item.map_err(|e| e.to_string())?)));
    }
    let next = AtomicUsize::new(0);
    let cores = std::thread::available_parallelism().map_or(1, Into::into);
    let work = || -> Result<(), String> {
        while let Some(item) = items.get(next.fetch_add(1, Ordering::Relaxed)) {
            let item = item.lock().ok().and_then(|mut i| i.take()).ok_or("two threads have taken the same picture")?;
            std::hint::black_box(item.payload.decode(None)?);
        }
        Ok(())
    };
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..cores).map(|_| scope.spawn(work)).collect();
        threads.into_iter().try_for_each(|t| t.join().map_err(|_| "a thread ended unexpectedly".to_owned())?)
    })
}

/// One way through the sequence with its best times in seconds.
struct Way {
    name: &'static str,
    /// Goal for the wall time, as a multiple of the time of decoding alone.
    goal: Option<f64>,
    command: Command,
    output: Option<PathBuf>,
    wall_s: f64,
    processor_s: f64,
}

fn run(options: &Options) -> Result<(), String> {
    let text = |e: std::io::Error| e.to_string();
    let target = PathBuf::from(std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into()));
    let folder = target.join("bench").join(format!("run-{}", options.frames));
    let megabytes = render_flight(&folder, options.frames)?;
    let own_program = std::env::current_exe().map_err(text)?;
    let mut ways = vec![Way::new("decoding alone", None, &own_program, &["decode"], &folder, None)];
    for (name, goal, file, more) in [
        ("`hzn run -o out.csv`", Some(1.15), "out.csv", &[][..]),
        ("`hzn run -o out.mcap --no-images`", None, "results.mcap", &["--no-images"]),
        ("`hzn run -o out.mcap`", Some(1.5), "out.mcap", &[]),
    ] {
        let args = [&["run", "--quiet", "--force"][..], more].concat();
        ways.push(Way::new(name, goal, &options.hzn, &args, &folder, Some(folder.join(file))));
    }
    for _ in 0..options.rounds {
        ways.iter_mut().try_for_each(Way::measure)?;
    }
    let table = make_table(&ways, options, megabytes);
    println!("{table}");
    fs::write(target.join("bench").join("run.md"), table).map_err(text)
}

impl Way {
    fn new(
        name: &'static str,
        goal: Option<f64>,
        program: &Path,
        args: &[&str],
        folder: &Path,
        output: Option<PathBuf>,
    ) -> Self {
        let mut command = Command::new(program);
        command.args(args).arg(folder).stdin(Stdio::null());
        if let Some(output) = &output {
            command.arg("-o").arg(output);
        }
        Self { name, goal, command, output, wall_s: f64::INFINITY, processor_s: f64::INFINITY }
    }

    fn measure(&mut self) -> Result<(), String> {
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

/// Writes a rocket flight as a folder with pictures, sensor.toml and frames.csv. Returns the size of the pictures in
/// megabytes.
fn render_flight(folder: &Path, frames: usize) -> Result<f64, String> {
    let text = |e: std::io::Error| format!("{}: {e}", folder.display());
    fs::create_dir_all(folder).map_err(text)?;
    let flight = hzn_sim::flight::rocket(1920, 1080, frames, 5);
    let mut known = String::from("file,time_s,x_km,y_km,z_km\n");
    let mut bytes = 0;
    for frame in &flight.frames {
        let path = folder.join(&frame.file);
        if !path.exists() {
            frame.render().map_err(|e| e.to_string())?.save(&path).map_err(|e| e.to_string())?;
        }
        bytes += fs::metadata(&path).map_err(text)?.len();
        let [x, y, z] = frame.prior().position_m.unwrap_or_default().map(|m| m / 1e3);
        let _ = writeln!(known, "{},{},{x},{y},{z}", frame.file, frame.time_s);
    }
    fs::write(folder.join("frames.csv"), known).map_err(text)?;
    let sensor = toml::to_string(&flight.sensor).map_err(|e| e.to_string())?;
    fs::write(folder.join("sensor.toml"), sensor).map_err(text)?;
    Ok(bytes as f64 / 1e6)
}

fn make_table(ways: &[Way], options: &Options, megabytes: f64) -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let load = fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let load = load.split_whitespace().next().unwrap_or("unknown").to_owned();
    let (frames, rounds) = (options.frames, options.rounds);
    let mut out = format!(
        "`cargo xtask bench run`: {frames} distinct PNGs of 1920x1080 ({megabytes:.0} MB), {cores} cores, {rounds} \
         rounds, in which the ways take turns; the table shows the least time of each way. Load of the machine at the \
         end: {load}.\n\n| way | wall, s | frames per second | ratio | goal | processor time, s | ratio \
         |\n|---|---|---|---|---|---|---|\n"
    );
    let Some(alone) = ways.first() else { return out };
    for way in ways {
        let goal = way.goal.map_or(String::new(), |g| format!("{g}"));
        let _ = writeln!(
            out,
            "| {} | {:.2} | {:.1} | {:.2} | {goal} | {:.2} | {:.2} |",
            way.name,
            way.wall_s,
            frames as f64 / way.wall_s,
            way.wall_s / alone.wall_s,
            way.processor_s,
            way.processor_s / alone.processor_s
        );
    }
    out
}
