//! `hzn run rig.toml`: processes the pictures of several cameras that are one sensor.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use hzn_core::status::Status;
use hzn_run::engine::End;
use hzn_run::rig::{self, Epochs, FinishedEpoch, HeadPlan, Opened, Plan, Request, Start};
use hzn_run::sink::{self, Outputs, StoredResults};
use hzn_run::{disk, explain, source};

use super::args::Args;
use crate::doubts::{Contradictions, Improbable, MissingPriors};
use crate::exit::{Exit, Outcome, Stop, usage};
use crate::limbs_of_rig::LimbsOfRig;
use crate::progress::{Counts, Progress, count_text};
use crate::setup::{TableFormat, stop_flag};
use crate::tell;

pub(super) fn run(args: &Args, path: &Path) -> Outcome {
    check(args)?;
    let request = Request {
        rig: path.to_owned(),
        frames: args.source.frames.clone(),
        raw: args.source.raw,
        altitude_km: args.sensor.altitude_km,
        flight: args.sensor.flight,
    };
    let opened = rig::open(&request)?;
    opened.warnings.iter().for_each(tell::warning);
    let files: Vec<_> = args.output.iter().filter(|path| !source::is_stdin(path)).cloned().collect();
    disk::refuse_inputs(&opened.files, &files)?;
    if !args.quiet {
        opened.notes.iter().for_each(|note| tell::line(format_args!("note: {note}")));
    }
    let plan = plan(args, &opened)?;
    let texts: Vec<_> = opened.heads.iter().map(|head| head.sensor.text.clone()).collect();
    let (total, text) = (opened.pictures(), opened.text.clone());
    let (rig, false_alarm) = (opened.rig.clone(), opened.rig.rig.false_alarm);
    let mut input = Input { request, tables: tables(&opened), epochs: epochs(opened)? };
    let heads: Vec<_> =
        plan.heads.iter().zip(texts).map(|(head, text)| (head.name.clone(), &head.plan.config, text)).collect();
    let Some((_, config, _)) = heads.first() else { return Err(usage(format!("{}: has no head", path.display()))) };
    let settings = sink::Settings { config, sensor_toml: &text, durable: args.durable, ros: args.ros, heads: &heads };
    let (mut output, stored) =
        Outputs::open(&args.output, TableFormat::or_csv(args.format), args.existing(), settings)?;
    let start = match input.go_on(&plan, &stored) {
        Ok(start) => start,
        Err(stop) => {
            output.put_back()?;
            return Err(stop);
        }
    };
    output.run_again_from(start.epoch());
    let done = stored.epochs.iter().map(|epoch| epoch.pictures() as u64).sum();
    let limbs = LimbsOfRig::new(&rig, &plan.joiner);
    let mut watch = Watch::new(args.quiet, total, (stored.frames, done), limbs);
    let end =
        rig::run(&plan, &mut input.epochs, start, &stop_flag(), &mut output, &mut |epoch| watch.see(epoch, &plan));
    let summary = watch.progress.summary(&[]);
    let end = match end {
        Ok(end) => end,
        Err(error) if stored.frames > 0 && !output.has_written() => {
            output.put_back()?;
            return Err(error.into());
        }
        Err(error) => return Err(error.into()),
    };
    output.finish(end == End::Complete)?;
    let epochs = input.epochs;
    let lost = epochs.describe_loss().filter(|_| end == End::Complete);
    lost.iter().chain(&epochs.warnings()).for_each(tell::warning);
    watch.tell(&plan, &summary, false_alarm);
    if end == End::Interrupted {
        tell::line(format_args!("interrupted after {}", explain::counted(watch.stored + watch.epochs, "epoch")));
        return Ok(Exit::Interrupted);
    }
    Ok(watch.exit(lost.is_some()))
}

/// The pictures of the heads, which are read again where a run is continued.
struct Input {
    request: Request,
    /// The files with the data of the pictures.
    tables: Vec<PathBuf>,
    epochs: Epochs,
}

impl Input {
    /// Goes on to the place where a continued run begins. Without results it is the first epoch.
    fn go_on(&mut self, plan: &Plan, stored: &StoredResults) -> Result<Start, Stop> {
        if stored.frames == 0 {
            return Ok(Start::default());
        }
        let from = rig::run_again_from(plan, &mut self.epochs, stored, &self.tables)?;
        self.open_again()?;
        if let Some(start) = rig::go_to(plan, &mut self.epochs, stored, from)? {
            return Ok(start);
        }
        self.open_again()?;
        Ok(Start::default())
    }

