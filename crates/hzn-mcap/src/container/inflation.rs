//! The limits of compressed chunks.
//!
//! zstd can pack gigabytes of zeros into some kilobytes. The sizes below are far above those of honest recordings, and
//! they bound the memory and the time that a malicious file can cost.

use super::MAX_RECORD_BYTES;

/// Largest factor by which the chunks of a file may grow. A picture with noise in its lowest bit grows by less than 10,
/// a black one by up to some thousands; [`ALWAYS_BYTES`] is there for black ones.
const MAX_FACTOR: u64 = 1024;
/// A chunk may always have this size, whatever its factor: it is a black picture of 20 Mpx with three channels.
const CHUNK_BYTES: u64 = 64 << 20;
/// The chunks of a file may always have this size together, whatever their factor. To read it takes about a second.
const ALWAYS_BYTES: u64 = 1 << 30;

/// Counts the stored and the uncompressed bytes of a file's chunks.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Inflation {
    stored: u64,
    size: u64,
}

impl Inflation {
    /// Counts a chunk of `stored` bytes that says that it has `size` bytes when it is uncompressed. Returns `false` if
    /// the chunk, or all chunks together, would be larger than the limits.
    pub(crate) fn admit(&mut self, stored: u64, size: u64) -> bool {
        self.stored = self.stored.saturating_add(stored);
        let sum = self.size.saturating_add(size);
        let grown = |stored: u64| stored.saturating_mul(MAX_FACTOR);
        let fits = size <= grown(stored).clamp(CHUNK_BYTES, MAX_RECORD_BYTES)
            && sum <= grown(self.stored).saturating_add(ALWAYS_BYTES);
        if fits {
            self.size = sum;
        }
        fits
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn honest_chunks_fit_and_bombs_do_not() {
        let mut file = Inflation::default();
        // A black picture of 20 Mpx in three channels, and noise that does not compress.
        assert!(file.admit(2_000, 60_000_000));
        assert!(file.admit(900_000_000, 900_000_000));
        assert!(!file.admit(10_000, 300_000_000));
        assert!(!file.admit(u64::MAX, u64::MAX));
        // Many chunks that fit one by one: together they reach the limit of the file.
        let mut file = Inflation::default();
        let admitted = (0..1000).take_while(|_| file.admit(3_000, 60_000_000)).count();
        assert_eq!(admitted, 18);
    }
}
