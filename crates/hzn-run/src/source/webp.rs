//! The parts of a WebP file: RIFF chunks, each with a name of four bytes, a length, and its data filled up to an even
//! length.

use std::io::{Read, Seek, SeekFrom};

/// Bytes before the first chunk: `RIFF`, a length, `WEBP`.
const HEADER_BYTES: u64 = 12;
/// Bytes at the beginning of a frame of an animation, before its own chunks.
const FRAME_BYTES: i64 = 16;
/// Largest number of chunks that are read, so that a malicious file takes no time.
const MAX_CHUNKS: u32 = 100_000;

/// Calls `see` with the name of each chunk until it returns false. It also enters the frames of an animation.
fn for_each_chunk(mut contents: impl Read + Seek, mut see: impl FnMut(&[u8; 4]) -> bool) -> Option<()> {
    contents.seek(SeekFrom::Start(HEADER_BYTES)).ok()?;
    for _ in 0..MAX_CHUNKS {
        let mut head = [0; 8];
        contents.read_exact(&mut head).ok()?;
        let [a, b, c, d, length @ ..] = head;
        let name = [a, b, c, d];
        if !see(&name) {
            break;
        }
        let length = i64::from(u32::from_le_bytes(length));
        let to_next = if name == *b"ANMF" { FRAME_BYTES } else { length + length % 2 };
        contents.seek(SeekFrom::Current(to_next)).ok()?;
    }
    Some(())
}

/// Returns whether the pixels were compressed with losses, as a camera does it with a photograph.
pub(super) fn is_lossy(contents: impl Read + Seek) -> bool {
    let mut lossy = false;
    let _ = for_each_chunk(contents, |name| {
        lossy |= name == b"VP8 ";
        !lossy
    });
    lossy
}

/// Returns the number of pictures in an animation; 0 for a single picture.
pub(super) fn frames(contents: impl Read + Seek) -> u32 {
    let mut frames = 0;
    // The end of the file ends the search.
    let _ = for_each_chunk(contents, |name| {
        frames += u32::from(name == b"ANMF");
        true
    });
    frames
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    fn chunk(name: &[u8; 4], data: &[u8]) -> Vec<u8> {
        let padding = vec![0; data.len() % 2];
        [&name[..], &(data.len() as u32).to_le_bytes(), data, &padding].concat()
    }

    fn file(chunks: &[Vec<u8>]) -> Cursor<Vec<u8>> {
        Cursor::new([&b"RIFF\0\0\0\0WEBP"[..], &chunks.concat()].concat())
    }

    #[test]
    fn chunks_say_what_is_in_the_file() {
        let frame = |name| chunk(b"ANMF", &[vec![0; 16], chunk(name, b"odd")].concat());
        let plain = file(&[chunk(b"VP8 ", b"1")]);
        assert!(is_lossy(plain.clone()) && frames(plain) == 0);
        let lossless = file(&[chunk(b"VP8X", b"123"), chunk(b"ICCP", b"VP8 "), chunk(b"VP8L", b"12")]);
        assert!(!is_lossy(lossless.clone()) && frames(lossless) == 0);
        let moving = file(&[chunk(b"VP8X", b"123"), frame(b"VP8L"), frame(b"VP8 "), frame(b"VP8 ")]);
        assert!(is_lossy(moving.clone()) && frames(moving) == 3);
        // Lengths beyond the end of the file.
        let mut broken = chunk(b"EXIF", b"");
        broken[4..8].copy_from_slice(&[0xff; 4]);
        assert!(!is_lossy(file(&[broken])) && frames(Cursor::new(Vec::new())) == 0);
    }
}
