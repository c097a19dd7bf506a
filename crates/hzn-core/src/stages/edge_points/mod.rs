//! Sub-pixel points of a candidate edge.
//!
//! A border pixel is lit and has a dark neighbour; the edge itself lies between both. The local limb is where the
//! brightness is halfway between the plateaus on both sides. A threshold of the whole picture would move the edge with
//! the illumination, which would be an error of the limb height.
//!
//! The profile is read across the edge, along the axis of the larger gradient. Three rows are smoothed with 1-2-1 and
//! read outwards on both sides until they level off, at most ten steps. A step is one pixel for a sharp edge. It is
//! longer for an edge that is spread over many pixels, for example by air seen from a rocket or by haze through a long
//! lens. With steps of one pixel the profile would end before the plateaus, and the limb would move with the
//! illumination.

#[cfg(feature = "erf")]
mod erf;
#[cfg(test)]
mod golden;
#[cfg(any(feature = "erf", feature = "zju"))]
mod patch;
#[cfg(feature = "zju")]
mod zernike;

use crate::base::error::{ConfigError, Limit, require};
use crate::base::keys::{Section, choices, section};
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES, Lit};
use crate::geometry::pixel::{ImagePoint, Pixel};
use crate::image::{Pixels, StreamedPoint};
use crate::model::observer::Observer;
use crate::stages::contour::BinaryPicture;

choices! {
    /// How a border pixel becomes an edge point.
    pub enum SubPixel {
        /// The point is where the brightness crosses the middle between the plateaus on both sides, in three rows
        /// smoothed along the edge.
        ///
        /// The Sun blooms into a glare that is no plateau: its edge point is where the brightness crosses the
        /// threshold.
        @0 Linear = "linear";
        /// The point is the border pixel's centre, moved half a pixel to the dark side.
        @1 None = "none";
        /// A blurred step is fitted to 7×7 pixels between the means of the plateaus: the best accuracy, at about a
        /// hundred times the cost.
        @- Erf = "erf" needs "erf";
        /// Zernike moments of 7×7 pixels locate a step across a disc (Wang et al. 2022).
        @- Zernike = "zernike" needs "zju";
    }
}

section! {
    /// `[candidates]` of sensor.toml: edges that are candidates for the limb, and their edge points.
    "candidates" pub struct Config: Copy {
        /// Shortest edge, border pixels; a small body or picture needs fewer.
        ///
        /// For a small disc, half of its circumference in pixels is enough; in a picture of fewer than 80 rows or
        /// columns, half of its shorter side.
        @70 min_points: u16 = 40, [8.0 or more];
        /// Points kept per edge, evenly along it; 0 keeps all that fit into memory.
        ///
        /// 200 points take half the time and lose little accuracy.
        @71 keep_points: u16 = 600, ["0 (all) or 16 to 65535"];
        /// How a border pixel becomes an edge point.
        @72 sub_pixel: SubPixel = SubPixel::Linear, [choice];
    }
}

impl Config {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        self.check_keys()?;
        let keep = f64::from(self.keep_points);
        let enough = self.keep_points == 0 || self.keep_points >= 16;
        require(enough, "candidates.keep_points", keep, Limit::Rule("must be 16 or more, or 0 to keep all"))
    }
}

/// Largest distance up to which a plateau is searched for, in steps.
const REACH: i32 = 10;
/// Longest step of a profile, in pixels.
const WIDEST: i32 = 6;
/// All reads are within this distance from a border pixel, in steps.
const MARGIN: i32 = REACH + 3;
/// Distance from the border pixel towards the dark, in pixels. There, an edge at most four pixels wide has faded to
/// half of the threshold.
const FADED: i32 = 3;
/// A lit plateau counts as clipped if it is at most 1/128 of full scale below full scale. This leaves room for JPEG
/// artefacts. A bright, noisy plateau that is not clipped seldom comes so near to full scale.
const CLIPPED_PART: i32 = 128;
/// More than the largest distance of an edge point from its border pixel, in pixels.
const FARTHEST: i32 = 1024;
/// Value for a brightness that cannot be read.
const UNSEEN: i32 = i32::MIN;

