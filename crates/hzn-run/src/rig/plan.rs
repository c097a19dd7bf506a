//! The run over the epochs of a rig.

use std::sync::atomic::AtomicBool;

use hzn_mcap::{FrameRecord, Row, Stamp};

use super::epochs::{Epoch, Epochs};
use super::joint::Joiner;
use super::memory::Memory;
use super::seen::Repeat;
use super::start::Start;
use crate::engine::{self, AnySensor, End, Finished, InOrder, Sink, Turns, Work, run_in_order};
use crate::error::Error;
use crate::sink::{self, Outputs, all_identities};

/// The settings of a run over a rig.
pub struct Plan {
    /// The settings of each head, in order.
    pub heads: Vec<HeadPlan>,
    /// Joins the answers.
    pub joiner: Joiner,
    /// Number of threads.
    pub threads: usize,
    /// Whether the output stores the pictures of the heads.
    pub keep_pictures: bool,
}

/// The settings of a head.
pub struct HeadPlan {
    /// Its name.
    pub name: String,
    /// The settings of its pictures. The times and the data come with the epochs.
    pub plan: engine::Plan,
}

/// A processed epoch.
pub struct FinishedEpoch {
    /// The joint answer.
    pub joint: Row,
    /// The pictures of the heads; `None` for a head without one.
    pub heads: Vec<Option<Finished>>,
    /// Which of them are other pictures.
    pub repeats: Vec<Option<Repeat>>,
}

/// Runs all epochs from `start` on. `seen` is called for each in order, after it is written.
///
/// # Errors
/// The output cannot be written, or a source breaks off. Epochs that were written before remain.
pub fn run(
    plan: &Plan,
    epochs: &mut Epochs,
    start: Start,
    stop: &AtomicBool,
    output: &mut Outputs,
    seen: &mut dyn FnMut(&FinishedEpoch),
) -> Result<End, Error> {
    let first = start.epoch();
    let mut order = Order::new(plan, start);
    let write = |(index, mut heads): (u64, Vec<Option<Finished>>), output: &mut &mut Outputs| {
        let (joint, repeats) = order.join(index, &mut heads);
        let identity = all_identities(heads.iter().flatten().map(|frame| frame.identity));
        output.write_heads(&records(plan, &joint, &mut heads), identity)?;
        seen(&FinishedEpoch { joint, heads, repeats });
        Ok(())
    };
    let mut out = InOrder { sink: output, write, flush: |output: &mut &mut Outputs| output.flush() };
    run_in_order(plan, plan.threads(), || epochs.next(), first, stop, &mut out)
}

/// Runs all epochs without an output. `seen` is called for each in order.
///
/// # Errors
/// A source breaks off.
pub fn look(
    plan: &Plan,
    epochs: &mut Epochs,
    stop: &AtomicBool,
    seen: &mut dyn FnMut(&FinishedEpoch),
) -> Result<End, Error> {
    let mut order = Order::new(plan, Start::default());
    let write = |(index, mut heads): (u64, Vec<Option<Finished>>), _: &mut ()| {
        let (joint, repeats) = order.join(index, &mut heads);
        seen(&FinishedEpoch { joint, heads, repeats });
        Ok(())
    };
    let mut out = InOrder { sink: (), write, flush: |_: &mut ()| Ok(()) };
    run_in_order(plan, plan.threads(), || epochs.next(), 0, stop, &mut out)
}

/// What depends on the order of the epochs.
struct Order<'a> {
    plan: &'a Plan,
    /// The turns of each head.
    turns: Vec<Turns>,
    memory: Memory,
}

impl<'a> Order<'a> {
    fn new(plan: &'a Plan, start: Start) -> Self {
        let mut turns = start.turns;
        turns.extend(plan.heads.iter().skip(turns.len()).map(|head| head.plan.turns.clone()));
        Self {
            plan,
            turns,
            memory: match start.levels {
                Some(levels) => Memory::with_levels(levels, plan.heads.len()),
                None => Memory::new(plan.heads.len()),
            },
        }
    }

    /// Judges the pictures of the heads, and joins their answers.
    fn join(&mut self, index: u64, heads: &mut [Option<Finished>]) -> (Row, Vec<Option<Repeat>>) {
        let digest = |frame: &Option<Finished>| Some(crc32fast::hash(frame.as_ref()?.picture.as_ref()?));
        let digests: Vec<_> = heads.iter().map(digest).collect();
        let repeats = self.memory.find_repeats(heads, &digests);
        for (frame, (turns, head)) in heads.iter_mut().zip(self.turns.iter_mut().zip(&self.plan.heads)) {
            if let Some(frame) = frame {
                turns.judge(frame, &head.plan.config);
                frame.picture = frame.picture.take().filter(|_| self.plan.keep_pictures);
            }
        }
        let seen = self.memory.see(&self.plan.joiner, heads, &repeats);
        (self.plan.joiner.join(index, &seen), repeats)
    }
}

/// Returns the records of an epoch: those of the joint answer, and those of each head.
fn records(plan: &Plan, joint: &Row, heads: &mut [Option<Finished>]) -> Vec<Vec<FrameRecord>> {
    // The time of the joint answer is that of a head if all were triggered at once.
    let mut stamps = heads.iter().flatten().filter_map(|frame| frame.stamp.as_ref());
    let stamp = stamps.find(|stamp| stamp.is_at(joint.time_s));
    let stamp = stamp.map(|stamp| Stamp { frame_id: None, ..stamp.clone() });
    let mut records = vec![vec![FrameRecord { stamp, ..FrameRecord::new(joint.clone()) }]];
    for (frame, head) in heads.iter_mut().zip(&plan.heads) {
        let own = frame.as_mut().map(|frame| sink::records(frame, &head.plan.config));
        let named = |record: FrameRecord| {
            let row = Row { head: Some(head.name.clone()), ..record.row };
            FrameRecord { row, ..record }
        };
        records.push(own.into_iter().flatten().map(named).collect());
    }
    records
}

impl Plan {
    /// Returns the number of threads. A limb is tracked from the picture before, which has to be on the same thread.
    fn threads(&self) -> usize {
        if self.heads.iter().any(|head| head.plan.config.track.is_on()) { 1 } else { self.threads }
    }
}

impl Work for Plan {
    type Job = Epoch;
    type Done = (u64, Vec<Option<Finished>>);
    type Worker = Vec<AnySensor>;

    fn worker(&self) -> Result<Vec<AnySensor>, Error> {
        self.heads.iter().map(|head| head.plan.worker()).collect()
    }

    fn process(&self, sensors: &mut Vec<AnySensor>, index: u64, epoch: Epoch) -> Result<Self::Done, Error> {
        let heads = self.heads.iter().zip(sensors).zip(epoch.pictures);
        let one = |((head, sensor), picture): ((&HeadPlan, &mut AnySensor), Option<_>)| {
            let Some((number, item)) = picture else { return Ok(None) };
            // The row has the number of the epoch, so that it stands with the rows of the other heads. Repeated
            // pictures are found in all heads at once, by [`Memory`].
            head.plan.process(sensor, number, item).map(|frame| Some(Finished { index, bytes: None, ..frame }))
        };
        Ok((index, heads.map(one).collect::<Result<_, Error>>()?))
    }
}
