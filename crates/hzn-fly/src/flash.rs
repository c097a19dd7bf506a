//! The memory that a reset leaves: two copies of the parameters, and a few words. Every file is written completely or
//! not at all.

use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use hzn_flight::board::RETAINED_WORDS;
use hzn_mcap::part_path;

use crate::error::Error;

/// Length of the identifier that the kernel gives each start of the computer.
const BOOT_ID: usize = 36;
/// Length of the file with the words: identifier, words, whether the program runs.
const RETAINED: usize = BOOT_ID + 4 * RETAINED_WORDS + 1;

/// Returns the files that a folder holds for a reset: two copies of the parameters, and the words.
pub fn files(folder: &Path) -> [PathBuf; 3] {
    [copy_path(folder, 1), copy_path(folder, 2), words_path(folder)]
}

/// Returns the error for a folder that cannot be opened, with advice if nothing can be written there.
pub(crate) fn refused(folder: &Path, error: &io::Error) -> Error {
    let advice = match error.kind() {
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "; parameters and log need a folder that can be written: --state names another one"
        }
        _ => "",
    };
    Error::failed(format!("{}: {error}{advice}", folder.display()))
}

fn copy_path(folder: &Path, copy: u8) -> PathBuf {
    folder.join(format!("parameters-{copy}.bin"))
}

fn words_path(folder: &Path) -> PathBuf {
    folder.join("retained.bin")
}

/// A folder that holds what a reset leaves.
#[derive(Debug)]
pub struct Flash {
    folder: PathBuf,
    /// The lock that keeps a second program out.
    _lock: File,
    boot_id: Vec<u8>,
    words: [u32; RETAINED_WORDS],
    was_cut_off: bool,
}

impl Flash {
    /// Opens the folder, which is made if it does not exist.
    ///
    /// # Errors
    /// Another program uses the folder ([`io::ErrorKind::ResourceBusy`]), or it cannot be written.
    pub fn open(folder: &Path) -> io::Result<Self> {
        Self::open_as(folder, fs::read("/proc/sys/kernel/random/boot_id").unwrap_or_default())
    }

    fn open_as(folder: &Path, mut boot_id: Vec<u8>) -> io::Result<Self> {
        fs::create_dir_all(folder)?;
        let lock = File::options().write(true).create(true).truncate(false).open(folder.join("lock"))?;
        if let Err(TryLockError::WouldBlock) = lock.try_lock() {
            let what = "another `hzn fly` uses this folder; end it, or choose another folder with --state";
            return Err(io::Error::new(io::ErrorKind::ResourceBusy, what));
        }
        boot_id.truncate(BOOT_ID);
        let mut flash =
            Self { folder: folder.to_owned(), _lock: lock, boot_id, words: [0; RETAINED_WORDS], was_cut_off: false };
        flash.read_words();
        Ok(flash)
    }

    /// Returns the folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }
    /// Returns whether a copy of the parameters was ever stored here.
    pub fn has_copies(&self) -> bool {
        [1, 2].iter().any(|&copy| copy_path(&self.folder, copy).exists())
    }
    /// Reads copy 1 or 2 of the parameters. What the file does not have is 0xFF, as in erased flash.
    pub fn read_copy(&self, copy: u8, into: &mut [u8]) {
        into.fill(0xFF);
        let bytes = fs::read(copy_path(&self.folder, copy)).unwrap_or_default();
        let n = bytes.len().min(into.len());
        if let (Some(room), Some(bytes)) = (into.get_mut(..n), bytes.get(..n)) {
            room.copy_from_slice(bytes);
        }
    }
    /// Writes copy 1 or 2 of the parameters. Afterwards the bytes are on the disk.
    ///
    /// # Errors
    /// The disk fails or is full. The earlier copy is then unchanged.
    pub fn write_copy(&self, copy: u8, bytes: &[u8]) -> io::Result<()> {
        let path = copy_path(&self.folder, copy);
        let part = part_path(&path);
        let written = File::create(&part)
            .and_then(|mut file| file.write_all(bytes).map(|()| file))
            .and_then(|file| hzn_mcap::publish(&file, &part, &path));
        written.inspect_err(|_| {
            let _ = fs::remove_file(&part);
        })
    }

