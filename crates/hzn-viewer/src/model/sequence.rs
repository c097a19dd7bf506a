//! The pictures of a sequence, with the data known about each. The list grows while a long recording is being read.

use std::path::PathBuf;

use hzn_calib::FrameData;
use hzn_run::source::Raw;

/// One picture of the sequence.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Name of the picture.
    pub name: String,
    /// Time in seconds, if it is known.
    pub time_s: Option<f64>,
    /// Data of the picture from frames.csv or the recording.
    pub data: Option<FrameData>,
    /// Place of the picture.
    pub place: Place,
}

/// Place of a picture.
#[derive(Debug, Clone, PartialEq)]
pub enum Place {
    /// A picture file.
    File(PathBuf),
    /// A headerless file.
    RawFile(PathBuf, Raw),
    /// A picture in the recording.
    Recorded(hzn_mcap::Place),
    /// The picture of this number in a video.
    Video(u64),
    /// There is no picture: the recording was made without pictures, or this picture could not be read at that time.
    Nowhere,
}

/// All pictures.
#[derive(Debug, Clone, Default)]
pub struct Sequence {
    /// Title: the name of a file or folder.
    pub title: String,
    /// Files and folders that were opened.
    pub inputs: Vec<PathBuf>,
    /// The recording that holds the pictures.
    pub recording: Option<PathBuf>,
    /// Folder in which sensor.toml, frames.csv and truth.csv may lie.
    pub folder: PathBuf,
    /// Pictures, in order.
    pub entries: Vec<Entry>,
    /// True if the list is complete.
    pub complete: bool,
}

impl Sequence {
    /// Returns the number of pictures so far.
    pub fn len(&self) -> usize {
        self.entries.len()
    }
    /// Returns true if there is no picture yet.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }
    /// Returns the default path of a file that is made from the sequence: next to the sequence. For a folder of
    /// pictures, the path is next to the folder, because a picture in the folder would become part of the sequence.
    pub fn default_output_path(&self, name: &str) -> PathBuf {
        let folder = match self.inputs.as_slice() {
            [one] if one.is_dir() => std::path::absolute(one).ok().and_then(|p| Some(p.parent()?.to_owned())),
            _ => None,
        };
        folder.as_deref().unwrap_or(&self.folder).join(name)
    }
    /// Returns the title without the ending of a recording.
    pub fn stem(&self) -> &str {
        self.title.trim_end_matches(".part").trim_end_matches(".mcap")
    }
    /// Returns the time in seconds until the next picture, if both times are known.
    pub fn duration_s(&self, frame: usize) -> Option<f64> {
        Some(self.entries.get(frame + 1)?.time_s? - self.entries.get(frame)?.time_s?)
    }
    /// Returns the index of the picture that is nearest in time.
    pub fn nearest(&self, time_s: f64) -> Option<usize> {
        let distance = |(i, e): (usize, &Entry)| Some((i, (e.time_s? - time_s).abs()));
        let best = self.entries.iter().enumerate().filter_map(distance).min_by(|(_, a), (_, b)| a.total_cmp(b));
        best.map(|(i, _)| i)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn output_files_lie_next_to_the_sequence() {
        // Any existing folder serves.
        let pictures = Path::new(env!("CARGO_MANIFEST_DIR"));
        let parent = pictures.parent().unwrap();
        let folder = Sequence { inputs: vec![pictures.into()], folder: pictures.into(), ..Sequence::default() };
        assert_eq!(folder.default_output_path("flight.mp4"), parent.join("flight.mp4"));
        let file = parent.join("flight.mcap");
        let recording = Sequence { inputs: vec![file], folder: parent.into(), ..Sequence::default() };
        assert_eq!(recording.default_output_path("flight.mp4"), parent.join("flight.mp4"));
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
