//! `hzn run`: processes a sequence of pictures and writes the results.

mod args;
mod explain_command;
mod picture_folders;
mod rig;
mod wcs;

use std::cmp::Ordering;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use hzn_core::Config;
use hzn_core::config::Orient;
use hzn_files::frames::Unused;
use hzn_files::{Frames, Sensor};
use hzn_run::engine::{self, End, Finished, Plan};
use hzn_run::open::{Opened, Request};
use hzn_run::sink::{self, Outputs};
use hzn_run::source::{self, Source, ending};
use hzn_run::{disk, explain};

pub(super) use args::{Args, cores};
use explain_command::explain_command;

use super::resume;
use crate::doubts::{
    Airglow, Altitudes, Improbable, MissingPriors, MultiPageFiles, OnePlace, Rates, Refused, Repeats, Shutter, Times,
    ToldSun,
};
use crate::exit::{Exit, Outcome, Stop, usage};
use crate::files;
use crate::progress::Progress;
use crate::refusals::Refusals;
use crate::setup::{self, TableFormat, stop_flag};
use crate::tell;
use crate::what_fits::{Again, ReadAgain, WhatFits};

pub(super) fn run(mut args: Args) -> Outcome {
    setup::list_stdin(&mut args.input, args.source.raw)?;
    let args = &args;
    check_arguments(args)?;
    if let [one] = args.input.as_slice()
        && ending(one) == "toml"
        && hzn_files::rig::is_rig(one)
    {
        return rig::run(args, one);
    }
    let watching = args.watch.then(stop_flag);
    let Opened { mut source, sensor, frames, notes, .. } = open(args, watching.as_ref())?;
    let recorded = recorded(&sensor);
    let plan = args.plan(sensor, frames)?;
    let settings = settings(args, &plan, &recorded);
    let format = TableFormat::or_csv(args.format);
    let (mut output, stored) = Outputs::open(&args.output, format, args.existing(), settings)?;
    let plan = Plan { last: stored.last_answers.clone(), ..plan };
    if !args.quiet {
        tell_notes(&notes, stored.frames, args.writes_pictures());
    }
    let total = source.total();
    let plan = match resume::skip_stored(source.as_mut(), &stored, &plan, &args.output) {
        Ok(turns) => Plan { turns, ..plan },
        Err(stop) => {
            output.put_back()?;
            return Err(stop);
        }
    };
    let mut watch = Watch::new(Progress::new(total, stored.frames, args.quiet), args.quiet);
    let mut copies = wcs::Copies::new(args.wcs.as_deref(), &plan.config);
    let stop = watching.clone().unwrap_or_else(stop_flag);
    tell::detail(|| format!("threads: {}", plan.threads));
    let mut see = |frame: &Finished| {
        copies.count(frame);
        watch.see(frame, &plan.config);
    };
    let end = engine::run(&plan, source.as_mut(), stored.frames, &stop, &mut output, &mut see);
    let summary = watch.summary(&plan.config);
    let end = end?;
    let done = stored.frames + watch.progress.frames();
    let is_interrupted = end == End::Interrupted && args.has_more(done, total);
    output.finish(!is_interrupted)?;
    copies.write(source.as_ref(), args)?;
    let lost = source.describe_loss().filter(|_| end == End::Complete);
    lost.iter().for_each(tell::warning);
    watch.tell(args, &plan);
    let again = watch.look_again(args, &plan).unwrap_or_default();
    if !args.quiet {
        watch.sum_up(args, &plan, source.as_ref(), &again, (&summary, stored.frames));
    }
    watch.tell_doubts(args, &plan, again.fits.as_ref(), end);
    if is_interrupted {
        tell_interruption(done, total, &args.output);
        return Ok(Exit::Interrupted);
    }
    let missed = watch.progress.any_unprocessed() || lost.is_some() || watch.multi_page.files > 0;
    Ok(if missed { Exit::SomeUnreadable } else { Exit::Done })
}

fn settings<'a>(args: &Args, plan: &'a Plan, sensor_toml: &'a str) -> sink::Settings<'a> {
    sink::Settings { config: &plan.config, sensor_toml, durable: args.durable, ros: args.ros, heads: &[] }
}

