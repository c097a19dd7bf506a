//! A folder that grows: its pictures, and those that arrive later.

use std::collections::{HashSet, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, SystemTime};

use hzn_core::image::Channel;

use super::files::Files;
use super::gather::{LeftOut, list_folder};
use super::item::Item;
use super::payload::Payload;
use super::raw::Raw;
use super::sequence::Source;
use super::tone::FoundTone;
use crate::error::{Error, unusable};

/// Time between two looks into the folder.
const LOOK_EVERY: Duration = Duration::from_millis(250);
/// Number of looks in which size and time of a file must be the same, before its picture counts as complete: its writer
/// may pause for half a second.
const LOOKS: u32 = 3;

/// The pictures of a folder in the order of their arrival; those that arrive together, in the order of their names.
pub(super) struct Watched {
    /// The pictures that were there at the beginning. They decide about size, bits, tone and times.
    files: Files,
    folder: PathBuf,
    raw: Option<Raw>,
    stop: Arc<AtomicBool>,
    /// Pictures that are complete but not handed out.
    ready: VecDeque<PathBuf>,
    /// Pictures that may still grow: with their size and time in the last look, and the number of equal looks.
    growing: Vec<(PathBuf, State, u32)>,
    known: HashSet<PathBuf>,
    handed_out: Vec<PathBuf>,
}

/// Size and time of the last change of a file.
type State = Option<(u64, Option<SystemTime>)>;

impl Watched {
    pub(super) fn open(folder: &Path, raw: Option<Raw>, stop: Arc<AtomicBool>) -> Result<Self, Error> {
        let (mut growing, mut known, mut ready) = (Vec::new(), HashSet::new(), VecDeque::new());
        // Header and samples of a picture are read only when one is complete.
        while ready.is_empty() {
            if stop.load(Ordering::Relaxed) {
                return Err(unusable(format!("{}: no picture arrived", folder.display())));
            }
            look(folder, raw, &mut growing, &mut known, &mut ready)?;
            if ready.is_empty() {
                std::thread::sleep(LOOK_EVERY);
            }
        }
        let files = Files::open(&[folder.to_owned()], raw)?;
        Ok(Self { files, folder: folder.to_owned(), raw, stop, ready, growing, known, handed_out: Vec::new() })
    }
}

/// Looks into the folder once, and moves the pictures that are complete to `ready`.
fn look(
    folder: &Path,
    raw: Option<Raw>,
    growing: &mut Vec<(PathBuf, State, u32)>,
    known: &mut HashSet<PathBuf>,
    ready: &mut VecDeque<PathBuf>,
) -> Result<(), Error> {
    for path in list_folder(folder, raw.is_some(), &mut LeftOut::new())? {
        if known.insert(path.clone()) {
            growing.push((path, None, 0));
        }
    }
    for (path, state, looks) in growing.iter_mut() {
        let now = std::fs::metadata(&*path).ok().map(|data| (data.len(), data.modified().ok()));
        *looks = if *state == now { *looks + 1 } else { 1 };
        *state = now;
    }
    // A file of no bytes waits for its content. One that was removed is handed out, because a picture that a program
    // takes away unseen must have a row.
    let is_complete =
        |(_, state, looks): &(PathBuf, State, u32)| *looks >= LOOKS && state.is_none_or(|(bytes, _)| bytes > 0);
    ready.extend(growing.iter().filter(|file| is_complete(file)).map(|(path, ..)| path.clone()));
    growing.retain(|file| !is_complete(file));
    Ok(())
}

impl Source for Watched {
    fn next(&mut self) -> Option<Result<Item, Error>> {
        while self.ready.is_empty() {
            if self.stop.load(Ordering::Relaxed) {
                return None;
            }
            std::thread::sleep(LOOK_EVERY);
            let Self { folder, raw, growing, known, ready, .. } = self;
            if let Err(e) = look(folder, *raw, growing, known, ready) {
                return Some(Err(e));
            }
        }
        let path = self.ready.pop_front()?;
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
        self.folder.clone()
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