/// Numbers of edge points made from the border of a candidate.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Points {
    /// Number of points made.
    pub(crate) count: u32,
    /// Number of these points at the threshold of the picture, because no local mid-level was found.
    pub(crate) fallback: u32,
    /// Number of these points with a lit side that is clipped at full scale.
    pub(crate) clipped: u32,
    /// Number of border pixels that cost more: next to a mask or the border of the picture, or on a wide edge.
    pub(crate) slow: u32,
    /// In a picture that arrives row by row: number of points with plateaus outside of the rows that are kept.
    pub(crate) cut: u32,
}

/// Fills `blocks` with the edge points of a border, thinned evenly to `keep_points`. Empty lanes have weight 0. The
/// function stops after `most_slow` points that cost more.
pub(crate) fn locate_edge_points<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    config: &Config,
    border: &[Pixel],
    candidate: u32,
    blocks: &mut [Block<T>],
    most_slow: u32,
) -> Points {
    let room = blocks.len() * LANES;
    let keep = match usize::from(config.keep_points) {
        0 => room,
        n => n.min(room),
    };
    let every = border.len().div_ceil(keep.max(1)).max(1);
    let mut made = Points::default();
    let mut place = 0;
    for &pixel in border.iter().skip(every / 2).step_by(every) {
        if made.slow >= most_slow {
            break;
        }
        let found = if P::STREAMED {
            let found = binary.picture.streamed_point(pixel.x, pixel.y);
            made.cut += u32::from(found.is_some_and(|f| f.cut));
            found.map(|f| {
                let point = point_off(pixel, f.lit.towards_dark(), T::from_f64(f.towards_dark_px.into()));
                EdgePoint { point, lit: f.lit, fallback: f.fallback, clipped: f.clipped }
            })
        } else {
            locate(binary, config, pixel, &mut made.slow)
        };
        let Some(found) = found else { continue };
        let Some(block) = blocks.get_mut(place / LANES) else { break };
        if place % LANES == 0 {
            *block = Block::default();
        }
        block.set_point(place % LANES, found.point, found.lit);
        binary.observer.point(candidate, found.point);
        place += 1;
        made.count += 1;
        made.fallback += u32::from(found.fallback);
        made.clipped += u32::from(found.clipped);
    }
    made
}

/// An edge point.
struct EdgePoint<T> {
    point: ImagePoint<T>,
    /// Side on which the light is.
    lit: Lit,
    /// The point is at the threshold of the picture, because no local mid-level was found.
    fallback: bool,
    /// The lit side is clipped at full scale, so that half of its brightness is not half of the light.
    clipped: bool,
}

impl<T> EdgePoint<T> {
    /// Makes a point of a method that has no mid-level.
    fn plain(point: ImagePoint<T>, lit: Lit) -> Self {
        Self { point, lit, fallback: false, clipped: false }
    }
}

/// Locates the edge point at a border pixel.
#[inline(always)]
fn locate<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    config: &Config,
    p: Pixel,
    slow: &mut u32,
) -> Option<EdgePoint<T>> {
    match config.sub_pixel {
        SubPixel::None => half_pixel(binary, p),
        #[cfg(feature = "erf")]
        SubPixel::Erf => erf::locate(binary, p).and_then(towards_light),
        #[cfg(feature = "zju")]
        SubPixel::Zernike => zernike::locate(binary, p).and_then(towards_light),
        // `Config::check` refuses a method that is not built in.
        _ if is_clear(binary, p, MARGIN as u16) => linear::<T, P, O, true>(binary, p, slow),
        _ => linear::<T, P, O, false>(binary, p, slow),
    }
}

