//! The file of unfinished results. Only one run at a time may write it.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

/// Returns the name of a recording until it is finished: `out.mcap.part`.
pub fn part_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    name.into()
}

/// Returns the folder of `path`; the current folder if `path` has none.
pub(crate) fn parent_folder(path: &Path) -> PathBuf {
    match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

/// Opens an unfinished file with its content, or a new one, for reading and writing. The file is locked for this run
/// until it is closed.
///
/// # Errors
/// [`io::ErrorKind::ResourceBusy`] while another run writes the file; other errors of the system.
pub fn open_part(part: &Path) -> io::Result<File> {
    let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(part)?;
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => {
            let what = "another run is writing it; wait until that ends, or choose another name";
            Err(io::Error::new(io::ErrorKind::ResourceBusy, what))
        }
        // Some file systems have no locks.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(file),
    }
}

/// Opens an unfinished file as [`open_part`] does, and empties it.
///
/// # Errors
/// The errors are those of [`open_part`].
pub fn create_part(part: &Path) -> io::Result<File> {
    let file = open_part(part)?;
    // The length of a device cannot be changed.
    if file.metadata()?.len() > 0 {
        file.set_len(0)?;
    }
    Ok(file)
}

/// Returns whether another run is writing this unfinished file now.
pub fn is_being_written(part: &Path) -> bool {
    // Only a regular file is opened, because to open a pipe would wait for its other end.
    let is_file = fs::metadata(part).is_ok_and(|meta| meta.is_file());
    is_file && open_part(part).is_err_and(|e| e.kind() == io::ErrorKind::ResourceBusy)
}

/// Passes the content of a file to the disk: a power cut can no longer lose it.
///
/// # Errors
/// The disk fails. It is no error if the file is on a device or a file system that cannot do this.
pub fn sync(file: &File) -> io::Result<()> {
    ignore_impossible(file.sync_data())
}

/// Returns the error that the system would otherwise tell only when the file is closed, where nothing reads it. A
/// network file system reports a full disk or a lost server this late. The file stays open, because a second
/// descriptor of it is closed. On other systems than Unix this does nothing.
///
/// # Errors
/// The file is not completely written.
pub fn check_close(file: &File) -> io::Result<()> {
    #[cfg(unix)]
    nix::unistd::close(file.try_clone()?)?;
    #[cfg(not(unix))]
    let _ = file;
    Ok(())
}

/// Gives a finished file its final name. After a power cut, either the earlier file of that name is there, or this file
/// with all of its content.
///
/// # Errors
/// The disk fails.
pub fn publish(file: &File, part: &Path, path: &Path) -> io::Result<()> {
    // Without this order the disk may have the new name before it has the content.
    sync(file)?;
    check_close(file)?;
    rename(part, path)
}

/// Renames a file whose content is on the disk already, and passes the new name to the disk.
///
/// # Errors
/// The disk fails.
pub fn rename(from: &Path, to: &Path) -> io::Result<()> {
    fs::rename(from, to)?;
    sync_name(to)
}

/// Passes the entry of a file in its folder to the disk. Only Unix systems can do this; on others it does nothing.
///
/// # Errors
/// The disk fails.
pub fn sync_name(path: &Path) -> io::Result<()> {
    if !cfg!(unix) {
        return Ok(());
    }
    match File::open(parent_folder(path)) {
        Ok(folder) => ignore_impossible(folder.sync_all()),
        // A folder may be writable and not readable; then its entries cannot be passed on.
        Err(e) if e.kind() == io::ErrorKind::PermissionDenied => Ok(()),
        Err(e) => Err(e),
    }
}

fn ignore_impossible(synced: io::Result<()>) -> io::Result<()> {
    synced.or_else(|e| match e.kind() {
        io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported => Ok(()),
        _ => Err(e),
    })
}
