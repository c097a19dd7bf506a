//! Paths and errors of files that are written, with advice for the user.

use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use hzn_mcap::part_path;

use crate::error::{Error, Remedy, failed, unusable};

/// Returns whether two paths lead to the same existing file or folder.
pub fn is_same(a: &Path, b: &Path) -> bool {
    let b = if b.as_os_str().is_empty() { Path::new(".") } else { b };
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// Refuses to write a file that is also read, under whatever name: by another path, or through a link. Each file that
/// is written counts with its `.part`.
///
/// # Errors
/// One of the files is read as well. The user may not replace it, so the error has no remedy.
pub fn refuse_inputs(read: &[PathBuf], written: &[PathBuf]) -> Result<(), Error> {
    let with_part = written.iter().flat_map(|path| [path.clone(), part_path(path)]);
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

/// Writes a file and checks that all of it arrived.
///
/// # Errors
/// The file cannot be written.
pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), Error> {
    let written = Checked::create(path).and_then(|mut file| file.write_all(bytes.as_ref()).and_then(|()| file.flush()));
    written.map_err(|e| cannot_write(path, &e))
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
}

impl Write for Checked {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes)
    }
    fn flush(&mut self) -> io::Result<()> {
        hzn_mcap::check_close(&self.0)
    }
}

/// Writes a text file completely or not at all: into `NAME.part`, which is then renamed.
///
/// # Errors
/// The file cannot be written. An earlier file of the name is then unchanged.
pub fn write_whole(path: &Path, text: &str) -> Result<(), Error> {
    let part = part_path(path);
    let written = std::fs::File::create(&part)
        .and_then(|mut file| file.write_all(text.as_bytes()).map(|()| file))
        .and_then(|file| hzn_mcap::publish(&file, &part, path));
    written.map_err(|e| {
        let _ = std::fs::remove_file(&part);
        cannot_write(path, &e)
    })
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