/// Locates the edge point at a border pixel of a picture that is not kept. It is for the methods that locate a point
/// along an axis.
#[inline(never)]
pub(crate) fn locate_streamed_point<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    config: &Config,
    p: Pixel,
) -> Option<StreamedPoint> {
    let EdgePoint { point, lit, fallback, clipped } = locate(binary, config, p, &mut 0)?;
    // The difference is exact, and the sum that restores the point from it is exact, too.
    let (dx, dy) = lit.towards_dark();
    let off =
        (point.u - T::from_i32(p.x.into())) * T::from_i32(dx) + (point.v - T::from_i32(p.y.into())) * T::from_i32(dy);
    Some(StreamedPoint { towards_dark_px: off.to_f64() as f32, lit, fallback, clipped, cut: false })
}

/// Reads pixels around one border pixel; a read gives `None` beyond the region and under a mask. With `FREE`, all
/// pixels within reach are known to be readable, so no read is checked.
struct Around<'a, 'b, T, P, O, const FREE: bool> {
    binary: &'a BinaryPicture<'b, T, P, O>,
    x: i32,
    y: i32,
    index: usize,
    across: isize,
    down: isize,
}

impl<'a, 'b, T: Real, P: Pixels, O: Observer<T>, const FREE: bool> Around<'a, 'b, T, P, O, FREE> {
    fn new(binary: &'a BinaryPicture<'b, T, P, O>, p: Pixel) -> Self {
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

    /// Reads the pixel at (dx, dy) from the border pixel, which is `offset` further in memory.
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
        Some(self.binary.picture.three(first).map(i32::from))
    }

    /// Reads the 3×3 neighbourhood.
    #[inline(always)]
    fn read_3x3(&self) -> Option<Near> {
        let [nw, n, ne] = self.row(-1)?;
        let [w, c, e] = self.row(0)?;
        let [sw, s, se] = self.row(1)?;
        let columns = [nw + 2 * w + sw, n + 2 * c + s, ne + 2 * e + se];
        let rows = [nw + 2 * n + ne, w + 2 * c + e, sw + 2 * s + se];
        Some(Near { columns, rows })
    }
}

/// The line across the edge through a border pixel.
struct Line<'a, 'b, 'c, T, P, O, const FREE: bool> {
    around: &'a Around<'b, 'c, T, P, O, FREE>,
    /// A step towards the dark, in pixels. `ahead` is the same step in memory, and `aside` is a pixel to its side in
    /// memory.
    step: (i32, i32),
    ahead: isize,
    aside: isize,
}

impl<'a, 'b, 'c, T: Real, P: Pixels, O: Observer<T>, const FREE: bool> Line<'a, 'b, 'c, T, P, O, FREE> {
    #[inline(always)]
    fn new(around: &'a Around<'b, 'c, T, P, O, FREE>, (dx, dy): (i32, i32), step: i32) -> Self {
        let (x, y) = (dx as isize, dy as isize);
        Self {
            around,
            step: (dx * step, dy * step),
            ahead: (x * around.across + y * around.down) * step as isize,
            aside: y * around.across + x * around.down,
        }
    }
    #[inline(always)]
    fn at(&self, k: i32, side: i32) -> Option<i32> {
        let (dx, dy) = self.step;
        // The side is one pixel, perpendicular to the step.
        let (sx, sy) = (dy.signum() * side, dx.signum() * side);
        self.around.read(k * dx + sx, k * dy + sy, k as isize * self.ahead + side as isize * self.aside)
    }
    /// Returns four times the brightness `k` steps towards the dark, smoothed with 1-2-1 along the edge.
    #[inline(always)]
    fn smoothed(&self, k: i32) -> Option<i32> {
        Some(self.at(k, -1)? + 2 * self.at(k, 0)? + self.at(k, 1)?)
    }
}

/// Reads pixels in a straight line.
struct Walk<'a, 'b, T, P, O, const FREE: bool> {
    binary: &'a BinaryPicture<'b, T, P, O>,
    /// Column and row of the next pixel. `step` leads to the one after it.
    at: (i32, i32),
    step: (i32, i32),
    index: usize,
    ahead: isize,
}

