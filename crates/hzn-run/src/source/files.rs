//! Pictures in separate files: a folder, a glob, or a list.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use hzn_core::image::Channel;
use image::metadata::Orientation;

use super::{Item, Payload, Raw, SIZES, Source, TimeSource, bits, ending, natural, picture, raw, turn, video};
use crate::error::{Error, Remedy, unusable};
use crate::explain;

/// Endings of the picture files that can be read.
const PICTURES: &[&str] = &["png", "jpg", "jpeg", "jpe", "tif", "tiff", "pnm", "pgm", "ppm", "pbm", "bmp"];
/// Endings of files that often lie next to pictures but are not pictures.
const COMPANIONS: &[&str] = &["csv", "toml", "txt", "md", "json", "jsonl", "yaml", "yml", "xml", "log", "mcap", "part"];

/// Number of pictures whose orientation is read.
const TURNED: usize = 4;

pub(super) struct Files {
    paths: Vec<PathBuf>,
    /// Number of files that were handed out.
    given: usize,
    folder: PathBuf,
    raw: Option<Raw>,
    time: TimeSource,
    /// Names include the folder, because the files lie in several folders.
    with_folder: bool,
    left_out: LeftOut,
    /// Two pictures whose order in the list differs from the order of their numbers.
    out_of_order: Option<[String; 2]>,
    /// The input is a single pattern.
    is_pattern: bool,
}

/// Files and other things that were left out, counted by kind and ending.
type LeftOut = BTreeMap<(Kind, String), usize>;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    File,
    Folder,
    /// A device, a pipe, a socket.
    Special,
}

impl Kind {
    /// A path without metadata counts as a file: it is a picture that cannot be read, such as a link into an archive
    /// that is not mounted.
    fn from_path(path: &Path) -> Self {
        match std::fs::metadata(path) {
            Ok(meta) if meta.is_dir() => Self::Folder,
            Ok(meta) if !meta.is_file() => Self::Special,
            _ => Self::File,
        }
    }
}

/// Removes everything that is not a file, and counts it in `left_out`.
fn only_files(paths: &mut Vec<PathBuf>, left_out: &mut LeftOut) {
    paths.retain(|p| {
        let kind = Kind::from_path(p);
        if kind != Kind::File {
            *left_out.entry((kind, ending(p))).or_default() += 1;
        }
        kind == Kind::File
    });
}

