//! Longer work on a file, on a separate thread, with progress and a way to stop.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, bounded};

use super::Wake;

/// Result of a job.
#[derive(Debug, PartialEq, Eq)]
pub enum Done {
    /// A file was written.
    Written(PathBuf),
    /// A sequence was rendered into this folder.
    Rendered(PathBuf),
    /// A recording was recovered.
    Recovered {
        /// Path of the recovered recording.
        path: PathBuf,
        /// Number of pictures in the recovered recording.
        frames: u64,
    },
}

/// Reason why a job has no result. In both cases no file is left.
#[derive(Debug, PartialEq, Eq)]
pub enum JobError {
    /// The job was stopped.
    Stopped,
    /// The job failed, for this reason.
    Failed(String),
}

impl From<String> for JobError {
    fn from(why: String) -> Self {
        Self::Failed(why)
    }
}

/// Progress of a job, and whether the job has to stop.
#[derive(Debug, Default)]
pub struct Progress {
    stop: AtomicBool,
    done: AtomicU64,
    total: AtomicU64,
}

impl Progress {
    /// Records that `done` of `total` parts are finished.
    ///
    /// # Errors
    /// The job was stopped.
    pub fn report(&self, done: u64, total: u64) -> Result<(), JobError> {
        self.done.store(done, Ordering::Relaxed);
        self.total.store(total, Ordering::Relaxed);
        if self.stop.load(Ordering::Relaxed) { Err(JobError::Stopped) } else { Ok(()) }
    }
    /// Returns the finished fraction, 0 to 1.
    pub fn fraction(&self) -> f32 {
        let [done, total] = [&self.done, &self.total].map(|n| n.load(Ordering::Relaxed));
        done as f32 / total.max(1) as f32
    }
    /// Asks the job to stop.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// A job in progress. It stops when the handle is dropped.
pub struct Job {
    /// Name of the job for the user.
    pub name: &'static str,
    progress: Arc<Progress>,
    end: Receiver<Result<Done, JobError>>,
    began: Instant,
}

impl Job {
    /// Starts a job. `wake` is called at its end.
    pub fn start(
        name: &'static str,
        wake: &Wake,
        work: impl FnOnce(&Progress) -> Result<Done, JobError> + Send + 'static,
    ) -> Self {
        let progress = Arc::new(Progress::default());
        let (send, end) = bounded(1);
        let (shared, wake) = (Arc::clone(&progress), Arc::clone(wake));
        std::thread::spawn(move || {
            let _ = send.send(work(&shared));
            wake();
        });
        Self { name, progress, end, began: Instant::now() }
    }
    /// Returns the finished fraction, 0 to 1.
    pub fn fraction(&self) -> f32 {
        self.progress.fraction()
    }
    /// Returns the time since the start.
    pub fn age(&self) -> Duration {
        self.began.elapsed()
    }
    /// Asks the job to stop.
    pub fn stop(&self) {
        self.progress.stop();
    }
    /// Returns true if the job was asked to stop.
    pub fn is_stopping(&self) -> bool {
        self.progress.stop.load(Ordering::Relaxed)
    }
    /// Stops the job and waits until its unfinished file is removed, but at most 3 s.
    pub fn abandon(&self) {
        self.stop();
        let _ = self.end.recv_timeout(Duration::from_secs(3));
    }
    /// Returns the result once the job has ended, and only once.
    pub fn end(&self) -> Option<Result<Done, JobError>> {
        self.end.try_recv().ok()
    }
}

impl Drop for Job {
    fn drop(&mut self) {
        self.stop();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(upto: u64) -> impl FnOnce(&Progress) -> Result<Done, JobError> {
        move |progress| {
            for i in 0..upto {
                progress.report(i, upto)?;
                std::thread::sleep(Duration::from_millis(1));
            }
            Ok(Done::Written("x".into()))
        }
    }

    fn wait(job: &Job) -> Result<Done, JobError> {
        job.end.recv_timeout(Duration::from_secs(30)).unwrap()
    }

    #[test]
    fn it_tells_how_far_it_is_and_ends() {
        let job = Job::start("count", &(Arc::new(|| {}) as Wake), count(4));
        assert_eq!(wait(&job), Ok(Done::Written("x".into())));
        assert_eq!(job.fraction(), 0.75);
    }

    #[test]
    fn it_stops_when_asked() {
        let job = Job::start("count", &(Arc::new(|| {}) as Wake), count(1_000_000));
        assert_eq!(job.end(), None);
        job.stop();
        assert_eq!((wait(&job), job.is_stopping()), (Err(JobError::Stopped), true));
    }
}