impl<T: Real, P: Pixels, O: Observer<T>, const FREE: bool> Walk<'_, '_, T, P, O, FREE> {
    /// Returns four times the brightness of the next pixel, or [`UNSEEN`] where nothing can be read.
    #[inline(always)]
    fn next(&mut self) -> i32 {
        let seen = read::<T, P, O, FREE>(self.binary, self.at, self.index);
        self.at = (self.at.0 + self.step.0, self.at.1 + self.step.1);
        self.index = self.index.wrapping_add_signed(self.ahead);
        seen.map_or(UNSEEN, |v| 4 * v)
    }
}

/// Reads the pixel at column `x` and row `y`, which is at `index` in memory; `None` beyond the region and under a mask.
/// With `FREE`, the pixel is known to be inside the region and unmasked.
#[inline(always)]
fn read<T: Real, P: Pixels, O: Observer<T>, const FREE: bool>(
    binary: &BinaryPicture<'_, T, P, O>,
    (x, y): (i32, i32),
    index: usize,
) -> Option<i32> {
    if !FREE && !binary.region.counts(x, y) {
        return None;
    }
    binary.observer.pixel(x as u16, y as u16);
    Some(i32::from(binary.picture.read(index)))
}

/// Sums over columns (left to right) and rows (downwards) of a 3×3 neighbourhood, smoothed with 1-2-1.
struct Near {
    columns: [i32; 3],
    rows: [i32; 3],
}

impl Near {
    /// Returns eight times the brightness change per pixel, to the right and down.
    #[inline(always)]
    fn gradient(&self) -> (i32, i32) {
        (self.columns[2] - self.columns[0], self.rows[2] - self.rows[0])
    }
    /// Returns the smoothed brightness one step to the lit side, here, and one step to the dark side.
    #[inline(always)]
    fn across(&self, lit: Lit) -> [i32; 3] {
        let ([w, x, e], [n, y, s]) = (self.columns, self.rows);
        match lit {
            Lit::Right => [e, x, w],
            Lit::Left => [w, x, e],
            Lit::Below => [s, y, n],
            Lit::Above => [n, y, s],
        }
    }
}

/// Returns the side of the light along the axis of the larger component, and the step (dx, dy) towards the dark. The
/// result is `None` if the gradient is zero.
fn orientation((gx, gy): (i32, i32)) -> Option<(Lit, i32, i32)> {
    if gx == 0 && gy == 0 {
        return None;
    }
    let lit = if gx.abs() >= gy.abs() {
        if gx > 0 { Lit::Right } else { Lit::Left }
    } else if gy > 0 {
        Lit::Below
    } else {
        Lit::Above
    };
    let (dx, dy) = lit.towards_dark();
    Some((lit, dx, dy))
}

/// Makes an edge point for the methods that know the direction of the gradient.
#[cfg(any(feature = "erf", feature = "zju"))]
fn towards_light<T: Real>((point, [x, y]): (ImagePoint<T>, [T; 2])) -> Option<EdgePoint<T>> {
    // `orientation` compares integers, and the direction is a unit vector.
    let scale = T::from_f64(1024.0);
    let (lit, _, _) = orientation(((x * scale).to_i32(), (y * scale).to_i32()))?;
    Some(EdgePoint::plain(point, lit))
}

fn half_pixel<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    p: Pixel,
) -> Option<EdgePoint<T>> {
    let around = Around::<T, P, O, false>::new(binary, p);
    let (lit, dx, dy) = orientation(around.read_3x3()?.gradient())?;
    Some(EdgePoint::plain(point_off(p, (dx, dy), T::from_f64(0.5)), lit))
}

fn point_off<T: Real>(p: Pixel, (dx, dy): (i32, i32), towards_dark: T) -> ImagePoint<T> {
    ImagePoint {
        u: T::from_i32(i32::from(p.x)) + T::from_i32(dx) * towards_dark,
        v: T::from_i32(i32::from(p.y)) + T::from_i32(dy) * towards_dark,
    }
}

