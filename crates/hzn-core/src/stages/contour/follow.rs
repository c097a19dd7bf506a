//! The border follower. It starts at a lit pixel with a dark neighbour and walks along the edge, with the lit side on
//! the left.
//!
//! It uses the Moore neighbourhood with 8-connected lit pixels, like Suzuki & Abe 1985 and OpenCV's `findContours`. It
//! goes counter-clockwise around the lit side, as seen on the screen. At each pixel it examines the neighbours
//! counter-clockwise, beginning after the one where it came from. The first lit neighbour is the next pixel. The dark
//! neighbours that it passes belong to the edge. If one of them is beyond the region, the edge ends there. If one of
//! the neighbours is bright but masked, the pixel is no edge point.
//!
//! Most steps are far from the border, the masks, the search lines and the start. These steps are done in runs, in
//! which only the threshold is checked.

use super::marks::Marks;
use super::thinned::Thinned;
use crate::base::real::Real;
use crate::geometry::pixel::Pixel;
use crate::image::Pixels;
use crate::image::region::Region;
use crate::model::observer::Observer;
use crate::model::tone::{Curve, Tone};
use crate::model::work;
use core::cell::Cell;

/// Steps to the eight neighbours, counter-clockwise on the screen from east: (dx, dy).
pub(super) const STEPS: [(i32, i32); 8] = [(1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1)];
/// Direction of the western neighbour, which search lines mark.
pub(super) const WEST: u8 = 4;

/// An edge point has its own mid-level if its local contrast is at least 1/`FULL_SCALE_PART` of full scale, or
/// 1/`CONTRAST_PART` of the contrast of the picture. In both cases `LEAST_CONTRAST` counts are necessary.
const FULL_SCALE_PART: i32 = 64;
const CONTRAST_PART: i32 = 16;
// A step of one count is the rounding of the values, therefore its contour line is no edge.
const LEAST_CONTRAST: i32 = 2;

/// The picture as the follower sees it: lit and dark pixels of a region.
pub(crate) struct BinaryPicture<'a, T, P, O> {
    pub(crate) picture: &'a P,
    pub(crate) region: &'a Region<T>,
    pub(crate) level: u16,
    pub(crate) observer: &'a O,
    /// Whether the disc of the body blooms. Its edge points then use the threshold of the picture, because the glare
    /// around the disc is no plateau.
    pub(crate) blooms: bool,
    /// Smallest local contrast, in counts, for which an edge point has its own mid-level.
    pub(crate) least_contrast: i32,
    /// The curve between light and counts, if it is known and no straight line.
    pub(crate) curve: Option<Curve<T>>,
    /// Cost of a read of the mask, in the unit of the work budget.
    mask: u32,
    /// Cost of the reads since the last payment to the budget.
    // The cost is collected in a cell and paid in turns, because a payment at every read would cost more than the read.
    owed: Cell<u32>,
    /// The eight moves, twice: a search over eight directions can begin at any of the first eight without wrapping.
    moves: [Move; 16],
}

/// A step of the follower.
#[derive(Clone, Copy)]
struct Move {
    /// Direction of the step, and the first direction to examine after it. The last dark neighbour that was passed is
    /// also a neighbour of the new pixel, and is not read again. `first` is therefore three directions
    /// counter-clockwise of the way back after a straight step, and two after a diagonal one.
    direction: u8,
    first: u8,
    dx: i32,
    dy: i32,
    /// The step as one word, to be added to a pixel as one word.
    word: u32,
    /// The step as an offset in the memory of the picture.
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
            // The step is an offset in memory, so that a step needs no product of row and stride.
            offset: dx as isize * picture.across() as isize + dy as isize * picture.down() as isize,
        }
    }
}

/// How an edge ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    /// The edge ends at the border of the region.
    Open,
    /// The edge returns to its start. `twice_area` is twice the enclosed area in px², negative for an outer edge
    /// (y down).
    Closed { twice_area: i64 },
    /// The work budget of the edge is used up.
    OutOfSteps,
}

/// State of the follower.
struct Walk {
    at: Pixel,
    index: usize,
    /// Direction back to the previous pixel.
    back: u8,
    /// Twice the area on the right of the way so far in px², by Green's theorem: each step adds (2x + dx) dy.
    twice_area: i64,
}

