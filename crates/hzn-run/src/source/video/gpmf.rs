//! GPMF, the format of what GoPro's cameras measure: entries with a key, a type, a size and a count
//! (<https://gopro.github.io/gpmf-parser/>).

/// An entry.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry<'a> {
    pub(super) key: &'a [u8],
    /// The type of a value as an ASCII letter; 0 if the data are entries.
    kind: u8,
    /// Size of a sample in bytes.
    size: usize,
    pub(super) data: &'a [u8],
}

/// Returns the entries in some bytes. One that is cut off ends the list.
pub(super) fn entries(mut bytes: &[u8]) -> impl Iterator<Item = Entry<'_>> {
    std::iter::from_fn(move || {
        let (key, kind, size) = (bytes.get(..4)?, *bytes.get(4)?, usize::from(*bytes.get(5)?));
        let count = usize::from(u16::from_be_bytes(*bytes.get(6..)?.first_chunk()?));
        let length = size * count;
        let data = bytes.get(8..8 + length)?;
        // Each entry fills words of four bytes.
        bytes = bytes.get(8 + length.next_multiple_of(4)..).unwrap_or_default();
        (key != [0; 4]).then_some(Entry { key, kind, size, data })
    })
}

impl<'a> Entry<'a> {
    /// Returns the entries in this one.
    pub(super) fn entries(self) -> impl Iterator<Item = Entry<'a>> {
        entries(if self.kind == 0 { self.data } else { &[] })
    }

    /// Returns a text without what fills it up.
    pub(super) fn text(self) -> String {
        let text: String = self.data.iter().take_while(|byte| **byte != 0).map(|byte| char::from(*byte)).collect();
        text.trim().to_owned()
    }

    /// Returns the samples, each with its values. `types` are those of the values of a sample with several types.
    pub(super) fn samples(self, types: &[u8]) -> Vec<Vec<f64>> {
        let one = [self.kind];
        let types = if self.kind == b'?' { types } else { &one };
        let sample = |mut bytes: &[u8]| {
            let mut values = Vec::new();
            for kind in types.iter().cycle() {
                let Some((value, rest)) = number(*kind, bytes) else { break };
                values.push(value);
                bytes = rest;
                // Types that are not a multiple of the sample end with it.
                if bytes.is_empty() {
                    break;
                }
            }
            values
        };
        self.data.chunks_exact(self.size.max(1)).map(sample).collect()
    }

    /// Returns the first value of the first sample.
    pub(super) fn value(self) -> Option<f64> {
        self.samples(&[]).first()?.first().copied()
    }
}

/// Returns the first number of a type, and the bytes after it.
fn number(kind: u8, bytes: &[u8]) -> Option<(f64, &[u8])> {
    let one = || bytes.split_first();
    let two = || bytes.split_first_chunk::<2>();
    let four = || bytes.split_first_chunk::<4>();
    let eight = || bytes.split_first_chunk::<8>();
    Some(match kind {
        b'b' => one().map(|(b, rest)| (f64::from(*b as i8), rest))?,
        b'B' => one().map(|(b, rest)| (f64::from(*b), rest))?,
        b's' => two().map(|(b, rest)| (f64::from(i16::from_be_bytes(*b)), rest))?,
        b'S' => two().map(|(b, rest)| (f64::from(u16::from_be_bytes(*b)), rest))?,
        b'l' => four().map(|(b, rest)| (f64::from(i32::from_be_bytes(*b)), rest))?,
        b'L' => four().map(|(b, rest)| (f64::from(u32::from_be_bytes(*b)), rest))?,
        b'f' => four().map(|(b, rest)| (f64::from(f32::from_be_bytes(*b)), rest))?,
        b'q' => four().map(|(b, rest)| (f64::from(i32::from_be_bytes(*b)) / 65536.0, rest))?,
        b'd' => eight().map(|(b, rest)| (f64::from_be_bytes(*b), rest))?,
        b'j' => eight().map(|(b, rest)| (i64::from_be_bytes(*b) as f64, rest))?,
        b'J' => eight().map(|(b, rest)| (u64::from_be_bytes(*b) as f64, rest))?,
        _ => return None,
    })
}
