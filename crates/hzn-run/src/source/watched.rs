//! A folder that grows: its pictures, and those that arrive later.

use std::collections::{HashSet, VecDeque};
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime};

use hzn_core::image::Channel;

use super::files::Files;
use super::gather::{LeftOut, list_folder};
use super::item::Item;
use super::paths::ending;
use super::payload::Payload;
use super::raw::Raw;
use super::sequence::Source;
use super::tone::FoundTone;
use crate::error::{Error, unusable};

/// Time between two looks into the folder.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Time in which size and time of a file must be the same, before its picture counts as complete: its writer may pause
/// for half a second.
const STILL: Duration = Duration::from_millis(500);
/// The same for a PNG or a JPEG without its end. It is damaged, or its writer waits for a slow line.
const STILL_WITHOUT_END: Duration = Duration::from_secs(10);
/// Longest time between two lists of the folder. Its time changes with every new file, but two changes within one tick
/// of the file system's clock have the same time.
const LIST_EVERY: Duration = Duration::from_secs(1);
/// The last bytes of a PNG: the type of the chunk `IEND`, which has no content, and its checksum.
const END_OF_PNG: [u8; 8] = *b"IEND\xAE\x42\x60\x82";
/// The last bytes of a JPEG: the marker EOI.
const END_OF_JPEG: [u8; 2] = [0xFF, 0xD9];

/// The pictures of a folder in the order of their arrival; those that arrive together, in the order of their names.
pub(super) struct Watched {
    /// The pictures that were there at the beginning. They decide about size, bits, tone and times.
    files: Files,
    arrivals: Arrivals,
    stop: Arc<AtomicBool>,
    handed_out: Vec<PathBuf>,
}

impl Watched {
    pub(super) fn open(folder: &Path, raw: Option<Raw>, stop: Arc<AtomicBool>) -> Result<Self, Error> {
        let mut arrivals = Arrivals::new(folder, raw);
        // Header and samples of a picture are read only when one is complete.
        while arrivals.ready.is_empty() {
            if stop.load(Ordering::Relaxed) {
                return Err(unusable(format!("{}: no picture arrived", folder.display())));
            }
            arrivals.look()?;
            if arrivals.ready.is_empty() {
                std::thread::sleep(LOOK_EVERY);
            }
        }
        let files = Files::open(&[folder.to_owned()], raw)?;
        Ok(Self { files, arrivals, stop, handed_out: Vec::new() })
    }
}

/// The files of a folder on their way to complete pictures.
struct Arrivals {
    folder: PathBuf,
    raw: Option<Raw>,
    /// Pictures that are complete but not handed out.
    ready: VecDeque<PathBuf>,
    /// Pictures that may still grow.
    growing: Vec<Growing>,
    known: HashSet<PathBuf>,
    /// Start and end of the last list of the folder, and the time of the folder then.
    listed: Option<(Instant, Instant, Option<SystemTime>)>,
}

/// A picture that may still grow.
struct Growing {
    path: PathBuf,
    state: State,
    /// Time of the first look that found this state.
    since: Instant,
}

/// Size and time of the last change of a file; `None` if it is gone.
type State = Option<(u64, Option<SystemTime>)>;

impl Growing {
    fn new(path: PathBuf) -> Self {
        Self { state: state_of(&path), path, since: Instant::now() }
    }

    /// Looks at the file again. Returns true if its picture is complete.
    fn is_complete(&mut self) -> bool {
        let state = state_of(&self.path);
        if state != self.state {
            (self.state, self.since) = (state, Instant::now());
        }
        // A file of no bytes waits for its content. One that was removed is handed out, because a picture that a
        // program takes away unseen must have a row.
        let is_empty = state.is_some_and(|(bytes, _)| bytes == 0);
        let rests = if has_known_end(&self.path) { STILL_WITHOUT_END } else { STILL };
        !is_empty && (self.since.elapsed() >= rests || has_end(&self.path))
    }
}

fn state_of(path: &Path) -> State {
    std::fs::metadata(path).ok().map(|data| (data.len(), data.modified().ok()))
}

/// Returns whether the end of a complete picture of this kind is known.
fn has_known_end(path: &Path) -> bool {
    matches!(ending(path).as_str(), "png" | "jpg" | "jpeg" | "jpe")
}

/// Returns whether a file ends as a PNG or a JPEG does, so that nothing more is written to it.
fn has_end(path: &Path) -> bool {
    let read = || -> std::io::Result<[u8; 8]> {
        let mut file = std::fs::File::open(path)?;
        file.seek(SeekFrom::End(-8))?;
        let mut end = [0; 8];
        file.read_exact(&mut end)?;
        Ok(end)
    };
    let Ok(end) = read() else { return false };
    match ending(path).as_str() {
        "png" => end == END_OF_PNG,
        "jpg" | "jpeg" | "jpe" => end.ends_with(&END_OF_JPEG),
        _ => false,
    }
}

