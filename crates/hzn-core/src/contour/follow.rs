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
pub(super) const STEPS: [(i32, i32); 8] = [(1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1)];
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
        let (across, down) = (self.picture.across() as isize, self.picture.down() as isize);
        let offsets = STEPS.map(|(dx, dy)| dx as isize * across + dy as isize * down);
        let moves = STEPS.map(|(dx, dy)| ((dy as u32) << 16).wrapping_add(dx as u32));
        let masked = self.region.has_mask();
        let home = place(start);
        let mut at = home;
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
            let here = pixel(at);
            let marked_row = marks.has_row(here.y);
            away = away.saturating_sub(1);
            if away == 0 && self.region.is_inside_by(here.x, here.y, AWAY + 1) {
                away = AWAY;
            }
            let next = if away > 0 && !marked_row && at != home && !masked {
                // Nothing to look after but the level.
                let mut next = None;
                while turn <= 8 {
                    let d = usize::from((back + turn) & 7);
                    let (to, there) = (at.wrapping_add(moves[d]), index.wrapping_add_signed(offsets[d]));
                    self.observer.pixel(to as u16, (to >> 16) as u16);
                    if self.picture.read(there) >= self.level {
                        next = Some((to, there, d as u8));
                        break;
                    }
                    turn += 1;
                }
                edge.push(here);
                next
            } else {
                let look = Look {
                    here,
                    index,
                    back,
                    home: (!first && at == home).then_some(dark),
                    marked_row,
                    away: away > 0,
                };
                match self.look(&look, &offsets, marks) {
                    Seen::Border { cut } => {
                        if !cut {
                            edge.push(here);
                        }
                        return End::Open;
                    }
                    Seen::Home => return End::Closed { twice_area },
                    Seen::Neighbour { next, cut } => {
                        if !cut {
                            edge.push(here);
                        }
                        next
                    }
                }
            };
            let Some((to, there, d)) = next else {
                // A single pixel: all around it is dark.
                return End::Closed { twice_area: 0 };
            };
            let there_px = pixel(to);
            twice_area += i64::from(here.x) * i64::from(there_px.y) - i64::from(there_px.x) * i64::from(here.y);
            (at, index) = (to, there);
            back = (d + 4) & 7;
            // The dark neighbour passed over last is a neighbour of the new pixel, too: after a straight step it
            // stands at the second turn, after a diagonal one at the first.
            turn = if away > 0 && !first { 3 - d % 2 } else { 1 };
            first = false;
        }
    }

    /// Looks around a pixel where more counts than the level: at the border, at the mask, on a search line, at home.
    /// Every neighbour is looked at, also the dark ones that are known already.
    #[inline(never)]
    fn look(&self, look: &Look, offsets: &[isize; 8], marks: &mut Marks<'_>) -> Seen {
        let here = look.here;
        let inside = look.away || self.region.is_inside_by(here.x, here.y, 1);
        let mut cut = false;
        for turn in 1..=8u8 {
            let d = (look.back + turn) & 7;
            let (dx, dy) = STEPS[usize::from(d)];
            let (nx, ny) = (i32::from(here.x) + dx, i32::from(here.y) + dy);
            if !inside {
                let beyond = nx < 0 || ny < 0 || !self.region.contains(nx as u16, ny as u16);
                // The ring is made of the pixels with an outer 4-neighbour: an outer corner is merely dark.
                if beyond && d % 2 == 1 {
                    continue;
                }
                if beyond {
                    return Seen::Border { cut };
                }
            }
            let to = Pixel { x: nx as u16, y: ny as u16 };
            self.observer.pixel(to.x, to.y);
            let there = look.index.wrapping_add_signed(offsets[usize::from(d)]);
            if self.picture.read(there) >= self.level {
                if !self.region.masked(to.x, to.y) {
                    return Seen::Neighbour { next: Some((place(to), there, d)), cut };
                }
                cut = true;
            }
            if look.marked_row && d == WEST {
                marks.set(here.x, here.y);
            }
            if look.home == Some(d) {
                return Seen::Home;
            }
        }
        Seen::Neighbour { next: None, cut }
    }
}

/// A look ahead by this many steps spares their checks.
const AWAY: u16 = 31;

/// A pixel as one word, row above column, so that a step is one addition.
fn place(p: Pixel) -> u32 {
    u32::from(p.y) << 16 | u32::from(p.x)
}
fn pixel(at: u32) -> Pixel {
    Pixel { x: at as u16, y: (at >> 16) as u16 }
}

struct Look {
    here: Pixel,
    index: usize,
    back: u8,
    /// At the start again: the direction whose dark neighbour closes the edge.
    home: Option<u8>,
    marked_row: bool,
    /// No neighbour can be beyond the region.
    away: bool,
}

/// What a look around came upon; `cut`: a masked pixel on the way, so that this one is no edge point.
enum Seen {
    Border { cut: bool },
    Home,
    Neighbour { next: Option<(u32, usize, u8)>, cut: bool },
}
