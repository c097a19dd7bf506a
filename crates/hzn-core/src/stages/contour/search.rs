//! Finds the beginnings of edges: at the border of the region (the ring), and on search lines.

use super::follow::{BinaryPicture, WEST};
use super::marks::Marks;
use crate::base::real::Real;
use crate::geometry::pixel::Pixel;
use crate::image::Pixels;
use crate::image::region::Run;
use crate::model::observer::Observer;

/// Largest number of starts that are ranked.
// A few are enough, because the other starts follow in the order of the ring.
pub(crate) const RANKED: usize = 4;

/// The beginning of an edge: a lit pixel of the ring after a dark one. `dark` is the direction to that dark pixel, and
/// `stretch` is the number of dark pixels before the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Start {
    pub(crate) pixel: Pixel,
    pub(crate) dark: u8,
    pub(crate) stretch: u32,
}

/// The starts after the longest dark stretches of the ring, longest first. In most pictures the sky is the longest
/// stretch. The limb therefore comes first, even if clouds have many edges.
pub(crate) type Ranked = heapless::Vec<Start, RANKED>;

impl<T: Real, P: Pixels, O: Observer<T>> BinaryPicture<'_, T, P, O> {
    /// Calls `found` with every start along the ring, clockwise, until it returns `false`. Each open edge has exactly
    /// one start.
    ///
    /// The ring is read at every `stride`-th pixel. If the pixel differs from the one read before, all pixels between
    /// them are read. If it is lit after dark, the pixels of the stride before are read too, because noise makes the
    /// beginning of a wide edge irregular.
    ///
    /// The stretch of the first start leaves out the dark pixels at the end of the walk. The return value is the number
    /// of these pixels.
    // `found` is a pointer to a function, so that the walk around the ring is compiled once and not for each caller.
    pub(crate) fn each_start(&self, stride: u16, found: &mut dyn FnMut(Start) -> bool) -> u32 {
        let stride = stride.max(1);
        let mut stretch = 0u32;
        let mut before: Option<(Pixel, bool)> = None;
        let mut first: Option<(Pixel, bool)> = None;
        let mut go_on = true;
        // Handles one pixel of the ring.
        let mut step = |before: &mut Option<(Pixel, bool)>, stretch: &mut u32, pixel: Pixel, lit: bool| -> bool {
            let go_on = match *before {
                Some((dark, false)) if lit => found(Start { pixel, dark: direction(pixel, dark), stretch: *stretch }),
                _ => true,
            };
            if lit {
                *stretch = 0;
            } else if !self.masked(pixel.x, pixel.y) {
                // Masked pixels do not count, because a dark part of the vehicle is no sky.
                *stretch += 1;
            }
            *before = Some((pixel, lit));
            go_on
        };
        self.region.each_run(|run| {
            let mut k = 0;
            // The last dark pixels that were skipped: their number, how many of them counted, and the pixel before
            // them.
            let mut passed = (0, 0, None);
            while k < run.len {
                let next = (k + stride).min(run.len) - 1;
                let Pixel { x, y } = run.at(next);
                let lit = self.lit_counted(x, y);
                match before {
                    Some((_, same)) if same == lit => {
                        let counted = if lit || self.masked(x, y) { 0 } else { u32::from(next + 1 - k) };
                        stretch += counted;
                        passed = (if lit { 0 } else { next + 1 - k }, counted, before);
                        before = Some((Pixel { x, y }, lit));
                        // With a mask every pixel needs its own test, so that strides cannot be compared by the
                        // threshold alone.
                        let equal =
                            if self.region.has_mask() { 0 } else { self.count_equal_strides(&run, next, stride, lit) };
                        if equal > 0 {
                            let after = |strides: u16| Some((run.at(next + strides * stride), lit));
                            if !lit {
                                stretch += u32::from(equal) * u32::from(stride);
                                passed = (stride, stride.into(), after(equal - 1));
                            }
                            before = after(equal);
                            k = next + equal * stride + 1;
                            continue;
                        }
                    }
                    _ => {
                        let (again, counted, prior) = core::mem::take(&mut passed);
                        if lit && again > 0 {
                            (k, stretch, before) = (k - again, stretch - counted, prior);
                        }
                        for i in k..=next {
                            let pixel = run.at(i);
                            let lit = if i == next { lit } else { self.lit_counted(pixel.x, pixel.y) };
                            if first.is_none() {
                                first = Some((pixel, lit));
                            }
                            if !step(&mut before, &mut stretch, pixel, lit) {
                                go_on = false;
                                return false;
                            }
                        }
                    }
                }
                k = next + 1;
            }
            true
        });
        // Close the ring: the last and the first pixel may form a start.
        if let (true, Some((pixel, true))) = (go_on, first) {
            step(&mut before, &mut stretch, pixel, true);
            return 0;
        }
        stretch
    }

    /// Returns how many times `stride` pixels can be skipped from pixel number `k` of a run, as long as each pixel read
    /// is lit (or dark) as `lit` says.
    #[inline(always)]
    fn count_equal_strides(&self, run: &Run, k: u16, stride: u16, lit: bool) -> u16 {
        let Pixel { x, y } = run.at(k);
        let (dx, dy) = run.step();
        let leap = (dx as isize * self.picture.across() as isize + dy as isize * self.picture.down() as isize)
            * stride as isize;
        let mut index = self.picture.index(x, y);
        let most = (run.len - 1 - k).checked_div(stride).unwrap_or(0);
        for count_equal_strides in 0..most {
            index = index.wrapping_add_signed(leap);
            let there = run.at(k + (count_equal_strides + 1) * stride);
            self.observer.pixel(there.x, there.y);
            if (self.picture.read(index) >= self.level) != lit {
                return count_equal_strides;
            }
        }
        most
    }

    /// Calls `found` with the starts that [`Self::each_start`] can miss, until it returns `false`. These starts have
    /// fewer than `stride` dark pixels before them, or fewer than `stride` lit pixels after them. Every pixel of the
    /// ring is read.
    // Strides miss a disc that touches the image circle over few pixels: 16 of 7880 such discs were lost before, which
    // is why this search exists.
    pub(crate) fn each_narrow_start(&self, stride: u16, found: &mut dyn FnMut(Start) -> bool) {
        let mut before: Option<(Pixel, bool)> = None;
        let (mut dark_px, mut lit_px) = (0u32, 0u32);
        let mut waiting: Option<Start> = None;
        let mut go_on = true;
        // The lit pixels of the last start may continue where the ring closes.
        for round in 0..2 {
            let mut starts = true;
            self.region.each_run(|run| {
                for k in 0..run.len {
                    let pixel = run.at(k);
                    let lit = self.lit_counted(pixel.x, pixel.y);
                    if lit {
                        if let Some((dark, false)) = before
                            && starts
                        {
                            (waiting, lit_px) =
                                (Some(Start { pixel, dark: direction(pixel, dark), stretch: dark_px }), 0);
                        }
                        (dark_px, lit_px) = (0, lit_px + 1);
                    } else {
                        dark_px += 1;
                    }
                    before = Some((pixel, lit));
                    starts &= round == 0;
                    let stride = u32::from(stride);
                    let ended = !lit || lit_px >= stride;
                    if let Some(start) = waiting.take_if(|_| ended) {
                        go_on = start.stretch >= stride && lit_px >= stride || found(start);
                    }
                    go_on &= round == 0 || waiting.is_some();
                    if !go_on {
                        return false;
                    }
                }
                true
            });
            if !go_on {
                return;
            }
        }
    }

    /// Returns the ranked starts.
    pub(crate) fn ranked_starts(&self, stride: u16) -> Ranked {
        let mut ranked = Ranked::new();
        let mut first: Option<Start> = None;
        let tail = self.each_start(stride, &mut |start| {
            if first.is_none() {
                // The first stretch may have begun at the end of the walk. It is ranked last, when its whole length is
                // known.
                first = Some(start);
            } else {
                insert(&mut ranked, start);
            }
            true
        });
        if let Some(start) = first {
            insert(&mut ranked, Start { stretch: start.stretch + tail, ..start });
        }
        ranked
    }

    /// Calls `found` with every crossing of a search line, until it returns `false`. A crossing is an unmarked lit
    /// pixel from column `x0` to `x1` of row `y` whose western neighbour is dark. `found` receives the marks for the
    /// follower. The return value is the number of changes from dark to lit on the line.
    pub(crate) fn each_crossing<'m>(
        &self,
        y: u16,
        (x0, x1): (u16, u16),
        marks: &mut Marks<'m>,
        mut found: impl FnMut(Pixel, u8, &mut Marks<'m>) -> bool,
    ) -> u32 {
        let (mut x, mut lit, mut crossings) = (x0, self.lit_counted(x0, y), 0);
        while x < x1 {
            if !self.region.has_mask() {
                x += self.count_equal_pixels(x, y, x1 - x);
            }
            x += 1;
            let now = x <= x1 && self.lit_counted(x, y);
            if now && !lit {
                crossings += 1;
                if !marks.get(x, y) && !found(Pixel { x, y }, WEST, marks) {
                    break;
                }
            }
            lit = now;
        }
        crossings
    }

    /// Returns how many of the `count` pixels east of column `x` of row `y` are lit (or dark) like that pixel, before
    /// the first one that differs.
    #[inline(never)]
    fn count_equal_pixels(&self, x: u16, y: u16, count: u16) -> u16 {
        let index = self.picture.index(x, y);
        let lit = self.picture.read(index) >= self.level;
        // The picture compares its samples itself, because only it knows whether they lie side by side in memory.
        let alike = self.picture.run_length(index + self.picture.across(), count.into(), self.level, lit) as u16;
        for dx in 0..(alike + 1).min(count) {
            self.observer.pixel(x + 1 + dx, y);
        }
        alike
    }
}

fn insert(ranked: &mut Ranked, start: Start) {
    if ranked.is_full() && ranked.last().is_some_and(|last| last.stretch < start.stretch) {
        ranked.pop();
    }
    // A full list holds only longer stretches here.
    let Ok(()) = ranked.push(start) else { return };
    let mut upwards = ranked.as_mut_slice();
    while let [.., longer, new] = &mut *upwards
        && longer.stretch < new.stretch
    {
        core::mem::swap(longer, new);
        upwards = upwards.split_last_mut().map_or(&mut [], |(_, rest)| rest);
    }
}

/// Returns the direction from `a` to its neighbour `b`, counter-clockwise from east.
fn direction(a: Pixel, b: Pixel) -> u8 {
    match (i32::from(b.x) - i32::from(a.x), i32::from(b.y) - i32::from(a.y)) {
        (1, 0) => 0,
        (1, -1) => 1,
        (0, -1) => 2,
        (-1, -1) => 3,
        (-1, 0) => 4,
        (-1, 1) => 5,
        (0, 1) => 6,
        _ => 7,
    }
}
