//! A list of border pixels that never overflows. If it is full, every second pixel is dropped and the stride doubles,
//! so that the list still covers the whole edge.

use crate::geometry::pixel::Pixel;

/// Border pixels of one edge, every `stride`-th of them.
#[derive(Debug)]
pub(crate) struct Thinned<'a> {
    buffer: &'a mut [Pixel],
    len: usize,
    stride: u32,
    /// Number of pixels to skip before the next one is stored.
    wait: u32,
    total: u32,
}

impl<'a> Thinned<'a> {
    pub(crate) fn new(buffer: &'a mut [Pixel]) -> Self {
        Self { buffer, len: 0, stride: 1, wait: 0, total: 0 }
    }

    pub(crate) fn push(&mut self, p: Pixel) {
        self.total += 1;
        if self.wait > 0 {
            self.wait -= 1;
            return;
        }
        if self.len == self.buffer.len() {
            // A list that stopped here would cut the limb into a short arc. Half of the pixels lose nothing, because
            // edge points are fewer anyway.
            self.halve();
            if self.wait > 0 {
                self.wait -= 1;
                return;
            }
        }
        if let Some(slot) = self.buffer.get_mut(self.len) {
            *slot = p;
            self.len += 1;
        }
        self.wait = self.stride - 1;
    }

    /// Returns the places of the next `n` pixels, which the caller must write; `None` if not all of them are stored.
    #[inline]
    pub(crate) fn places(&mut self, n: usize) -> Option<&mut [Pixel]> {
        // With a stride some of the pixels are skipped, so that there is no place for each of them.
        if self.stride > 1 {
            return None;
        }
        let places = self.buffer.get_mut(self.len..self.len + n)?;
        self.len += n;
        self.total += n as u32;
        Some(places)
    }

    /// Adds several pixels.
    pub(crate) fn extend(&mut self, passed: &[Pixel]) {
        let mut rest = passed;
        while let Some((&p, after)) = rest.get(self.wait as usize..).and_then(<[_]>::split_first) {
            self.total += self.wait;
            self.wait = 0;
            self.push(p);
            rest = after;
        }
        // All that is left is skipped.
        self.wait -= rest.len() as u32;
        self.total += rest.len() as u32;
    }

    #[cold]
    fn halve(&mut self) {
        // The loop goes upwards, so that a pixel is read before its place is written.
        let kept = self.len.div_ceil(2);
        for i in 0..kept {
            if let Some(&p) = self.buffer.get(2 * i)
                && let Some(slot) = self.buffer.get_mut(i)
            {
                *slot = p;
            }
        }
        // The next stored pixel must be 2·stride after the last kept one. If `len` is even, this is the next pixel,
        // because the last stored one is dropped.
        self.wait = if self.len.is_multiple_of(2) { 0 } else { self.stride };
        self.len = kept;
        self.stride *= 2;
    }

    /// Clears the list.
    pub(crate) fn clear(&mut self) {
        (self.len, self.stride, self.wait, self.total) = (0, 1, 0, 0);
    }

    /// Returns the stored pixels, so that they can be sorted.
    pub(crate) fn pixels_mut(&mut self) -> &mut [Pixel] {
        self.buffer.get_mut(..self.len).unwrap_or_default()
    }

    /// Returns the stored pixels in order.
    pub(crate) fn pixels(&self) -> &[Pixel] {
        self.buffer.get(..self.len).unwrap_or_default()
    }
    /// Returns the stride: one pixel in `stride` is stored.
    pub(crate) fn stride(&self) -> u32 {
        self.stride
    }
    /// Returns the number of pixels that were pushed.
    pub(crate) fn total(&self) -> u32 {
        self.total
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn keeps_every_nth_over_the_whole_length() {
        // With an odd length the next pixel after halving is not one of those that are kept.
        for (n, length) in (0..200u16).flat_map(|n| [(n, 8), (n, 7)]) {
            let mut buffer = [Pixel::default(); 8];
            let mut t = Thinned::new(&mut buffer[..length]);
            for x in 0..n {
                t.push(Pixel { x, y: 0 });
            }
            let stride = t.stride() as u16;
            let want: Vec<u16> = (0..n).step_by(usize::from(stride)).collect();
            let got: Vec<u16> = t.pixels().iter().map(|p| p.x).collect();
            assert_eq!(got, want, "n {n}, length {length}");
            assert_eq!(t.total(), u32::from(n));

            let mut buffer = [Pixel::default(); 8];
            let mut t = Thinned::new(&mut buffer[..length]);
            let all: Vec<Pixel> = (0..n).map(|x| Pixel { x, y: 0 }).collect();
            all.chunks(3).for_each(|three| match t.places(three.len()) {
                Some(places) => places.copy_from_slice(three),
                None => t.extend(three),
            });
            let got: Vec<u16> = t.pixels().iter().map(|p| p.x).collect();
            assert_eq!((got, t.total()), (want, u32::from(n)), "by threes, n {n}, length {length}");
        }
    }
}
