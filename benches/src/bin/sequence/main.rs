//! Compares `hzn run` on sequences with decoding alone: PNG, JPEG and headerless pictures of two sizes. Both use the
//! same files, the same decoder and all cores, and take turns in one run.
//!
//! `cargo xtask bench run` builds `hzn` and starts this program. Each way is a separate process, so its start and end
//! count too. The tables show the least wall time and the least processor time of all rounds.
#![forbid(unsafe_code)]

mod flight;
mod way;

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use flight::Sequence;
use hzn_run::source::{self, Raw};
use way::Way;

const HELP: &str = "usage: cargo xtask bench run [OPTION]...
  --frames N   distinct rendered frames of 1920x1080; a quarter as many of 4096x3072 (default 100)
  --rounds N   times that every way is measured (default 7)";

/// Sizes of the pictures, each with the share of `--frames` that is rendered.
const SIZES: [((u16, u16), usize); 2] = [((1920, 1080), 1), ((4096, 3072), 4)];

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let result = match args.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["decode", folder] => decode(Path::new(folder), None),
        ["decode", folder, raw] => raw.parse().and_then(|raw| decode(Path::new(folder), Some(raw))),
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
fn decode(folder: &Path, raw: Option<Raw>) -> Result<(), String> {
    let mut source = source::open(&[folder.to_owned()], raw, None).map_err(|e| e.to_string())?;
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

fn run(options: &Options) -> Result<(), String> {
    let text = |e: std::io::Error| e.to_string();
    let target = PathBuf::from(std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into()));
    let mut page = head(options);
    for (size, share) in SIZES {
        let frames = options.frames.div_ceil(share);
        let sequences = flight::render(&target.join("bench"), size, frames)?;
        let _ = write!(page, "\n## {frames} pictures of {}×{}\n\n{TABLE_HEAD}", size.0, size.1);
        for sequence in sequences {
            let mut ways = Way::all(&sequence, &options.hzn)?;
            for _ in 0..options.rounds {
                ways.iter_mut().try_for_each(Way::measure)?;
            }
            add_rows(&mut page, &sequence, frames, &ways);
        }
    }
    println!("{page}");
    fs::write("book/results/batch.md", page).map_err(text)
}

fn head(options: &Options) -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let load = fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let load = load.split_whitespace().next().unwrap_or("unknown");
    format!(
        "# Batches\n\n`cargo xtask bench run` writes this page. It compares `hzn run` with a program that only decodes \
         the same files with the same decoder. Both use all {cores} cores. The programs take turns in {} rounds, and \
         each time is the shortest of all rounds. The ratio is the time divided by that of decoding alone. Load of the \
         machine at the start: {load}.\n\n\
         A headerless picture is ready as soon as it is read, so its ratios show what hzn and the writing of results \
         cost, and have no goal. `out.mcap` keeps the pictures: PNG and JPEG as they are, headerless pictures as PNG, \
         which must be encoded first. [Where the time goes](speed.md#batches) says why goals are missed.\n",
        options.rounds
    )
}

const TABLE_HEAD: &str = "| files | way | wall, s | pictures per second | ratio | goal | processor time, s | ratio |
|---|---|---|---|---|---|---|---|
";

fn add_rows(page: &mut String, sequence: &Sequence, frames: usize, ways: &[Way]) {
    let Some(alone) = ways.first() else { return };
    for way in ways {
        let goal = way.goal.map_or(String::new(), |g| format!("{g}"));
        let _ = writeln!(
            page,
            "| {}, {:.0} MB | {} | {:.2} | {:.1} | {:.2} | {goal} | {:.2} | {:.2} |",
            sequence.kind,
            sequence.megabytes,
            way.name,
            way.wall_s,
            frames as f64 / way.wall_s,
            way.wall_s / alone.wall_s,
            way.processor_s,
            way.processor_s / alone.processor_s
        );
    }
}
