//! The check of a recording: it reads every part once, because damage shows only in the checksum of a part.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crossbeam_channel::{Receiver, bounded};
use hzn_mcap::{Contents, Reader};

use super::Wake;
use crate::model::{Entry, Place};

/// Indices of the pictures in damaged parts of the recording.
pub type Damaged = Vec<usize>;

/// A check in progress. It stops when the handle is dropped.
#[derive(Debug)]
pub struct Check {
    stop: Arc<AtomicBool>,
    receive: Receiver<Damaged>,
}

impl Check {
    /// Starts the check of a recording. A recording of another program has no results; its pictures are checked when
    /// they are decoded.
    pub fn start(recording: PathBuf, entries: Vec<Entry>, has_results: bool, wake: Wake) -> Self {
        let (send, receive) = bounded(1);
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        std::thread::spawn(move || {
            let damaged = find(&recording, &entries, has_results, &flag);
            let _ = send.send(damaged);
            wake();
        });
        Self { stop, receive }
    }
    /// Returns the pictures in damaged parts, once the check has ended.
    pub fn end(&self) -> Option<Damaged> {
        self.receive.try_recv().ok()
    }
}

impl Drop for Check {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// Returns the pictures that the list of the recording has and its sound parts lack. A part holds several pictures, and
/// its checksum does not say which of them is wrong.
fn find(recording: &Path, entries: &[Entry], has_results: bool, stop: &AtomicBool) -> Damaged {
    let mut sound = vec![!has_results; entries.len()];
    // If no part is sound, the recording cannot be opened at all.
    let mut reader = Reader::open(recording, Contents::All).ok().filter(|_| has_results);
    for frame in reader.iter_mut().flatten() {
        if stop.load(Ordering::Relaxed) {
            return Damaged::new();
        }
        let Ok(frame) = frame else { break };
        if let Some(slot) = sound.get_mut(frame.row.index as usize) {
            *slot |= frame.image.is_some();
        }
    }
    if reader.is_some_and(|r| r.broken_chunks() == 0) {
        return Damaged::new();
    }
    let lost = |(index, (entry, sound)): (usize, (&Entry, &bool))| {
        (matches!(entry.place, Place::Recorded(_)) && !sound).then_some(index)
    };
    entries.iter().zip(&sound).enumerate().filter_map(lost).collect()
}
