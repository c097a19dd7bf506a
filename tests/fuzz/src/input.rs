//! Takes values from arbitrary bytes.

use std::cell::RefCell;
use std::path::{Path, PathBuf};

/// Bytes that are taken from the front. After the end, every byte is 0.
pub(crate) struct Input<'a>(pub(crate) &'a [u8]);

impl<'a> Input<'a> {
    pub(crate) fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        *first
    }
    pub(crate) fn word(&mut self) -> u16 {
        u16::from_le_bytes([self.byte(), self.byte()])
    }
    pub(crate) fn number(&mut self) -> f64 {
        f64::from_le_bytes(std::array::from_fn(|_| self.byte()))
    }
    /// Returns a number from 0 to `below` - 1.
    pub(crate) fn below(&mut self, below: usize) -> usize {
        usize::from(self.word()) % below.max(1)
    }
    /// Returns the bytes that are left.
    pub(crate) fn rest(self) -> &'a [u8] {
        self.0
    }
}

thread_local! {
    static FOLDER: RefCell<Option<tempfile::TempDir>> = const { RefCell::new(None) };
}

/// Writes the bytes to a file with this name, and calls `read` with its path and a path for results next to it.
///
/// # Panics
/// The folder for temporary files cannot be written.
pub(crate) fn with_file(name: &str, bytes: &[u8], read: impl FnOnce(&Path, &Path)) {
    let folder = FOLDER.with(|folder| {
        let mut folder = folder.borrow_mut();
        folder.get_or_insert_with(|| tempfile::tempdir().expect("a folder for temporary files")).path().to_owned()
    });
    let (path, out): (PathBuf, PathBuf) = (folder.join(name), folder.join(format!("out-{name}")));
    std::fs::write(&path, bytes).expect("a temporary file");
    read(&path, &out);
    let _ = std::fs::remove_file(&out);
}
