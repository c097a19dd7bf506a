//! Glow gate: airglow and aurora are layers of light high above the limb, and their edge has the form of a limb. Air
//! fades within a few scale heights above the limb, so light that reaches higher is a glow.

use super::places::{MAX_PLACES, inliers};
use crate::base::linalg::V3;
use crate::base::median;
use crate::base::real::Real;
use crate::geometry::block::Block;
use crate::geometry::camera::Camera;
use crate::geometry::frames::UnitVec3;
use crate::image::Pixels;
use crate::model::body::Expected;
use crate::model::observer::Observer;
use crate::stages::contour::BinaryPicture;

/// Number of standard deviations of the limb height, and of scale heights of the air, above which the air is dark. The
/// light of the air decays by e over one scale height. The counts of an sRGB picture are about the 2.4th root of the
/// light, so they decay by e over 2.4 scale heights. Twice that leaves e⁻² of the brightness at the limb, a fifteenth
/// of the step. A camera with linear counts leaves far less.
const SIGMAS: f64 = 3.0;
const SCALE_HEIGHTS: f64 = 2.0 * 2.4;
/// Allowance for the blur of the picture, in pixels. A Gaussian blur of 3.5 px leaves an eighth of a step there.
const BLUR_PX: f64 = 4.0;
/// Farthest place at which the brightness of the sky is read, and the nearest that counts, as multiples of the distance
/// at which the air is dark.
const FARTHEST: f64 = 8.0;
const NEAREST: f64 = 2.0;
/// Fewest places from which the sky must be visible.
const LEAST: usize = 3;

/// Returns the angle above the limb at which the air is dark, in radians; `None` for a body without known air.
fn dark_angle<T: Real>(sin: T, c: T, expected: &Expected<T>) -> Option<T> {
    let height_m =
        expected.limb_sigma_parts_m[0] * T::from_f64(SIGMAS) + expected.scale_height_m * T::from_f64(SCALE_HEIGHTS);
    // An angle is a height divided by the distance (R + d) cot α of the limb.
    let by_height = sin / (c.max(T::from_f64(1e-6)) * (expected.radius_m + expected.limb_m));
    (expected.scale_height_m > T::ZERO).then_some(height_m * by_height)
}

/// A line across the limb through one inlier.
struct Line<'a, 'b, T, P, O> {
    binary: &'a BinaryPicture<'b, T, P, O>,
    from: [T; 2],
    inwards: [T; 2],
    /// Pixels per radian across the limb.
    px_rad: T,
}

impl<'a, 'b, T: Real, P: Pixels, O: Observer<T>> Line<'a, 'b, T, P, O> {
    fn new(
        e: &V3<T>,
        sin: T,
        block: &Block<T>,
        lane: usize,
        binary: &'a BinaryPicture<'b, T, P, O>,
        camera: &Camera<T>,
    ) -> Option<Self> {
        let from = camera.project(&UnitVec3::assume_unit(block.ray(lane)))?;
        let [gu, gv] = block.gradient_at(lane, e);
        // The gradient is that of 1 − cos ρ by the image point, sin ρ dρ.
        let norm = (gu * gu + gv * gv).sqrt().max(T::from_f64(1e-20));
        Some(Self { binary, from: [from.u, from.v], inwards: [gu / norm, gv / norm], px_rad: sin / norm })
    }

    /// Returns the mean brightness of nine pixels at this distance inwards, in pixels; `None` outside of the region.
    /// One pixel would be too noisy.
    fn at(&self, inwards_px: T) -> Option<u16> {
        let half = T::from_f64(0.5);
        let [x, y] = [0, 1].map(|k| self.from[k] + self.inwards[k] * inwards_px + half);
        if !(x >= T::one() && y >= T::one()) {
            return None;
        }
        let (x, y) = (x.to_i32(), y.to_i32());
        let mut sum = 0;
        for v in y - 1..=y + 1 {
            for u in x - 1..=x + 1 {
                let (u, v) = (u16::try_from(u).ok()?, u16::try_from(v).ok()?);
                if !self.binary.region.contains(u, v) || self.binary.masked(u, v) {
                    return None;
                }
                sum += u32::from(self.binary.brightness(u, v));
            }
        }
        u16::try_from(sum / 9).ok()
    }
}

/// Returns whether the edge about (`e`, `c`) may belong to a glow: if the light above it, above the sky farther out, is
/// more than `most` of the step from the sky to the body. `false` if the body's air is unknown, or if the picture shows
/// too little of the sky. `most` is `select.max_glow`.
pub(super) fn is_likely<T: Real, P: Pixels, O: Observer<T>>(
    e: &V3<T>,
    c: T,
    blocks: &[Block<T>],
    binary: &BinaryPicture<'_, T, P, O>,
    camera: &Camera<T>,
    expected: &Expected<T>,
    most: T,
) -> bool {
    let sin = (T::one() - c * c).max(T::ZERO).sqrt();
    let Some(dark) = dark_angle(sin, c, expected) else { return false };
    let blur = T::from_f64(BLUR_PX);
    let (mut body, mut air, mut sky) = (Counts::new(), Counts::new(), Counts::new());
    for (block, lane) in inliers(blocks, MAX_PLACES) {
        let Some(line) = Line::new(e, sin, block, lane, binary, camera) else { continue };
        let dark_px = dark * line.px_rad + blur;
        let mut multiple = T::from_f64(FARTHEST);
        let mut far = None;
        while far.is_none() && multiple >= T::from_f64(NEAREST) {
            far = line.at(-dark_px * multiple);
            multiple *= T::from_f64(0.5);
        }
        if let (Some(b), Some(a), Some(s)) = (line.at(blur), line.at(-dark_px), far) {
            let _ = (body.push(b), air.push(a), sky.push(s));
        }
    }
    if body.len() < LEAST {
        return false;
    }
    let [body, air, sky] = [&body, &air, &sky].map(|all| T::from_i32(median::median_of_counts(all).into()));
    air - sky > (body - sky).max(T::one()) * most
}

type Counts = heapless::Vec<u16, MAX_PLACES>;