    fn open_again(&mut self) -> Result<(), Stop> {
        self.epochs = epochs(rig::open(&self.request)?)?;
        Ok(())
    }
}

fn epochs(opened: Opened) -> Result<Epochs, Stop> {
    Ok(Epochs::new(opened.heads, opened.rig.rig.sync_s)?)
}

/// Returns the tables of the vehicle and of the heads.
fn tables(opened: &Opened) -> Vec<PathBuf> {
    let own = opened.heads.iter().filter_map(|head| head.frames.as_ref());
    opened.frames.as_deref().into_iter().chain(own).map(|frames| frames.path.clone()).collect()
}

/// Refuses the options that have no meaning for several cameras, or that are not built for them.
fn check(args: &Args) -> Result<(), Stop> {
    let refused = [
        ("--sensor", args.sensor.sensor.is_some(), "each head has a sensor of its own: write it into rig.toml"),
        ("--topic", args.source.topic.is_some(), "name the pictures of each head in rig.toml"),
        ("--overlay", args.overlay.is_some(), "draw the pictures of one head: hzn run FOLDER --overlay DIR"),
        ("--mask-pictures", args.mask_pictures.is_some(), "use one head: hzn run FOLDER --mask-pictures DIR"),
        ("--wcs", args.wcs.is_some(), "use one head: hzn run FOLDER --wcs DIR"),
        ("--watch", args.watch, "watch the folder of one head"),
    ];
    match refused.into_iter().find(|(_, is_given, _)| *is_given) {
        Some((option, _, what)) => Err(usage(format!("{option} is not possible with a rig.toml: {what}"))),
        None => Ok(()),
    }
}

fn plan(args: &Args, opened: &Opened) -> Result<Plan, Stop> {
    let is_mcap = Outputs::want_trace(&args.output);
    let heads: Vec<HeadPlan> = opened
        .heads
        .iter()
        .map(|head| {
            let plan = args.rig_plan(head.sensor.clone())?;
            Ok(HeadPlan { name: head.name.clone(), plan })
        })
        .collect::<Result<_, Stop>>()?;
    let threads = heads.iter().map(|head| head.plan.threads).min().unwrap_or(1);
    Ok(Plan { heads, joiner: opened.joiner()?, threads, keep_pictures: is_mcap && !args.no_images })
}

/// Number of pictures that are reported one by one.
const MAX_LISTED: u64 = 20;
/// Most epochs whose limbs are compared with the mounts at the end, evenly spread.
const MOST_EPOCHS: usize = 2000;

/// Counts and messages while the run goes on.
struct Watch {
    progress: Progress,
    quiet: bool,
    missing: MissingPriors,
    unreadable: u64,
    epochs: u64,
    /// Number of epochs that the outputs contained before this run.
    stored: u64,
    /// The statuses of the joint answers.
    joint: Counts,
    /// Number of epochs in which a head was excluded.
    excluded: BTreeMap<String, u64>,
    contradictions: Contradictions,
    /// Answers of each head whose edge is more likely no limb.
    improbable: Vec<Improbable>,
    /// Number of epochs that the heads together refuse, by the reason.
    refused: BTreeMap<String, u64>,
    /// What the heads see together, to compare it with the mounts at the end.
    limbs: LimbsOfRig,
}

impl Watch {
    /// `done` has the numbers of epochs and of pictures that the outputs contain already.
    fn new(quiet: bool, pictures: Option<u64>, done: (u64, u64), limbs: LimbsOfRig) -> Self {
        let (stored, done) = done;
        let progress = Progress::new(pictures, done, quiet);
        let missing = MissingPriors::default();
        Self {
            progress,
            quiet,
            missing,
            unreadable: 0,
            epochs: 0,
            stored,
            joint: Counts::default(),
            excluded: BTreeMap::new(),
            contradictions: Contradictions::default(),
            improbable: Vec::new(),
            refused: BTreeMap::new(),
            limbs,
        }
    }

