//! Paths and errors of files that are written, with advice for the user.

use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use hzn_mcap::part_path;

use crate::error::{Error, Remedy, failed, unusable};

/// Returns the name of the file next to an unfinished output that says which pictures were processed.
pub fn chain_path(path: &Path) -> PathBuf {
    let mut name = part_path(path).into_os_string();
    name.push(".chain");
    name.into()
}

/// Returns whether two paths lead to the same existing file or folder.
pub fn is_same(a: &Path, b: &Path) -> bool {
    let b = if b.as_os_str().is_empty() { Path::new(".") } else { b };
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// Refuses to write a file that is also read, under whatever name: by another path, or through a link. Each file that
/// is written counts with its `.part` and the file next to that.
///
/// # Errors
/// One of the files is read as well. The user may not replace it, so the error has no remedy.
pub fn refuse_inputs(read: &[PathBuf], written: &[PathBuf]) -> Result<(), Error> {
    let with_part = written.iter().flat_map(|path| [path.clone(), part_path(path), chain_path(path)]);
    refuse_inputs_exactly(read, &with_part.collect::<Vec<_>>())
}

/// Refuses files as [`refuse_inputs`] does, but without their `.part`.
///
/// # Errors
/// The errors are those of [`refuse_inputs`].
pub fn refuse_inputs_exactly(read: &[PathBuf], written: &[PathBuf]) -> Result<(), Error> {
    let written: HashMap<Place, &PathBuf> = written.iter().filter_map(|path| Some((place(path)?, path))).collect();
    let same = read.iter().find_map(|read| Some((read, written.get(&place(read)?)?)));
    let Some((read, written)) = same else { return Ok(()) };
    let other = if read == *written { String::new() } else { format!("{} ", read.display()) };
    let what = "itself and would be replaced; choose another name for the output";
    Err(unusable(format!("{}: is the input {other}{what}", written.display())))
}

/// Where a file is, whatever path leads there.
#[derive(PartialEq, Eq, Hash)]
enum Place {
    /// Device and number of the file on it.
    #[cfg(unix)]
    Node(u64, u64),
    /// The path without links, of a file that does not exist yet or whose system has no such numbers.
    Path(PathBuf),
}

fn place(path: &Path) -> Option<Place> {
    #[cfg(unix)]
    if let Ok(meta) = std::fs::metadata(path) {
        use std::os::unix::fs::MetadataExt;
        return Some(Place::Node(meta.dev(), meta.ino()));
    }
    let in_folder = || {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Some(folder.canonicalize().ok()?.join(path.file_name()?))
    };
    path.canonicalize().ok().or_else(in_folder).map(Place::Path)
}

/// Refuses a file that exists, unless it may be replaced.
///
/// # Errors
/// The file exists and `force` is false.
pub fn refuse_existing(path: &Path, force: bool) -> Result<(), Error> {
    if path.exists() && !force {
        return Err(unusable(format!("{}: exists already", path.display())).with_remedy(Remedy::Replace));
    }
    Ok(())
}

/// Writes a file completely or not at all: into `NAME.part`, which is then renamed.
///
/// # Errors
/// The file cannot be written. An earlier file of the name is then unchanged.
pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), Error> {
    let into = |file: io::Result<Checked>| file?.write_whole(bytes.as_ref());
    with_part(path, |part| into(Checked::create(part)).and_then(|()| std::fs::rename(part, target(path))))
        .unwrap_or_else(|| into(Checked::create(path)))
        .map_err(|e| cannot_write(path, &e))
}

/// Writes a text file as [`write()`] does, and waits until the disk has it.
///
/// # Errors
/// The errors are those of [`write()`].
pub fn write_whole(path: &Path, text: &str) -> Result<(), Error> {
    let durable = |part: &Path| {
        let mut file = File::create(part)?;
        file.write_all(text.as_bytes())?;
        hzn_mcap::publish(&file, part, &target(path))
    };
    with_part(path, durable)
        .unwrap_or_else(|| Checked::create(path)?.write_whole(text.as_bytes()))
        .map_err(|e| cannot_write(path, &e))
}

/// Writes a file by way of its `.part`, which is removed if that fails. Returns `None` for what cannot be renamed to: a
/// device or a pipe, and a file in a folder in which no other can be made.
fn with_part(path: &Path, write: impl FnOnce(&Path) -> io::Result<()>) -> Option<io::Result<()>> {
    let known = std::fs::metadata(path).ok();
    if known.as_ref().is_some_and(|known| !known.is_file()) {
        return None;
    }
    let part = part_path(&target(path));
    let written = write(&part);
    if written.is_err() {
        let _ = std::fs::remove_file(&part);
    }
    let no_room = |e: &io::Error| matches!(e.kind(), io::ErrorKind::PermissionDenied | io::ErrorKind::InvalidFilename);
    match written {
        Err(e) if known.is_some() && no_room(&e) => None,
        written => Some(written),
    }
}