/// Largest number of steps of a run.
const RUN: usize = 32;

impl<'a, T: Real, P: Pixels, O: Observer<T>> BinaryPicture<'a, T, P, O> {
    pub(crate) fn new(picture: &'a P, region: &'a Region<T>, level: u16, observer: &'a O) -> Self {
        let moves = core::array::from_fn(|i| Move::new(i as u8, picture));
        let mask = region.mask_cost();
        let least_contrast = (i32::from(picture.full_scale()) / FULL_SCALE_PART).max(LEAST_CONTRAST);
        Self {
            picture,
            region,
            level,
            observer,
            blooms: false,
            least_contrast,
            curve: None,
            mask,
            owed: Cell::new(0),
            moves,
        }
    }

    /// Reduces the smallest contrast of edge points to 1/16 of `contrast`, which is the contrast between the dark and
    /// the lit pixels of the picture in counts. This contrast may be a small part of full scale, as in 16-bit pictures
    /// of a thermal camera. Pictures with 8 bits keep their limit of three counts, which is small in any case.
    pub(crate) fn with_contrast(self, contrast: T) -> Self {
        let own = (contrast / T::from_i32(CONTRAST_PART)).to_i32();
        let least = if own > 0 && self.picture.full_scale() > 255 { own.max(LEAST_CONTRAST) } else { i32::MAX };
        Self { least_contrast: self.least_contrast.min(least), ..self }
    }

    /// Locates edge points at half of the light, if the tone of the picture is known.
    pub(crate) fn with_tone(self, tone: Option<Tone>) -> Self {
        Self { curve: tone.and_then(Tone::curve), ..self }
    }

    pub(crate) fn with_blooming(self, blooms: bool) -> Self {
        Self { blooms, ..self }
    }

    /// Returns whether a pixel of the region is lit and not masked.
    #[inline(always)]
    pub(crate) fn lit(&self, x: u16, y: u16) -> bool {
        self.brightness(x, y) >= self.level && !self.masked(x, y)
    }
    /// Does the same as [`Self::lit`], and counts the read. A search over many pixels uses it.
    #[inline(always)]
    pub(super) fn lit_counted(&self, x: u16, y: u16) -> bool {
        self.owed.set(self.owed.get() + work::READ);
        self.lit(x, y)
    }
    /// Returns whether a polygon covers the pixel.
    #[inline(always)]
    pub(crate) fn masked(&self, x: u16, y: u16) -> bool {
        // The flag is tested inline and the polygons are not: most cameras have no mask, and the loop stays small.
        self.region.has_mask() && self.is_covered(x, y)
    }
    #[inline(never)]
    fn is_covered(&self, x: u16, y: u16) -> bool {
        self.owed.set(self.owed.get() + self.mask);
        self.region.masked(x, y)
    }
    /// Returns the clearance of a pixel, see [`Region::clearance`], and counts its cost.
    #[inline(always)]
    pub(crate) fn clearance(&self, x: u16, y: u16, most: u16) -> u16 {
        let mut cost = 0;
        let clear = self.region.clearance(x, y, most, &mut cost);
        self.owed.set(self.owed.get() + cost);
        clear
    }
    /// Returns the cost of one read of the mask.
    pub(crate) fn mask_cost(&self) -> u32 {
        self.mask
    }
    /// Returns the cost of [`Self::masked`], [`Self::clearance`] and [`Self::lit_counted`] since the last call.
    pub(crate) fn cost(&self) -> u32 {
        self.owed.take()
    }

    /// Reads the brightness of a pixel in counts.
    #[inline(always)]
    pub(crate) fn brightness(&self, x: u16, y: u16) -> u16 {
        self.observer.pixel(x, y);
        self.picture.at(x, y)
    }

