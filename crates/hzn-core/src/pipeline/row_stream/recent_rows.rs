//! The last rows of a picture that comes row by row.

use core::cell::Cell;

use crate::image::{Pixels, Sample};

/// Rows of the picture that are kept in memory.
// A power of two makes the remainder of the row a mask. With 32 rows the plateaus of edges up to 15 rows away are in
// memory.
pub const ROWS_HELD: u16 = 32;

/// The last [`ROWS_HELD`] rows. A read of an older or a later row returns the first or the last of these rows instead,
/// and is counted.
#[derive(Debug)]
pub(super) struct RecentRows<'a, S> {
    samples: &'a mut [S],
    width: u16,
    height: u16,
    full_scale: u16,
    /// Number of rows so far.
    rows: u16,
    // A cell, because reads of a picture take `&self`.
    beyond: Cell<u32>,
}

impl<'a, S: Sample> RecentRows<'a, S> {
    pub(super) fn new(samples: &'a mut [S], width: u16, height: u16, full_scale: u16) -> Self {
        Self { samples, width, height, full_scale, rows: 0, beyond: Cell::new(0) }
    }
    fn start(&self, y: u16) -> usize {
        usize::from(y % ROWS_HELD) * usize::from(self.width)
    }
    /// Stores the next row in place of the oldest.
    pub(super) fn push(&mut self, row: &[S]) {
        let start = self.start(self.rows);
        if let Some(place) = self.samples.get_mut(start..start + usize::from(self.width))
            && place.len() == row.len()
        {
            place.copy_from_slice(row);
        }
        self.rows += 1;
    }
    /// Returns whether rows that are not in memory were read since the last call.
    pub(super) fn went_beyond(&self) -> bool {
        self.beyond.replace(0) > 0
    }
}

impl<S: Sample> Pixels for RecentRows<'_, S> {
    fn width(&self) -> u16 {
        self.width
    }
    fn height(&self) -> u16 {
        self.height
    }
    fn full_scale(&self) -> u16 {
        self.full_scale
    }
    #[inline(always)]
    fn index(&self, x: u16, y: u16) -> usize {
        usize::from(y) << 16 | usize::from(x)
    }
    #[inline(always)]
    fn across(&self) -> usize {
        1
    }
    #[inline(always)]
    fn down(&self) -> usize {
        1 << 16
    }
    #[inline]
    fn read(&self, index: usize) -> u16 {
        let (x, y) = (index & 0xFFFF, (index >> 16) as u16);
        // The nearest row stands for one that is gone, because the brightness of a plateau changes little; a 0 would
        // look like sky.
        let held = y.max(self.rows.saturating_sub(ROWS_HELD)).min(self.rows.saturating_sub(1));
        if held != y {
            self.beyond.set(self.beyond.get() + 1);
        }
        self.samples.get(self.start(held) + x).map_or(0, |&s| s.into())
    }
}