/// Returns the file that a link leads to, so that a rename does not replace the link.
fn target(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}

/// A file whose [`flush`](Write::flush) also returns the errors that the system tells only when a file is closed.
/// The last step of a writer must therefore be a flush.
#[derive(Debug)]
pub struct Checked(File);

impl Checked {
    /// Creates a file, or empties it.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn create(path: &Path) -> io::Result<Self> {
        File::create(path).map(Self)
    }

    fn write_whole(mut self, bytes: &[u8]) -> io::Result<()> {
        self.write_all(bytes)?;
        self.flush()
    }
}

impl Write for Checked {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes)
    }
    fn flush(&mut self) -> io::Result<()> {
        hzn_mcap::check_close(&self.0)
    }
}

/// Refuses a file in a folder that does not exist, before any work is done for it.
///
/// # Errors
/// There is no such folder.
pub fn refuse_missing_folder(path: &Path) -> Result<(), Error> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    match folder.map(std::fs::metadata) {
        Some(Err(e)) => Err(unusable(advice(path, &e))),
        Some(Ok(folder)) if !folder.is_dir() => Err(unusable(advice(path, &io::ErrorKind::NotADirectory.into()))),
        _ => Ok(()),
    }
}

/// Returns the error for a file that cannot be written, with advice.
pub fn cannot_write(path: &Path, error: &std::io::Error) -> Error {
    failed(advice(path, error))
}

/// Returns the meaning of a write error, with advice.
pub fn advice(path: &Path, error: &std::io::Error) -> String {
    let name = path.display();
    match error.kind() {
        std::io::ErrorKind::StorageFull | std::io::ErrorKind::QuotaExceeded => {
            format!("{name}: the disk is full: free some space, or write elsewhere")
        }
        std::io::ErrorKind::PermissionDenied | std::io::ErrorKind::ReadOnlyFilesystem => {
            format!("{name}: no permission to write here; choose another folder for the output")
        }
        std::io::ErrorKind::FileTooLarge => {
            format!("{name}: the file is larger than the limit (ulimit -f): raise the limit, or write elsewhere")
        }
        std::io::ErrorKind::ResourceBusy => format!("{name}: {error}"),
        std::io::ErrorKind::NotFound => format!("{name}: the folder does not exist; create it first"),
        std::io::ErrorKind::NotADirectory => {
            format!("{name}: a part of this path is a file, not a folder; choose another folder for the output")
        }
        // This error comes from making a folder.
        std::io::ErrorKind::AlreadyExists => format!("{name}: is a file, not a folder; choose another name"),
        _ => format!("{name}: cannot be written: {error}"),
    }
}

/// Returns the text of [`advice`] for the file of a run. If the disk is full, it adds that finished pictures are kept.
#[cfg(feature = "recordings")]
pub(crate) fn run_advice(path: &Path, error: &std::io::Error) -> String {
    let what = advice(path, error);
    match error.kind() {
        std::io::ErrorKind::StorageFull | std::io::ErrorKind::QuotaExceeded | std::io::ErrorKind::FileTooLarge => {
            format!("{what}; finished pictures are kept; resume the run to continue after them")
        }
        _ => what,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_written_whole_or_stays_as_it_was() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        write(&at("a.toml"), "first").unwrap();
        write_whole(&at("a.toml"), "second").unwrap();
        assert_eq!(std::fs::read_to_string(at("a.toml")).unwrap(), "second");
        // The part cannot be made, as on a full disk, because a folder has its name.
        std::fs::create_dir(at("a.toml.part")).unwrap();
        assert!(write(&at("a.toml"), "third").is_err() && write_whole(&at("a.toml"), "third").is_err());
        assert_eq!(std::fs::read_to_string(at("a.toml")).unwrap(), "second");
        std::fs::create_dir(at("b.toml.part")).unwrap();
        assert!(write(&at("b.toml"), "new").is_err() && !at("b.toml").exists());
        let names = std::fs::read_dir(dir.path()).unwrap().count();
        assert_eq!(names, 3, "nothing else is left");
        assert!(write(&at("no/c.toml"), "").unwrap_err().to_string().contains("the folder does not exist"));
        assert!(refuse_missing_folder(&at("no/c.toml")).is_err() && refuse_missing_folder(&at("c.toml")).is_ok());
        assert!(refuse_missing_folder(Path::new("c.toml")).is_ok() && refuse_missing_folder(&at("a.toml/c")).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn links_and_devices_are_kept() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        write(&at("real"), "first").unwrap();
        std::os::unix::fs::symlink("real", at("link")).unwrap();
        write(&at("link"), "second").unwrap();
        assert!(at("link").is_symlink() && std::fs::read_to_string(at("real")).unwrap() == "second");
        write(Path::new("/dev/null"), "gone").unwrap();
        write_whole(Path::new("/dev/null"), "gone").unwrap();
    }
}
