//! Reads the pixels around a border pixel: its neighbourhood, and the line across the edge.

use crate::base::real::Real;
use crate::geometry::block::Lit;
use crate::geometry::pixel::Pixel;
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::stages::contour::BinaryPicture;

/// Value for a brightness that cannot be read.
pub(super) const UNSEEN: i32 = i32::MIN;

/// Reads pixels around one border pixel; a read gives `None` beyond the region and under a mask. With `FREE`, all
/// pixels within reach are known to be readable, so no read is checked.
// `FREE` is a parameter of the type, so that the reads of most points are compiled without any test.
pub(super) struct Around<'a, 'b, T, P, O, const FREE: bool> {
    pub(super) binary: &'a BinaryPicture<'b, T, P, O>,
    pub(super) x: i32,
    pub(super) y: i32,
    pub(super) index: usize,
    across: isize,
    down: isize,
}

impl<'a, 'b, T: Real, P: Pixels, O: Observer<T>, const FREE: bool> Around<'a, 'b, T, P, O, FREE> {
    pub(super) fn new(binary: &'a BinaryPicture<'b, T, P, O>, p: Pixel) -> Self {
        Self {
            binary,
            x: i32::from(p.x),
            y: i32::from(p.y),
            index: binary.picture.index(p.x, p.y),
            across: binary.picture.across() as isize,
            down: binary.picture.down() as isize,
        }
    }

    #[inline(always)]
    fn at(&self, dx: i32, dy: i32) -> Option<i32> {
        self.read(dx, dy, dx as isize * self.across + dy as isize * self.down)
    }

    /// Reads the pixel that is (dx, dy) away from the border pixel in the picture, and `offset` away from it in memory.
    #[inline(always)]
    fn read(&self, dx: i32, dy: i32, offset: isize) -> Option<i32> {
        read::<T, P, O, FREE>(self.binary, (self.x + dx, self.y + dy), self.index.wrapping_add_signed(offset))
    }

    /// Reads three pixels side by side, `dy` rows down.
    #[inline(always)]
    fn row(&self, dy: i32) -> Option<[i32; 3]> {
        if !FREE {
            return Some([self.at(-1, dy)?, self.at(0, dy)?, self.at(1, dy)?]);
        }
        let (x, y) = (self.x as u16, (self.y + dy) as u16);
        for dx in [u16::MAX, 0, 1] {
            self.binary.observer.pixel(x.wrapping_add(dx), y);
        }
        let first = self.index.wrapping_add_signed(dy as isize * self.down - self.across);
        // Three neighbours cost one check of the slice instead of three.
        Some(self.binary.picture.three(first).map(i32::from))
    }

    /// Reads the 3×3 neighbourhood.
    #[inline(always)]
    pub(super) fn read_3x3(&self) -> Option<Near> {
        let [nw, n, ne] = self.row(-1)?;
        let [w, c, e] = self.row(0)?;
        let [sw, s, se] = self.row(1)?;
        // Nine reads give both the gradient and the smoothed brightness across the edge, whichever its direction is.
        let columns = [nw + 2 * w + sw, n + 2 * c + s, ne + 2 * e + se];
        let rows = [nw + 2 * n + ne, w + 2 * c + e, sw + 2 * s + se];
        Some(Near { columns, rows })
    }
}

/// The line across the edge through a border pixel.
pub(super) struct Line<'a, 'b, 'c, T, P, O, const FREE: bool> {
    pub(super) around: &'a Around<'b, 'c, T, P, O, FREE>,
    /// A step towards the dark, in pixels. `ahead` is the same step in memory, and `aside` is a pixel to its side in
    /// memory.
    pub(super) step: (i32, i32),
    pub(super) ahead: isize,
    aside: isize,
}

