//! One bit for each pixel of the search lines: its edge to the dark western neighbour has been followed.
//!
//! Every closed edge that crosses a line has such a crossing on it, so a line's edges are followed once each.

/// Search lines at rows y with y mod spacing = offset; the spacing is a power of two.
#[derive(Debug)]
pub(crate) struct Marks<'a> {
    bits: &'a mut [u32],
    width: u32,
    spacing: u16,
    offset: u16,
}

impl<'a> Marks<'a> {
    /// Lines at most `spacing` rows apart, rounded down to a power of two; further apart when the bits do not
    /// suffice. All clear.
    pub(crate) fn new(bits: &'a mut [u32], width: u16, height: u16, spacing: u16) -> Self {
        let room = bits.len() as u32 * 32;
        let mut spacing = if spacing < 2 { 1u16 } else { 1 << (15 - spacing.min(1 << 14).leading_zeros()) };
        let lines = |spacing: u16| u32::from(height).div_ceil(u32::from(spacing));
        while lines(spacing) * u32::from(width) > room && spacing < 1 << 14 {
            spacing *= 2;
        }
        let used = (lines(spacing) * u32::from(width)).div_ceil(32) as usize;
        if let Some(bits) = bits.get_mut(..used) {
            bits.fill(0);
        }
        Self { bits, width: u32::from(width), spacing, offset: spacing / 2 }
    }

    /// Whether row `y` is a search line.
    #[inline(always)]
    pub(crate) fn has_row(&self, y: u16) -> bool {
        y & (self.spacing - 1) == self.offset & (self.spacing - 1)
    }

    fn place(&self, x: u16, y: u16) -> (usize, u32) {
        let bit = u32::from(y / self.spacing) * self.width + u32::from(x);
        ((bit / 32) as usize, 1 << (bit % 32))
    }
    #[inline]
    pub(crate) fn set(&mut self, x: u16, y: u16) {
        let (word, bit) = self.place(x, y);
        if let Some(word) = self.bits.get_mut(word) {
            *word |= bit;
        }
    }
    pub(crate) fn get(&self, x: u16, y: u16) -> bool {
        let (word, bit) = self.place(x, y);
        self.bits.get(word).is_some_and(|w| w & bit != 0)
    }
    /// The rows of the lines within `height`.
    pub(crate) fn rows(&self, height: u16) -> impl Iterator<Item = u16> + use<> {
        (self.offset..height).step_by(usize::from(self.spacing))
    }
}
