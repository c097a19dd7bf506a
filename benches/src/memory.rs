//! Frames in memory, on pages of 2 MiB where the system has them.
//!
//! NumPy asks for such pages for its large arrays, and the rows of a large picture lie in many small pages. Both
//! programs therefore ask for them for every frame, through `madvise`.

use std::fs;
use std::io;

use memmap2::MmapMut;

/// Size and alignment of a large page in bytes.
const LARGE_PAGE: usize = 2 << 20;

/// Bytes of a frame, at the start of a large page.
pub(crate) struct FrameBytes {
    map: MmapMut,
    start: usize,
    len: usize,
}

impl FrameBytes {
    /// Copies a frame. On a system without large pages the frame lies on the usual ones.
    pub(crate) fn copy(bytes: &[u8]) -> io::Result<Self> {
        let mut map = MmapMut::map_anon(bytes.len().next_multiple_of(LARGE_PAGE) + LARGE_PAGE)?;
        // A system without large pages refuses the advice. The page says what both programs got.
        #[cfg(target_os = "linux")]
        let _ = map.advise(memmap2::Advice::HugePage);
        let start = map.as_ptr().align_offset(LARGE_PAGE);
        let room = map.get_mut(start..start + bytes.len()).ok_or_else(|| io::Error::other("a frame is too large"))?;
        room.copy_from_slice(bytes);
        Ok(Self { map, start, len: bytes.len() })
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        self.map.get(self.start..self.start + self.len).unwrap_or_default()
    }
}

/// Returns the memory of this program that lies on large pages, in MiB; 0 if the system does not say.
pub(crate) fn on_large_pages_mib() -> f64 {
    let text = fs::read_to_string("/proc/self/smaps_rollup").unwrap_or_default();
    let kib =
        text.lines().find_map(|line| line.strip_prefix("AnonHugePages:")?.split_whitespace().next()?.parse().ok());
    kib.unwrap_or(0.0) / 1024.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_copied_to_the_start_of_a_large_page() {
        for len in [1, LARGE_PAGE - 1, LARGE_PAGE, LARGE_PAGE + 1] {
            let bytes: Vec<u8> = (0..len).map(|i| i as u8).collect();
            let frame = FrameBytes::copy(&bytes).unwrap();
            assert!(frame.bytes() == bytes);
            assert_eq!(frame.bytes().as_ptr().align_offset(LARGE_PAGE), 0);
        }
    }
}
