//! The frames that are there, with what is known about each; it grows while a long recording is still being read.

use std::path::PathBuf;

use hzn_calib::FrameData;
use hzn_run::source::Raw;

/// One frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Name of its picture.
    pub name: String,
    /// Time in seconds, where it is known.
    pub time_s: Option<f64>,
    /// What frames.csv or the recording says about it.
    pub data: Option<FrameData>,
    /// Where its picture is.
    pub place: Place,
}

/// Where a picture is.
#[derive(Debug, Clone, PartialEq)]
pub enum Place {
    /// A picture file.
    File(PathBuf),
    /// A headerless file.
    RawFile(PathBuf, Raw),
    /// In the recording.
    Recorded(hzn_mcap::Place),
    /// The picture of this number in a video.
    Video(u64),
    /// The recording was made without pictures, or this one could not be read then.
    Nowhere,
}

/// All frames.
#[derive(Debug, Clone, Default)]
pub struct Sequence {
    /// What it is called: a file's or folder's name.
    pub title: String,
    /// What was opened.
    pub inputs: Vec<PathBuf>,
    /// The recording that holds the pictures.
    pub recording: Option<PathBuf>,
    /// Folder in which sensor.toml, frames.csv and truth.csv may lie.
    pub folder: PathBuf,
    /// Frames, in order.
    pub entries: Vec<Entry>,
    /// All frames are there.
    pub complete: bool,
}

impl Sequence {
    /// Number of frames so far.
    pub fn len(&self) -> usize {
        self.entries.len()
    }
    /// No frame yet.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }
    /// Where a file that is made of it goes, unless another place is named: beside it. In a folder of pictures, a
    /// further picture would be a further frame.
    pub fn beside(&self, name: &str) -> PathBuf {
        let folder = match self.inputs.as_slice() {
            [one] if one.is_dir() => std::path::absolute(one).ok().and_then(|p| Some(p.parent()?.to_owned())),
            _ => None,
        };
        folder.as_deref().unwrap_or(&self.folder).join(name)
    }
    /// Its name without the ending of a recording.
    pub fn stem(&self) -> &str {
        self.title.trim_end_matches(".part").trim_end_matches(".mcap")
    }
    /// How long a frame lasts in seconds, until the next one.
    pub fn duration_s(&self, frame: usize) -> Option<f64> {
        Some(self.entries.get(frame + 1)?.time_s? - self.entries.get(frame)?.time_s?)
    }
    /// Index of the frame nearest in time.
    pub fn nearest(&self, time_s: f64) -> Option<usize> {
        let apart = |(i, e): (usize, &Entry)| Some((i, (e.time_s? - time_s).abs()));
        let best = self.entries.iter().enumerate().filter_map(apart).min_by(|(_, a), (_, b)| a.total_cmp(b));
        best.map(|(i, _)| i)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn what_is_made_of_it_lies_beside_it() {
        // Any folder that is there.
        let pictures = Path::new(env!("CARGO_MANIFEST_DIR"));
        let parent = pictures.parent().unwrap();
        let folder = Sequence { inputs: vec![pictures.into()], folder: pictures.into(), ..Sequence::default() };
        assert_eq!(folder.beside("flight.mp4"), parent.join("flight.mp4"));
        let file = parent.join("flight.mcap");
        let recording = Sequence { inputs: vec![file], folder: parent.into(), ..Sequence::default() };
        assert_eq!(recording.beside("flight.mp4"), parent.join("flight.mp4"));
        assert_eq!(Sequence { title: "a.mcap.part".into(), ..Sequence::default() }.stem(), "a");
    }

    #[test]
    fn frames_are_found_by_their_time() {
        let entry = |t: f64| Entry { name: format!("{t}"), time_s: Some(t), data: None, place: Place::Nowhere };
        let s = Sequence { entries: [0.0, 0.5, 2.0].map(entry).to_vec(), ..Sequence::default() };
        assert_eq!(
            (s.nearest(-9.0), s.nearest(0.4), s.nearest(1.3), s.nearest(1e9)),
            (Some(0), Some(1), Some(2), Some(2))
        );
        assert_eq!((s.duration_s(1), s.duration_s(2)), (Some(1.5), None));
        assert_eq!(Sequence::default().nearest(0.0), None);
        let mut s = s;
        s.entries[1].time_s = None;
        assert_eq!((s.nearest(0.4), s.duration_s(0), s.duration_s(1)), (Some(0), None, None));
    }
}
