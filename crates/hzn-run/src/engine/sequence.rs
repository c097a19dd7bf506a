//! The run over a sequence of one camera.

use std::sync::atomic::AtomicBool;

use super::outcome::Finished;
use super::plan::Plan;
use super::pool::{End, InOrder, Work, run_in_order};
use super::process::process_one;
use super::sensor::AnySensor;
use crate::error::Error;
use crate::mask::MaskOutcome;
use crate::source::{Item, Source};

/// The destination of processed pictures, in order.
pub trait Sink {
    /// Takes one picture; its pixels and its drawing may be moved out of it.
    ///
    /// # Errors
    /// It could not be written; the run ends.
    fn write(&mut self, frame: &mut Finished) -> Result<(), Error>;
    /// Makes everything written so far safe against a crash of this program.
    ///
    /// # Errors
    /// As for `write`.
    fn flush(&mut self) -> Result<(), Error>;
}

/// Runs the sequence from picture `first` on. The caller has skipped the pictures before it.
///
/// # Errors
/// The sink cannot be written, the source breaks off, or an overlay cannot be written. Pictures that were written
/// before remain.
pub fn run(
    plan: &Plan,
    source: &mut dyn Source,
    first: u64,
    stop: &AtomicBool,
    sink: &mut dyn Sink,
    seen: &mut dyn FnMut(&Finished),
) -> Result<End, Error> {
    let mut turns = plan.turns.clone();
    let write = |mut frame: Finished, sink: &mut &mut dyn Sink| {
        turns.judge(&mut frame, &plan.config);
        take_back_mask(plan, &mut frame)?;
        sink.write(&mut frame)?;
        seen(&frame);
        Ok(())
    };
    let mut out = InOrder { sink, write, flush: |sink: &mut &mut dyn Sink| sink.flush() };
    run_in_order(plan, plan.threads, || source.next(), first, stop, &mut out)
}

/// Removes the mask of a picture whose answer was refused after the mask was written: only the sequence of the pictures
/// shows that a limb is fixed in them.
fn take_back_mask(plan: &Plan, frame: &mut Finished) -> Result<(), Error> {
    let has_answer = frame.answers().first().is_some_and(Option::is_some);
    if let Some(masks) = plan.masks.as_ref().filter(|_| !has_answer)
        && matches!(frame.mask, Some(MaskOutcome::Written(_)))
    {
        masks.remove(&frame.name)?;
        frame.mask = Some(MaskOutcome::Missing("no answer".into()));
    }
    Ok(())
}

/// Processes one picture without a sequence, on this thread. The result is that of the first picture of a run.
///
/// # Errors
/// The sensor is refused, or an overlay cannot be written.
pub fn process_alone(plan: &Plan, item: Item) -> Result<Finished, Error> {
    let mut finished = process_one(plan, &mut plan.worker()?, 0, item)?;
    plan.turns.clone().judge(&mut finished, &plan.config);
    Ok(finished)
}

impl Work for Plan {
    type Job = Item;
    type Done = Finished;
    type Worker = AnySensor;

    // The limb is tracked within a block only, so that the rows do not depend on the number of threads.
    fn block(&self) -> u64 {
        if self.config.track.is_on() { self.config.track.full_every.into() } else { 1 }
    }

    fn worker(&self) -> Result<AnySensor, Error> {
        let mut sensor = AnySensor::new(&self.config, self.flight).map_err(Error::failed)?;
        sensor.remember(&self.last);
        Ok(sensor)
    }

    fn process(&self, sensor: &mut AnySensor, index: u64, item: Item) -> Result<Finished, Error> {
        // A run that goes on in the middle of a block begins with a full search, too.
        if self.config.track.is_on() && (index.is_multiple_of(self.block()) || !sensor.is_in_sequence()) {
            sensor.begin_sequence();
        }
        process_one(self, sensor, index, item)
    }
}
