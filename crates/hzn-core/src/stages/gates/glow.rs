//! Glow gate: airglow and aurora are layers of light high above the limb, and their edge has the form of a limb. Two
//! looks tell them apart. Air fades within a few scale heights above the limb, so light that reaches higher is a glow.
//! And a layer with a sharp upper edge has the true limb inside, at the same depth everywhere.

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
/// Depth below a limb at which another one cannot be the same, in scale heights, beyond `SIGMAS`. An edge nearer to
/// it is haze above clouds, and sigma covers that.
const OWN_AIR: f64 = 2.0;
/// Number of places that are read inwards below that depth, one scale height apart. The airglow stands 11 to 13 scale
/// heights above the ground.
const INWARDS: usize = 20;
/// Smallest rise of the brightness at an inner limb, as a part of the step at the fitted limb.
const MIN_RISE: f64 = 0.2;
/// Fewest lines inwards.
const LEAST_LINES: usize = 6;
/// Smallest mean rise, in standard errors from the scatter between the lines. Clouds rise and fall at random: with
/// twelve lines and sixteen depths, one of a thousand pictures exceeds six by chance.
const MIN_ERRORS: f64 = 6.0;
/// Value of `select.max_glow` that turns the gate off.
const OFF: f64 = 1e6;
/// Number of depths at which the rise is measured.
const DEPTHS: usize = INWARDS - 4;

/// The scales of the looks.
struct Scales<T> {
    /// Angle of a scale height at the limb, and of the standard deviation of the limb height, in radians.
    scale_height: T,
    sigma: T,
    /// Sine of the half-angle of the cone.
    sin: T,
}

impl<T: Real> Scales<T> {
    /// Returns `None` for a body without known air.
    fn new(c: T, expected: &Expected<T>) -> Option<Self> {
        let sin = (T::one() - c * c).max(T::ZERO).sqrt();
        // An angle is a height divided by the distance (R + d) cot α of the limb.
        let by_height = sin / (c.max(T::from_f64(1e-6)) * (expected.radius_m + expected.limb_m));
        let (air, sigma) = (expected.scale_height_m * by_height, expected.limb_sigma_parts_m[0] * by_height);
        (air > T::ZERO).then_some(Self { scale_height: air, sigma, sin })
    }
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

    /// Returns the brightness at this distance inwards, in pixels; `None` outside of the region.
    fn at(&self, inwards_px: T) -> Option<u16> {
        let half = T::from_f64(0.5);
        let [x, y] = [0, 1].map(|k| self.from[k] + self.inwards[k] * inwards_px + half);
        if !(x >= T::ZERO && y >= T::ZERO) {
            return None;
        }
        let (x, y) = (u16::try_from(x.to_i32()).ok()?, u16::try_from(y.to_i32()).ok()?);
        (self.binary.region.contains(x, y) && !self.binary.masked(x, y)).then(|| self.binary.brightness(x, y))
    }

    /// Returns the rises of the brightness inwards, one scale height apart, in counts. A rise is between the means of
    /// two places on each side of one that is left out. The median of the line is subtracted, because a disc that grows
    /// brighter inwards without a step has about the same rise everywhere.
    fn rises(&self, scales: &Scales<T>) -> Option<[i32; DEPTHS]> {
        let own = scales.sigma * T::from_f64(SIGMAS) + scales.scale_height * T::from_f64(OWN_AIR);
        let first = own * self.px_rad + T::from_f64(BLUR_PX);
        let step = scales.scale_height * self.px_rad;
        let mut seen = [0; INWARDS];
        for (k, b) in seen.iter_mut().enumerate() {
            *b = i32::from(self.at(first + step * T::from_i32(k as i32))?);
        }
        let mut rises = [0; DEPTHS];
        for (rise, w) in rises.iter_mut().zip(seen.windows(5)) {
            if let [a, b, _, c, d] = w {
                *rise = (c + d - a - b) / 2;
            }
        }
        let mut sorted = rises;
        sorted.sort_unstable();
        let median = sorted.get(DEPTHS / 2).copied().unwrap_or(0);
        Some(rises.map(|rise| rise - median))
    }
}

/// Returns whether the edge about (`e`, `c`) may belong to a glow: if the light above it, above the sky farther out, is
/// more than `most` of the step from the sky to the body; or if there is another limb inside. `false` if the body's air
/// is unknown, or if the picture shows too little of the sky. `most` is `select.max_glow`.
pub(super) fn is_likely<T: Real, P: Pixels, O: Observer<T>>(
    e: &V3<T>,
    c: T,
    blocks: &[Block<T>],
    binary: &BinaryPicture<'_, T, P, O>,
    camera: &Camera<T>,
    expected: &Expected<T>,
    most: f64,
) -> bool {
    let Some(scales) = Scales::new(c, expected).filter(|_| most < OFF) else { return false };
    let blur = T::from_f64(BLUR_PX);
    let dark = scales.sigma * T::from_f64(SIGMAS) + scales.scale_height * T::from_f64(SCALE_HEIGHTS);
    let (mut body, mut air, mut sky) = (Counts::new(), Counts::new(), Counts::new());
    let mut lines = heapless::Vec::<[i32; DEPTHS], MAX_PLACES>::new();
    for (block, lane) in inliers(blocks, MAX_PLACES) {
        let Some(line) = Line::new(e, scales.sin, block, lane, binary, camera) else { continue };
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
        // Less than a pixel apart, the places do not resolve a layer.
        if scales.scale_height * line.px_rad >= T::one()
            && let Some(rises) = line.rises(&scales)
        {
            let _ = lines.push(rises);
        }
    }
    if body.len() < LEAST {
        return false;
    }
    let [body, air, sky] = [&body, &air, &sky].map(|all| T::from_i32(median::median_of_counts(all).into()));
    let step = (body - sky).max(T::one());
    air - sky > step * T::from_f64(most) || has_inner_limb(&lines, step * T::from_f64(MIN_RISE))
}

/// Returns whether the brightness rises by at least `least` counts at the same depth of all lines.
fn has_inner_limb<T: Real>(lines: &[[i32; DEPTHS]], least: T) -> bool {
    let count = T::from_i32(lines.len() as i32);
    let stands_out = |depth: usize| {
        let rises = || lines.iter().filter_map(|rises| rises.get(depth)).map(|&rise| T::from_i32(rise));
        let mean = rises().fold(T::ZERO, |sum, rise| sum + rise) / count;
        let scatter = rises().fold(T::ZERO, |sum, rise| sum + (rise - mean) * (rise - mean));
        let errors = mean * mean * count * (count - T::one()) / scatter.max(T::one());
        mean >= least && errors >= T::from_f64(MIN_ERRORS * MIN_ERRORS)
    };
    lines.len() >= LEAST_LINES && (0..DEPTHS).any(stands_out)
}

type Counts = heapless::Vec<u16, MAX_PLACES>;
