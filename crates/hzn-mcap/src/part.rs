//! The file that results have until they are finished, which one run at a time may write.

use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

/// The name a recording has until it is finished: `out.mcap.part`.
pub fn part_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    name.into()
}

/// Opens an unfinished file with what is in it, or a new one, for reading and writing. It is this run's until it is
/// closed.
///
/// # Errors
/// [`io::ErrorKind::ResourceBusy`] while another run writes it; whatever the system says.
pub fn open_part(part: &Path) -> io::Result<File> {
    let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(part)?;
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => {
            let what = "another run is writing it; wait until that ends, or choose another name";
            Err(io::Error::new(io::ErrorKind::ResourceBusy, what))
        }
        // Not every file system has locks.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(file),
    }
}

/// As [`open_part`], empty.
///
/// # Errors
/// As [`open_part`].
pub fn create_part(part: &Path) -> io::Result<File> {
    let file = open_part(part)?;
    // A device has no length to be cut to.
    if file.metadata()?.len() > 0 {
        file.set_len(0)?;
    }
    Ok(file)
}
