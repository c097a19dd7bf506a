//! Marks of the crossings of search lines that have been followed. A crossing is a lit pixel on a line whose western
//! neighbour is dark.
//!
//! Every closed edge that crosses a search line has a crossing on it. The marks therefore ensure that each edge is
//! followed only once. If memory suffices, there is one bit for each pixel of the lines. Small bodies in large pictures
//! need lines that are too close together for this; then a table holds the crossings themselves. If the table is full,
//! edges are followed again; the work budget of the picture limits this.

/// Search lines at the rows y with y mod spacing = offset; the spacing is a power of two, in pixels.
#[derive(Debug)]
pub(crate) struct Marks<'a> {
    words: &'a mut [u32],
    width: u32,
    spacing: u16,
    offset: u16,
    bits: bool,
    /// Whether the table has no free place.
    full: bool,
}

/// Number of places in the table that are tried for a crossing.
// The number bounds the work of a crossing. A table that is nearly full would otherwise be searched from end to end.
const MAX_PROBES: usize = 16;

/// Rounds `spacing` down to a power of two.
fn rounded(spacing: u16) -> u16 {
    // The spacing is a power of two because the follower tests every row: the remainder is then a mask and not a
    // division.
    1 << (15 - spacing.clamp(1, 1 << 14).leading_zeros())
}

impl<'a> Marks<'a> {
    /// Places lines at most `spacing` rows apart, rounded down to a power of two. If memory does not suffice for the
    /// bits of these lines, the spacing grows up to `widest`. If it still does not suffice, the table is used with the
    /// small spacing. All marks are clear.
    pub(crate) fn new(words: &'a mut [u32], width: u16, height: u16, spacing: u16, widest: u16) -> Self {
        let needed = |spacing: u16| (u32::from(height).div_ceil(u32::from(spacing)) * u32::from(width)).div_ceil(32);
        let fit = |spacing: u16| needed(spacing) as usize <= words.len();
        let (narrow, widest) = (rounded(spacing), rounded(widest.max(spacing)));
        let found = (0..15).map(|k| 1u16 << k).find(|&s| s >= narrow && s <= widest && fit(s));
        let (spacing, used) = found.map_or((narrow, words.len()), |s| (s, needed(s) as usize));
        if let Some(words) = words.get_mut(..used) {
            // Only the words in use are cleared, so that a small picture does not pay for the room of a large one.
            words.fill(0);
        }
        Self { words, width: u32::from(width), spacing, offset: spacing / 2, bits: found.is_some(), full: false }
    }

    /// Returns whether row `y` is a search line.
    #[inline(always)]
    pub(crate) fn has_row(&self, y: u16) -> bool {
        y & (self.spacing - 1) == self.offset & (self.spacing - 1)
    }

    /// Returns the number of rows from `y` to the nearest search line.
    #[inline(always)]
    pub(crate) fn rows_away(&self, y: u16) -> u16 {
        let above = y.wrapping_sub(self.offset) & (self.spacing - 1);
        above.min(self.spacing - above)
    }

    fn place(&self, x: u16, y: u16) -> (usize, u32) {
        let bit = u32::from(y >> (self.spacing.trailing_zeros() & 15)) * self.width + u32::from(x);
        ((bit / 32) as usize, 1 << (bit % 32))
    }
    /// Returns the entry of a crossing in the table (0 is an empty place), and the places where it may be.
    fn key(&self, x: u16, y: u16) -> (u32, impl Iterator<Item = usize> + use<>) {
        let key = (u32::from(y) << 16 | u32::from(x)) + 1;
        // The product spreads neighbouring crossings, which would otherwise fall into one cluster of places.
        let (n, first) = (self.words.len().max(1), key.wrapping_mul(0x9e37_79b1) >> 7);
        (key, (0..MAX_PROBES).map(move |k| (first as usize + k) % n))
    }

    #[inline]
    pub(crate) fn set(&mut self, x: u16, y: u16) {
        if self.bits {
            let (word, bit) = self.place(x, y);
            if let Some(word) = self.words.get_mut(word) {
                *word |= bit;
            }
            return;
        }
        // In a full table every attempt would cost all probes.
        if self.full {
            return;
        }
        let (key, mut places) = self.key(x, y);
        let place = places.find(|&p| self.words.get(p).is_some_and(|&w| w == 0 || w == key));
        match place.and_then(|p| self.words.get_mut(p)) {
            Some(word) => *word = key,
            None => self.full = true,
        }
    }
    pub(crate) fn get(&self, x: u16, y: u16) -> bool {
        if self.bits {
            let (word, bit) = self.place(x, y);
            return self.words.get(word).is_some_and(|w| w & bit != 0);
        }
        let (key, mut places) = self.key(x, y);
        // A marked crossing comes before the first empty place.
        places.find_map(|p| self.words.get(p).filter(|&&w| w == 0 || w == key)) == Some(&key)
    }
    /// Returns the rows of the lines within `height`.
    pub(crate) fn rows(&self, height: u16) -> impl Iterator<Item = u16> + use<> {
        (self.offset..height).step_by(usize::from(self.spacing.max(1)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;

    #[test]
    fn lines_are_as_narrow_as_memory_allows() {
        let spacing = |words: usize, spacing, widest| {
            let mut words = vec![7u32; words];
            let marks = Marks::new(&mut words, 1920, 1080, spacing, widest);
            (marks.spacing, marks.bits)
        };
        assert_eq!(spacing(16384, 5, 5), (4, true));
        // At a spacing of 128, the 9 lines with 1920 bits each exceed 512 words. The spacing therefore grows to
        // `widest`.
        assert_eq!(spacing(512, 32, 256), (256, true));
        assert_eq!(spacing(512, 4, 16), (4, false));
        assert_eq!(spacing(1, 1, 1), (1, false));
    }

    #[test]
    fn both_kinds_of_memory_keep_what_was_set() {
        for (words, spacing) in [(16384, 64), (512, 1)] {
            let mut words = vec![u32::MAX; words];
            let mut marks = Marks::new(&mut words, 1920, 1080, spacing, spacing);
            let row = marks.rows(1080).nth(3).unwrap();
            assert!(marks.has_row(row));
            let columns = || (0..1920u16).step_by(7);
            assert!(columns().all(|x| !marks.get(x, row)));
            for x in columns() {
                marks.set(x, row);
            }
            let kept = columns().filter(|&x| marks.get(x, row)).count();
            assert!(kept * 10 > columns().count() * 9 && !marks.get(1, row), "{kept}");
        }
    }
}
