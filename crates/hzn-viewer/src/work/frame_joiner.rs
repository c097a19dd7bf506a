//! The pictures of a recording with their results.

use std::collections::{HashMap, VecDeque};

use hzn_files::Frames;
use hzn_mcap::{Clock, Index, IndexEntry, Row};

use crate::model::{Entry, Place};

/// Joins pictures and their results.
pub(super) struct FrameJoiner {
    name: String,
    frames: Option<Frames>,
    /// Pictures whose results have not been read yet, by log time and sequence number.
    pending: HashMap<(u64, u32), VecDeque<hzn_mcap::Place>>,
    /// Number of pictures so far, in a recording without results.
    pictures_only: u64,
    /// The clock of the pictures in a recording without results; `None` before the first one.
    clock: Option<Clock>,
    /// The last picture; results of further bodies may follow.
    last: Option<(Entry, Vec<Row>)>,
}

impl FrameJoiner {
    /// Begins with a recording of this name.
    pub(super) fn new(name: String, frames: Option<Frames>) -> Self {
        Self { name, frames, pending: HashMap::new(), pictures_only: 0, clock: None, last: None }
    }

    /// Returns the last picture, when no further results of it follow.
    pub(super) fn take_last(&mut self) -> Option<(Entry, Vec<Row>)> {
        self.last.take()
    }

    /// Returns the clock of the pictures, which is that of `hzn run`.
    fn clock_of(&mut self, index: &Index) -> Clock {
        *self.clock.get_or_insert_with(|| index.clock().unwrap_or(Clock::Log))
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

    /// Returns the pictures of a part of the recording that `index` found. The last one waits for the results of
    /// further bodies.
    pub(super) fn join(&mut self, part: Vec<IndexEntry>, index: &Index) -> Vec<(Entry, Vec<Row>)> {
        let mut out = Vec::new();
        for found in part {
            match found {
                IndexEntry::Picture(place) if index.has_reports() => {
                    self.pending.entry(place.frame()).or_default().push_back(place);
                }
                IndexEntry::Picture(place) => {
                    let name = format!("{}#{:06}", self.name, self.pictures_only);
                    self.pictures_only += 1;
                    let data = self.frames.as_ref().and_then(|f| f.get(&name)).cloned();
                    let time_s = match &self.frames {
                        Some(frames) if frames.has_times() => data.as_ref().and_then(|d| d.time_s),
                        _ => place.time_s(self.clock_of(index)),
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

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::path::Path;

    use super::*;
    use hzn_run::source::{self, TimeSource};

    /// Returns an `Image` of one pixel with a stamp in seconds.
    fn image(stamp_s: u32) -> Vec<u8> {
        let mut message = vec![0, 1, 0, 0];
        let words = [stamp_s, 0, 4, u32::from_le_bytes(*b"cam\0"), 1, 1, 6, u32::from_le_bytes(*b"mono")];
        message.extend(words.into_iter().flat_map(u32::to_le_bytes));
        // The rest of the encoding, the byte order, and the step and the data behind their gaps.
        message.extend([b'8', 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 7]);
        message
    }

    fn write(path: &Path, messages: &[(&str, u32)]) {
        let mut writer = mcap::Writer::new(std::fs::File::create(path).unwrap()).unwrap();
        let schema = writer.add_schema("sensor_msgs/msg/Image", "ros2msg", b"").unwrap();
        writer.add_channel(schema, "/silent", "cdr", &BTreeMap::new()).unwrap();
        for (log_time, (topic, stamp_s)) in (9_000_000_000..).zip(messages) {
            let channel_id = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap();
            let header = mcap::records::MessageHeader { channel_id, sequence: 0, log_time, publish_time: log_time };
            writer.write_to_known_channel(&header, &image(*stamp_s)).unwrap();
        }
        writer.finish().unwrap();
    }

    #[test]
    fn the_pictures_of_a_bag_have_the_times_of_hzn_run() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.mcap");
        for stamps in [[5, 6], [0, 6], [0, 0]] {
            write(&path, &[("/front", stamps[0]), ("/rear", 70), ("/front", stamps[1])]);
            let mut index = Index::open(&path).unwrap();
            let mut joiner = FrameJoiner::new("a.mcap".into(), None);
            let mut listed = Vec::new();
            while let Some(part) = index.next_part().unwrap() {
                listed.extend(joiner.join(part, &index).into_iter().map(|(entry, _)| (entry.name, entry.time_s)));
            }
            let mut source = source::open(std::slice::from_ref(&path), None, None).unwrap();
            let of_run: Vec<_> = std::iter::from_fn(|| source.next())
                .map(|item| item.unwrap())
                .map(|item| match item.time {
                    TimeSource::Container(time_s) => (item.name, time_s),
                    other => panic!("{other:?}"),
                })
                .collect();
            assert_eq!(of_run.len(), 2);
            assert_eq!(listed, of_run);
        }
    }
}
