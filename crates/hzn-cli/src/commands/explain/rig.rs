//! `hzn explain rig.toml`: explains the pictures of one epoch, head by head, and their joint answer.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use hzn_mcap::Row;
use hzn_run::overlay;
use hzn_run::rig::{self, Epochs, HeadPlan, Opened, Plan, Request};
use image::{RgbImage, imageops};

use super::args::Args;
use super::picture::explain_item;
use crate::commands::run::{Args as RunArgs, cores};
use crate::exit::{Exit, Outcome, Stop, usage};
use crate::{files, tell};

/// Space between the pictures of two heads, in pixels.
const GAP: u32 = 8;

pub(super) fn run(args: &Args, path: &Path) -> Outcome {
    check(args)?;
    let opened = open(args, path)?;
    opened.warnings.iter().for_each(tell::warning);
    opened.notes.iter().for_each(|note| tell::line(format_args!("note: {note}")));
    if let Some(overlay) = &args.overlay {
        files::check_outputs(&opened.files, std::slice::from_ref(overlay), args.force)?;
    }
    let sync_s = opened.rig.rig.sync_s;
    let heads: Vec<_> = opened.heads.iter().map(|head| (head.name.clone(), head.sensor.config.clone())).collect();
    // The joint answer also depends on the epochs before, so all of them are processed, as `hzn run` does.
    let joint = joint(args, open(args, path)?)?;
    let mut epochs = Epochs::new(opened.heads, sync_s)?;
    let none = || usage(format!("--index {}: the rig has fewer epochs; they are numbered from 0", args.index));
    let epoch = epochs.nth(args.index as usize).transpose()?.ok_or_else(none)?;
    let (mut exit, mut drawings) = (Exit::Done, Vec::new());
    for ((name, config), item) in heads.iter().zip(epoch.into_pictures()) {
        tell::result(format_args!("head {name}\n"))?;
        let Some(mut item) = item else {
            tell::result("It has no picture in this epoch.\n\n")?;
            continue;
        };
        let data = item.take_prior(None);
        let explained = explain_item(item, config, data.as_ref(), &format!("{name}: "), args)?;
        if explained.exit == Exit::SomeUnreadable {
            exit = Exit::SomeUnreadable;
        }
        drawings.extend(explained.drawing);
        tell::result("\n")?;
    }
    tell::result(describe(&joint))?;
    if let (Some(path), false) = (&args.overlay, drawings.is_empty()) {
        overlay::save(&side_by_side(&drawings), path)?;
        tell::line(format_args!("overlay: {}", path.display()));
    }
    Ok(exit)
}

/// Refuses the options that have no meaning for several cameras.
fn check(args: &Args) -> Result<(), Stop> {
    let refused = [
        ("--sensor", args.sensor.sensor.is_some(), "each head has a sensor of its own: write it into rig.toml"),
        ("--topic", args.source.topic.is_some(), "name the pictures of each head in rig.toml"),
    ];
    match refused.into_iter().find(|(_, is_given, _)| *is_given) {
        Some((option, _, what)) => Err(usage(format!("{option} is not possible with a rig.toml: {what}"))),
        None => Ok(()),
    }
}

fn open(args: &Args, path: &Path) -> Result<Opened, Stop> {
    Ok(rig::open(&Request {
        rig: path.to_owned(),
        frames: args.source.frames.clone(),
        raw: args.source.raw,
        altitude_km: args.sensor.altitude_km,
        flight: args.sensor.flight,
    })?)
}

/// Returns the joint answer of the epoch.
fn joint(args: &Args, opened: Opened) -> Result<Row, Stop> {
    let mut run = RunArgs::quiet_run(Path::new(""), Path::new(""));
    run.sensor = args.sensor.clone();
    let head = |head: &rig::OpenHead| {
        let plan = run.rig_plan(head.sensor.clone())?;
        Ok(HeadPlan { name: head.name.clone(), plan })
    };
    let heads = opened.heads.iter().map(head).collect::<Result<Vec<_>, Stop>>()?;
    let threads = heads.iter().map(|head| head.plan.threads).min().unwrap_or_else(cores);
    let plan = Plan { heads, joiner: opened.joiner()?, threads, keep_pictures: false };
    let mut epochs = Epochs::new(opened.heads, opened.rig.rig.sync_s)?;
    let (mut joint, stop, mut seen) = (None, AtomicBool::new(false), 0u64);
    rig::look(&plan, &mut epochs, &stop, &mut |epoch| {
        seen += 1;
        if epoch.joint.index == args.index {
            joint = Some(epoch.joint.clone());
            stop.store(true, Ordering::Relaxed);
        }
    })?;
    joint.ok_or_else(|| usage(format!("--index {}: the rig has {seen} epochs, numbered from 0", args.index)))
}

/// Returns the joint answer in words.
fn describe(row: &Row) -> String {
    let mut lines = vec![format!("rig: {}", row.status)];
    let mut line = |name: &str, text: Option<String>| {
        if let Some(text) = text.filter(|text| !text.is_empty()) {
            lines.push(format!("  {name:<12} {text}"));
        }
    };
    line("detail", Some(row.detail.clone()));
    line("heads", row.heads_used.as_ref().map(|heads| format!("used: {heads}")));
    line("excluded", row.heads_excluded.clone());
    let separation = row.separation_deg.zip(row.separation_limit_deg);
    line(
        "check",
        separation.map(|(own, limit)| format!("the heads are at most {own:.4} deg apart, the limit is {limit:.4} deg")),
    );
    let axis = row.axis_x.zip(row.axis_y).zip(row.axis_z);
    line("axis", axis.map(|((x, y), z)| format!("{x:+.6} {y:+.6} {z:+.6} in the axes of the vehicle")));
    line("sigma", row.sigma_max_deg.map(|sigma| format!("{sigma:.4} deg in the worst direction")));
    line("protection", row.protection_deg.map(|deg| format!("{deg:.4} deg")));
    line("altitude", row.altitude_est_km.map(|km| format!("{km:.2} km, from the half-angle")));
    let height = row.limb_height_est_km.zip(row.limb_height_est_sigma_km);
    line("limb height", height.map(|(km, sigma)| format!("{km:.2} +- {sigma:.2} km")));
    let coarse = row.coarse_x.zip(row.coarse_y).zip(row.coarse_z).zip(row.coarse_sigma_deg);
    line(
        "coarse",
        coarse.map(|(((x, y), z), sigma)| {
            format!("{x:+.3} {y:+.3} {z:+.3} +- {sigma:.1} deg: what the heads see of Earth and sky; this is no answer")
        }),
    );
    lines.join("\n") + "\n"
}

/// Returns the pictures of the heads in one picture: two side by side, others below them.
fn side_by_side(drawings: &[RgbImage]) -> RgbImage {
    let width = drawings.iter().map(RgbImage::width).max().unwrap_or(0);
    let height = drawings.iter().map(RgbImage::height).max().unwrap_or(0);
    let columns = drawings.len().clamp(1, 2) as u32;
    let rows = (drawings.len() as u32).div_ceil(columns);
    let size = |each: u32, count: u32| each * count + GAP * count.saturating_sub(1);
    let mut all = RgbImage::new(size(width, columns), size(height, rows));
    for (n, drawing) in (0u32..).zip(drawings) {
        let at = |each: u32, place: u32| i64::from((each + GAP) * place);
        imageops::replace(&mut all, drawing, at(width, n % columns), at(height, n / columns));
    }
    all
}
