//! The structure of a JPEG, read before it is decoded.

/// What the markers of a JPEG say.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Structure {
    /// The picture comes in passes of rising quality, so that its coefficients are kept until the last pass.
    pub(super) is_progressive: bool,
    /// Number of scans: passes over the picture, or over one of its colours.
    pub(super) scans: usize,
}

/// Reads the markers. Data that are no JPEG have no structure.
pub(super) fn read(bytes: &[u8]) -> Structure {
    let mut found = Structure::default();
    let mut rest = bytes.strip_prefix(&[0xff, 0xd8]).unwrap_or_default();
    while let Some((marker, after)) = next_marker(rest) {
        rest = after;
        match marker {
            // The end, and a marker without a segment.
            0xd9 => break,
            0x01 | 0xd0..=0xd7 => continue,
            0xc2 | 0xc6 | 0xca | 0xce => found.is_progressive = true,
            0xda => found.scans += 1,
            _ => {}
        }
        // A preview in a segment has markers of its own, so the segment is skipped.
        let length = rest.first_chunk().map_or(0, |length| usize::from(u16::from_be_bytes(*length)));
        rest = rest.get(length.max(2)..).unwrap_or_default();
    }
    found
}

/// Returns the next marker and what follows it. In the data of a scan, FF is followed by 00.
fn next_marker(mut rest: &[u8]) -> Option<(u8, &[u8])> {
    loop {
        let at = rest.iter().position(|byte| *byte == 0xff)?;
        let (marker, after) = rest.get(at + 1..)?.split_first()?;
        if !matches!(marker, 0 | 0xff) {
            return Some((*marker, after));
        }
        rest = rest.get(at + 1..)?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scans_are_counted_but_not_those_of_a_preview() {
        let segment =
            |marker: u8, data: &[u8]| [&[0xff, marker][..], &(data.len() as u16 + 2).to_be_bytes(), data].concat();
        let preview = segment(0xe1, &[0xff, 0xd8, 0xff, 0xda, 0, 2, 1, 0xff, 0xd9]);
        let scan = [segment(0xda, &[1, 1, 0]), vec![5, 0xff, 0, 0xff, 0xd3, 7, 0xff, 0xff]].concat();
        let file = |frame: u8, scans: usize| {
            [vec![0xff, 0xd8], preview.clone(), segment(frame, &[8]), scan.repeat(scans), vec![0xff, 0xd9]].concat()
        };
        assert_eq!(read(&file(0xc0, 1)), Structure { is_progressive: false, scans: 1 });
        assert_eq!(read(&file(0xc2, 300)), Structure { is_progressive: true, scans: 300 });
        // What follows the end belongs to no picture.
        assert_eq!(read(&[file(0xc2, 2), file(0xc2, 9)].concat()).scans, 2);
        for bytes in [&b""[..], b"\xff", b"\xff\xd8", b"\xff\xd8\xff", b"\xff\xd8\xff\xda", b"\xff\xd8\xff\xda\0"] {
            assert!(read(bytes).scans <= 1);
        }
        assert_eq!(read(b"P5 1 1 255 \xff\xda"), Structure::default());
    }
}