impl Arrivals {
    fn new(folder: &Path, raw: Option<Raw>) -> Self {
        let (ready, growing, known) = (VecDeque::new(), Vec::new(), HashSet::new());
        Self { folder: folder.to_owned(), raw, ready, growing, known, listed: None }
    }

    /// Looks into the folder once, and moves the pictures that are complete to `ready`.
    fn look(&mut self) -> Result<(), Error> {
        if self.is_list_due() {
            let (begin, changed) = (Instant::now(), self.changed());
            for path in list_folder(&self.folder, self.raw.is_some(), &mut LeftOut::new())? {
                if self.known.insert(path.clone()) {
                    self.growing.push(Growing::new(path));
                }
            }
            self.listed = Some((begin, Instant::now(), changed));
        }
        let ready = &mut self.ready;
        self.growing.retain_mut(|file| {
            let is_complete = file.is_complete();
            if is_complete {
                ready.push_back(std::mem::take(&mut file.path));
            }
            !is_complete
        });
        Ok(())
    }

    fn changed(&self) -> Option<SystemTime> {
        std::fs::metadata(&self.folder).and_then(|data| data.modified()).ok()
    }

    /// Returns whether the folder has changed, or was not listed for a while. A large folder is listed less often, so
    /// that the lists take at most a fifth of the time.
    fn is_list_due(&self) -> bool {
        let Some((begin, end, changed)) = self.listed else { return true };
        let is_rested = end.elapsed() >= (end - begin) * 4;
        is_rested && (begin.elapsed() >= LIST_EVERY || self.changed() != changed)
    }
}

impl Source for Watched {
    fn next(&mut self) -> Option<Result<Item, Error>> {
        while self.arrivals.ready.is_empty() {
            if self.stop.load(Ordering::Relaxed) {
                return None;
            }
            std::thread::sleep(LOOK_EVERY);
            if let Err(e) = self.arrivals.look() {
                return Some(Err(e));
            }
        }
        let path = self.arrivals.ready.pop_front()?;
        self.handed_out.push(path.clone());
        Some(Ok(self.files.item(path)))
    }
    fn total(&self) -> Option<u64> {
        None
    }
    fn sizes(&self) -> Box<dyn Iterator<Item = (String, (u32, u32))> + '_> {
        self.files.sizes()
    }
    fn path(&self, frame: u64) -> Option<PathBuf> {
        self.handed_out.get(usize::try_from(frame).ok()?).cloned()
    }
    fn folder(&self) -> PathBuf {
        self.arrivals.folder.clone()
    }
    fn files(&self) -> Vec<PathBuf> {
        self.files.files()
    }
    fn bits(&self) -> Option<u8> {
        self.files.bits()
    }
    fn tone(&self) -> Option<FoundTone> {
        self.files.tone()
    }
    fn samples(&self) -> Box<dyn Iterator<Item = Payload> + '_> {
        self.files.samples()
    }
    fn display_turn(&self) -> Option<(String, &'static str)> {
        self.files.display_turn()
    }
    fn want_channel(&mut self, channel: Channel) -> Result<(), Error> {
        self.files.want_channel(channel)
    }
    fn notes(&self) -> Vec<String> {
        self.files.notes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_complete_when_it_has_its_end_or_rests() {
        let dir = tempfile::tempdir().unwrap();
        let file = |name: &str| dir.path().join(name);
        let mut arrivals = Arrivals::new(dir.path(), None);
        image::GrayImage::new(16, 12).save(file("whole.png")).unwrap();
        image::GrayImage::new(16, 12).save(file("whole.jpg")).unwrap();
        let bytes = std::fs::read(file("whole.png")).unwrap();
        std::fs::write(file("part.png"), &bytes[..bytes.len() - 1]).unwrap();
        std::fs::write(file("empty.png"), []).unwrap();
        arrivals.look().unwrap();
        let names = |a: &mut Arrivals| -> Vec<PathBuf> { a.ready.drain(..).collect() };
        assert_eq!(names(&mut arrivals), [file("whole.jpg"), file("whole.png")]);
        std::fs::write(file("part.png"), &bytes).unwrap();
        arrivals.look().unwrap();
        assert_eq!(names(&mut arrivals), [file("part.png")]);
        // A picture that never gets its end is handed out when it has rested; one without bytes never.
        arrivals.growing.iter_mut().for_each(|file| file.since -= STILL_WITHOUT_END);
        arrivals.look().unwrap();
        assert!(names(&mut arrivals).is_empty());
        std::fs::write(file("empty.png"), b"no end").unwrap();
        arrivals.look().unwrap();
        assert!(names(&mut arrivals).is_empty(), "it has just changed");
        arrivals.growing.iter_mut().for_each(|file| file.since -= STILL_WITHOUT_END);
        arrivals.look().unwrap();
        assert_eq!(names(&mut arrivals), [file("empty.png")]);
    }
}
