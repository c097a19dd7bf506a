//! `hzn run`: processes a sequence of pictures and writes the results.

use std::cmp::Ordering;
use std::path::{Path, PathBuf};

use hzn_core::config::Orient;
use hzn_files::{Frames, Sensor};
use hzn_run::engine::{self, End, Finished, Plan, Turns};
use hzn_run::open::Opened;
use hzn_run::sink::{self, Existing, Output};
use hzn_run::source::{self, Source, ending};
use hzn_run::{disk, explain};

use super::resume;
use crate::doubts::{MissingPriors, MultiPageFiles, Times};
use crate::exit::{Exit, Outcome, Stop, usage};
use crate::files;
use crate::progress::Progress;
use crate::refusals::{Refusals, quoted, quoted_path};
use crate::setup::{self, InputArgs, SensorArgs, stop_flag};
use crate::{tell, what_fits};

/// Process a sequence of pictures
///
/// Pictures are PNG, JPEG, TIFF, PNM or BMP, in a folder, as a pattern, or one by one; or headerless (--raw); or a
/// video (through ffmpeg on PATH); or an MCAP with an image topic. The pictures of a folder or pattern are sorted by
/// name, and numbers in names are compared by value (img2 before img10). An MCAP of an earlier run is processed again
/// with its own sensor, names, times and positions. A picture that cannot be read becomes a row with status
/// `unreadable`; the run goes on.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A folder, a pattern in quotes, pictures, a video, or an MCAP
    #[arg(required = true, value_name = "INPUT")]
    input: Vec<PathBuf>,
    #[command(flatten)]
    sensor: SensorArgs,
    #[command(flatten)]
    source: InputArgs,
    /// Results: .mcap, .csv or .jsonl; without it, CSV on stdout
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Replace an output that exists
    #[arg(long)]
    force: bool,
    /// Continue an output after its last finished picture
    #[arg(long, conflicts_with = "force", requires = "output")]
    resume: bool,
    /// Wait for the disk at each flush (every 0.2 s), so that even a power cut loses no finished picture
    #[arg(long, requires = "output")]
    durable: bool,
    /// Leave the pictures out of an MCAP
    #[arg(long)]
    no_images: bool,
    /// Draw the result over every picture, as PNG into this folder
    #[arg(long, value_name = "DIR")]
    overlay: Option<PathBuf>,
    /// Number of threads; without it, all cores
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Print no progress and no summary
    #[arg(short, long)]
    quiet: bool,
}

impl Args {
    /// Returns the arguments to process a folder with its own sensor.toml into `output`. An existing output is
    /// replaced, and no progress is printed.
    pub(super) fn quiet_run(folder: &Path, output: &Path) -> Self {
        Self {
            input: vec![folder.to_owned()],
            sensor: SensorArgs { sensor: None, altitude_km: None, flight: false },
            source: InputArgs { frames: None, fps: 1.0, raw: None, topic: None },
            output: Some(output.to_owned()),
            force: true,
            resume: false,
            durable: false,
            no_images: false,
            overlay: None,
            jobs: None,
            quiet: true,
        }
    }
}

pub(super) fn run(args: &Args) -> Outcome {
    check_arguments(args)?;
    let opened = setup::open(&args.input, &args.sensor, &args.source)?;
    opened.check_size()?;
    opened.check_altitude()?;
    let Opened { mut source, sensor, frames, notes, .. } = opened;
    // The check is made only for folders, because the table next to a single picture also lists all others.
    if let Some(frames) = frames.as_ref().filter(|_| args.input.iter().all(|p| p.is_dir())) {
        warn_of_missing_pictures(frames, &source.folder());
    }
    refuse_inputs(args, source.as_ref())?;
    if let Some(drawn) = &args.overlay {
        prepare_overlays(drawn, args.force || args.resume)?;
    }
    let path = args.output.as_deref();
    // A recording stores the pictures as they were processed, that is, already turned and inverted.
    let recorded = match sensor.config.input.orient {
        Orient::AsStored => sensor.text.clone(),
        _ => source::with_key(&sensor.text, "orient", "as-stored"),
    };
    let recorded = if sensor.config.input.invert { source::with_key(&recorded, "invert", false) } else { recorded };
    let plan = plan(args, sensor, frames);
    let settings = sink::Settings { config: &plan.config, sensor_toml: &recorded, durable: args.durable };
    let (mut output, stored) = sink::open(path, existing(args), settings)?;
    let plan = Plan { last: stored.last_answers.clone(), ..plan };
    if !args.quiet {
        tell_notes(&notes, stored.frames, plan.overlay.is_some());
    }
    let total = source.total();
    let plan = match resume::skip_stored(source.as_mut(), &stored, &plan, path) {
        Ok(turns) => Plan { turns, ..plan },
        Err(stop) => {
            output.put_back()?;
            return Err(stop);
        }
    };
    let mut watch = Watch::new(Progress::new(total, stored.frames, args.quiet), args.quiet);
    let stop = stop_flag();
    let end = engine::run(&plan, source.as_mut(), stored.frames, &stop, &mut output, &mut |frame| watch.see(frame));
    let bodies: Vec<&str> = plan.config.each_body().iter().map(|b| b.kind.name()).collect();
    let summary = watch.progress.summary(&bodies);
    let end = end?;
    output.finish()?;
    let lost = source.describe_loss().filter(|_| end == End::Complete);
    lost.iter().for_each(tell::warning);
    watch.missing.tell(plan.frames.as_ref());
    watch.times.tell();
    watch.multi_page.tell();
    if !args.quiet {
        watch.sum_up(args, &plan, source.as_ref(), &summary, stored.frames);
    }
    let done = stored.frames + watch.progress.frames();
    if end == End::Interrupted && total.is_none_or(|n| done < n) {
        tell_interruption(done, total, path);
        return Ok(Exit::Interrupted);
    }
    let missed = watch.progress.any_unprocessed() || lost.is_some() || watch.multi_page.files > 0;
    Ok(if missed { Exit::SomeUnreadable } else { Exit::Done })
}