    fn see(&mut self, epoch: &FinishedEpoch, plan: &Plan) {
        if epoch.joint.index < self.stored {
            return;
        }
        self.epochs += 1;
        if let Some(count) = self.joint.get_mut(epoch.joint.status as usize) {
            *count += 1;
        }
        let excluded = epoch.joint.heads_excluded.is_some();
        self.contradictions.count(epoch.joint.status == Status::Ok, &epoch.joint.detail, excluded);
        self.limbs.add(epoch, &plan.joiner, true);
        self.limbs.thin_out(MOST_EPOCHS);
        self.improbable.resize_with(plan.heads.len(), Improbable::default);
        for (frame, improbable) in epoch.heads.iter().zip(&mut self.improbable) {
            frame.iter().for_each(|frame| improbable.count(frame));
        }
        if epoch.joint.status == Status::Rejected {
            let why = epoch.joint.detail.split(';').next().unwrap_or_default();
            *self.refused.entry(why.to_owned()).or_default() += 1;
        }
        for head in epoch.joint.heads_excluded.iter().flat_map(|heads| heads.split(' ')) {
            *self.excluded.entry(head.to_owned()).or_default() += 1;
        }
        for (frame, head) in epoch.heads.iter().zip(&plan.heads) {
            let Some(frame) = frame else { continue };
            self.missing.count(frame);
            if let Some(why) = frame.unreadable() {
                self.unreadable += 1;
                if !self.quiet && self.unreadable <= MAX_LISTED {
                    self.progress.say(&format!("unreadable: {}: {}: {why}", head.name, frame.name));
                }
            }
            // The joint answer is about the first body.
            self.progress.count(frame.outcomes.iter().map(|outcome| outcome.status()).take(1));
        }
    }

    /// Returns the exit of a run that came to its end; `is_lossy` says that pictures could not be handed out.
    fn exit(&self, is_lossy: bool) -> Exit {
        let is_unread = self.progress.any_unprocessed() || self.unreadable > 0 || is_lossy;
        if is_unread { Exit::SomeUnreadable } else { Exit::Done }
    }

    /// Tells what is odd about the answers, and sums them up.
    fn tell(&self, plan: &Plan, summary: &str, false_alarm: f64) {
        self.missing.tell(None);
        for (improbable, head) in self.improbable.iter().zip(&plan.heads) {
            improbable.tell_of_head(&head.name, &head.plan.config.gates);
        }
        if !self.quiet {
            self.sum_up(summary, false_alarm);
        }
        // It is told in a quiet run, too: a program that reads only the statuses takes the other answers.
        let doubt = self.contradictions.describe_doubt(false_alarm);
        doubt.iter().for_each(tell::warning);
        // Each epoch may hide an error that is the same in all.
        if doubt.is_none() && self.joint[Status::Ok as usize] > 0 {
            let what = self.limbs.contradiction().map(|what| {
                format!(
                    "the answers are doubtful: over the whole run the heads contradict the mounts of rig.toml, \
                     although each epoch alone hides it: {what}. The sigma of the answers does not contain it: see \
                     `hzn calibrate rig --check`"
                )
            });
            what.iter().for_each(tell::warning);
        }
    }

    fn sum_up(&self, summary: &str, false_alarm: f64) {
        tell::line(summary);
        let before = match self.stored {
            0 => String::new(),
            stored => format!(" (after {stored} that were finished before)"),
        };
        tell::line(format_args!("{}: {}{before}", explain::counted(self.epochs, "epoch"), count_text(&self.joint)));
        if let Some((why, epochs)) = self.refused.iter().max_by_key(|(_, epochs)| **epochs) {
            let epochs = explain::counted(*epochs, "epoch");
            tell::line(format_args!(
                "note: {epochs} rejected as {why} (column detail; the heads' own rows are below it)"
            ));
        }
        if self.contradictions.is_in_all(false_alarm) {
            tell::line(
                "note: the heads contradict each other in every epoch: are the mounts in rig.toml those of these heads \
                 (not exchanged, not inverted, q_vehicle_from_camera_wxyz with the scalar first), are the pictures of \
                 each head its own and not mirrored, and do all heads have the same clock?",
            );
        }
        for (head, epochs) in &self.excluded {
            let epochs = explain::counted(*epochs, "epoch");
            tell::line(format_args!("note: head {head} was excluded in {epochs} (column heads_excluded)"));
        }
    }
}
