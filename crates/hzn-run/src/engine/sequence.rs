//! The run over a sequence: threads, channels and tickets, and the sink that takes the results.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};

use super::outcome::Finished;
use super::plan::Plan;
use super::process::process_one;
use super::sensor::AnySensor;
use crate::error::{Error, failed};
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

/// The way in which a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// All pictures are processed.
    Complete,
    /// The run was asked to stop; every picture that was begun is written.
    Interrupted,
}

/// Longest time until written data are flushed.
const FLUSH_EVERY: Duration = Duration::from_millis(200);

struct Job {
    index: u64,
    item: Item,
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
    let threads = plan.threads.max(1);
    let window = 2 * threads + 2;
    let (job_in, job_out) = bounded::<Job>(window);
    let (result_in, result_out) = bounded::<Result<Finished, Error>>(window);
    let (ticket_in, ticket_out) = bounded::<()>(window);
    for _ in 0..window {
        ticket_in.send(()).map_err(Error::failed)?;
    }
    // Set when the writer stops with an error, so that the source ends too.
    let give_up = AtomicBool::new(false);
    let mut turns = plan.turns.clone();
    std::thread::scope(|scope| {
        let stopped = || stop.load(Ordering::Relaxed) || give_up.load(Ordering::Relaxed);
        let source_end = scope.spawn(move || read_source(source, first, &ticket_out, &job_in, stopped));
        for _ in 0..threads {
            let (jobs, results) = (job_out.clone(), result_in.clone());
            scope.spawn(move || process_jobs(plan, &jobs, &results));
        }
        drop((job_out, result_in));
        let mut judged = |frame: &mut Finished| turns.judge(frame, &plan.config);
        let written = write_in_order(first, &result_out, &ticket_in, &mut judged, sink, seen);
        if written.is_err() {
            give_up.store(true, Ordering::Relaxed);
        }
        // With the channels closed, the threads end.
        drop((result_out, ticket_in));
        let read = source_end.join().unwrap_or_else(|_| Err(failed("reading the input failed")));
        written?;
        if stop.load(Ordering::Relaxed) {
            // After Ctrl-C an error of the source is expected, because the same signal can reach it.
            return Ok(End::Interrupted);
        }
        read?;
        Ok(End::Complete)
    })
}

/// Reads the source from picture `first` on, and sends a job for each picture. Every picture takes a ticket.
fn read_source(
    source: &mut dyn Source,
    first: u64,
    tickets: &Receiver<()>,
    jobs: &Sender<Job>,
    stopped: impl Fn() -> bool,
) -> Result<(), Error> {
    for index in first.. {
        if tickets.recv().is_err() || stopped() {
            break;
        }
        match source.next() {
            None => break,
            Some(Err(e)) => return Err(e),
            Some(Ok(item)) => {
                if jobs.send(Job { index, item }).is_err() {
                    break;
                }
            }
        }
    }
    Ok(())
}

/// Processes jobs with a sensor of its own, until there are no more.
fn process_jobs(plan: &Plan, jobs: &Receiver<Job>, results: &Sender<Result<Finished, Error>>) {
    let mut sensor = match AnySensor::new(&plan.config, plan.flight) {
        Ok(sensor) => sensor,
        Err(e) => return drop(results.send(Err(Error::failed(e)))),
    };
    sensor.remember(&plan.last);
    for Job { index, item } in jobs {
        if results.send(process_one(plan, &mut sensor, index, item)).is_err() {
            return;
        }
    }
}

/// Judges and writes the results in the order of the pictures, and returns a ticket for each. Flushes the sink
/// regularly.
fn write_in_order(
    first: u64,
    results: &Receiver<Result<Finished, Error>>,
    tickets: &Sender<()>,
    judge: &mut dyn FnMut(&mut Finished),
    sink: &mut dyn Sink,
    seen: &mut dyn FnMut(&Finished),
) -> Result<(), Error> {
    let mut next = first;
    let mut waiting = BTreeMap::new();
    let mut flush_at: Option<Instant> = None;
    loop {
        let received = match flush_at {
            Some(at) => results.recv_deadline(at),
            None => results.recv().map_err(|_| RecvTimeoutError::Disconnected),
        };
        match received {
            Ok(result) => {
                let frame = result.inspect_err(|_| {
                    // Data written so far must survive the error.
                    let _ = sink.flush();
                })?;
                waiting.insert(frame.index, frame);
                while let Some(mut frame) = waiting.remove(&next) {
                    judge(&mut frame);
                    sink.write(&mut frame)?;
                    seen(&frame);
                    next += 1;
                    flush_at.get_or_insert_with(|| Instant::now() + FLUSH_EVERY);
                    // The source may have ended already; it then needs no ticket.
                    let _ = tickets.try_send(());
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return sink.flush(),
        }
        if flush_at.is_some_and(|at| Instant::now() >= at) {
            sink.flush()?;
            flush_at = None;
        }
    }
}
