//! The folder of a bag of ROS 2: its recordings, one after another.

use std::path::{Path, PathBuf};

use super::item::Item;
use super::natural;
use super::paths::ending;
use super::payload::Payload;
use super::recording::Recording;
use super::sequence::Source;
use crate::error::{Error, unusable};
use crate::provenance::quoted;

/// The file that makes a folder a bag.
const METADATA: &str = "metadata.yaml";

/// Pictures of one topic in all recordings of a bag.
pub(super) struct Bag {
    folder: PathBuf,
    recordings: Vec<Recording>,
    /// Number of the recording whose pictures are handed out.
    current: usize,
    /// The recordings without pictures of the topic, with the reason.
    left_out: Vec<String>,
}

/// Returns whether a folder is a bag of ROS 2.
pub fn is_bag(folder: &Path) -> bool {
    folder.join(METADATA).is_file()
}

/// Returns the recordings of a bag, and its other files, in their order.
pub(super) fn files(folder: &Path) -> std::io::Result<[Vec<PathBuf>; 2]> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)?.flatten().map(|entry| entry.path()).collect();
    paths.sort_by(|a, b| natural::compare(a, b));
    let (files, others) = paths.into_iter().partition(|path| ending(path) == "mcap");
    Ok([files, others])
}

/// Returns the recordings of a bag.
///
/// # Errors
/// It has none in MCAP, or cannot be listed.
pub fn recordings(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let refuse = |what: String| unusable(format!("{}: {what}", folder.display()));
    let [files, others] = files(folder).map_err(|e| refuse(format!("cannot be listed: {e}")))?;
    if files.is_empty() {
        return Err(refuse(match others.iter().find(|path| ["db3", "zstd"].contains(&ending(path).as_str())) {
            Some(path) if ending(path) == "db3" => format!("is a bag in SQLite; {}", conversion(folder)),
            Some(path) => format!("is a bag of compressed files; `zstd -d {}` unpacks one", path.display()),
            None => "is a bag without a recording (.mcap)".to_owned(),
        }));
    }
    Ok(files)
}

/// Returns what to do with a bag that hzn does not read: the commands that convert it. A bag of ROS 2 is converted by
/// its folder, and ROS itself converts no bag of ROS 1.
pub fn conversion(from: &Path) -> String {
    let folder = from.parent().filter(|folder| ending(from) == "db3" && !folder.as_os_str().is_empty());
    let bag = folder.unwrap_or(if ending(from) == "db3" { Path::new(".") } else { from });
    let bag = quoted(bag);
    let with_ros = match ending(from).as_str() {
        "bag" => String::new(),
        _ => format!(
            "; with ROS 2: echo 'output_bags: [{{uri: converted, storage_id: mcap, all: true}}]' > mcap.yaml && ros2 \
             bag convert -i {bag} -o mcap.yaml"
        ),
    };
    format!(
        "hzn reads bags in MCAP, so convert it: pip install rosbags && rosbags-convert --src {bag} --dst converted \
         --dst-storage mcap{with_ros}; then run hzn on the folder converted"
    )
}

impl Bag {
    pub(super) fn open(folder: &Path, topic: Option<&str>) -> Result<Self, Error> {
        let refuse = |what: String| unusable(format!("{}: {what}", folder.display()));
        let files = recordings(folder)?;
        let mut bag = Self { folder: folder.to_owned(), recordings: Vec::new(), current: 0, left_out: Vec::new() };
        let mut topic = topic.map(str::to_owned);
        let mut first_error = None;
        for path in &files {
            // All pictures have the times of one clock.
            let clock = bag.recordings.first().and_then(Recording::clock);
            match Recording::open(path, topic.as_deref(), clock) {
                Ok(recording) => {
                    topic = topic.or_else(|| recording.topic().map(str::to_owned));
                    bag.recordings.push(recording);
                }
                Err(e) => {
                    bag.left_out.push(format!("{e}; this part of the bag is left out"));
                    first_error.get_or_insert(e);
                }
            }
        }
        if bag.recordings.is_empty() {
            Err(first_error.unwrap_or_else(|| refuse("is empty".to_owned())))
        } else {
            Ok(bag)
        }
    }
}

impl Source for Bag {
    fn next(&mut self) -> Option<Result<Item, Error>> {
        loop {
            match self.recordings.get_mut(self.current)?.next() {
                Some(item) => return Some(item),
                None => self.current += 1,
            }
        }
    }
    fn total(&self) -> Option<u64> {
        None
    }
    fn sizes(&self) -> Box<dyn Iterator<Item = (String, (u32, u32))> + '_> {
        Box::new(self.recordings.iter().flat_map(Recording::sizes))
    }
    fn folder(&self) -> PathBuf {
        self.folder.clone()
    }
    fn files(&self) -> Vec<PathBuf> {
        self.recordings.iter().flat_map(Recording::files).collect()
    }
    fn samples(&self) -> Box<dyn Iterator<Item = Payload> + '_> {
        Box::new(self.recordings.iter().flat_map(Recording::samples))
    }
    fn describe_loss(&self) -> Option<String> {
        self.recordings.iter().find_map(Recording::describe_loss)
    }
    fn notes(&self) -> Vec<String> {
        let others = self.recordings.first().map(Recording::notes).unwrap_or_default();
        self.left_out.iter().cloned().chain(others).collect()
    }
}
