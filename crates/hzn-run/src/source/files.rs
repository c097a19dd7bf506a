//! Pictures in separate files: a folder, a glob, or a list.

use std::path::{Path, PathBuf};

use hzn_core::image::Channel;
use hzn_core::tone::Tone;
use image::metadata::Orientation;

use super::gather::{self, Gathered, Kind, LeftOut};
use super::item::{Item, TimeSource};
use super::paths::{ending, open_file};
use super::payload::Payload;
use super::raw::{self, Raw};
use super::sequence::{MAX_SIZES_READ, Source};
use super::tone::FoundTone;
use super::{bits, header, natural, turn};
use crate::error::Error;
use crate::explain;

/// Number of pictures whose orientation is read.
const MAX_ORIENTATIONS_READ: usize = 4;

pub(super) struct Files {
    paths: Vec<PathBuf>,
    /// Index of the file that is handed out next.
    next: usize,
    folder: PathBuf,
    raw: Option<Raw>,
    time: TimeSource,
    /// A picture whose EXIF exists but has no readable time, and the reason.
    unread_exif: Option<String>,
    /// Names include the folder, because the files lie in several folders.
    with_folder: bool,
    left_out: LeftOut,
    /// Two pictures whose order in the list differs from the order of their numbers.
    out_of_order: Option<[String; 2]>,
    /// The input is a single pattern.
    is_pattern: bool,
}

impl Files {
    pub(super) fn open(inputs: &[PathBuf], raw: Option<Raw>) -> Result<Self, Error> {
        let Gathered { paths, folder, left_out } = Gathered::from_inputs(inputs, raw.is_some())?;
        let parent = |p: &PathBuf| p.parent().map(Path::to_owned).unwrap_or_default();
        let first = paths.first().map(parent).unwrap_or_default();
        let with_folder = paths.iter().any(|p| parent(p) != first);
        let folder = folder.unwrap_or(first);
        let timed = if raw.is_none() { have_exif_time(&paths) } else { Ok(false) };
        let time = if timed == Ok(true) { TimeSource::Exif } else { TimeSource::Count };
        let out_of_order = out_of_order(&paths);
        let is_pattern = matches!(inputs, [one] if !one.exists());
        let unread_exif = timed.err();
        Ok(Self { paths, next: 0, folder, raw, time, unread_exif, with_folder, left_out, out_of_order, is_pattern })
    }
}

/// Returns the first two names in byte order, as a shell lists them, whose numbers have the opposite order. Returns
/// `None` unless all names are in byte order: the user chose any other order.
fn out_of_order(paths: &[PathBuf]) -> Option<[String; 2]> {
    let pairs = || paths.windows(2).filter_map(|w| w.first().zip(w.last()));
    if !pairs().all(|(a, b)| a.as_os_str() <= b.as_os_str()) {
        return None;
    }
    let (a, b) = pairs().find(|(a, b)| natural::compare(a, b).is_gt())?;
    Some([a, b].map(|p| p.file_name().unwrap_or_default().to_string_lossy().into_owned()))
}

/// Returns whether the camera wrote the time into the pictures. The first readable picture decides for all.
///
/// # Errors
/// The picture has EXIF that cannot be read: its name and the reason.
fn have_exif_time(paths: &[PathBuf]) -> Result<bool, String> {
    match paths
        .iter()
        .take(MAX_SIZES_READ)
        .find_map(|path| Some((path, header::read_exif_time(open_file(path).ok()?)?)))
    {
        Some((path, Err(why))) => Err(format!("{}: {why}", path.display())),
        Some((_, Ok(time))) => Ok(time.is_some()),
        None => Ok(false),
    }
}

impl Files {
    /// Returns the picture of a file that is in the folder.
    pub(super) fn item(&self, path: PathBuf) -> Item {
        let name = self.name(&path);
        Item { name, time: self.time, stamp: None, data: None, payload: self.payload(path) }
    }

    fn name(&self, path: &Path) -> String {
        match path.file_name() {
            Some(name) if !self.with_folder => name.to_string_lossy().into_owned(),
            _ => path.to_string_lossy().into_owned(),
        }
    }

    fn payload(&self, path: PathBuf) -> Payload {
        match self.raw {
            Some(raw) => Payload::RawFile(path, raw),
            None => Payload::File(path),
        }
    }

    /// Returns the pictures with the same ending in the folder of `one`, in order.
    fn same_kind_in_folder(&self, one: &Path) -> Vec<PathBuf> {
        let folder = Some(&self.folder).filter(|f| !f.as_os_str().is_empty()).map_or(Path::new("."), |f| f);
        let paths = gather::list_folder(folder, self.raw.is_some(), &mut LeftOut::new()).unwrap_or_default();
        paths.into_iter().filter(|path| ending(path) == ending(one)).collect()
    }
}

