//! The pictures of a recording with their results.

use std::collections::{HashMap, VecDeque};

use hzn_files::Frames;
use hzn_mcap::{IndexEntry, Row};

use crate::model::{Entry, Place};

/// Joins pictures and their results.
pub(super) struct FrameJoiner {
    name: String,
    frames: Option<Frames>,
    /// Pictures whose results have not been read yet, by log time and sequence number.
    pending: HashMap<(u64, u32), VecDeque<hzn_mcap::Place>>,
    /// Number of pictures so far, in a recording without results.
    pictures_only: u64,
    /// The last picture; results of further bodies may follow.
    last: Option<(Entry, Vec<Row>)>,
}

impl FrameJoiner {
    /// Begins with a recording of this name.
    pub(super) fn new(name: String, frames: Option<Frames>) -> Self {
        Self { name, frames, pending: HashMap::new(), pictures_only: 0, last: None }
    }

    /// Returns the last picture, when no further results of it follow.
    pub(super) fn take_last(&mut self) -> Option<(Entry, Vec<Row>)> {
        self.last.take()
    }

    /// Takes the first picture of a frame.
    fn take_pending(&mut self, frame: (u64, u32)) -> Option<hzn_mcap::Place> {
        let places = self.pending.get_mut(&frame)?;
        let place = places.pop_front();
        if places.is_empty() {
            self.pending.remove(&frame);
        }
        place
    }

    /// Returns the pictures of a part of the recording. The last one waits for the results of further bodies.
    pub(super) fn join(&mut self, part: Vec<IndexEntry>, has_reports: bool) -> Vec<(Entry, Vec<Row>)> {
        let mut out = Vec::new();
        for found in part {
            match found {
                IndexEntry::Picture(place) if has_reports => {
                    self.pending.entry(place.frame()).or_default().push_back(place);
                }
                IndexEntry::Picture(place) => {
                    let name = format!("{}#{:06}", self.name, self.pictures_only);
                    self.pictures_only += 1;
                    let data = self.frames.as_ref().and_then(|f| f.get(&name)).cloned();
                    let time_s = match &self.frames {
                        Some(frames) if frames.has_times() => data.as_ref().and_then(|d| d.time_s),
                        _ => Some(place.log_time_s()),
                    };
                    out.push((Entry { name, time_s, data, place: Place::Recorded(place) }, Vec::new()));
                }
                IndexEntry::Report(at, row, _, given) => {
                    if let Some((entry, rows)) = &mut self.last
                        && rows.first().is_some_and(|r| r.index == row.index)
                        && entry.name == row.file
                    {
                        rows.push(*row);
                        continue;
                    }
                    out.extend(self.last.take());
                    let data = hzn_run::source::recorded_prior(&row, *given);
                    let place = self.take_pending(at.frame()).map_or(Place::Nowhere, Place::Recorded);
                    let entry = Entry { name: row.file.clone(), time_s: row.time_s, data: Some(data), place };
                    self.last = Some((entry, vec![*row]));
                }
            }
        }
        out
    }
}