/// Opens the pictures with their sensor, and refuses what cannot be processed or would replace an input.
fn open(args: &Args, watching: Option<&Arc<AtomicBool>>) -> Result<Opened, Stop> {
    let request = setup::request(&args.input, &args.sensor, &args.source)?;
    let opened = setup::open_request(&Request { watch: watching.cloned(), ..request })?;
    opened.check_size()?;
    opened.check_altitude()?;
    // The check is made only for folders, because the table next to a single picture also lists all others.
    if let Some(frames) = opened.frames.as_ref().filter(|_| args.input.iter().all(|p| p.is_dir())) {
        warn_of_missing_pictures(frames);
    }
    refuse_inputs(args, opened.source.as_ref())?;
    wcs::check(args, opened.source.as_ref(), opened.sensor.config.input.orient)?;
    picture_folders::prepare(args)?;
    Ok(opened)
}

/// Returns the sensor.toml that a recording stores. Its pictures are stored as they were processed, that is, already
/// turned and inverted.
fn recorded(sensor: &Sensor) -> String {
    let text = match sensor.config.input.orient {
        Orient::AsStored => sensor.text.clone(),
        _ => source::with_key(&sensor.text, "input", "orient", "as-stored"),
    };
    if sensor.config.input.invert { source::with_key(&text, "input", "invert", false) } else { text }
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
    Outputs::check(&args.output, args.existing())?;
    if args.no_images && !args.output.iter().any(|p| ending(p) == "mcap") {
        return Err(usage("--no-images: only an MCAP contains pictures; give -o out.mcap, or leave out --no-images"));
    }
    TableFormat::tell_unused(args.format, args.output.iter());
    if args.ros && !args.output.iter().any(|p| ending(p) == "mcap") {
        return Err(usage("--ros: only an MCAP has messages of ROS; give -o out.mcap, or leave out --ros"));
    }
    Ok(())
}

/// Refuses outputs that are also read.
fn refuse_inputs(args: &Args, source: &dyn Source) -> Result<(), Stop> {
    let drawn = picture_folders::check(args, source)?;
    let files = args.output.iter().filter(|path| !source::is_stdin(path));
    let written: Vec<PathBuf> = files.cloned().chain(drawn).collect();
    let request = setup::request(&args.input, &args.sensor, &args.source)?;
    Ok(disk::refuse_inputs(&files::of_sequence(source, &request), &written)?)
}

/// Counts and messages while the run goes on.
struct Watch {
    progress: Progress,
    quiet: bool,
    tipped: bool,
    missing: MissingPriors,
    times: Times,
    rates: Rates,
    one_place: OnePlace,
    improbable: Improbable,
    repeats: Repeats,
    told_sun: ToldSun,
    shutter: Shutter,
    airglow: Airglow,
    altitudes: Altitudes,
    refused: Refused,
    refusals: Refusals,
    multi_page: MultiPageFiles,
    masks: picture_folders::Masks,
    /// Number of pictures that could not be read.
    unreadable: u64,
}

/// Number of unreadable pictures that are reported one by one.
const MAX_UNREADABLE_LISTED: u64 = 20;
/// Number of refused pictures with a limb of another size from which on the answers are doubtful, too.
const DOUBTFUL_REFUSALS: usize = 3;

impl Watch {
    fn new(progress: Progress, quiet: bool) -> Self {
        Self {
            progress,
            quiet,
            tipped: quiet,
            missing: MissingPriors::default(),
            times: Times::default(),
            rates: Rates::default(),
            one_place: OnePlace::default(),
            improbable: Improbable::default(),
            repeats: Repeats::default(),
            told_sun: ToldSun::default(),
            shutter: Shutter::default(),
            airglow: Airglow::default(),
            altitudes: Altitudes::default(),
            refused: Refused::default(),
            refusals: Refusals::default(),
            multi_page: MultiPageFiles::default(),
            masks: picture_folders::Masks::default(),
            unreadable: 0,
        }
    }