/// Prints the notes of the pictures, and that a continued run does not draw the pictures of the earlier one.
fn tell_notes(notes: &[String], stored: u64, is_drawn: bool) {
    notes.iter().for_each(|note| tell::line(format_args!("note: {note}")));
    if stored > 0 && is_drawn {
        tell::line(format_args!("note: the {stored} pictures of the earlier run are not drawn again"));
    }
}

/// Refuses arguments that contradict each other, before anything is opened.
fn check_arguments(args: &Args) -> Result<(), Stop> {
    args.output.as_deref().map(sink::target).transpose()?;
    if args.no_images && args.output.as_deref().is_none_or(|p| ending(p) != "mcap") {
        return Err(usage("--no-images: only an MCAP contains pictures; give -o out.mcap, or leave out --no-images"));
    }
    Ok(())
}

/// Refuses outputs that are also read.
fn refuse_inputs(args: &Args, source: &dyn Source) -> Result<(), Stop> {
    if let Some(drawn) = args.overlay.as_deref().filter(|drawn| disk::is_same(drawn, &source.folder())) {
        let what = "is the folder of the pictures, and they would be replaced; choose another folder";
        return Err(usage(format!("--overlay {}: {what}", drawn.display())));
    }
    let drawn = args.overlay.as_deref().map(files::pictures_in).unwrap_or_default();
    let written: Vec<PathBuf> = args.output.iter().cloned().chain(drawn).collect();
    let request = setup::request(&args.input, &args.sensor, &args.source)?;
    Ok(disk::refuse_inputs(&files::of_sequence(source, &request), &written)?)
}

/// Makes the folder of the overlays. If `may_have_files` is true, the folder may already contain files.
fn prepare_overlays(drawn: &Path, may_have_files: bool) -> Result<(), Stop> {
    std::fs::create_dir_all(drawn).map_err(|e| disk::cannot_write(drawn, &e))?;
    let has_files = std::fs::read_dir(drawn).map_err(|e| disk::cannot_write(drawn, &e))?.next().is_some();
    if has_files && !may_have_files {
        let what = "contains files already; choose another folder, or --force replaces files of the same name";
        return Err(usage(format!("--overlay {}: {what}", drawn.display())));
    }
    Ok(())
}

fn existing(args: &Args) -> Existing {
    match (args.force, args.resume) {
        (true, _) => Existing::Replace,
        (_, true) => Existing::Resume,
        _ => Existing::Refuse,
    }
}

fn plan(args: &Args, sensor: Sensor, frames: Option<Frames>) -> Plan {
    let trace = Output::wants_trace(args.output.as_deref());
    // If the threshold or a gate comes from the previous picture, pictures are processed one after another.
    let threads = if sensor.config.tracks() { 1 } else { args.jobs.map_or_else(cores, usize::from) };
    Plan {
        config: sensor.config,
        flight: args.sensor.flight,
        threads,
        frames,
        fps: args.source.fps,
        trace,
        keep_traces: false,
        keep_picture: trace && !args.no_images,
        overlay: args.overlay.clone(),
        last: Vec::new(),
        turns: Turns::default(),
    }
}

/// Counts and messages while the run goes on.
struct Watch {
    progress: Progress,
    quiet: bool,
    tipped: bool,
    missing: MissingPriors,
    times: Times,
    refusals: Refusals,
    multi_page: MultiPageFiles,
    /// Number of pictures that could not be read.
    unreadable: u64,
}

/// Number of unreadable pictures that are reported one by one.
const MAX_UNREADABLE_LISTED: u64 = 20;

