//! The file of unfinished results. Only one run at a time may write it.

use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

/// Returns the name of a recording until it is finished: `out.mcap.part`.
pub fn part_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    name.into()
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
