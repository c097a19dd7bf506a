//! The begin of a run that continues an earlier one: what depends on the epochs before is as if they had just been run.
//!
//! The turns of the heads come from the rows. The checksums of the last pictures and the rows themselves come from a
//! second run of the last epochs, which are compared with what the outputs contain. The brightness at the last limb of
//! a head comes from that one picture.

use std::path::PathBuf;

use super::epochs::{Epoch, Epochs};
use super::levels::Levels;
use super::plan::{HeadPlan, Plan};
use super::start::Start;
use crate::engine::{Turns, Work, process_one};
use crate::error::{Error, Remedy, unusable};
use crate::explain::counted;
use crate::sink::{StoredEpoch, StoredPicture, StoredResults};

/// Returns the number of the epoch from which on a continued run processes the pictures again: the one before the last
/// that the outputs contain, or before the first with a picture or a row that was changed since. `tables` are the files
/// with the data of the pictures; if one was changed, it is the first epoch, and so it is if a sensor uses earlier
/// pictures.
///
/// # Errors
/// The input has other pictures than the results, or a source breaks off.
pub fn run_again_from(
    plan: &Plan,
    epochs: &mut Epochs,
    stored: &StoredResults,
    tables: &[PathBuf],
) -> Result<u64, Error> {
    let uses_earlier = plan.heads.iter().any(|head| head.plan.config.tracks() || head.plan.config.track.is_on());
    let has_changed_table = stored.frames > 0 && tables.iter().any(|table| stored.is_older_than(table));
    let mut from = if uses_earlier || has_changed_table { 0 } else { stored.frames.saturating_sub(2) };
    for (index, stored_epoch) in (0..).zip(&stored.epochs) {
        let Some(epoch) = epochs.next() else {
            let has = counted(stored.frames, "epoch");
            return Err(other_input(format!("the results have {has}, but the input has only {index}")));
        };
        let epoch = epoch?;
        check_names(plan, index, &epoch, stored_epoch)?;
        if stored.is_changed(index, epoch.pictures.iter().flatten().map(|(_, item)| &item.payload)) {
            from = from.min(index.saturating_sub(1));
        }
    }
    // The joint answer of an epoch is compared only together with the epoch before.
    Ok(stored.contradicted_from().map_or(from, |first| from.min(first.saturating_sub(1))))
}

/// Goes on to an epoch in the input, with what the results say of the epochs before. `None` if they do not say all that
/// matters, so that the run has to begin with the first epoch.
///
/// # Errors
/// A source breaks off.
pub fn go_to(plan: &Plan, epochs: &mut Epochs, stored: &StoredResults, from: u64) -> Result<Option<Start>, Error> {
    let before = stored.epochs.get(..from as usize).unwrap_or_default();
    let has_limb = |epoch: &StoredEpoch, head: &HeadPlan| epoch.picture(&head.name).is_some_and(|own| own.is_ok);
    // The epoch of the last limb of each head.
    let last: Vec<Option<usize>> =
        plan.heads.iter().map(|head| before.iter().rposition(|epoch| has_limb(epoch, head))).collect();
    let mut turns: Vec<Turns> = plan.heads.iter().map(|head| head.plan.turns.clone()).collect();
    let mut levels = Levels::new(plan.heads.len());
    for (index, stored_epoch) in before.iter().enumerate() {
        let Some(epoch) = epochs.next() else { return Ok(None) };
        for (k, ((head, turns), picture)) in plan.heads.iter().zip(&mut turns).zip(epoch?.pictures).enumerate() {
            let Some(((number, item), own)) = picture.zip(stored_epoch.picture(&head.name)) else { continue };
            let before = turns.clone();
            turns.replay(item.data.as_ref(), own.time_s, own.answers, &head.plan.config);
            if last.get(k).copied().flatten() == Some(index) {
                let mut frame = process_one(&head.plan, &mut head.plan.worker()?, number, item)?;
                before.clone().judge(&mut frame, &head.plan.config);
                let Some(level) = plan.joiner.level(k, Some(&frame)) else { return Ok(None) };
                levels.see(k, Some(level));
            }
        }
    }
    Ok(Some(Start { epoch: from, turns, levels: Some(levels) }))
}

/// Refuses an input whose heads have other pictures in an epoch than the results.
fn check_names(plan: &Plan, index: u64, epoch: &Epoch, stored: &StoredEpoch) -> Result<(), Error> {
    let mut pictures = 0;
    for (head, picture) in plan.heads.iter().zip(&epoch.pictures) {
        let Some((_, item)) = picture else { continue };
        pictures += 1;
        let has_name = |own: StoredPicture<'_>| own.has_name(&item.name);
        if !stored.picture(&head.name).is_some_and(has_name) {
            let what = format!("the results have another picture of head {} in epoch {index}", head.name);
            return Err(other_input(format!("{what} than the input, {}", item.name)));
        }
    }
    if pictures == stored.pictures() {
        return Ok(());
    }
    let has = counted(stored.pictures() as u64, "picture");
    Err(other_input(format!("the results have {has} in epoch {index}, but the input has {pictures}")))
}

fn other_input(what: String) -> Error {
    unusable(format!("{what}; give the rig.toml and the pictures that they were begun with"))
        .with_remedy(Remedy::Restart)
}
