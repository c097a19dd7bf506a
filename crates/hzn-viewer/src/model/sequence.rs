//! The pictures of a sequence, with the data known about each. The list grows while a long recording is being read.

use std::path::PathBuf;

use hzn_files::FrameData;
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
    /// Shift of the altitudes and positions of all pictures that is on trial, in km.
    pub altitude_shift_km: f64,
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
    /// Returns true if pictures have altitudes or positions of their own, so that `body.altitude_km` has no effect.
    pub fn has_altitudes(&self) -> bool {
        let own = |d: &FrameData| d.altitude_km.is_some() || d.position_km.is_some();
        self.entries.iter().any(|e| e.data.as_ref().is_some_and(own))
    }
    /// Shifts the altitudes of all pictures by `by_km` on trial, and their positions along the radius. No file changes.
    pub fn shift_altitudes(&mut self, by_km: f64) {
        self.altitude_shift_km += by_km;
        for data in self.entries.iter_mut().filter_map(|e| e.data.as_mut()) {
            data.altitude_km = data.altitude_km.map(|km| km + by_km);
            data.position_km = data.position_km.map(|p| {
                let radius_km = p.iter().map(|x| x * x).sum::<f64>().sqrt();
                p.map(|x| x * (1.0 + by_km / radius_km.max(1.0)))
            });
        }
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
    /// Returns the time of a picture in words, as its file has it; `None` if it is not known. Every part of the window
    /// that tells a time uses these words.
    pub fn time_text(&self, frame: usize) -> Option<String> {
        Some(format!("{:.3} s", self.entries.get(frame)?.time_s?))
    }
    /// Returns the time in seconds until the next picture, if both times are known.
    pub fn duration_s(&self, frame: usize) -> Option<f64> {
        Some(self.entries.get(frame + 1)?.time_s? - self.entries.get(frame)?.time_s?)
    }
    /// Returns the mean time between two pictures in seconds, if the times of the first and the last one are known.
    pub fn interval_s(&self) -> Option<f64> {
        let steps = self.entries.len().checked_sub(1).filter(|steps| *steps > 0)?;
        let time_s = |entry: Option<&Entry>| entry?.time_s;
        Some((time_s(self.entries.last())? - time_s(self.entries.first())?) / steps as f64)
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
    fn altitudes_and_positions_are_shifted_and_come_back() {
        let data =
            FrameData { altitude_km: Some(200.0), position_km: Some([0.0, 3000.0, 4000.0]), ..FrameData::default() };
        let entry = Entry { name: "a".into(), time_s: None, data: Some(data.clone()), place: Place::Nowhere };
        let mut s = Sequence { entries: vec![entry], ..Sequence::default() };
        assert!(s.has_altitudes());
        s.shift_altitudes(-50.0);
        let shifted = s.entries[0].data.clone().unwrap();
        assert_eq!((shifted.altitude_km, s.altitude_shift_km), (Some(150.0), -50.0));
        assert!((shifted.position_km.unwrap()[2] - 3960.0).abs() < 1e-9);
        s.shift_altitudes(50.0);
        assert!((s.entries[0].data.as_ref().unwrap().position_km.unwrap()[2] - 4000.0).abs() < 1e-9);
        assert_eq!((s.entries[0].data.as_ref().unwrap().altitude_km, s.altitude_shift_km), (Some(200.0), 0.0));
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
        assert_eq!((s.interval_s(), Sequence::default().interval_s()), (Some(1.0), None));
        let mut s = s;
        s.entries[1].time_s = None;
        assert_eq!((s.nearest(0.4), s.duration_s(0), s.duration_s(1)), (Some(0), None, None));
    }
}
