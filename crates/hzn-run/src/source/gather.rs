//! Gathers the picture files of the inputs: of a folder, of a pattern, or of a list.

use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

use super::paths::ending;
use super::{natural, pattern, video};
use crate::error::{Error, Remedy, unusable};

/// Endings of the picture files that can be read.
const PICTURES: &[&str] = &[
    "png", "jpg", "jpeg", "jpe", "tif", "tiff", "pnm", "pgm", "ppm", "pbm", "bmp", "webp", "fits", "fit", "fts", "npy",
];
/// Endings of files that often lie next to pictures but are not pictures.
const COMPANIONS: &[&str] = &["csv", "toml", "txt", "md", "json", "jsonl", "yaml", "yml", "xml", "log", "mcap", "part"];

/// Files and other things that were left out, counted by kind and ending.
pub(super) type LeftOut = BTreeMap<(Kind, String), usize>;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    File,
    Folder,
    /// A file that was found before, because a link leads to its folder.
    Again,
    /// A folder that could not be listed.
    Unlisted,
}

impl Kind {
    /// Everything that is no folder counts as a file. A link into an archive that is not mounted, a device or a pipe
    /// with the name of a picture is a picture that cannot be read.
    fn from_path(path: &Path) -> Self {
        if path.is_dir() { Self::Folder } else { Self::File }
    }
}

/// Removes everything that is not a file, and counts it in `left_out`.
fn retain_files(paths: &mut Vec<PathBuf>, left_out: &mut LeftOut) {
    paths.retain(|p| {
        let kind = Kind::from_path(p);
        if kind != Kind::File {
            *left_out.entry((kind, ending(p))).or_default() += 1;
        }
        kind == Kind::File
    });
}

/// Keeps one path to each name in each folder, the shortest. A link to a folder above it leads to the same pictures on
/// ever longer paths. Links to single pictures stay: whoever gave a picture two names wants two rows.
fn retain_places(paths: &mut Vec<PathBuf>) {
    paths.sort_by_cached_key(|path| (path.components().count(), path.clone()));
    let mut places = HashSet::new();
    paths.retain(|path| {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
        places.insert(folder.join(path.file_name().unwrap_or_default()))
    });
}

/// The picture files of the inputs.
#[derive(Default)]
pub(super) struct Gathered {
    /// The files, in order.
    pub(super) paths: Vec<PathBuf>,
    /// The folder, if the input is one.
    pub(super) folder: Option<PathBuf>,
    /// What was left out.
    pub(super) left_out: LeftOut,
}

impl Gathered {
    /// Gathers the files; `raw` says that they have no header.
    pub(super) fn from_inputs(inputs: &[PathBuf], raw: bool) -> Result<Self, Error> {
        let mut gathered = Self::default();
        for input in inputs {
            gathered.add(input, inputs.len() == 1, raw)?;
        }
        match gathered.paths.first() {
            None => Err(gathered.empty(inputs, raw)),
            // Nothing is there: the list is wrong as a whole, or it belongs to another folder.
            Some(first) if gathered.paths.iter().all(|path| is_nothing(path)) => Err(missing(first)),
            Some(first) if gathered.paths.iter().all(|path| path.is_dir() || is_nothing(path)) && inputs.len() > 1 => {
                Err(unusable(format!(
                    "{}: a folder cannot be combined with other inputs; give one folder, or only files",
                    first.display()
                )))
            }
            Some(_) => Ok(gathered),
        }
    }

    /// Adds the files of one input; `alone` says that there is no other input.
    fn add(&mut self, input: &Path, alone: bool, raw: bool) -> Result<(), Error> {
        let text = input.to_string_lossy();
        if input.is_dir() && !alone {
            // Its row says that it cannot be read, as that of a missing picture does, and the others count.
            self.paths.push(input.to_owned());
            Ok(())
        } else if input.is_dir() {
            self.folder = Some(input.to_owned());
            self.paths.extend(list_folder(input, raw, &mut self.left_out)?);
            Ok(())
        } else if input.exists() || (!alone && input.is_symlink()) {
            self.add_file(input, alone, raw)
        } else if text.contains(['*', '?', '[']) {
            self.add_pattern(&text, raw)
        } else if !alone && (raw || PICTURES.contains(&ending(input).as_str())) {
            // Another program may delete a picture between the list and the run. Its row says so, and the others count.
            self.paths.push(input.to_owned());
            Ok(())
        } else {
            Err(missing(input))
        }
    }