impl Watch {
    fn new(progress: Progress, quiet: bool) -> Self {
        Self {
            progress,
            quiet,
            tipped: quiet,
            missing: MissingPriors::default(),
            times: Times::default(),
            refusals: Refusals::default(),
            multi_page: MultiPageFiles::default(),
            unreadable: 0,
        }
    }

    fn see(&mut self, frame: &Finished) {
        self.missing.count(frame);
        self.times.count(frame);
        self.refusals.count(frame);
        self.multi_page.count(frame);
        if let Some(tip) = frame.tip.as_ref().filter(|_| !self.tipped) {
            self.tipped = true;
            self.progress.say(&format!("note: nothing was found in {}: {tip}", frame.name));
        }
        // A picture that cannot be read is unreadable for every body.
        if let Some(e) = frame.unreadable().filter(|_| !self.quiet) {
            self.unreadable += 1;
            match self.unreadable.cmp(&MAX_UNREADABLE_LISTED) {
                Ordering::Less => self.progress.say(&format!("unreadable: {}: {e}", frame.name)),
                Ordering::Equal => self.progress.say(&format!(
                    "unreadable: {}: {e} (further ones are only counted; the results have their reasons)",
                    frame.name
                )),
                Ordering::Greater => {}
            }
        }
        self.progress.count(frame.outcomes.iter().map(|f| f.status()));
    }

    /// Prints the summary, the commonest refusal, and the command that explains it.
    fn sum_up(&self, args: &Args, plan: &Plan, source: &dyn Source, summary: &str, stored: u64) {
        let before = match stored {
            0 => String::new(),
            n => format!(" (after {n} that were finished before)"),
        };
        tell::line(format_args!("{summary}{before}"));
        if let Some(further) = self.refusals.further() {
            tell::line(format_args!("note: {further}"));
        }
        if let Some(commonest) = self.refusals.commonest(&plan.config.gates) {
            let nothing = !self.progress.any_answered() && stored == 0;
            let found = if nothing { "nothing was found in any picture; " } else { "" };
            let more = commonest.pictures.first().map(|frame| {
                let command = explain_command(args, source, *frame);
                format!("; for an explanation and advice: {command}")
            });
            tell::line(format_args!("note: {found}{}{}", commonest.text, more.unwrap_or_default()));
            let request = setup::request(&args.input, &args.sensor, &args.source).ok().filter(|_| commonest.is_size);
            let fits = request.and_then(|r| what_fits::in_pictures(&r, &plan.config, commonest.pictures));
            fits.iter().for_each(|fits| tell::line(format_args!("note: {fits}")));
        }
    }
}

fn tell_interruption(done: u64, total: Option<u64>, path: Option<&Path>) {
    let of = total.map(|n| format!(" of {n}")).unwrap_or_default();
    let next = match path {
        Some(path) => format!("; {} is valid, and --resume continues it", path.display()),
        None => String::new(),
    };
    tell::line(format_args!("interrupted after {done}{of} pictures{next}"));
}

/// Returns the command that explains a picture of this run, ready to be typed.
fn explain_command(args: &Args, source: &dyn Source, frame: u64) -> String {
    let mut words = vec!["hzn".to_owned(), "explain".to_owned()];
    match (source.path(frame), args.input.first()) {
        (Some(path), _) => words.push(quoted_path(&path)),
        (None, input) => {
            words.extend(input.map(|input| quoted_path(input)));
            words.extend(["--index".to_owned(), frame.to_string()]);
        }
    }
    let mut option = |name: &str, value: Option<String>| {
        if let Some(value) = value {
            words.extend([name.to_owned(), quoted(Path::new(&value))]);
        }
    };
    let path = |path: &PathBuf| path.to_string_lossy().into_owned();
    option("--sensor", args.sensor.sensor.as_ref().map(path));
    option("--altitude-km", args.sensor.altitude_km.map(|km| km.to_string()));
    option("--frames", args.source.frames.as_ref().map(path));
    option("--raw", args.source.raw.map(|raw| raw.to_string()));
    option("--topic", args.source.topic.clone());
    if args.sensor.flight {
        words.push("--flight".to_owned());
    }
    words.join(" ")
}

pub(super) fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, Into::into)
}

fn warn_of_missing_pictures(frames: &Frames, folder: &Path) {
    let missing: Vec<_> = frames.rows.iter().filter(|r| !folder.join(&r.file).exists()).collect();
    for row in missing.iter().take(MAX_MISSING_LISTED) {
        tell::warning(frames.problem(row, "no such picture in the folder; the row is not used"));
    }
    if let Some(more) = missing.len().checked_sub(MAX_MISSING_LISTED).filter(|n| *n > 0) {
        let rows = explain::counted(more as u64, "further row");
        tell::warning(format_args!("{}: {rows} without a picture in the folder", frames.path.display()));
    }
}

/// Number of rows without a picture that are reported one by one.
const MAX_MISSING_LISTED: usize = 3;