    fn see(&mut self, frame: &Finished, config: &Config) {
        self.missing.count(frame);
        self.times.count(frame);
        self.rates.count(frame);
        self.one_place.count(frame);
        self.improbable.count(frame);
        self.repeats.count(frame);
        self.told_sun.count(frame);
        self.shutter.count(frame);
        self.airglow.count(frame, config);
        self.altitudes.count(frame, config);
        self.refused.count(frame);
        self.refusals.count(frame, config);
        self.multi_page.count(frame);
        if !self.quiet {
            self.masks.count(frame, &self.progress);
        }
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
        if tell::tells_pictures() {
            self.progress.say(&picture_line(frame));
        }
        self.progress.count(frame.outcomes.iter().map(|f| f.status()));
    }

    /// Tells what is odd about the pictures.
    fn tell(&self, args: &Args, plan: &Plan) {
        self.missing.tell(plan.frames.as_ref());
        if args.sensor.altitude_km.is_some() {
            self.missing.tell_unused_altitude(plan.frames.as_ref());
        }
        self.times.tell();
        self.rates.tell(mount_of(&plan.config));
        self.one_place.tell();
        self.improbable.tell(&plan.config.gates);
        self.repeats.tell(&plan.config.gates, self.quiet);
        self.told_sun.tell();
        self.multi_page.tell();
    }

    /// Prints the summary, the commonest refusal, and the command that explains it.
    fn sum_up(&self, args: &Args, plan: &Plan, source: &dyn Source, again: &Again, done: (&str, u64)) {
        let (summary, stored) = done;
        let before = match stored {
            0 => String::new(),
            n => format!(" (after {n} that were finished before)"),
        };
        tell::line(format_args!("{summary}{before}"));
        self.masks.tell();
        self.airglow.tell();
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
            again.bars.iter().for_each(|bars| tell::line(format_args!("note: {bars}")));
            again.fits.iter().for_each(|fits| tell::line(format_args!("note: {}", fits.text)));
        }
    }

    /// Looks again at some pictures that were refused for their edges. A quiet run looks only if there are answers to
    /// doubt.
    fn look_again(&self, args: &Args, plan: &Plan) -> Option<Again> {
        let commonest = self.refusals.commonest(&plan.config.gates).filter(|commonest| commonest.is_edge)?;
        let casts_doubt = commonest.is_size && commonest.pictures.len() >= DOUBTFUL_REFUSALS;
        if self.quiet && !(casts_doubt && self.progress.any_answered()) {
            return None;
        }
        let request = request_again(args)?;
        let refused = ReadAgain::read(&request, &plan.config, commonest.pictures)?;
        let fits = commonest.is_size.then(|| refused.what_fits(&request, &plan.config)).flatten();
        let two = ReadAgain::two_values(&request, &plan.config, &self.refusals.of_size());
        Some(Again { bars: refused.bars(&plan.config), fits: two.or(fits) })
    }

    /// Returns the counts of the statuses, in words.
    fn summary(&self, config: &Config) -> String {
        let bodies: Vec<&str> = config.each_body().iter().map(|b| b.kind.name()).collect();
        self.progress.summary(&bodies)
    }

    /// Tells what makes the answers doubtful. An interrupted run does not look at its pictures again.
    fn tell_doubts(&self, args: &Args, plan: &Plan, fits: Option<&WhatFits>, end: End) {
        let is_told = self.tell_doubt(fits);
        if end == End::Complete {
            self.tell_contradictions(args, plan, is_told);
        }
    }

    /// Tells that the answers of the run are doubtful if the limb of refused pictures contradicts what the answers were
    /// computed with. Returns whether it told it.
    // The rows are written by then, and none of them is better than the others.
    fn tell_doubt(&self, fits: Option<&WhatFits>) -> bool {
        let Some(fits) = fits.filter(|fits| fits.pictures >= DOUBTFUL_REFUSALS && self.progress.any_answered()) else {
            return false;
        };
        tell::warning(format_args!(
            "the answers are doubtful: {} refused pictures show a limb of another size than expected ({}). If the \
             lens or the altitude is wrong, the answers are wrong, too, and their sigma does not contain it: the \
             answers have the same lens and the same source of altitudes",
            fits.pictures, fits.text
        ));
        true
    }

    /// Looks again at pictures that contradict their attitudes or rates, and tells which convention or unit would make
    /// them agree.
    fn tell_refused(&self, request: &Request, config: &Config) {
        let read = |indices: Vec<u64>| ReadAgain::read(request, config, &indices);
        if let Some(what) = read(self.refused.of_attitude()).and_then(|r| r.attitude_convention(request, config)) {
            tell::warning(format_args!("the refused pictures agree with each other if {what}"));
        }
        let pairs = self.refused.pairs().into_iter().flat_map(|later| [later.saturating_sub(1), later]);
        // A table whose answers contradict its rates was told already.
        let is_told = self.rates.contradiction(mount_of(config)).is_some();
        let turns = || read(pairs.collect())?.turn_fault(request, config);
        if let Some(what) = (!is_told).then(turns).flatten() {
            tell::warning(format_args!(
                "gates.fixed_edge refuses pictures whose edge moves, but not as rate_x, rate_y, rate_z say: {what}"
            ));
        }
    }

    /// Looks again at some pictures, and tells that the answers are doubtful if they contradict their rates, or all
    /// together what was told of altitude and lens.
    fn tell_contradictions(&self, args: &Args, plan: &Plan, is_told: bool) {
        let config = &plan.config;
        let Some(request) = request_again(args) else { return };
        let read = |indices: Vec<u64>| ReadAgain::read(&request, config, &indices);
        self.tell_refused(&request, config);
        let rates = || read(self.shutter.pictures(config))?.rate_fault(&request, config);
        let limb = || read(self.altitudes.pictures())?.contradiction(&request, config);
        // Refused pictures of another size do not say whether the principal point is their cause.
        let centre = || {
            let is_worth_it = is_told || self.altitudes.are_at_several_places();
            if is_worth_it { read(self.altitudes.with_edge())?.centre_fault(&request, config) } else { None }
        };
        // Wrong rates change the half-angles, too.
        let what = rates().or_else(|| if is_told { None } else { limb() }).or_else(centre);
        if let Some(what) = what {
            tell::warning(format_args!("the answers are doubtful: {what}"));
        }
    }
}

