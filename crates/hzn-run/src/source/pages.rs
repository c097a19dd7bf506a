//! Counts the pictures in one picture file: pages of a TIFF, frames of an animated PNG or WebP, consecutive pictures
//! of a PNM.

use std::io::Cursor;

use image::ImageFormat;

use super::webp;

/// Largest number of pictures that is counted, so that a malicious file cannot cause an endless loop.
const MAX_PAGES: u32 = 100_000;

/// Returns the number of pictures; 1 if the format has only one or the file is broken.
pub(super) fn count(bytes: &[u8], format: ImageFormat) -> u32 {
    let pages = match format {
        ImageFormat::Tiff => tiff(bytes),
        ImageFormat::Png => animation(bytes),
        ImageFormat::Pnm => portable(bytes),
        ImageFormat::WebP => Some(webp::frames(Cursor::new(bytes))),
        _ => None,
    };
    pages.unwrap_or(1).max(1)
}

/// Counts the pages of a TIFF, without smaller copies and masks.
fn tiff(bytes: &[u8]) -> Option<u32> {
    let big_endian = bytes.starts_with(b"MM");
    let number = |at: u64, len: usize| -> Option<u64> {
        let start = usize::try_from(at).ok()?;
        let digits = bytes.get(start..start.checked_add(len)?)?;
        let shifted = |n: u64, byte: &u8| n << 8 | u64::from(*byte);
        Some(if big_endian { digits.iter().fold(0, shifted) } else { digits.iter().rev().fold(0, shifted) })
    };
    // The file is a TIFF, or a BigTIFF with longer numbers.
    let (first, count_len, entry_len, offset_len) = match number(2, 2)? {
        42 => (number(4, 4)?, 2, 12, 4),
        43 => (number(8, 8)?, 8, 20, 8),
        _ => return None,
    };
    let (mut at, mut pages) = (first, 0);
    for _ in 0..MAX_PAGES {
        if at == 0 {
            break;
        }
        let Some(entries) = number(at, count_len).filter(|n| *n <= 4096) else { break };
        let start = at + count_len as u64;
        let entry = |i: u64| start + i * entry_len;
        let value_at = |i: u64| entry(i) + if entry_len == 12 { 8 } else { 12 };
        let is_part = (0..entries).any(|i| match number(entry(i), 2) {
            // In NewSubfileType, bit 0 marks a smaller copy and bit 2 a mask.
            Some(254) => number(value_at(i), 4).is_some_and(|kind| kind & 0b101 != 0),
            // In SubfileType, 2 marks a smaller copy.
            Some(255) => number(value_at(i), 2) == Some(2),
            _ => false,
        });
        pages += u32::from(!is_part);
        let Some(next) = number(entry(entries), offset_len) else { break };
        at = next;
    }
    Some(pages)
}

/// Counts the frames of an animated PNG.
fn animation(bytes: &[u8]) -> Option<u32> {
    let mut rest = bytes.get(8..)?;
    loop {
        let (length, after) = rest.split_first_chunk::<4>()?;
        let length = usize::try_from(u32::from_be_bytes(*length)).ok()?;
        let (kind, after) = after.split_first_chunk::<4>()?;
        match kind {
            b"acTL" => return Some(u32::from_be_bytes(*after.first_chunk::<4>()?).min(MAX_PAGES)),
            b"IDAT" => return None,
            // The chunk's data and checksum are skipped.
            _ => rest = after.get(length.checked_add(4)?..)?,
        }
    }
}

/// Counts the pictures of a binary PGM or PPM, which may follow one another in a file.
fn portable(bytes: &[u8]) -> Option<u32> {
    let (mut rest, mut pictures) = (bytes, 0);
    while pictures < MAX_PAGES {
        let channels = match rest.get(..2) {
            Some(b"P5") => 1,
            Some(b"P6") => 3,
            _ => break,
        };
        let mut at = 2;
        let mut next = || {
            // White space and comments precede a number. A single white space follows the last number.
            while let Some(c) = rest.get(at) {
                match c {
                    b'#' => at += rest.get(at..)?.iter().position(|c| *c == b'\n')?,
                    c if c.is_ascii_whitespace() => at += 1,
                    _ => break,
                }
            }
            let digits = rest.get(at..)?.iter().take_while(|c| c.is_ascii_digit()).count();
            let number: usize = std::str::from_utf8(rest.get(at..at + digits)?).ok()?.parse().ok()?;
            at += digits;
            Some(number)
        };
        let (Some(width), Some(height), Some(white)) = (next(), next(), next()) else { break };
        let samples = width.checked_mul(height)?.checked_mul(channels)?;
        let length = samples.checked_mul(if white > 255 { 2 } else { 1 })?;
        pictures += 1;
        rest = rest.get((at + 1).checked_add(length)?..).unwrap_or_default();
    }
    Some(pictures)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_are_counted() {
        // The file has two pages and, between them, a smaller copy of the first; each directory has one entry.
        let page = |tag: u16, value: u32, next: u32| {
            let entry =
                [&tag.to_le_bytes()[..], &4u16.to_le_bytes(), &1u32.to_le_bytes(), &value.to_le_bytes()].concat();
            [&1u16.to_le_bytes()[..], &entry, &next.to_le_bytes()].concat()
        };
        let tiff = [b"II*\0\x08\0\0\0".to_vec(), page(256, 9, 26), page(254, 1, 44), page(254, 2, 0)].concat();
        assert_eq!(count(&tiff, ImageFormat::Tiff), 2);
        // The directories form a circle; the count ends nevertheless.
        let circle = [b"II*\0\x08\0\0\0".to_vec(), page(256, 9, 8)].concat();
        assert_eq!(count(&circle, ImageFormat::Tiff), MAX_PAGES);
        assert_eq!(count(&tiff[..20], ImageFormat::Tiff), 1);
        assert_eq!(count(b"MM", ImageFormat::Tiff), 1);
        let pgm = b"P5 2 1 255\n\x01\x02".as_slice();
        assert_eq!(count(pgm, ImageFormat::Pnm), 1);
        assert_eq!(count(&[pgm, b"P6\n# c\n1 1\n65535\n123456", pgm].concat(), ImageFormat::Pnm), 3);
        assert_eq!(count(b"P5 9999999999 9999999999 255\n", ImageFormat::Pnm), 1);
    }
}
