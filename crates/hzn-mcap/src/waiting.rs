//! Parts of frames that wait for the reports of their frames.

use std::collections::{BTreeMap, VecDeque};

use crate::container::Message;
use crate::frame::{Annotations, Attitude, EncodedImage, LogLine};

/// Largest size in bytes of all parts that wait, except that a single frame may be larger. In recordings of hzn, at
/// most one batch waits.
const MAX_BYTES: usize = 64 << 20;

/// Log time in nanoseconds and sequence number of a frame's messages, and number of the head of a rig. In recordings of
/// hzn, the sequence number is the index of the frame. Other writers may leave it out; then the log time tells the
/// frames apart.
type Key = (u64, u32, usize);

/// The parts of a frame. A frame with several records may have several of each kind.
#[derive(Debug, Default)]
pub(crate) struct Parts {
    pub(crate) images: VecDeque<EncodedImage>,
    pub(crate) annotations: VecDeque<Annotations>,
    pub(crate) attitudes: VecDeque<Attitude>,
    pub(crate) log: Vec<LogLine>,
    bytes: usize,
}

/// Parts of frames, by their frames.
#[derive(Debug, Default)]
pub(crate) struct Waiting {
    frames: BTreeMap<Key, Parts>,
    bytes: usize,
}

fn key(message: &Message<'_>, head: usize) -> Key {
    (message.log_time_ns, message.sequence, head)
}

impl Waiting {
    /// Returns the parts of the frame of a message, which adds a part to them. If too many bytes wait, the parts of the
    /// earliest other frames are given up, because the reports of these frames are missing.
    pub(crate) fn add_to(&mut self, message: &Message<'_>, head: usize) -> &mut Parts {
        let (key, bytes) = (key(message, head), size_of::<Parts>() + message.data.len());
        self.bytes += bytes;
        while self.bytes > MAX_BYTES
            && let Some(earliest) = self.frames.keys().copied().find(|other| *other != key)
            && let Some(lost) = self.frames.remove(&earliest)
        {
            self.bytes -= lost.bytes;
        }
        let parts = self.frames.entry(key).or_default();
        parts.bytes += bytes;
        parts
    }

    /// Lets `take` take what the record of a report has of the parts of its frame; `None` if the frame has no parts.
    pub(crate) fn take<T>(
        &mut self,
        report: &Message<'_>,
        head: usize,
        take: impl FnOnce(&mut Parts) -> T,
    ) -> Option<T> {
        let key = key(report, head);
        let parts = self.frames.get_mut(&key)?;
        let taken = take(parts);
        if parts.images.is_empty() && parts.annotations.is_empty() && parts.attitudes.is_empty() && parts.log.is_empty()
        {
            self.bytes -= parts.bytes;
            self.frames.remove(&key);
        }
        Some(taken)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::ImageFormat;

    fn message(log_time_ns: u64, sequence: u32, data: &[u8]) -> Message<'_> {
        Message { channel: 2, sequence, log_time_ns, data }
    }

    fn add(waiting: &mut Waiting, message: &Message<'_>) {
        let image = EncodedImage { format: ImageFormat::Png, bytes: vec![message.sequence as u8] };
        waiting.add_to(message, 0).images.push_back(image);
    }

    fn take(waiting: &mut Waiting, report: &Message<'_>) -> Option<Vec<u8>> {
        waiting.take(report, 0, |parts| parts.images.pop_front())?.map(|image| image.bytes)
    }

    #[test]
    fn parts_go_to_the_frame_with_the_same_time_and_number() {
        let mut waiting = Waiting::default();
        for (time, sequence) in [(1, 7), (2, 7), (2, 8)] {
            add(&mut waiting, &message(time, sequence, b"data"));
        }
        assert_eq!(take(&mut waiting, &message(3, 7, b"")), None);
        assert_eq!(take(&mut waiting, &message(2, 8, b"")), Some(vec![8]));
        assert_eq!(take(&mut waiting, &message(2, 8, b"")), None);
        assert_eq!(take(&mut waiting, &message(1, 7, b"")), Some(vec![7]));
        assert_eq!((waiting.frames.len(), waiting.bytes), (1, size_of::<Parts>() + 4));
        // A head of a rig has parts of its own.
        assert_eq!(waiting.take(&message(2, 7, b""), 1, |parts| parts.images.len()), None);
    }

    #[test]
    fn pictures_without_reports_need_a_bounded_memory() {
        let (mut waiting, data) = (Waiting::default(), vec![0; MAX_BYTES / 4 - size_of::<Parts>()]);
        for n in 0..9 {
            add(&mut waiting, &message(u64::from(n), n, &data));
        }
        assert_eq!((waiting.frames.len(), waiting.bytes), (4, MAX_BYTES));
        assert_eq!(take(&mut waiting, &message(4, 4, b"")), None);
        assert_eq!(take(&mut waiting, &message(8, 8, b"")), Some(vec![8]));
        // A single frame may be larger.
        let (mut waiting, data) = (Waiting::default(), vec![0; MAX_BYTES + 1]);
        add(&mut waiting, &message(0, 0, &data));
        waiting.add_to(&message(0, 0, b"drawn"), 0).annotations.push_back(Annotations::default());
        assert_eq!(take(&mut waiting, &message(0, 0, b"")), Some(vec![0]));
    }
}
