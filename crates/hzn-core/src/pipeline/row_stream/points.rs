//! Edge points by the border pixel at which they were measured, in the order of the rows.

use crate::geometry::block::Lit;
use crate::image::{Profile, StreamedPoint};

/// An edge point: the column of its border pixel, and the distance from there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    towards_dark_px: f32,
    x: u16,
    /// The lit side in the lowest two bits, and the contrast of the profile.
    side: u8,
    /// The marks of the point, and the width of the profile above them.
    marks: u8,
}

const MARKS: u8 = StreamedPoint::MARK_BITS;
/// Number of bits of the lit side.
const SIDE: u8 = 2;
/// The lit sides by number.
const SIDES: [Lit; 4] = [Lit::Right, Lit::Left, Lit::Below, Lit::Above];

impl Point {
    pub(super) const NONE: Self = Self { towards_dark_px: 0.0, x: 0, side: 0, marks: 0 };
}

/// The points of the rows so far, in borrowed memory. When the memory is full, every second pixel is left out, both of
/// the points so far and from then on. A hash of the coordinates selects the pixels, independently of the course of
/// edges.
#[derive(Debug)]
pub(super) struct Points<'a> {
    /// Index in `points` at which each row ends.
    ends: &'a mut [u16],
    points: &'a mut [Point],
    rows: u16,
    used: usize,
    /// One of 2^thinned pixels is measured.
    thinned: u32,
    dropped: u32,
}

impl<'a> Points<'a> {
    pub(super) fn new(ends: &'a mut [u16], points: &'a mut [Point]) -> Self {
        // The ends of the rows have 16 bits, which is half of the memory of a `usize` on a flight computer.
        let room = points.len().min(usize::from(u16::MAX));
        let points = points.get_mut(..room).unwrap_or_default();
        Self { ends, points, rows: 0, used: 0, thinned: 0, dropped: 0 }
    }

    /// Returns the number of border pixels that were left out.
    pub(super) fn dropped(&self) -> u32 {
        self.dropped
    }

    fn kept(x: u16, y: u16, thinned: u32) -> bool {
        let n = (u32::from(y) << 16 | u32::from(x)).wrapping_mul(0x9E37_79B1);
        // A rule such as every second column would leave out whole stretches of vertical edges. The hash thins all
        // directions alike, and it is nested: what is left out at one level stays out at the next.
        (n ^ n >> 15).wrapping_mul(0x2C1B_3C6D).checked_shr(32 - thinned).unwrap_or(0) == 0
    }

    /// Returns whether the pixel must be measured, and makes room for its point.
    pub(super) fn wants(&mut self, x: u16, y: u16) -> bool {
        while Self::kept(x, y, self.thinned) {
            if self.used < self.points.len() {
                return true;
            }
            // The limit is there so that the loop ends for a memory without any room.
            if self.thinned > 24 {
                break;
            }
            self.halve(y);
        }
        self.dropped += 1;
        false
    }

    /// Leaves out every second pixel of the finished rows and of row `y`, which is not finished.
    // The attribute keeps the loop out of the path of a usual picture, which never thins.
    #[cold]
    fn halve(&mut self, y: u16) {
        self.thinned += 1;
        let (mut from, mut to) = (0, 0);
        for row in 0..=y {
            // The row in progress has no end yet.
            let end = if row < self.rows {
                self.ends.get(usize::from(row)).map_or(0, |&e| usize::from(e))
            } else {
                self.used
            };
            for i in from..end {
                let Some(&point) = self.points.get(i) else { break };
                if Self::kept(point.x, row, self.thinned)
                    && let Some(place) = self.points.get_mut(to)
                {
                    *place = point;
                    to += 1;
                } else {
                    self.dropped += 1;
                }
            }
            from = end;
            if row < self.rows
                && let Some(place) = self.ends.get_mut(usize::from(row))
            {
                *place = to as u16;
            }
        }
        self.used = to;
    }

    /// Adds a point to the row that is not finished, in order of increasing columns.
    pub(super) fn push(&mut self, x: u16, found: StreamedPoint) {
        if let Some(place) = self.points.get_mut(self.used) {
            let Profile { width, contrast } = found.profile;
            let side = found.lit as u8 + (contrast << SIDE);
            let marks = found.marks + (width << MARKS);
            *place = Point { towards_dark_px: found.towards_dark_px, x, side, marks };
            self.used += 1;
        }
    }

    /// Ends the row.
    pub(super) fn end_row(&mut self) {
        if let Some(end) = self.ends.get_mut(usize::from(self.rows)) {
            *end = self.used as u16;
        }
        self.rows += 1;
    }

    /// Returns the point at a border pixel of a finished row.
    pub(super) fn get(&self, x: u16, y: u16) -> Option<StreamedPoint> {
        let at = |y: u16| self.ends.get(usize::from(y)).map_or(0, |&e| usize::from(e));
        let start = if y == 0 { 0 } else { at(y - 1) };
        let row = self.points.get(start..at(y))?;
        // A row is searched by halves because its points are sorted by column; a clouded row may have hundreds.
        let found = row.get(row.partition_point(|p| p.x < x)).filter(|p| p.x == x)?;
        let Point { towards_dark_px, side, marks, .. } = *found;
        Some(StreamedPoint {
            towards_dark_px,
            lit: SIDES[usize::from(side & 3)],
            marks: marks & ((1 << MARKS) - 1),
            profile: Profile { width: marks >> MARKS, contrast: side >> SIDE },
        })
    }
}