impl Source for Files {
    fn next(&mut self) -> Option<Result<Item, Error>> {
        let path = self.paths.get(self.next)?.clone();
        self.next += 1;
        Some(Ok(self.item(path)))
    }
    fn total(&self) -> Option<u64> {
        Some(self.paths.len() as u64)
    }
    fn names(&self) -> Option<Box<dyn Iterator<Item = String> + '_>> {
        Some(Box::new(self.paths.iter().map(|path| self.name(path))))
    }
    fn sizes(&self) -> Box<dyn Iterator<Item = (String, (u32, u32))> + '_> {
        // The pictures are spread evenly over the whole sequence, because its beginning may be of another camera.
        let step = self.paths.len().div_ceil(MAX_SIZES_READ).max(1);
        let size = |path: &PathBuf| match self.raw {
            Some(raw) => Some(raw.size()),
            None => header::read_size(path),
        };
        Box::new(self.paths.iter().step_by(step).filter_map(move |p| Some((self.name(p), size(p)?))))
    }
    fn path(&self, frame: u64) -> Option<PathBuf> {
        // With a pattern over several folders, the picture alone would have another name than in frames.csv.
        let one = self.paths.get(usize::try_from(frame).ok()?)?;
        (!self.with_folder || !self.is_pattern).then(|| one.clone())
    }
    fn folder(&self) -> PathBuf {
        self.folder.clone()
    }
    fn files(&self) -> Vec<PathBuf> {
        self.paths.clone()
    }
    fn bits(&self) -> Option<u8> {
        // Words of mono16 can have any number of significant bits.
        self.raw.filter(|raw| raw.format != raw::Format::Words(16)).map(|raw| raw.bits())
    }
    fn tone(&self) -> Option<FoundTone> {
        // A picture without a header comes from a detector as it is.
        self.raw.map(|_| FoundTone { tone: Tone::Linear, kind: "raw" })
    }
    fn samples(&self) -> Box<dyn Iterator<Item = Payload> + '_> {
        let [one] = self.paths.as_slice() else {
            let path = |i: usize| self.paths.get(i).cloned();
            return Box::new(bits::places(self.paths.len()).filter_map(move |i| Some(self.payload(path(i)?))));
        };
        // A single picture of a sequence must give the same result as in the sequence.
        let others = self.same_kind_in_folder(one);
        let size = header::read_size(one);
        let is_same_size = move |path: &PathBuf| path != one && (self.raw.is_some() || header::read_size(path) == size);
        let sampled: Vec<PathBuf> = bits::places(others.len()).filter_map(|i| others.get(i).cloned()).collect();
        let others = sampled.into_iter().filter(is_same_size).map(|path| self.payload(path));
        Box::new(std::iter::once(self.payload(one.clone())).chain(others))
    }
    fn display_turn(&self) -> Option<(String, &'static str)> {
        if self.raw.is_some() {
            return None;
        }
        let turned = |path: &PathBuf| {
            let turn =
                header::read_orientation(open_file(path).ok()?).filter(|turn| *turn != Orientation::NoTransforms)?;
            Some((self.name(path), turn::describe(turn)))
        };
        // A camera writes the orientation into all pictures. Only a few are examined, because each is read as a whole.
        let step = self.paths.len().div_ceil(MAX_ORIENTATIONS_READ).max(1);
        self.paths.iter().step_by(step).find_map(turned)
    }
    fn want_channel(&mut self, channel: Channel) -> Result<(), Error> {
        self.raw.map_or(Ok(()), |raw| raw.check_channel(channel))
    }
    fn notes(&self) -> Vec<String> {
        let note = |((kind, ending), n): (&(Kind, String), &usize)| {
            let what = match kind {
                Kind::File => "file",
                Kind::Folder => "folder",
                Kind::Unlisted => {
                    let folders = explain::counted(*n as u64, "folder");
                    return format!("{folders} could not be listed and were left out; check the permissions");
                }
                Kind::Again => {
                    let paths = explain::counted(*n as u64, "path");
                    return format!("{paths} through links to pictures that are in the list already were left out");
                }
            };
            let name = if ending.is_empty() { "without an ending".to_owned() } else { format!("ending in .{ending}") };
            let were = if *n == 1 { "was" } else { "were" };
            format!("{} {name} {were} left out", explain::counted(*n as u64, what))
        };
        let mut notes: Vec<String> = self.left_out.iter().map(note).collect();
        notes.extend(self.unread_exif.as_ref().map(|why| {
            format!(
                "the EXIF of the pictures gives no time of exposure ({why}); without frames.csv, times are numbers of \
                 pictures divided by --fps"
            )
        }));
        notes.extend(self.out_of_order.as_ref().map(|[a, b]| {
            format!(
                "pictures are processed in the given order, {a} before {b}; give the folder, or the pattern in quotes, \
                 to sort them by number"
            )
        }));
        notes
    }
}