/// Locates the crossing of the mid-level along the axis of the larger gradient.
#[inline(always)]
fn linear<T: Real, P: Pixels, O: Observer<T>, const FREE: bool>(
    binary: &BinaryPicture<'_, T, P, O>,
    p: Pixel,
    slow: &mut u32,
) -> Option<EdgePoint<T>> {
    let around = Around::<T, P, O, FREE>::new(binary, p);
    let near = around.read_3x3()?;
    let gradient = near.gradient();
    let (lit, dx, dy) = orientation(gradient)?;
    let level = i32::from(binary.level);
    if binary.blooms {
        let [_, inner, outer] = near.across(lit);
        let level4 = (4 * level).max(outer + 1).min(inner);
        let part = T::from_i32(inner - level4) / T::from_i32((inner - outer).max(1));
        return (inner > outer).then(|| EdgePoint::plain(point_off(p, (dx, dy), part), lit));
    }
    // The edge fades over level / gradient pixels. At the top of a narrow edge, the gradient says less than the
    // distance at which the profile is dark, so both are tested. A step is half of the fading width, so that the
    // profile of air seen from a rocket is read to its end. Above 4 pixels, a step is only a fifth of this width,
    // because in haze through a long lens the clouds begin just below.
    let steep = gradient.0.abs().max(gradient.1.abs());
    let line = Line::new(&around, (dx, dy), 1);
    if FREE && (2 * level < steep || line.at(FADED, 0).is_some_and(|v| 2 * v < level)) {
        let Crossing { part, fallback, clipped, .. } = line.crossing(near.across(lit))?;
        return Some(EdgePoint { point: point_off(p, (dx, dy), part), lit, fallback, clipped });
    }
    *slow += 1;
    let (half, fifth) = (4 * level / steep.max(1), 3 * level / (2 * steep.max(1)));
    let step = half.min(fifth.max(4)).clamp(1, WIDEST);
    let found = if FREE && is_clear(binary, p, (MARGIN * step) as u16) {
        locate_in_steps::<T, P, O, true>(binary, p, (dx, dy), step)?
    } else {
        locate_in_steps::<T, P, O, false>(binary, p, (dx, dy), step)?
    };
    let WideCrossing { off, fallback, clipped, .. } =
        if found.rising { recentre_profile(binary, p, (dx, dy), step, found, slow) } else { found };
    Some(EdgePoint { point: point_off(p, (dx, dy), off), lit, fallback, clipped })
}

/// Largest number of times that a profile is read again about its crossing.
const CLIMBS: u32 = 4;

/// Reads a profile again about its crossing, until the crossing is in the middle of the profile. This is necessary if
/// the lit side still rises at the end of the reach. There is no plateau then, and the mid-level depends on the
/// threshold that determined the border pixel.
#[inline(never)]
fn recentre_profile<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    p: Pixel,
    (dx, dy): (i32, i32),
    step: i32,
    mut found: WideCrossing<T>,
    slow: &mut u32,
) -> WideCrossing<T> {
    let mut whole = 0;
    for _ in 0..CLIMBS {
        let moved = (found.off + T::from_i32(FARTHEST)).to_i32() - FARTHEST - whole;
        if !found.rising || moved.abs() < step {
            break;
        }
        let (x, y) = (i32::from(p.x) + dx * (whole + moved), i32::from(p.y) + dy * (whole + moved));
        if !binary.region.counts(x, y) {
            break;
        }
        *slow += 1;
        let Some(next) = locate_in_steps::<T, P, O, false>(binary, Pixel { x: x as u16, y: y as u16 }, (dx, dy), step)
        else {
            break;
        };
        whole += moved;
        found = WideCrossing { off: next.off + T::from_i32(whole), ..next };
    }
    found
}

/// Whether the border of the region and all masks are more than `margin` pixels away.
#[inline(always)]
fn is_clear<T: Real, P: Pixels, O: Observer<T>>(binary: &BinaryPicture<'_, T, P, O>, p: Pixel, margin: u16) -> bool {
    let region = binary.region;
    region.is_inside_by(p.x, p.y, margin) && (!region.has_mask() || region.clearance(p.x, p.y, margin) == margin)
}

