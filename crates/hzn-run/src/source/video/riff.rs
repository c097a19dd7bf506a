//! Whether an AVI is whole: ffmpeg reads one that was cut without a word, and the number of frames in its header also
//! counts those that were left out on purpose.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// Bytes that are missing at the end of a RIFF file, by the sizes of its parts; `None` where none are, and for other
/// files.
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
            // Written to a pipe: not known.
            return None;
        }
        let end = at + 8 + u64::from(size);
        if end > length {
            return Some(end - length);
        }
        // Parts of a large file follow one another at even places.
        at = end + end % 2;
    }
}
