//! The border follower: from a lit pixel and a dark neighbour along the edge, the lit side on the left.
//!
//! Moore neighbourhood, lit pixels 8-connected, as Suzuki & Abe 1985 and OpenCV's `findContours`. Going
//! counter-clockwise about the lit side (as seen on the screen), the neighbours of a pixel are examined
//! counter-clockwise from the one where the follower came from; the first lit one is next. The dark ones passed over
//! belong to the edge: where one of them lies beyond the region, the edge ends there; where it is masked, the pixel
//! is no edge point.
//!
//! Most steps are far from the border, the masks, the search lines and the start: they are taken in runs in which
//! nothing is looked at but the level.

use super::marks::Marks;
use super::thinned::Thinned;
use crate::base::real::Real;
use crate::geometry::pixel::Pixel;
use crate::image::Pixels;
use crate::image::region::Region;
use crate::model::observer::Observer;
use crate::model::work;
use core::cell::Cell;

/// Neighbours counter-clockwise on the screen from east: (dx, dy).
pub(super) const STEPS: [(i32, i32); 8] = [(1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1)];
/// The western neighbour, which search lines mark.
pub(super) const WEST: u8 = 4;

/// An edge point's mid-level is its own from this part of full scale on, or of the picture's contrast, and from so many
/// counts.
const FULL_SCALE_PART: i32 = 64;
const CONTRAST_PART: i32 = 16;
const LEAST_CONTRAST: i32 = 2;

/// What is followed: a picture, its level and its region.
pub(crate) struct BinaryPicture<'a, T, P, O> {
    pub(crate) picture: &'a P,
    pub(crate) region: &'a Region<T>,
    pub(crate) level: u16,
    pub(crate) observer: &'a O,
    /// The body's disc blooms: its edge is where the picture's level says, as what lies around it is no plateau.
    pub(crate) blooms: bool,
    /// Contrast in counts that an edge point's own mid-level needs at least.
    pub(crate) least_contrast: i32,
    /// What a look at the mask costs, and a look around.
    mask: u32,
    look: u32,
    /// Looks at the mask outside of the follower that were not paid for yet.
    masked: Cell<u32>,
    /// Twice around, so that eight directions follow each other from any of the first eight.
    moves: [Move; 16],
}

/// A step of the follower.
#[derive(Clone, Copy)]
struct Move {
    /// Its direction, and the first to be looked at after it: the dark neighbour passed over last is a neighbour of the
    /// new pixel, too. It stands three directions before the way back after a straight step, two after a diagonal one.
    direction: u8,
    first: u8,
    dx: i32,
    dy: i32,
    /// Added to a pixel as one word.
    word: u32,
    /// In the picture's memory.
    offset: isize,
}

impl Move {
    fn new(direction: u8, picture: &impl Pixels) -> Self {
        let (dx, dy) = STEPS[usize::from(direction & 7)];
        Self {
            direction: direction & 7,
            first: if direction.is_multiple_of(2) { direction + 7 } else { direction + 6 } & 7,
            dx,
            dy,
            word: ((dy as u32) << 16).wrapping_add(dx as u32),
            offset: dx as isize * picture.across() as isize + dy as isize * picture.down() as isize,
        }
    }
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

/// Where the follower stands.
struct Walk {
    at: Pixel,
    index: usize,
    /// The direction back to where it came from.
    back: u8,
    /// Twice the area on the right of its way so far, by Green's theorem: each step adds (2x + dx) dy.
    twice_area: i64,
}

/// Most steps of a run.
const RUN: usize = 32;

impl<'a, T: Real, P: Pixels, O: Observer<T>> BinaryPicture<'a, T, P, O> {
    pub(crate) fn new(picture: &'a P, region: &'a Region<T>, level: u16, observer: &'a O) -> Self {
        let moves = core::array::from_fn(|i| Move::new(i as u8, picture));
        let (mask, masked) = (region.mask_cost(), Cell::new(0));
        let least_contrast = (i32::from(picture.full_scale()) / FULL_SCALE_PART).max(LEAST_CONTRAST);
        Self {
            picture,
            region,
            level,
            observer,
            blooms: false,
            least_contrast,
            mask,
            look: work::look(mask),
            masked,
            moves,
        }
    }