/// Crossing of the mid-level on a wide edge; `off` is its distance from the border pixel towards the dark, in pixels.
struct WideCrossing<T> {
    off: T,
    fallback: bool,
    clipped: bool,
    /// The lit side did not level off within reach.
    rising: bool,
}

/// Locates the crossing like [`linear`], with steps of `step` pixels.
#[inline(never)]
fn locate_in_steps<T: Real, P: Pixels, O: Observer<T>, const FREE: bool>(
    binary: &BinaryPicture<'_, T, P, O>,
    p: Pixel,
    (dx, dy): (i32, i32),
    step: i32,
) -> Option<WideCrossing<T>> {
    let around = Around::<T, P, O, FREE>::new(binary, p);
    let line = Line::new(&around, (dx, dy), step);
    let Crossing { part, mid2, fallback, clipped, rising } =
        line.crossing([line.smoothed(-1)?, line.smoothed(0)?, line.smoothed(1)?])?;
    let coarse = part * T::from_i32(step);
    // The profile is curved within a step. The crossing is therefore interpolated again over half a step around it.
    let half = step / 2;
    if half == 0 {
        return Some(WideCrossing { off: coarse, fallback, clipped, rising });
    }
    let pixels = Line::new(&around, (dx, dy), 1);
    let whole = (coarse + T::from_i32(REACH * WIDEST)).to_i32() - REACH * WIDEST;
    let k = whole - half / 2;
    let (a, b) = (pixels.smoothed(k)?, pixels.smoothed(k + half)?);
    let fine = T::from_i32(k) + T::from_i32(half * (2 * a - mid2)) / T::from_i32((2 * (a - b)).max(1));
    let off = if (fine - coarse).abs() <= T::from_i32(half) { fine } else { coarse };
    Some(WideCrossing { off, fallback, clipped, rising })
}

/// Crossing of an edge with the mid-level.
struct Crossing<T> {
    /// Distance from the border pixel towards the dark, in steps.
    part: T,
    /// Twice the mid-level, in units of [`Line::smoothed`].
    mid2: i32,
    /// The threshold of the picture replaces the local mid-level.
    fallback: bool,
    /// The lit side is clipped at full scale.
    clipped: bool,
    /// The lit side did not level off within reach.
    rising: bool,
}

