//! Passes a growing file to the disk while it is being written, so that little is left to pass on at its end.

use std::fs::File;
use std::io;
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::thread::{self, JoinHandle};

use crate::part::sync;

/// Number of new bytes that are worth a write to the disk.
const STEP_BYTES: u64 = 16 << 20;

/// The writing in the background of one file. Small files never start its thread.
#[derive(Debug, Default)]
pub(crate) struct EarlySync {
    /// Bytes that are not passed on yet.
    new_bytes: u64,
    thread: Option<(SyncSender<()>, JoinHandle<io::Result<()>>)>,
}

impl EarlySync {
    /// Takes notice of new bytes in `file`, and passes them on if they are enough. It does not wait for the disk.
    pub(crate) fn add(&mut self, bytes: u64, file: &File) {
        self.new_bytes += bytes;
        if self.new_bytes < STEP_BYTES {
            return;
        }
        if self.thread.is_none() {
            self.thread = start(file);
        }
        // While the disk is busy, the bytes wait for the next call.
        if let Some((request, _)) = &self.thread
            && !matches!(request.try_send(()), Err(TrySendError::Full(())))
        {
            self.new_bytes = 0;
        }
    }

    /// Waits for the disk.
    ///
    /// # Errors
    /// The disk has failed. The system reports a failure only once, so it must not be lost here.
    pub(crate) fn finish(&mut self) -> io::Result<()> {
        let Some((request, thread)) = self.thread.take() else { return Ok(()) };
        drop(request);
        thread.join().unwrap_or_else(|_| Err(io::Error::other("the thread that passes the file to the disk failed")))
    }
}

impl Drop for EarlySync {
    fn drop(&mut self) {
        // The file stays locked while the thread has it open. No caller can receive an error here.
        let _ = self.finish();
    }
}

/// Starts the thread. Without one, all bytes are passed on at the end.
fn start(file: &File) -> Option<(SyncSender<()>, JoinHandle<io::Result<()>>)> {
    let file = file.try_clone().ok()?;
    let (request, requests) = sync_channel(1);
    let thread = thread::Builder::new().name("early sync".into());
    let thread = thread.spawn(move || requests.iter().try_for_each(|()| sync(&file))).ok()?;
    Some((request, thread))
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn a_large_file_starts_the_thread_and_a_small_one_does_not() {
        let folder = tempfile::tempdir().unwrap();
        let mut file = File::create(folder.path().join("a")).unwrap();
        let mut early = EarlySync::default();
        file.write_all(&[7; 1000]).unwrap();
        early.add(1000, &file);
        assert!(early.thread.is_none());
        early.add(STEP_BYTES, &file);
        assert!(early.thread.is_some());
        early.finish().unwrap();
        assert!(early.thread.is_none(), "the thread has ended");
    }

    #[test]
    fn the_file_is_free_when_it_is_dropped() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let file = crate::part::create_part(&path).unwrap();
        let mut early = EarlySync::default();
        early.add(STEP_BYTES, &file);
        drop((file, early));
        crate::part::open_part(&path).unwrap();
    }
}
