//! The border follower: from a lit pixel and a dark neighbour along the edge, the lit side on the left.
//!
//! Moore neighbourhood, lit pixels 8-connected, as Suzuki & Abe 1985 and OpenCV's `findContours`. Going
//! counter-clockwise about the lit side (as seen on the screen), the neighbours of a pixel are examined
//! counter-clockwise from the one where the follower came from; the first lit one is next. The dark ones passed over
//! belong to the edge: where one of them lies beyond the region, the edge ends there; where it is masked, the pixel
//! is no edge point.

use super::marks::Marks;
use super::thinned::Thinned;
use crate::image::Pixels;
use crate::pipeline::Observer;
use crate::pixel::Pixel;
use crate::real::Real;
use crate::region::Region;

/// Neighbours counter-clockwise on the screen from east: (dx, dy).
const STEPS: [(i32, i32); 8] = [(1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1)];
/// The western neighbour, which search lines mark.
pub(super) const WEST: u8 = 4;

/// What is followed: a picture, its level and its region.
pub(crate) struct Scene<'a, T, P, O> {
    pub(crate) picture: &'a P,
    pub(crate) region: &'a Region<T>,
    pub(crate) level: u16,
    pub(crate) observer: &'a O,
}

/// How an edge ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    /// At the border of the region.
    Open,
    /// Back at its start; twice the enclosed area, negative for an outer edge (y down).
    Closed { twice_area: i64 },
    /// The picture's steps are used up.
    OutOfSteps,
}

impl<T: Real, P: Pixels, O: Observer<T>> Scene<'_, T, P, O> {
    /// Whether a pixel of the region is lit.
    #[inline(always)]
    pub(crate) fn lit(&self, x: u16, y: u16) -> bool {
        self.observer.pixel(x, y);
        self.picture.at(x, y) >= self.level && !self.region.masked(x, y)
    }

    /// Follows the edge that passes between the lit pixel `start` and its dark neighbour in direction `dark`.
    /// Stores it in `edge`, marks the crossings of search lines, and counts `steps` down.
    pub(crate) fn follow(
        &self,
        start: Pixel,
        dark: u8,
        edge: &mut Thinned<'_>,
        marks: &mut Marks<'_>,
        steps: &mut u32,
    ) -> End {
        let home = (i32::from(start.x), i32::from(start.y));
        let (mut x, mut y) = home;
        let (across, down) = (self.picture.across() as isize, self.picture.down() as isize);
        let offsets = STEPS.map(|(dx, dy)| dx as isize * across + dy as isize * down);
        let masked = self.region.has_mask();
        let mut index = self.picture.index(start.x, start.y);
        // The direction back to where the follower came from.
        let mut back = dark;
        // The first turn whose neighbour is not known yet.
        let mut turn = 1u8;
        // Steps that certainly stay away from the border of the region.
        let mut away = 0u16;
        let mut twice_area = 0i64;
        let mut first = true;
        loop {
            if *steps == 0 {
                return End::OutOfSteps;
            }
            *steps -= 1;
            let at_home = !first && (x, y) == home;
            let marked_row = marks.has_row(y as u16);
            if away == 0 && self.region.is_inside_by(x as u16, y as u16, AWAY + 1) {
                away = AWAY;
            }
            let inside = away > 0 || self.region.is_inside_by(x as u16, y as u16, 1);
            away = away.saturating_sub(1);
            if at_home || marked_row || masked {
                // Here the known dark ones count, too.
                turn = 1;
            }
            let mut cut = false;
            let mut next = None;
            while turn <= 8 {
                let d = (back + turn) & 7;
                turn += 1;
                let (dx, dy) = STEPS[usize::from(d)];
                let (nx, ny) = (x + dx, y + dy);
                if !inside {
                    let beyond = nx < 0 || ny < 0 || !self.region.contains(nx as u16, ny as u16);
                    // The ring is made of the pixels with an outer 4-neighbour: an outer corner is merely dark.
                    if beyond && d % 2 == 1 {
                        continue;
                    }
                    if beyond {
                        if !cut {
                            edge.push(Pixel { x: x as u16, y: y as u16 });
                        }
                        return End::Open;
                    }
                }
                self.observer.pixel(nx as u16, ny as u16);
                let at = index.wrapping_add_signed(offsets[usize::from(d)]);
                if self.picture.read(at) >= self.level {
                    if !masked || !self.region.masked(nx as u16, ny as u16) {
                        next = Some((nx, ny, at, d));
                        break;
                    }
                    cut = true;
                }
                if marked_row && d == WEST {
                    marks.set(x as u16, y as u16);
                }
                if at_home && d == dark {
                    return End::Closed { twice_area };
                }
            }
            if !cut {
                edge.push(Pixel { x: x as u16, y: y as u16 });
            }
            let Some((nx, ny, at, d)) = next else {
                // A single pixel: all around it is dark.
                return End::Closed { twice_area: 0 };
            };
            twice_area += i64::from(x) * i64::from(ny) - i64::from(nx) * i64::from(y);
            (x, y, index) = (nx, ny, at);
            back = (d + 4) & 7;
            // The dark neighbour passed over last is a neighbour of the new pixel, too: after a straight step it
            // stands at the second turn, after a diagonal one at the first.
            turn = if inside && !first { 3 - d % 2 } else { 1 };
            first = false;
        }
    }
}

/// A look this far ahead spares the check of as many steps.
const AWAY: u16 = 31;