impl<T: Real, P: Pixels, O: Observer<T>, const FREE: bool> Line<'_, '_, '_, T, P, O, FREE> {
    /// Reads one step after another in the direction `out`, beginning `k` steps towards the dark.
    #[inline(always)]
    fn outwards(&self, k: i32, out: i32) -> Walk<'_, '_, T, P, O, FREE> {
        let Around { binary, x, y, index, .. } = *self.around;
        let (dx, dy) = self.step;
        Walk {
            binary,
            at: (x + k * dx, y + k * dy),
            step: (out * dx, out * dy),
            index: index.wrapping_add_signed(k as isize * self.ahead),
            ahead: out as isize * self.ahead,
        }
    }

    /// Returns the brightness of a plateau, in units of [`Line::smoothed`], and the offset in steps where it begins. The
    /// search begins at the border pixel (or its dark neighbour) with brightness `v` and goes outwards until the
    /// profile levels off. It has levelled off if each of two more steps changes it by less than a twelfth of the
    /// contrast to `other`.
    #[inline(always)]
    fn plateau<const LIT: bool>(&self, mut v: i32, other: i32) -> (i32, i32) {
        let (from, out) = if LIT { (0, -1) } else { (1, 1) };
        // Difference between `v` and `w`, positive if `v` is further from the brightness of the other side.
        let beyond = |v: i32, w: i32| if LIT { v - w } else { w - v };
        // The side ends where nothing can be read.
        let or_here = |seen: i32, v: i32| if FREE || seen != UNSEEN { seen } else { v };
        let mut k = from;
        let mut outwards = self.outwards(from + out, out);
        let (mut near, mut far) = (outwards.next(), outwards.next());
        loop {
            let (n, f) = (or_here(near, v), or_here(far, v));
            let contrast = beyond(v, other).max(24);
            if 12 * beyond(n, v) > contrast {
                (k, v, near) = (k + out, n, far);
            } else if 6 * beyond(f, v) > contrast {
                (k, v, near) = (k + 2 * out, f, outwards.next());
            } else {
                // Further pixels on the same level are part of the mean.
                let level = match (6 * beyond(v, n) < contrast, 6 * beyond(v, f) < contrast) {
                    (true, true) => (v + n + f) / 3,
                    (true, false) => (v + n) / 2,
                    (false, true) => (v + f) / 2,
                    (false, false) => v,
                };
                return (level, k);
            }
            if (k - from) * out >= REACH {
                return (v, k);
            }
            far = outwards.next();
        }
    }

    /// Locates the crossing of the mid-level. The arguments are the smoothed brightness one step to the lit side, here,
    /// and one step to the dark side.
    #[inline(always)]
    fn crossing(&self, [inside, first_lit, first_dark]: [i32; 3]) -> Option<Crossing<T>> {
        let binary = self.around.binary;
        // The plateaus are read in one row, because a mean over several pixels is taken. The crossing is read in three
        // rows.
        let (bright, inner) = self.plateau::<true>(first_lit, first_dark);
        let (dim, outer) = self.plateau::<false>(first_dark, bright);
        let contrast = bright - dim;
        let level4 = i32::from(binary.level) * 4;
        let (mid2, fallback) = if contrast >= 4 * binary.least_contrast {
            (bright + dim, false)
        } else if first_lit > first_dark {
            (2 * level4.max(first_dark + 1).min(first_lit), true)
        } else {
            return None;
        };
        // Finds the crossing next to the border pixel: outwards if the pixel is lit, otherwise inwards. In the end `a`
        // at `k` is lit and `b` at `k + 1` is not.
        let (mut k, mut a, mut b) =
            if 2 * first_lit >= mid2 { (0, first_lit, first_dark) } else { (-1, inside, first_lit) };
        while 2 * b >= mid2 {
            (k, a) = (k + 1, b);
            if k >= outer.max(1) {
                return None;
            }
            b = self.smoothed(k + 1)?;
        }
        while 2 * a < mid2 {
            if k <= inner.min(-1) {
                return None;
            }
            (k, b) = (k - 1, a);
            a = self.smoothed(k)?;
        }
        if a <= b {
            return None;
        }
        let part = T::from_i32(k) + T::from_i32(2 * a - mid2) / T::from_i32(2 * (a - b));
        let full = i32::from(binary.picture.full_scale());
        let clipped = bright >= 4 * (full - full / CLIPPED_PART);
        Some(Crossing { part, mid2, fallback, clipped, rising: inner <= -REACH })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::region::Region;
    use crate::image::{Grey, Layout};
    use crate::model::observer::Unobserved;
    use std::vec::Vec;

    /// Makes a picture of a straight edge between two plateaus, blurred over `width_px` and lit where
    /// (x, y)·n > offset.
    fn picture(n: [f64; 2], offset: f64, width_px: f64, dim: f64, bright: f64) -> Vec<u8> {
        (0..100 * 100)
            .map(|i| {
                let d = f64::from(i % 100) * n[0] + f64::from(i / 100) * n[1] - offset;
                let part = 0.5 + 0.5 * (d / width_px).clamp(-1.0, 1.0);
                (dim + (bright - dim) * part + 0.5) as u8
            })
            .collect()
    }

    fn points(data: &[u8], config: &Config, level: u16) -> Vec<(f64, f64)> {
        let grey = Grey::try_new(data, Layout::packed(100, 100, 1, 8)).unwrap();
        let region = Region::<f64>::whole(100, 100);
        let binary = BinaryPicture::new(&grey, &region, level, &Unobserved);
        let border: Vec<Pixel> = (0..100u16)
            .flat_map(|y| (0..100u16).map(move |x| Pixel { x, y }))
            .filter(|p| (20..80).contains(&p.x) && (20..80).contains(&p.y))
            .filter(|p| binary.lit(p.x, p.y))
            .filter(|p| {
                [(1, 0), (-1, 0), (0, 1), (0, -1)]
                    .iter()
                    .any(|(dx, dy)| !binary.lit((i32::from(p.x) + dx) as u16, (i32::from(p.y) + dy) as u16))
            })
            .collect();
        let mut blocks = [Block::default(); 64];
        let made = locate_edge_points(&binary, config, &border, 0, &mut blocks, u32::MAX);
        assert!(made.count > 30, "{made:?}");
        blocks
            .iter()
            .flat_map(|b| (0..LANES).filter(|&l| b.weight[l] > 0.0).map(|l| (b.point(l).u, b.point(l).v)))
            .collect()
    }

    #[test]
    fn linear_finds_the_local_mid_level_whatever_the_level() {
        // The edges have four directions and other angles, and are narrow or wide.
        for (nx, ny) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (0.8, 0.6), (-0.6, 0.8)] {
            for width in [1.0, 2.5, 5.0] {
                let offset = 50.3 * nx + 49.8 * ny;
                let data = picture([nx, ny], offset, width, 20.0, 220.0);
                for level in [70, 120, 170] {
                    for (u, v) in points(&data, &Config::default(), level) {
                        let off = u * nx + v * ny - offset;
                        assert!(off.abs() < 0.13, "normal {nx} {ny} width {width} level {level}: {off}");
                    }
                }
            }
        }
    }

    #[test]
    fn without_sub_pixel_points_stand_half_a_pixel_out() {
        let data = picture([0.0, 1.0], 49.8, 0.1, 20.0, 220.0);
        let config = Config { sub_pixel: SubPixel::None, ..Config::default() };
        for (_, v) in points(&data, &config, 120) {
            // Row 50 is the first lit one.
            assert_eq!(v, 49.5);
        }
    }

    /// If the light exceeds full scale, half of full scale is not half of the light.
    #[test]
    fn points_before_a_clipped_side_are_counted() {
        let border: Vec<Pixel> = (20..80).map(|x| Pixel { x, y: 50 }).collect();
        for width in [1.0, 4.0] {
            for (bright, all) in [(255.0, true), (254.0, true), (240.0, false), (120.0, false)] {
                let data = picture([0.0, 1.0], 49.8, width, 20.0, bright);
                let grey = Grey::try_new(&data, Layout::packed(100, 100, 1, 8)).unwrap();
                let region = Region::<f64>::whole(100, 100);
                let binary = BinaryPicture::new(&grey, &region, 70, &Unobserved);
                let mut blocks = [Block::default(); 8];
                let made = locate_edge_points(&binary, &Config::default(), &border, 0, &mut blocks, u32::MAX);
                assert_eq!((made.count, made.clipped), (60, if all { 60 } else { 0 }), "{width} {bright}");
            }
        }
    }

    #[test]
    fn thinning_keeps_the_whole_edge() {
        let data = picture([0.0, 1.0], 49.8, 1.0, 20.0, 220.0);
        let config = Config { keep_points: 16, ..Config::default() };
        let grey = Grey::try_new(&data, Layout::packed(100, 100, 1, 8)).unwrap();
        let region = Region::<f32>::whole(100, 100);
        let binary = BinaryPicture::new(&grey, &region, 120, &Unobserved);
        let border: Vec<Pixel> = (20..80).map(|x| Pixel { x, y: 50 }).collect();
        let mut blocks = [Block::default(); 2];
        assert_eq!(
            locate_edge_points(&binary, &config, &border, 0, &mut blocks, u32::MAX),
            Points { count: 15, ..Points::default() }
        );
        let (first, last) = (blocks[0].point(0).u, blocks[1].point(6).u);
        assert_eq!((first, last), (22.0, 78.0));
    }
}
