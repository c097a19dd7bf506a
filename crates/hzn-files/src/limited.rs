//! Reads files up to a limit, so that a wrong file cannot fill the memory.
//!
//! The limits are far above the sizes of honest files. A device such as `/dev/zero` has no end and therefore reaches
//! the limit too.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Largest sensor.toml, scene.toml or fuse.toml in bytes. One with every key and comment has less than 50 KB; a parsed
/// TOML needs about 100 times its size in memory.
pub const SETTINGS_BYTES: u64 = 1 << 20;
/// Largest camera file of another tool, in bytes. OpenCV writes the points of every view into it: some megabytes.
pub const CAMERA_FILE_BYTES: u64 = 8 << 20;
/// Largest table that is read as a whole, in bytes: frames.csv, truth.csv, points. A million rows have about 200 MB.
pub const TABLE_BYTES: u64 = 512 << 20;

/// Reads a whole file of at most `limit` bytes.
///
/// # Errors
/// The file cannot be read, or is larger: [`io::ErrorKind::FileTooLarge`].
pub fn read(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path, limit)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Reads a whole text of at most `limit` bytes.
///
/// # Errors
/// The errors are those of [`read`], and [`io::ErrorKind::InvalidData`] for a file that is not UTF-8.
pub fn read_text(path: &Path, limit: u64) -> io::Result<String> {
    String::from_utf8(read(path, limit)?).map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "is not UTF-8 text"))
}

/// Opens a file that is read from its beginning to its end. After `limit` bytes, reading is an error.
///
/// # Errors
/// The file cannot be opened, or is larger: [`io::ErrorKind::FileTooLarge`].
pub fn open(path: &Path, limit: u64) -> io::Result<Limited<File>> {
    let file = File::open(path)?;
    // The size of a device or a pipe is 0, so these are limited only while they are read.
    if file.metadata()?.len() > limit { Err(too_large(limit)) } else { Ok(Limited { file, left: limit, limit }) }
}

/// A file that gives an error after a limit.
#[derive(Debug)]
pub struct Limited<R> {
    file: R,
    left: u64,
    limit: u64,
}

impl<R: Read> Read for Limited<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.file.read(buffer)?;
        self.left = self.left.checked_sub(n as u64).ok_or_else(|| too_large(self.limit))?;
        Ok(n)
    }
}

fn too_large(limit: u64) -> io::Error {
    let what = match limit >> 20 {
        0 => format!("is larger than {limit} bytes; such a file is expected to be smaller"),
        mb => format!("is larger than {mb} MB; such a file is expected to be smaller"),
    };
    io::Error::new(io::ErrorKind::FileTooLarge, what)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_up_to_the_limit_are_read() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a");
        std::fs::write(&path, "12345").unwrap();
        assert_eq!(read_text(&path, 5).unwrap(), "12345");
        let e = read(&path, 4).unwrap_err();
        assert_eq!(e.kind(), io::ErrorKind::FileTooLarge);
        assert!(e.to_string().contains("larger than 4 bytes"), "{e}");
        std::fs::write(&path, [0xff]).unwrap();
        assert_eq!(read_text(&path, 5).unwrap_err().kind(), io::ErrorKind::InvalidData);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_device_without_an_end_is_refused() {
        let e = read(Path::new("/dev/zero"), 1 << 20).unwrap_err();
        assert!(e.to_string().contains("larger than 1 MB"), "{e}");
    }
}