    /// Returns the words that the last program left since the computer was switched on; else zeros.
    pub fn words(&self) -> [u32; RETAINED_WORDS] {
        self.words
    }
    /// Returns whether the last program ended without [`Self::end`]: it crashed, was killed, or hung until the watchdog
    /// killed it.
    pub fn was_cut_off(&self) -> bool {
        self.was_cut_off
    }
    /// Keeps words for the next program. They need not survive a power cut, so they are not forced to the disk.
    pub fn keep_words(&mut self, words: [u32; RETAINED_WORDS]) {
        self.words = words;
        self.write_words(true);
    }
    /// Takes note that the program ends as it should.
    pub fn end(&self) {
        self.write_words(false);
    }

    fn write_words(&self, runs: bool) {
        let mut bytes = self.boot_id.clone();
        bytes.extend(self.words.iter().flat_map(|word| word.to_le_bytes()));
        bytes.push(u8::from(runs));
        let part = part_path(&words_path(&self.folder));
        // If it fails, the next program starts as after power-on.
        let _ = fs::write(&part, bytes).and_then(|()| fs::rename(&part, words_path(&self.folder)));
    }

    fn read_words(&mut self) {
        let Ok(bytes) = fs::read(words_path(&self.folder)) else { return };
        // After power-on the identifier is another one.
        if self.boot_id.len() != BOOT_ID || bytes.len() != RETAINED || !bytes.starts_with(&self.boot_id) {
            return;
        }
        let words = bytes.get(BOOT_ID..).unwrap_or_default().chunks_exact(4);
        for (word, bytes) in self.words.iter_mut().zip(words) {
            *word = bytes.first_chunk().map_or(0, |b| u32::from_le_bytes(*b));
        }
        self.was_cut_off = bytes.last() == Some(&1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HERE: &[u8; 36] = b"01234567-89ab-cdef-0123-456789abcdef";

    #[test]
    fn copies_are_kept_and_a_second_program_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let flash = Flash::open(dir.path()).unwrap();
        assert!(!flash.has_copies());
        flash.write_copy(2, b"table").unwrap();
        let mut bytes = [0; 7];
        flash.read_copy(2, &mut bytes);
        assert_eq!((&bytes, flash.has_copies()), (b"table\xff\xff", true));
        flash.read_copy(1, &mut bytes);
        assert_eq!(bytes, [0xFF; 7]);
        assert_eq!(Flash::open(dir.path()).unwrap_err().kind(), io::ErrorKind::ResourceBusy);
        // A copy that cannot be written leaves the earlier one.
        fs::create_dir(dir.path().join("parameters-2.bin.part")).unwrap();
        assert!(flash.write_copy(2, b"other").is_err());
        flash.read_copy(2, &mut bytes);
        assert_eq!(&bytes, b"table\xff\xff");
    }

    #[test]
    fn words_survive_a_crash_and_no_power_cut() {
        let dir = tempfile::tempdir().unwrap();
        let open = |id: &[u8]| Flash::open_as(dir.path(), id.to_vec()).unwrap();
        assert!(!open(HERE).was_cut_off());
        open(HERE).keep_words([1, 2, 3, 4]);
        let crashed = open(HERE);
        assert_eq!((crashed.words(), crashed.was_cut_off()), ([1, 2, 3, 4], true));
        crashed.end();
        drop(crashed);
        let stopped = open(HERE);
        assert_eq!((stopped.words(), stopped.was_cut_off()), ([1, 2, 3, 4], false));
        drop(stopped);
        let after_power_on = open(b"11234567-89ab-cdef-0123-456789abcdef");
        assert_eq!((after_power_on.words(), after_power_on.was_cut_off()), ([0; 4], false));
        drop(after_power_on);
        // Without an identifier nothing is known.
        open(HERE).keep_words([1, 2, 3, 4]);
        assert_eq!(open(b"").words(), [0; 4]);
    }
}
