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

mod config;
mod erf;
#[cfg(test)]
#[path = "../../../tests/unit/edge_points.rs"]
mod golden;
mod linear;
mod patch;
mod plateau;
mod point;
mod reads;
#[cfg(test)]
mod tests;
mod zernike;

use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};
use crate::geometry::pixel::Pixel;
use crate::image::{Pixels, Profile, Profiles, StreamedPoint};
use crate::model::observer::Observer;
use crate::stages::contour::BinaryPicture;
use linear::{MARGIN, is_clear, linear};
use point::towards_light;
use point::{Aside, EdgePoint, orientation, point_off};
use reads::Around;

pub use config::{Config, SubPixel};

/// Numbers of edge points made from the border of a candidate.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Points {
    /// Number of points made.
    pub(crate) count: u32,
    /// Number of these points at the threshold of the picture, because no local mid-level was found.
    pub(crate) fallback: u32,
    /// Number of these points with a lit side that is clipped at full scale.
    pub(crate) clipped: u32,
    /// What border pixels cost in addition: next to a mask or the border of the picture, or on a wide edge.
    pub(crate) extra_cost: u32,
    /// In a picture that arrives row by row: number of points, also of lost ones, with plateaus outside of the rows
    /// that are kept.
    pub(crate) cut: u32,
    /// Width and contrast of the edge in each third of it.
    pub(crate) profiles: Profiles,
}

/// Least number of the points of a long edge whose profiles are summed, evenly along the edge. The means of sixteen
/// logarithms are known better than the term that is computed from them needs; each further profile costs as much as a
/// tenth of a point.
const PROFILES: usize = 48;

/// Fills `blocks` with the edge points of a border, thinned evenly to `keep_points`. Empty lanes have weight 0. The
/// function stops when points have cost more than `most_extra` in addition.
pub(crate) fn locate_edge_points<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    config: &Config,
    border: &[Pixel],
    candidate: u32,
    blocks: &mut [Block<T>],
    most_extra: u32,
) -> Points {
    let room = blocks.len() * LANES;
    let keep = match usize::from(config.keep_points) {
        0 => room,
        n => n.min(room),
    };
    let every = border.len().div_ceil(keep.max(1)).max(1);
    let (mut made, mut aside) = (Points::default(), Aside::default());
    let mut place = 0;
    // The first point lies half a step from the end, so that the points are centred on the edge.
    let pixels = border.iter().skip(every / 2).step_by(every);
    let all = pixels.len().max(1);
    let (mut next_profile, every_profile) = (0, (all / PROFILES).max(1));
    for (number, &pixel) in pixels.enumerate() {
        if aside.extra_cost >= most_extra {
            break;
        }
        aside.wants_profile = number == next_profile;
        if aside.wants_profile {
            next_profile += every_profile;
            aside.profile = Profile::default();
        }
        let found = if P::STREAMED {
            streamed(binary, pixel, &mut made.cut, &mut aside)
        } else {
            locate(binary, config, pixel, &mut aside)
        };
        let Some(found) = found else { continue };
        let Some(block) = blocks.get_mut(place / LANES) else { break };
        // A block is cleared when its first point comes. Clearing all blocks in advance would write memory that no edge
        // uses.
        if place % LANES == 0 {
            *block = Block::default();
        }
        block.set_point(place % LANES, found.point, found.lit);
        binary.observer.point(candidate, found.point);
        if aside.wants_profile {
            made.profiles.add(3 * number / all, place, aside.profile);
        }
        place += 1;
        made.count += 1;
        made.fallback += u32::from(found.fallback);
        made.clipped += u32::from(found.clipped);
    }
    made.extra_cost = aside.extra_cost;
    made
}

/// Returns the edge point at a border pixel of a picture that is not kept, and adds 1 to `cut` if its plateaus were not
/// in the rows that were kept.
#[inline(always)]
fn streamed<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    p: Pixel,
    cut: &mut u32,
    aside: &mut Aside,
) -> Option<EdgePoint<T>> {
    let found = binary.picture.streamed_point(p.x, p.y)?;
    *cut += u32::from(found.is(StreamedPoint::CUT));
    let StreamedPoint { towards_dark_px, lit, profile, .. } = found;
    if towards_dark_px.is_nan() {
        return None;
    }
    let point = point_off(p, lit.towards_dark(), T::from_f64(towards_dark_px.into()));
    aside.profile = profile;
    let (fallback, clipped) = (found.is(StreamedPoint::FALLBACK), found.is(StreamedPoint::CLIPPED));
    Some(EdgePoint { point, lit, fallback, clipped })
}

/// Locates the edge point at a border pixel.
#[inline(always)]
fn locate<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    config: &Config,
    p: Pixel,
    aside: &mut Aside,
) -> Option<EdgePoint<T>> {
    match config.sub_pixel {
        // The border pixel's centre lies inside the disc: without the half pixel every disc would be half a pixel too
        // small.
        SubPixel::None => half_pixel(binary, p),
        SubPixel::Erf if cfg!(feature = "erf") => erf::locate(binary, p).and_then(towards_light),
        SubPixel::Zernike if cfg!(feature = "zju") => zernike::locate(binary, config, p).and_then(towards_light),
        // `Config::check` refuses a method that is not built in.
        // The test is made once a point, so that the reads of most points need no test of their own.
        _ if is_clear(binary, p, MARGIN as u16) => linear::<T, P, O, true>(binary, p, aside),
        _ => linear::<T, P, O, false>(binary, p, aside),
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
    let mut aside = Aside { wants_profile: true, ..Aside::default() };
    let EdgePoint { point, lit, fallback, clipped } = locate(binary, config, p, &mut aside)?;
    // The difference is exact, and the sum that restores the point from it is exact, too.
    let (dx, dy) = lit.towards_dark();
    let off =
        (point.u - T::from_i32(p.x.into())) * T::from_i32(dx) + (point.v - T::from_i32(p.y.into())) * T::from_i32(dy);
    let marks = u8::from(fallback) * StreamedPoint::FALLBACK + u8::from(clipped) * StreamedPoint::CLIPPED;
    Some(StreamedPoint { towards_dark_px: off.to_f64() as f32, lit, marks, profile: aside.profile })
}

fn half_pixel<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    p: Pixel,
) -> Option<EdgePoint<T>> {
    let around = Around::<T, P, O, false>::new(binary, p);
    let (lit, dx, dy) = orientation(around.read_3x3()?.gradient())?;
    Some(EdgePoint::plain(point_off(p, (dx, dy), T::from_f64(0.5)), lit))
}
