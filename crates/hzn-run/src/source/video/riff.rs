//! Checks whether an AVI is complete. ffmpeg reads a truncated AVI without an error. The number of frames in its header
//! is no help, because it also counts frames that were left out on purpose.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// Returns the number of bytes that are missing at the end of a RIFF file, from the sizes of its parts. Returns `None`
/// if none are missing, and for other files.
pub(super) fn missing_bytes(path: &Path) -> Option<u64> {
    let mut file = File::open(path).ok()?;
    let length = file.metadata().ok()?.len();
    let mut at = 0;
    loop {
        let mut head = [0; 8];
        file.seek(SeekFrom::Start(at)).ok()?;
        file.read_exact(&mut head).ok()?;
        let [b'R', b'I', b'F', b'F', size @ ..] = head else { return None };
        let size = u32::from_le_bytes(size);
        if size == 0 || size == u32::MAX {
            // The file was written to a pipe, so its size is not known.
            return None;
        }
        let end = at + 8 + u64::from(size);
        if end > length {
            return Some(end - length);
        }
        // The parts of a large file follow one another at even offsets.
        at = end + end % 2;
    }
}