    fn add_file(&mut self, input: &Path, alone: bool, raw: bool) -> Result<(), Error> {
        let text = input.display();
        if !alone && (ending(input) == "mcap" || video::ENDINGS.contains(&ending(input).as_str())) {
            return Err(unusable(format!(
                "{text}: a video or a recording cannot be combined with other inputs; give it alone"
            )));
        }
        if !raw && COMPANIONS.contains(&ending(input).as_str()) {
            // The shell expands `hzn run flight/*` to a list that contains these files.
            if alone {
                // The programs of thermal arrays write tables.
                let hint = match ending(input).as_str() {
                    "csv" => {
                        "; a table of temperatures becomes one with numpy.save(\"a.npy\", numpy.loadtxt(\"a.csv\", \
                              delimiter=\",\"))"
                    }
                    _ => "",
                };
                return Err(unusable(format!(
                    "{text}: is not a picture (PNG, JPEG, TIFF, PNM, BMP, WebP, FITS, NumPy){hint}"
                )));
            }
            return Ok(());
        }
        self.paths.push(input.to_owned());
        Ok(())
    }

    fn add_pattern(&mut self, text: &str, raw: bool) -> Result<(), Error> {
        let matches = pattern::find(text).map_err(|e| unusable(format!("{text}: not a valid pattern: {e}")))?;
        if matches.unlisted > 0 {
            *self.left_out.entry((Kind::Unlisted, String::new())).or_default() += matches.unlisted;
        }
        let mut found = matches.paths;
        found.retain(|p| match Kind::from_path(p) {
            Kind::File => raw || !COMPANIONS.contains(&ending(p).as_str()),
            _ => PICTURES.contains(&ending(p).as_str()),
        });
        retain_files(&mut found, &mut self.left_out);
        let paths = found.len();
        retain_places(&mut found);
        if let Some(again) = paths.checked_sub(found.len()).filter(|n| *n > 0) {
            *self.left_out.entry((Kind::Again, String::new())).or_default() += again;
        }
        if found.is_empty() {
            return Err(unusable(format!("{text}: no picture matches")));
        }
        found.sort_by(|a, b| natural::compare(a, b));
        self.paths.extend(found);
        Ok(())
    }

    /// Returns the error for inputs without a picture.
    fn empty(&self, inputs: &[PathBuf], raw: bool) -> Error {
        let what =
            if raw { "no headerless files" } else { "no pictures (PNG, JPEG, TIFF, PNM, BMP, WebP, FITS, NumPy)" };
        let name = inputs.first().map(|p| p.display().to_string()).unwrap_or_default();
        let what = format!("{name}: {what} in this folder");
        if let Some(recording) = inputs.first().and_then(|folder| first_recording(folder)) {
            return unusable(format!(
                "{what}; there are recordings, so give one of them, such as {}. The folder of a bag of ROS 2 has a \
                 metadata.yaml, which `ros2 bag reindex` writes",
                recording.display()
            ));
        }
        match self.left_out.keys().next() {
            Some((Kind::File, e)) => unusable(format!("{what}; there are files ending in .{e}: convert them"))
                .with_remedy(Remedy::Headerless),
            _ => unusable(what),
        }
    }
}

/// Returns the first recording in a folder.
fn first_recording(folder: &Path) -> Option<PathBuf> {
    let paths = std::fs::read_dir(folder).ok()?.flatten().map(|entry| entry.path());
    paths.filter(|path| ending(path) == "mcap").min_by(|a, b| natural::compare(a, b))
}

/// Returns whether there is neither a file nor a link with this name.
fn is_nothing(path: &Path) -> bool {
    !path.exists() && !path.is_symlink()
}

fn missing(input: &Path) -> Error {
    unusable(format!("{}: no such file or folder", input.display()))
}

/// Returns the pictures of a folder in order, and counts other files in `left_out`.
pub(super) fn list_folder(folder: &Path, raw: bool, left_out: &mut LeftOut) -> Result<Vec<PathBuf>, Error> {
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
    retain_files(&mut paths, left_out);
    // The paths are sorted by name, so that the order does not depend on the file system.
    paths.sort_by(|a, b| natural::compare(a, b));
    Ok(paths)
}
