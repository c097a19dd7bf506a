//! The ring: the closed path of the outermost pixels of a region.

use crate::base::real::Real;
use crate::geometry::pixel::Pixel;

use super::Region;

/// Number of rows by which the walk around the ring advances in one step along the picture's sides.
// Every row costs a test of the circle. With leaps a side of 1080 rows costs some 80 tests instead of 1080.
const LEAP: u16 = 64;

impl<T: Real> Region<T> {
    /// Passes the outermost pixels of the region to `visit` as straight runs, once around, until it returns false. The
    /// order is clockwise on the screen, from the left end of the top row. The outermost pixels are those with a
    /// 4-neighbour outside the region.
    pub(crate) fn each_run(&self, mut visit: impl FnMut(Run) -> bool) {
        // Most pictures have no image circle, and four runs then are the whole ring.
        let _ = if self.circle.is_none() { self.sides(&mut visit) } else { self.around(&mut visit) };
    }

    /// Does the work of [`Self::each_run`] for a rectangle. `None` means that `visit` stopped it.
    #[inline(always)]
    fn sides(&self, visit: &mut impl FnMut(Run) -> bool) -> Option<()> {
        let ((first, last), (upper, lower)) = (self.columns(), self.rows());
        let (across, down) = (last.saturating_sub(first), lower.saturating_sub(upper));
        let sides = [
            run(first, upper, 1, 0, across + 1),
            // Each side begins one pixel after the corner, so that no corner is visited twice.
            run(last, upper + 1, 0, 1, down),
            run(last.saturating_sub(1), lower, -1, 0, across),
            run(first, lower.saturating_sub(1), 0, -1, down.saturating_sub(1)),
        ];
        for side in sides {
            if side.len > 0 && !visit(side) {
                return None;
            }
        }
        Some(())
    }

    /// Does the work of [`Self::each_run`] for a region that the image circle cuts. `None` means that `visit` stopped
    /// it.
    #[inline(always)]
    fn around(&self, visit: &mut impl FnMut(Run) -> bool) -> Option<()> {
        let (upper, lower) = self.rows();
        let (top, (left, right)) = (upper..=lower).find_map(|y| self.row_span(y).map(|s| (y, s)))?;
        // The rows of a convex region are contiguous.
        let (bottom, (low, _)) = (top..=lower).rev().find_map(|y| self.row_span(y).map(|s| (y, s)))?;
        if !visit(run(left, top, 1, 0, right - left + 1)) {
            return None;
        }
        let x = self.down_the_right(right, top, bottom, visit)?;
        if bottom == top {
            return None;
        }
        if x > low && !visit(run(x - 1, bottom, -1, 0, x - low)) {
            return None;
        }
        let x = self.up_the_left(low, top, bottom, visit)?;
        // The path closes at the left end of the top row, along the second row where the top row is shorter.
        if x + 1 < left {
            visit(run(x + 1, top + 1, 1, 0, left - x - 1));
        }
        Some(())
    }

    /// Walks down the right side from the row below `top` and returns the end of the last row. The end of each row is
    /// found from that of the row above.
    #[inline(always)]
    fn down_the_right(&self, right: u16, top: u16, bottom: u16, visit: &mut impl FnMut(Run) -> bool) -> Option<u16> {
        let (first, last) = self.columns();
        let (mut x, mut y) = (right, top + 1);
        while y <= bottom {
            let mut end = x;
            // The end of a row is searched from that of the row above, because the circle moves by few pixels a row.
            // The whole walk costs the length of the ring.
            if self.contains(x, y) {
                while end < last && self.contains(end + 1, y) {
                    end += 1;
                }
            } else {
                while end > first && !self.contains(end, y) {
                    end -= 1;
                }
            }
            if end == x {
                // This run goes down as long as the column continues unchanged.
                let from = y;
                // Along the picture's side the region is convex: a property of both ends holds between them.
                while x == last && y + LEAP <= bottom && self.contains(x, y + LEAP) {
                    y += LEAP;
                }
                while y <= bottom && self.contains(x, y) && (x == last || !self.contains(x + 1, y)) {
                    y += 1;
                }
                if !visit(run(x, from, 0, 1, y - from)) {
                    return None;
                }
                continue;
            }
            // The path goes inwards along the row above, then outwards along this one.
            if x > end + 1 && !visit(run(x - 1, y - 1, -1, 0, x - end - 1)) {
                return None;
            }
            let from = if end > x { x + 1 } else { end };
            if !visit(run(from, y, 1, 0, end - from + 1)) {
                return None;
            }
            x = end;
            y += 1;
        }
        Some(x)
    }

