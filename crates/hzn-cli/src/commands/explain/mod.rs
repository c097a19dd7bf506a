//! `hzn explain`: explains the processing of one picture, stage by stage.

mod args;
mod drawing;
mod picture;
mod rig;

use std::path::Path;

use hzn_run::open::Opened;
use hzn_run::source::{self, Item, Source, ending};
use hzn_run::{disk, overlay};

use crate::exit::{Outcome, Stop, usage};
use crate::files;
use crate::setup;
use crate::tell;
pub(super) use args::Args;
use picture::{Explained, explain_item};

pub(super) fn run(args: &Args) -> Outcome {
    if let Some(path) = &args.overlay {
        check_overlay(path)?;
    }
    if ending(&args.frame) == "toml" && hzn_files::rig::is_rig(&args.frame) {
        return rig::run(args, &args.frame);
    }
    let inputs = std::slice::from_ref(&args.frame);
    let opened = setup::open(inputs, &args.sensor, &args.source)?;
    opened.notes.iter().for_each(|note| tell::line(format_args!("note: {note}")));
    opened.check_altitude()?;
    let Opened { mut source, sensor, frames, .. } = opened;
    if let Some(path) = &args.overlay {
        let request = setup::request(inputs, &args.sensor, &args.source)?;
        let read = files::of_sequence(source.as_ref(), &request);
        files::check_outputs(&read, std::slice::from_ref(path), args.force)?;
    }
    let mut item = item(source.as_mut(), args.index)?;
    let data = item.take_prior(frames.as_ref());
    let Explained { exit, drawing } = explain_item(item, &sensor.config, data.as_ref(), "", args)?;
    if let (Some(path), Some(drawing)) = (&args.overlay, drawing) {
        overlay::save(&drawing, path)?;
        tell::line(format_args!("overlay: {}", path.display()));
    }
    Ok(exit)
}

/// Refuses an overlay that is not a PNG, or in a folder that does not exist.
fn check_overlay(path: &Path) -> Result<(), Stop> {
    if source::ending(path) != "png" {
        return Err(usage(format!("{}: the overlay's ending must be .png", path.display())));
    }
    Ok(disk::refuse_missing_folder(path)?)
}

/// Returns picture number `index` of a sequence, counted from 0.
fn item(source: &mut dyn Source, index: u64) -> Result<Item, Stop> {
    let mut item = None;
    for n in 0..=index {
        item = source.next().transpose()?;
        if item.is_none() {
            return Err(usage(format!("--index {index}: the sequence has {n} pictures, numbered from 0")));
        }
    }
    item.ok_or_else(|| usage("the sequence is empty"))
}