    /// With the contrast between the picture's dark and its lit pixels in counts: where it is a small part of full
    /// scale, as in words of a thermal camera, an edge has less of it, too. Of bytes three counts are little in any
    /// case.
    pub(crate) fn contrasting(self, contrast: T) -> Self {
        let own = (contrast / T::from_i32(CONTRAST_PART)).to_i32();
        let least = if own > 0 && self.picture.full_scale() > 255 { own.max(LEAST_CONTRAST) } else { i32::MAX };
        Self { least_contrast: self.least_contrast.min(least), ..self }
    }

    pub(crate) fn blooming(self, blooms: bool) -> Self {
        Self { blooms, ..self }
    }

    /// Whether a pixel of the region is lit.
    #[inline(always)]
    pub(crate) fn lit(&self, x: u16, y: u16) -> bool {
        self.brightness(x, y) >= self.level && !self.masked(x, y)
    }
    /// Whether a polygon covers the pixel.
    #[inline(always)]
    pub(super) fn masked(&self, x: u16, y: u16) -> bool {
        self.region.has_mask() && self.is_covered(x, y)
    }
    #[inline(never)]
    fn is_covered(&self, x: u16, y: u16) -> bool {
        self.masked.set(self.masked.get() + 1);
        self.region.masked(x, y)
    }
    /// What a look at the mask costs.
    pub(crate) fn mask_cost(&self) -> u32 {
        self.mask
    }
    /// What [`Self::lit`] has cost since the last time.
    pub(crate) fn cost(&self) -> u32 {
        self.masked.take() * self.mask
    }

    /// The brightness of a pixel in counts.
    #[inline(always)]
    pub(crate) fn brightness(&self, x: u16, y: u16) -> u16 {
        self.observer.pixel(x, y);
        self.picture.at(x, y)
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
        let mut walk = Walk { at: start, index: self.picture.index(start.x, start.y), back: dark, twice_area: 0 };
        let mut away = false;
        loop {
            let free = self.free_steps(walk.at, start, marks).min(*steps);
            if free > 0 {
                *steps -= free;
                self.run(&mut walk, free as usize, edge);
                continue;
            }
            if *steps == 0 {
                return End::OutOfSteps;
            }
            *steps = steps.saturating_sub(self.look);
            let home = (away && walk.at == start).then_some(dark);
            away = true;
            match self.look(&walk, home, marks) {
                Seen::Lit { direction, cut } => {
                    if !cut {
                        edge.push(walk.at);
                    }
                    self.go(&mut walk, direction);
                }
                Seen::Border { cut } => {
                    if !cut {
                        edge.push(walk.at);
                    }
                    return End::Open;
                }
                Seen::Home => return End::Closed { twice_area: walk.twice_area },
                Seen::Nothing { cut } => {
                    if !cut {
                        edge.push(walk.at);
                    }
                    return End::Closed { twice_area: 0 };
                }
            }
        }
    }

    /// Steps from here during which nothing counts but the level.
    #[inline]
    fn free_steps(&self, here: Pixel, start: Pixel, marks: &Marks<'_>) -> u32 {
        let home = here.x.abs_diff(start.x).max(here.y.abs_diff(start.y));
        let most = home.min(marks.rows_away(here.y)).min(RUN as u16);
        if most == 0 {
            return 0;
        }
        // What the last step looks at is one pixel further.
        u32::from(self.region.clearance(here.x, here.y, most + 1).saturating_sub(1))
    }