fn mount_of(config: &Config) -> Option<[f64; 4]> {
    config.mount.map(|mount| mount.q_vehicle_from_camera_wxyz)
}

/// Returns the request to read the pictures again; `None` for a stream, which cannot be read twice.
fn request_again(args: &Args) -> Option<Request> {
    let request = setup::request(&args.input, &args.sensor, &args.source).ok()?;
    (!request.inputs.iter().any(|input| source::is_stdin(input))).then_some(request)
}

/// Returns the result of a picture in one line, for example `0001.png: ok 0.031 deg in 4.2 ms`.
fn picture_line(frame: &Finished) -> String {
    let each = frame.outcomes.iter().map(|found| {
        let solution = found.report.as_ref().ok().and_then(|report| report.solution.as_ref());
        let sigma =
            solution.map(|s| format!(" {:.3} deg", s.covariance.sigma_max_rad().to_degrees())).unwrap_or_default();
        format!("{}{sigma} in {:.1} ms", found.status().name(), found.elapsed.as_secs_f64() * 1e3)
    });
    format!("{}: {}", frame.name, each.collect::<Vec<_>>().join("; "))
}

fn tell_interruption(done: u64, total: Option<u64>, outputs: &[PathBuf]) {
    let of = total.map(|n| format!(" of {n}")).unwrap_or_default();
    let names: Vec<String> = outputs.iter().map(|path| path.display().to_string()).collect();
    let next = match names.as_slice() {
        _ if outputs.iter().any(|path| source::is_stdin(path)) => String::new(),
        [] => String::new(),
        [one] => format!("; {one} is valid, and --resume continues it"),
        several => format!("; {} are valid, and --resume continues them", several.join(", ")),
    };
    tell::line(format_args!("interrupted after {done}{of} pictures{next}"));
}

fn warn_of_missing_pictures(frames: &Frames) {
    let Unused { rows, first, other_names } = &frames.unused;
    for row in first {
        tell::warning(frames.problem(row, "no such picture in the folder; the row is not used"));
    }
    if let Some(more) = rows.checked_sub(first.len()).filter(|n| *n > 0) {
        let rows = explain::counted(more as u64, "further row");
        tell::warning(format_args!("{}: {rows} without a picture in the folder", frames.path.display()));
    }
    if let Some(how) = other_names {
        tell::warning(format_args!("{}: {how}; the column file has the names as in the folder", frames.path.display()));
    }
}