    /// Follows the edge that passes between the lit pixel `start` and its dark neighbour in direction `dark`. The
    /// function stores the edge in `edge`, marks the crossings of search lines, and counts `steps` down.
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
            // The run is also limited by the budget, so that it can never spend more than is left.
            let free = self.free_steps(walk.at, start, marks).min(*steps);
            if free > 0 {
                *steps = steps.saturating_sub(free + work::RUN + self.cost());
                match edge.places(free as usize) {
                    Some(places) => self.run(&mut walk, places),
                    None => self.run_thinned(&mut walk, free as usize, edge),
                }
                continue;
            }
            if *steps == 0 {
                return End::OutOfSteps;
            }
            // At the first look the follower stands at its start, too, but has not been around.
            let home = (away && walk.at == start).then_some(dark);
            away = true;
            let seen = self.look(&walk, home, marks);
            *steps = steps.saturating_sub(work::LOOK_AROUND + self.cost());
            match seen {
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

    /// Returns the number of steps from here in which only the threshold needs to be checked.
    #[inline]
    fn free_steps(&self, here: Pixel, start: Pixel, marks: &Marks<'_>) -> u32 {
        // Each step moves by at most one pixel in x and y; within this distance the walk cannot reach its start.
        let home = here.x.abs_diff(start.x).max(here.y.abs_diff(start.y));
        let most = home.min(marks.rows_away(here.y)).min(RUN as u16);
        if most == 0 {
            return 0;
        }
        // The last step reads one pixel further.
        u32::from(self.clearance(here.x, here.y, most + 1).saturating_sub(1))
    }

    /// Does `n` free steps, at most [`RUN`], if not every pixel is stored.
    #[inline(never)]
    fn run_thinned(&self, walk: &mut Walk, n: usize, edge: &mut Thinned<'_>) {
        // A thinned edge stores few of its pixels. The run writes them to a short list first, so that its loop has no
        // test of the stride.
        let mut passed = [Pixel::default(); RUN];
        let passed = passed.get_mut(..n).unwrap_or_default();
        self.run(walk, passed);
        edge.extend(passed);
    }

    /// Does as many free steps as there are places, and stores the pixels that are passed.
    #[inline(never)]
    fn run(&self, walk: &mut Walk, passed: &mut [Pixel]) {
        // The area of a run fits 32 bits.
        let (mut at, mut index, mut twice_area) = (word(walk.at), walk.index, 0i32);
        let mut last = &self.moves[usize::from((walk.back + 4) & 7)];
        for slot in passed {
            *slot = pixel(at);
            let first = usize::from(last.first & 7);
            // The slice of the doubled list needs no wrap-around in the loop, which is why the moves are there twice.
            for turn in self.moves.get(first..first + 8).unwrap_or_default() {
                let there = index.wrapping_add_signed(turn.offset);
                let to = at.wrapping_add(turn.word);
                self.observer.pixel(to as u16, (to >> 16) as u16);
                // No bounds, masks or marks are tested here: the clearance has shown that the run cannot meet them.
                if self.picture.read(there) >= self.level {
                    twice_area += (2 * i32::from(at as u16) + turn.dx) * turn.dy;
                    (at, index, last) = (to, there, turn);
                    break;
                }
            }
        }
        let twice_area = walk.twice_area + i64::from(twice_area);
        *walk = Walk { at: pixel(at), index, back: (last.direction + 4) & 7, twice_area };
    }

    /// Does one step.
    fn go(&self, walk: &mut Walk, direction: u8) {
        let step = &self.moves[usize::from(direction & 7)];
        walk.twice_area += i64::from((2 * i32::from(walk.at.x) + step.dx) * step.dy);
        walk.at = pixel(word(walk.at).wrapping_add(step.word));
        walk.index = walk.index.wrapping_add_signed(step.offset);
        walk.back = (direction + 4) & 7;
    }

    /// Examines all neighbours of a pixel where more than the threshold has to be checked: at the border, at a mask, on
    /// a search line, or at the start. The function also reads the dark neighbours that are already known. `home` is
    /// set at the start of the edge: it is the direction of the dark neighbour that closes the edge.
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
                // The ring consists of the pixels with an outer 4-neighbour. An outer pixel at a corner counts as dark.
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
                // The mask is read only for bright pixels, because it can only make a pixel dark.
                if !self.masked(x, y) {
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

/// Packs a pixel into one word, with the row above the column, so that a step is one addition.
fn word(p: Pixel) -> u32 {
    u32::from(p.y) << 16 | u32::from(p.x)
}
fn pixel(word: u32) -> Pixel {
    Pixel { x: word as u16, y: (word >> 16) as u16 }
}

/// Result of a look at all neighbours. `cut` says that a bright but masked pixel was passed, so that this pixel is no
/// edge point.
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
    /// The pixel is single: all its neighbours are dark.
    Nothing {
        cut: bool,
    },
}
