//! Jobs on all cores, with their results in order.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};

use crate::error::{Error, failed};

/// The work of the threads.
pub(crate) trait Work: Sync {
    /// What is to be processed.
    type Job: Send;
    /// What comes of it.
    type Done: Send;
    /// What each thread has for itself.
    type Worker;

    /// Number of jobs that follow each other on one thread: a block, which begins at each multiple of this number.
    fn block(&self) -> u64 {
        1
    }

    /// Makes what a thread has for itself.
    fn worker(&self) -> Result<Self::Worker, Error>;

    /// Processes one job. An error ends the run.
    fn process(&self, worker: &mut Self::Worker, index: u64, job: Self::Job) -> Result<Self::Done, Error>;
}

/// The destination of the results, in order: a sink with what is done to write to it.
pub(crate) struct InOrder<S, W, F> {
    pub(crate) sink: S,
    pub(crate) write: W,
    pub(crate) flush: F,
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

/// Runs all jobs that `next` returns, on `threads` threads. The first job has the number `first`.
///
/// # Errors
/// The first error of `next`, of the work or of the output; `stop` is then set. What was written before remains.
pub(crate) fn run_in_order<K: Work, S, W, F>(
    work: &K,
    threads: usize,
    next: impl FnMut() -> Option<Result<K::Job, Error>> + Send,
    first: u64,
    stop: &AtomicBool,
    out: &mut InOrder<S, W, F>,
) -> Result<End, Error>
where
    W: FnMut(K::Done, &mut S) -> Result<(), Error>,
    F: FnMut(&mut S) -> Result<(), Error>,
{
    let threads = threads.max(1);
    let block = work.block().max(1);
    // Each thread needs a block of its own, and the writer waits for the first of them.
    let window = if threads > 1 { 2 * threads + 2 + threads * (block as usize - 1) } else { 4 };
    // Threads take single jobs from one lane. Blocks go to the threads in turn, and each of them has its lane.
    let lanes: Vec<_> = (0..if block > 1 { threads } else { 1 }).map(|_| bounded::<(u64, K::Job)>(window)).collect();
    let (result_in, result_out) = bounded::<Numbered<K::Done>>(window);
    let (ticket_in, ticket_out) = bounded::<()>(window);
    for _ in 0..window {
        ticket_in.send(()).map_err(Error::failed)?;
    }
    std::thread::scope(|scope| {
        let stopped = || stop.load(Ordering::Relaxed);
        for (_, jobs) in lanes.iter().cycle().take(threads) {
            let (jobs, results) = (jobs.clone(), result_in.clone());
            scope.spawn(move || process_jobs(work, &jobs, &results));
        }
        drop(result_in);
        // The threads have the only receivers, so that the source ends with them.
        let lanes: Vec<_> = lanes.into_iter().map(|(jobs, _)| jobs).collect();
        let send = move |index: u64, job| {
            let lane = lanes.get((index / block % lanes.len() as u64) as usize);
            lane.is_some_and(|lane| lane.send((index, job)).is_ok())
        };
        let source_end = scope.spawn(move || hand_out(next, first, &ticket_out, send, stopped));
        let written = write_in_order(first, &result_out, &ticket_in, out);
        if written.is_err() {
            // The source must end too, also one that waits for pictures.
            stop.store(true, Ordering::Relaxed);
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

/// A result with the number of its job.
type Numbered<D> = Result<(u64, D), Error>;

/// Hands out the jobs. Every job takes a ticket.
fn hand_out<J>(
    mut next: impl FnMut() -> Option<Result<J, Error>>,
    first: u64,
    tickets: &Receiver<()>,
    send: impl Fn(u64, J) -> bool,
    stopped: impl Fn() -> bool,
) -> Result<(), Error> {
    for index in first.. {
        if tickets.recv().is_err() || stopped() {
            break;
        }
        match next() {
            None => break,
            Some(Err(e)) => return Err(e),
            Some(Ok(job)) => {
                if !send(index, job) {
                    break;
                }
            }
        }
    }
    Ok(())
}

/// Processes jobs with a worker of its own, until there are no more.
fn process_jobs<K: Work>(work: &K, jobs: &Receiver<(u64, K::Job)>, results: &Sender<Numbered<K::Done>>) {
    let mut worker = match work.worker() {
        Ok(worker) => worker,
        Err(e) => return drop(results.send(Err(e))),
    };
    for (index, job) in jobs {
        let done = work.process(&mut worker, index, job).map(|done| (index, done));
        if results.send(done).is_err() {
            return;
        }
    }
}

/// Writes the results in the order of the jobs, and returns a ticket for each. Flushes the sink regularly.
fn write_in_order<D, S, W, F>(
    first: u64,
    results: &Receiver<Numbered<D>>,
    tickets: &Sender<()>,
    out: &mut InOrder<S, W, F>,
) -> Result<(), Error>
where
    W: FnMut(D, &mut S) -> Result<(), Error>,
    F: FnMut(&mut S) -> Result<(), Error>,
{
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
                let (index, done) = result.inspect_err(|_| {
                    // Data written so far must survive the error.
                    let _ = (out.flush)(&mut out.sink);
                })?;
                waiting.insert(index, done);
                while let Some(done) = waiting.remove(&next) {
                    (out.write)(done, &mut out.sink)?;
                    next += 1;
                    flush_at.get_or_insert_with(|| Instant::now() + FLUSH_EVERY);
                    // The source may have ended already; it then needs no ticket.
                    let _ = tickets.try_send(());
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return (out.flush)(&mut out.sink),
        }
        if flush_at.is_some_and(|at| Instant::now() >= at) {
            (out.flush)(&mut out.sink)?;
            flush_at = None;
        }
    }
}