    /// `n` free steps, at most [`RUN`].
    #[inline(never)]
    fn run(&self, walk: &mut Walk, n: usize, edge: &mut Thinned<'_>) {
        let mut passed = [Pixel::default(); RUN];
        // The area of a run fits 32 bits.
        let (mut at, mut index, mut twice_area) = (word(walk.at), walk.index, 0i32);
        let mut last = &self.moves[usize::from((walk.back + 4) & 7)];
        for slot in passed.iter_mut().take(n) {
            *slot = pixel(at);
            let first = usize::from(last.first & 7);
            for turn in self.moves.get(first..first + 8).unwrap_or_default() {
                let there = index.wrapping_add_signed(turn.offset);
                let to = at.wrapping_add(turn.word);
                self.observer.pixel(to as u16, (to >> 16) as u16);
                if self.picture.read(there) >= self.level {
                    twice_area += (2 * i32::from(at as u16) + turn.dx) * turn.dy;
                    (at, index, last) = (to, there, turn);
                    break;
                }
            }
        }
        edge.extend(passed.get(..n).unwrap_or_default());
        let twice_area = walk.twice_area + i64::from(twice_area);
        *walk = Walk { at: pixel(at), index, back: (last.direction + 4) & 7, twice_area };
    }

    /// One step.
    fn go(&self, walk: &mut Walk, direction: u8) {
        let step = &self.moves[usize::from(direction & 7)];
        walk.twice_area += i64::from((2 * i32::from(walk.at.x) + step.dx) * step.dy);
        walk.at = pixel(word(walk.at).wrapping_add(step.word));
        walk.index = walk.index.wrapping_add_signed(step.offset);
        walk.back = (direction + 4) & 7;
    }

    /// Looks around a pixel where more counts than the level: at the border, at the mask, on a search line, at home.
    /// Every neighbour is looked at, also the dark ones that are known already. `home`: at the start again, the
    /// direction whose dark neighbour closes the edge.
    #[inline(never)]
    fn look(&self, walk: &Walk, home: Option<u8>, marks: &mut Marks<'_>) -> Seen {
        let here = walk.at;
        let inside = self.region.is_inside_by(here.x, here.y, 1);
        let marked_row = marks.has_row(here.y);
        let mut cut = false;
        for turn in 1..=8u8 {
            let direction = (walk.back + turn) & 7;
            let step = &self.moves[usize::from(direction)];
            let (nx, ny) = (i32::from(here.x) + step.dx, i32::from(here.y) + step.dy);
            if !inside {
                let beyond = nx < 0 || ny < 0 || !self.region.contains(nx as u16, ny as u16);
                // The ring is made of the pixels with an outer 4-neighbour: an outer corner is merely dark.
                if beyond && direction % 2 == 1 {
                    continue;
                }
                if beyond {
                    return Seen::Border { cut };
                }
            }
            let (x, y) = (nx as u16, ny as u16);
            self.observer.pixel(x, y);
            if self.picture.read(walk.index.wrapping_add_signed(step.offset)) >= self.level {
                if !self.region.masked(x, y) {
                    return Seen::Lit { direction, cut };
                }
                cut = true;
            }
            if marked_row && direction == WEST {
                marks.set(here.x, here.y);
            }
            if home == Some(direction) {
                return Seen::Home;
            }
        }
        Seen::Nothing { cut }
    }
}

/// A pixel as one word, row above column, so that a step is one addition.
fn word(p: Pixel) -> u32 {
    u32::from(p.y) << 16 | u32::from(p.x)
}
fn pixel(word: u32) -> Pixel {
    Pixel { x: word as u16, y: (word >> 16) as u16 }
}

/// What a look around came upon; `cut`: a masked pixel on the way, so that this one is no edge point.
enum Seen {
    /// The next pixel.
    Lit {
        direction: u8,
        cut: bool,
    },
    Border {
        cut: bool,
    },
    Home,
    /// A single pixel: all around it is dark.
    Nothing {
        cut: bool,
    },
}