impl<'a, 'b, 'c, T: Real, P: Pixels, O: Observer<T>, const FREE: bool> Line<'a, 'b, 'c, T, P, O, FREE> {
    #[inline(always)]
    pub(super) fn new(around: &'a Around<'b, 'c, T, P, O, FREE>, (dx, dy): (i32, i32), step: i32) -> Self {
        let (x, y) = (dx as isize, dy as isize);
        Self {
            around,
            step: (dx * step, dy * step),
            ahead: (x * around.across + y * around.down) * step as isize,
            aside: y * around.across + x * around.down,
        }
    }
    #[inline(always)]
    pub(super) fn at(&self, k: i32, side: i32) -> Option<i32> {
        let (dx, dy) = self.step;
        // The side is one pixel, perpendicular to the step.
        let (sx, sy) = (dy.signum() * side, dx.signum() * side);
        self.around.read(k * dx + sx, k * dy + sy, k as isize * self.ahead + side as isize * self.aside)
    }
    /// Returns four times the brightness `k` steps towards the dark, smoothed with 1-2-1 along the edge.
    #[inline(always)]
    pub(super) fn smoothed(&self, k: i32) -> Option<i32> {
        Some(self.at(k, -1)? + 2 * self.at(k, 0)? + self.at(k, 1)?)
    }
}

/// Reads pixels in a straight line.
pub(super) struct Walk<'a, 'b, T, P, O, const FREE: bool> {
    pub(super) binary: &'a BinaryPicture<'b, T, P, O>,
    /// Column and row of the next pixel. `step` leads to the one after it.
    pub(super) at: (i32, i32),
    pub(super) step: (i32, i32),
    pub(super) index: usize,
    pub(super) ahead: isize,
}

impl<T: Real, P: Pixels, O: Observer<T>, const FREE: bool> Walk<'_, '_, T, P, O, FREE> {
    /// Returns four times the brightness of the next pixel, or [`UNSEEN`] where nothing can be read.
    #[inline(always)]
    pub(super) fn next(&mut self) -> i32 {
        let seen = read::<T, P, O, FREE>(self.binary, self.at, self.index);
        self.at = (self.at.0 + self.step.0, self.at.1 + self.step.1);
        self.index = self.index.wrapping_add_signed(self.ahead);
        // The factor of four is that of the smoothed rows, so that plateaus and crossings have one unit without a
        // division.
        seen.map_or(UNSEEN, |v| 4 * v)
    }
}

/// Reads the pixel at column `x` and row `y`, which is at `index` in memory; `None` beyond the region and under a mask.
/// With `FREE`, the pixel is known to be inside the region and unmasked.
#[inline(always)]
pub(super) fn read<T: Real, P: Pixels, O: Observer<T>, const FREE: bool>(
    binary: &BinaryPicture<'_, T, P, O>,
    (x, y): (i32, i32),
    index: usize,
) -> Option<i32> {
    if !FREE && !binary.region.is_usable(x, y) {
        return None;
    }
    binary.observer.pixel(x as u16, y as u16);
    Some(i32::from(binary.picture.read(index)))
}

/// Sums over columns (left to right) and rows (downwards) of a 3×3 neighbourhood, smoothed with 1-2-1.
pub(super) struct Near {
    columns: [i32; 3],
    rows: [i32; 3],
}

impl Near {
    /// Returns eight times the brightness change per pixel, to the right and down.
    #[inline(always)]
    pub(super) fn gradient(&self) -> (i32, i32) {
        (self.columns[2] - self.columns[0], self.rows[2] - self.rows[0])
    }
    /// Returns the smoothed brightness one step to the lit side, here, and one step to the dark side.
    #[inline(always)]
    pub(super) fn across(&self, lit: Lit) -> [i32; 3] {
        let ([w, x, e], [n, y, s]) = (self.columns, self.rows);
        match lit {
            Lit::Right => [e, x, w],
            Lit::Left => [w, x, e],
            Lit::Below => [s, y, n],
            Lit::Above => [n, y, s],
        }
    }
}