impl Files {
    pub(super) fn open(inputs: &[PathBuf], raw: Option<Raw>) -> Result<Self, Error> {
        let mut left_out = LeftOut::new();
        let mut paths = Vec::new();
        let mut folder = None;
        for input in inputs {
            let text = input.to_string_lossy();
            if input.is_dir() {
                if inputs.len() > 1 {
                    return Err(unusable(format!(
                        "{text}: a folder cannot be combined with other inputs; give one folder, or only files"
                    )));
                }
                folder = Some(input.clone());
                paths.extend(in_folder(input, raw.is_some(), &mut left_out)?);
            } else if input.exists() || (inputs.len() > 1 && input.is_symlink()) {
                if inputs.len() > 1 && (ending(input) == "mcap" || video::ENDINGS.contains(&ending(input).as_str())) {
                    return Err(unusable(format!(
                        "{text}: a video or a recording cannot be combined with other inputs; give it alone"
                    )));
                }
                if raw.is_none() && COMPANIONS.contains(&ending(input).as_str()) {
                    // The shell expands `hzn run flight/*` to a list that contains these files.
                    if inputs.len() == 1 {
                        return Err(unusable(format!("{text}: is not a picture (PNG, JPEG, TIFF, PNM, BMP)")));
                    }
                    continue;
                }
                paths.push(input.clone());
            } else if text.contains(['*', '?', '[']) {
                let matches = glob::glob(&text).map_err(|e| unusable(format!("{text}: not a valid pattern: {e}")))?;
                let mut found: Vec<PathBuf> = matches.flatten().collect();
                found.retain(|p| match Kind::from_path(p) {
                    Kind::File => raw.is_some() || !COMPANIONS.contains(&ending(p).as_str()),
                    _ => PICTURES.contains(&ending(p).as_str()),
                });
                only_files(&mut found, &mut left_out);
                if found.is_empty() {
                    return Err(unusable(format!("{text}: no picture matches")));
                }
                found.sort_by(|a, b| natural::compare(a, b));
                paths.extend(found);
            } else {
                return Err(unusable(format!("{text}: no such file or folder")));
            }
        }
        if paths.is_empty() {
            let what = if raw.is_some() { "no headerless files" } else { "no pictures (PNG, JPEG, TIFF, PNM, BMP)" };
            let name = inputs.first().map(|p| p.display().to_string()).unwrap_or_default();
            let what = format!("{name}: {what} in this folder");
            return Err(match left_out.keys().next() {
                Some((Kind::File, e)) => {
                    unusable(format!("{what}; there are files ending in .{e}: convert them")).with(Remedy::Headerless)
                }
                _ => unusable(what),
            });
        }
        let parent = |p: &PathBuf| p.parent().map(Path::to_owned).unwrap_or_default();
        let first = paths.first().map(parent).unwrap_or_default();
        let with_folder = paths.iter().any(|p| parent(p) != first);
        let folder = folder.unwrap_or(first);
        let time = if raw.is_none() && tell_their_time(&paths) { TimeSource::Exif } else { TimeSource::Count };
        let out_of_order = out_of_order(&paths);
        let is_pattern = matches!(inputs, [one] if !one.exists());
        Ok(Self { paths, given: 0, folder, raw, time, with_folder, left_out, out_of_order, is_pattern })
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
fn tell_their_time(paths: &[PathBuf]) -> bool {
    paths.iter().take(SIZES).find_map(|p| picture::exif_of(p)).flatten().is_some()
}

fn in_folder(folder: &Path, raw: bool, left_out: &mut LeftOut) -> Result<Vec<PathBuf>, Error> {
    let cannot = |e: std::io::Error| unusable(format!("{}: cannot be listed: {e}", folder.display()));
    let list = std::fs::read_dir(folder).map_err(cannot)?;
    let mut paths = list.map(|e| Ok(e.map_err(cannot)?.path())).collect::<Result<Vec<PathBuf>, Error>>()?;
    paths.retain(|p| {
        let e = ending(p);
        let hidden = p.file_name().is_some_and(|n| n.to_string_lossy().starts_with('.'));
        let (picture, companion) = (PICTURES.contains(&e.as_str()), COMPANIONS.contains(&e.as_str()) || hidden);
        let take = if raw { !picture && !companion } else { picture };
        if !take && !companion && Kind::from_path(p) == Kind::File {
            *left_out.entry((Kind::File, e)).or_default() += 1;
        }
        take
    });
    only_files(&mut paths, left_out);
    // The paths are sorted by name, so that the order does not depend on the file system.
    paths.sort_by(|a, b| natural::compare(a, b));
    Ok(paths)
}

impl Files {
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
    fn alike_in_folder(&self, one: &Path) -> Vec<PathBuf> {
        let folder = Some(&self.folder).filter(|f| !f.as_os_str().is_empty()).map_or(Path::new("."), |f| f);
        let paths = in_folder(folder, self.raw.is_some(), &mut LeftOut::new()).unwrap_or_default();
        paths.into_iter().filter(|path| ending(path) == ending(one)).collect()
    }
}

impl Source for Files {
    fn next(&mut self) -> Option<anyhow::Result<Item>> {
        let path = self.paths.get(self.given)?.clone();
        self.given += 1;
        let name = self.name(&path);
        let payload = self.payload(path);
        Some(Ok(Item { name, time: self.time, data: None, payload }))
    }
    fn total(&self) -> Option<u64> {
        Some(self.paths.len() as u64)
    }
    fn sizes(&self) -> Box<dyn Iterator<Item = (String, (u32, u32))> + '_> {
        // The pictures are spread evenly over the whole sequence, because its beginning may be of another camera.
        let step = self.paths.len().div_ceil(SIZES).max(1);
        let size = |path: &PathBuf| match self.raw {
            Some(raw) => Some(raw.size()),
            None => picture::size_of(path),
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
    fn bits(&self) -> Option<u8> {
        // Words of mono16 can have any number of significant bits.
        self.raw.filter(|raw| raw.format != raw::Format::Words(16)).map(|raw| raw.bits())
    }
    fn samples(&self) -> Box<dyn Iterator<Item = Payload> + '_> {
        let [one] = self.paths.as_slice() else {
            let path = |i: usize| self.paths.get(i).cloned();
            return Box::new(bits::places(self.paths.len()).filter_map(move |i| Some(self.payload(path(i)?))));
        };
        // A single picture of a sequence must give the same result as in the sequence.
        let others = self.alike_in_folder(one);
        let size = picture::size_of(one);
        let alike = move |path: &PathBuf| path != one && (self.raw.is_some() || picture::size_of(path) == size);
        let sampled: Vec<PathBuf> = bits::places(others.len()).filter_map(|i| others.get(i).cloned()).collect();
        let others = sampled.into_iter().filter(alike).map(|path| self.payload(path));
        Box::new(std::iter::once(self.payload(one.clone())).chain(others))
    }
    fn to_be_turned(&self) -> Option<(String, &'static str)> {
        if self.raw.is_some() {
            return None;
        }
        let turned = |path: &PathBuf| {
            let turn = picture::orientation_of(path).filter(|turn| *turn != Orientation::NoTransforms)?;
            Some((self.name(path), turn::in_words(turn)))
        };
        // A camera writes the orientation into all pictures. Only a few are examined, because each is read as a whole.
        let step = self.paths.len().div_ceil(TURNED).max(1);
        self.paths.iter().step_by(step).find_map(turned)
    }
    fn want_channel(&mut self, channel: Channel) -> Result<(), Error> {
        match self.raw {
            Some(raw) if channel != Channel::Mean && raw.format == raw::Format::Bayer8 => Err(unusable(format!(
                "raw pictures, {raw}: every cell of a Bayer mosaic becomes one grey pixel; set channel = \"mean\" in \
                    [input] of sensor.toml"
            ))),
            _ => Ok(()),
        }
    }
    fn notes(&self) -> Vec<String> {
        let note = |((kind, ending), n): (&(Kind, String), &usize)| {
            let what = match kind {
                Kind::File => "file",
                Kind::Folder => "folder",
                Kind::Special => "special file",
            };
            let name = if ending.is_empty() { "without an ending".to_owned() } else { format!("ending in .{ending}") };
            let were = if *n == 1 { "was" } else { "were" };
            format!("{} {name} {were} left out", explain::counted(*n as u64, what))
        };
        let mut notes: Vec<String> = self.left_out.iter().map(note).collect();
        notes.extend(self.out_of_order.as_ref().map(|[a, b]| {
            format!(
                "pictures are processed in the given order, {a} before {b}; give the folder, or the pattern in quotes, \
                 to sort them by number"
            )
        }));
        notes
    }
}