    /// Walks up the left side from the row above `bottom` to the row below `top`, as [`Self::down_the_right`].
    #[inline(always)]
    fn up_the_left(&self, low: u16, top: u16, bottom: u16, visit: &mut impl FnMut(Run) -> bool) -> Option<u16> {
        let (first, last) = self.columns();
        let (mut x, mut y) = (low, bottom - 1);
        while y > top {
            let mut start = x;
            if self.contains(x, y) {
                while start > first && self.contains(start - 1, y) {
                    start -= 1;
                }
            } else {
                while start < last && !self.contains(start, y) {
                    start += 1;
                }
            }
            if start == x {
                let from = y;
                while x == first && y > top + LEAP && self.contains(x, y - LEAP) {
                    y -= LEAP;
                }
                while y > top && self.contains(x, y) && (x == first || !self.contains(x - 1, y)) {
                    y -= 1;
                }
                if !visit(run(x, from, 0, -1, from - y)) {
                    return None;
                }
                continue;
            }
            if x + 1 < start && !visit(run(x + 1, y + 1, 1, 0, start - x - 1)) {
                return None;
            }
            let from = if start < x { x - 1 } else { start };
            if !visit(run(from, y, -1, 0, from - start + 1)) {
                return None;
            }
            x = start;
            y -= 1;
        }
        Some(x)
    }
}

fn run(x: u16, y: u16, dx: i32, dy: i32, len: u16) -> Run {
    Run { x, y, dx, dy, len }
}

/// A straight run of the ring: `len` pixels from (x, y), each one (dx, dy) further.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Run {
    x: u16,
    y: u16,
    dx: i32,
    dy: i32,
    pub(crate) len: u16,
}

impl Run {
    #[inline(always)]
    pub(crate) fn at(&self, i: u16) -> Pixel {
        let i = i32::from(i);
        Pixel { x: (i32::from(self.x) + self.dx * i) as u16, y: (i32::from(self.y) + self.dy * i) as u16 }
    }
    /// Returns the step from a pixel to the next, (dx, dy).
    pub(crate) fn step(&self) -> (i32, i32) {
        (self.dx, self.dy)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Config;
    use super::*;
    use crate::geometry::camera::{Camera, Config as CameraConfig, Model};
    use std::collections::HashSet;
    use std::vec::Vec;

    fn ring(region: &Region<f64>) -> Vec<(u16, u16)> {
        let mut ring = Vec::new();
        region.each_run(|run| {
            ring.extend((0..run.len).map(|i| run.at(i)).map(|p| (p.x, p.y)));
            true
        });
        ring
    }

    /// Checks that the ring is closed, without repeats, and has exactly the pixels of the region with a 4-neighbour
    /// outside it.
    fn check(region: &Region<f64>) {
        let ring = ring(region);
        let set: HashSet<_> = ring.iter().copied().collect();
        assert_eq!(set.len(), ring.len(), "a pixel is visited twice");
        for (i, a) in ring.iter().enumerate() {
            let b = ring[(i + 1) % ring.len()];
            assert!(a.0.abs_diff(b.0) <= 1 && a.1.abs_diff(b.1) <= 1, "gap between {a:?} and {b:?}");
        }
        for y in 0..region.height() {
            for x in 0..region.width() {
                let outside = |dx: i32, dy: i32| {
                    let (x, y) = (i32::from(x) + dx, i32::from(y) + dy);
                    x < 0 || y < 0 || !region.contains(x as u16, y as u16)
                };
                let border =
                    region.contains(x, y) && (outside(1, 0) || outside(-1, 0) || outside(0, 1) || outside(0, -1));
                assert_eq!(border, set.contains(&(x, y)), "{x} {y}");
            }
        }
    }

    #[test]
    fn ring_of_a_rectangle() {
        check(&Region::whole(7, 5));
        check(&Region::whole(2, 2));
        check(&Region::whole(9, 8).without_frame(2));
        check(&Region::whole(5, 6).without_frame(2));
    }

    #[test]
    fn ring_of_image_circles() {
        for (w, h, f, deg) in [(80, 60, 30.0, 40.0), (80, 60, 30.0, 60.0), (61, 61, 20.0, 80.0), (90, 40, 33.3, 70.0)] {
            let config = CameraConfig {
                theta_max_deg: Some(deg),
                fy_px: f * 1.1,
                cx_px: f64::from(w) * 0.47,
                ..CameraConfig::ideal(Model::Equidistant, w, h, f)
            };
            let camera = Camera::try_new(&config).unwrap();
            assert!(camera.image_circle_px().is_some());
            let region = Region::new(&Config::default(), &camera);
            check(&region);
            check(&region.without_frame(3));
        }
    }
}
