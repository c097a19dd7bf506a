//! Errors of recordings, with remedies.

use std::io;
use std::path::{Path, PathBuf};

use crate::container::REWRITE;
use crate::part::parent_folder;

/// Why a recording could not be written or read. The message names a remedy if there is one.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The output already exists and `force` is not set.
    #[error("{} exists: choose another name, or replace it", path.display())]
    Exists {
        /// The output that exists.
        path: PathBuf,
    },
    /// The file of an unfinished run exists next to the output.
    #[error("{} is from an unfinished run: continue that run, or start over", path.display())]
    Unfinished {
        /// The unfinished file.
        path: PathBuf,
    },
    /// The disk is full.
    #[error(
        "no space is left on the disk of {}: free some space, or write elsewhere; finished frames are kept in {}; \
         resume the run to continue from there",
        folder.display(), part.display()
    )]
    DiskFull {
        /// The folder that is full.
        folder: PathBuf,
        /// The unfinished file.
        part: PathBuf,
    },
    /// The folder cannot be written to.
    #[error("cannot write into the folder {}: {source}; make it writable or choose another", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// Another error of the system while writing.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// The file cannot be opened or read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// The file does not begin with the magic bytes of an MCAP.
    #[error("{} is not an MCAP file: it does not begin with the MCAP magic bytes", path.display())]
    NotMcap {
        /// The file.
        path: PathBuf,
    },
    /// The MCAP contains data that cannot be decoded.
    #[error("{} cannot be decoded: {detail}", path.display())]
    Decode {
        /// The file.
        path: PathBuf,
        /// The data, their place and the reason.
        detail: String,
    },
    /// The data are compressed with a method that hzn does not know.
    #[error("{} is compressed with {compression:?}, which hzn does not read: {REWRITE}", path.display())]
    Compression {
        /// The file.
        path: PathBuf,
        /// Name of the compression.
        compression: String,
    },
    /// The unfinished run was made with another sensor.toml.
    #[error(
        "{} was begun with another sensor.toml: resume with the same one, or start over", path.display()
    )]
    OtherSensor {
        /// The unfinished file.
        path: PathBuf,
    },
    /// The unfinished file was not written by hzn, so it cannot be continued.
    #[error("{} is not a recording of hzn: choose another name for the output", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// A picture or an annotation list is too large for a record.
    #[error("a record of {bytes} bytes is too large for a recording (at most {limit})")]
    TooLarge {
        /// Size of the record in bytes.
        bytes: u64,
        /// Largest size in bytes.
        limit: u64,
    },
    /// The caller stopped the recovery.
    #[error("recovering {} was stopped: nothing was written", path.display())]
    Stopped {
        /// The recording that should be recovered.
        path: PathBuf,
    },
    /// An earlier write failed; the recording takes no further frames.
    #[error(
        "an earlier write to {} failed: finished frames are kept there; resume the run to continue", path.display()
    )]
    AfterFailure {
        /// The unfinished file.
        path: PathBuf,
    },
}

/// Converts an error of writing to `path` to the variant with its remedy.
pub(crate) fn while_writing(path: &Path, source: io::Error) -> Error {
    match source.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            Error::DiskFull { folder: parent_folder(path), part: path.to_path_buf() }
        }
        io::ErrorKind::FileTooLarge => {
            let what = "the file exceeds the largest allowed size (ulimit -f); finished frames are kept; resume the \
                        run to continue with them";
            Error::Write { path: path.to_path_buf(), source: io::Error::new(io::ErrorKind::FileTooLarge, what) }
        }
        io::ErrorKind::PermissionDenied
        | io::ErrorKind::NotFound
        | io::ErrorKind::NotADirectory
        | io::ErrorKind::ReadOnlyFilesystem => Error::Folder { folder: parent_folder(path), source },
        _ => Error::Write { path: path.to_path_buf(), source },
    }
}
