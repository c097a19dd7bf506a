//! Gate: an edge that continues smoothly next to the fitted cone is evidence against a limb, because a limb
//! stays on its cone.

use super::case::{Case, refuse_if};
use super::places::{MAX_PLACES, inliers};
use super::shape::{RIVAL_FLOOR_PX, Residuals};
use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};
use crate::geometry::frames::UnitVec3;
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::model::verdict::Verdict;
use crate::stages::contour::BinaryPicture;

/// Length of edge over which points are averaged (a box), in pixels. It gives the direction to a few degrees.
const BOX_PX: f64 = 16.0;
/// Largest number of boxes beyond each end of the inliers.
const BOXES: usize = 24;
/// Number of boxes beyond an end that show whether the edge keeps its contrast there.
const NEAR: usize = 2;
/// Longest gap within a run of inliers, in pixels.
const GAP_PX: f64 = 12.0;
/// Largest turn between two boxes that counts as smooth, in degrees. 8 degrees are a curve of 115 px radius; corners of
/// clouds are sharper.
const TURN_DEG: f64 = 8.0;
/// Smallest contrast of a continuation that counts, as a part of the limb's contrast. A terminator fades; the rim of a
/// flare does not.
const CONTRAST: f64 = 0.6;
/// Distance from the edge at which the contrast is read on each side, in pixels.
const ASIDE_PX: i32 = 3;

/// The longest run of inliers: its first and last point, and its length in pixels.
struct Run<T> {
    first: usize,
    last: usize,
    length: T,
}

fn longest<T: Real>(blocks: &[Block<T>]) -> Option<Run<T>> {
    let mut best: Option<Run<T>> = None;
    let mut now: Option<Run<T>> = None;
    let mut gap = T::ZERO;
    for (number, block) in blocks.iter().enumerate() {
        for lane in 0..LANES {
            let place = number * LANES + lane;
            let step = block.step_px[lane];
            gap += step;
            if !(block.weight[lane] > T::ZERO) {
                continue;
            }
            now = match now.take() {
                Some(run) if !(gap > T::from_f64(GAP_PX).max(step)) => {
                    Some(Run { last: place, length: run.length + gap, ..run })
                }
                ended => {
                    best = longer(best, ended);
                    Some(Run { first: place, last: place, length: T::ZERO })
                }
            };
            gap = T::ZERO;
        }
    }
    longer(best, now)
}

fn longer<T: Real>(a: Option<Run<T>>, b: Option<Run<T>>) -> Option<Run<T>> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.length > a.length { b } else { a }),
        (a, b) => a.or(b),
    }
}

/// A stretch of edge: the place of its middle, and its mean distance from the cone, in pixels.
#[derive(Clone, Copy)]
struct Stretch<T> {
    at: [T; 2],
    off: T,
    length: T,
    points: i32,
}

/// An edge with its residuals.
struct Edge<'a, 'b, T, P, O> {
    case: &'a Case<'b, T>,
    binary: &'a BinaryPicture<'b, T, P, O>,
    residuals: &'a Residuals<'a, T>,
}

impl<T: Real, P: Pixels, O: Observer<T>> Edge<'_, '_, T, P, O> {
    fn block(&self, place: usize) -> Option<(&Block<T>, usize)> {
        (place < self.case.points as usize).then_some(())?;
        Some((self.case.blocks.get(place / LANES)?, place % LANES))
    }

    /// Returns whether a point cannot be on the limb because the Sun does not light the limb there. The edge then
    /// continues as the terminator, which says nothing about the limb. This is known only for a position.
    fn is_terminator(&self, ray: &V3<T>) -> bool {
        let (expected, curve) = (self.case.expected, self.residuals.curve);
        if expected.target().is_none() {
            return false;
        }
        let (fx, fy) = self.case.camera.focal_px();
        let focal_px = (fx + fy) * T::from_f64(0.5);
        !expected.is_lit(ray, curve.axis(), T::one() - curve.k(), focal_px)
    }

    /// Averages the points from `place` on over one box, in the direction `ahead`, and moves `place` past them.
    fn stretch(&self, place: &mut Option<usize>, ahead: bool) -> Option<Stretch<T>> {
        let mut sum = Stretch { at: [T::ZERO; 2], off: T::ZERO, length: T::ZERO, points: 0 };
        while sum.length < T::from_f64(BOX_PX) || sum.points == 0 {
            let here = (*place)?;
            let Some((block, lane)) = self.block(here) else { break };
            if self.is_terminator(&block.ray(lane)) {
                break;
            }
            let Some(at) = self.case.camera.project(&UnitVec3::assume_unit(block.ray(lane))) else { break };
            // The step from the previous point in the order of the walk.
            let step = if ahead { Some((block, lane)) } else { self.block(here + 1) };
            sum.length += step.map_or(T::ZERO, |(b, l)| b.step_px[l]);
            sum.at = [sum.at[0] + at.u, sum.at[1] + at.v];
            sum.off += self.residuals.curve.distance(block, lane);
            sum.points += 1;
            *place = if ahead { Some(here + 1) } else { here.checked_sub(1) };
        }
        if sum.points == 0 {
            return None;
        }
        let n = T::from_i32(sum.points);
        Some(Stretch { at: sum.at.map(|x| x / n), off: sum.off / n, ..sum })
    }

    /// Follows the edge beyond the end of a run of inliers, and adds its boxes that are not on the cone to `found`.
    #[inline(always)]
    fn follow_beyond(&self, end: usize, ahead: bool, found: &mut Continuation<T>) {
        let noise_px = self.residuals.noise_px;
        let off_cone = noise_px.max(T::from_f64(RIVAL_FLOOR_PX)) * T::from_f64(3.0);
        let turn = T::from_f64(TURN_DEG.to_radians());
        // Two boxes within the run give the direction at its end.
        let mut place = Some(end);
        let (Some(mut before), Some(further)) = (self.stretch(&mut place, !ahead), self.stretch(&mut place, !ahead))
        else {
            return;
        };
        let mut heading = [before.at[0] - further.at[0], before.at[1] - further.at[1]];
        let mut place = if ahead { Some(end + 1) } else { end.checked_sub(1) };
        let mut is_smooth = true;
        for number in 0..BOXES {
            let Some(now) = self.stretch(&mut place, ahead) else { break };
            let step = [now.at[0] - before.at[0], now.at[1] - before.at[1]];
            let cross = heading[0] * step[1] - heading[1] * step[0];
            let dot = heading[0] * step[0] + heading[1] * step[1];
            // Each place is a mean of n points, and a turn compares three places: four sigmas are 4 √6 σ/√n over the
            // box.
            let n = T::from_i32(now.points.max(1)).sqrt();
            let length = (step[0] * step[0] + step[1] * step[1]).sqrt().max(T::one());
            let blur = noise_px * T::from_f64(4.0 * 2.449_489_743) / (n * length);
            is_smooth = is_smooth && cross.abs().atan2(dot) <= turn + blur;
            if now.off.abs() > off_cone {
                let contrast = self.contrast(now.at, step);
                if number < NEAR {
                    found.near.add(contrast);
                }
                if is_smooth {
                    found.away += now.length;
                    found.smooth.add(contrast);
                }
            }
            if !is_smooth && number >= NEAR {
                break;
            }
            (before, heading) = (now, step);
        }
    }

    /// Returns the difference in brightness across the edge at `at`, in counts. The edge has the direction (dx, dy).
    fn contrast(&self, at: [T; 2], [dx, dy]: [T; 2]) -> Option<i32> {
        let norm = (dx * dx + dy * dy).sqrt().max(T::from_f64(1e-6));
        let side = |px: i32| {
            let half = T::from_f64(0.5);
            let x = (at[0] - dy / norm * T::from_i32(px) + half).to_i32();
            let y = (at[1] + dx / norm * T::from_i32(px) + half).to_i32();
            let (x, y) = (u16::try_from(x).ok()?, u16::try_from(y).ok()?);
            let binary = self.binary;
            let counts = binary.region.contains(x, y) && !binary.masked(x, y);
            counts.then(|| i32::from(binary.brightness(x, y)))
        };
        Some((side(ASIDE_PX)? - side(-ASIDE_PX)?).abs())
    }
}

/// Refuses an edge that continues next to the cone and keeps its contrast there. There are two cases. Either the
/// continuation is smooth and longer than `gates.max_departure` of the longest run of inliers. Or edge points cover
/// less than `gates.min_support_abrupt` of the limb in view; then any continuation counts.
///
/// A continuation is smooth if it turns from box to box by less than [`TURN_DEG`], plus an allowance for
/// the noise of the boxes.
pub(super) fn refuse<T: Real, P: Pixels, O: Observer<T>>(
    case: &Case<'_, T>,
    binary: &BinaryPicture<'_, T, P, O>,
    residuals: &Residuals<'_, T>,
) -> Result<(), Verdict> {
    let Case { fit, blocks, camera, config, .. } = *case;
    // Of a picture that came row by row, only lit and dark pixels are left.
    if P::STREAMED || fit.inliers >= case.points {
        return Ok(());
    }
    let edge = Edge { case, binary, residuals };
    let Some(run) = longest(blocks) else { return Ok(()) };
    let mut found = Continuation { away: T::ZERO, smooth: Mean::default(), near: Mean::default() };
    for ahead in [false, true] {
        edge.follow_beyond(if ahead { run.last } else { run.first }, ahead, &mut found);
    }
    let Continuation { away, smooth, near } = found;
    let is_long =
        away >= T::from_f64(2.0 * BOX_PX) && away > run.length.max(T::one()) * T::from_f64(config.max_departure);
    let is_abrupt = near.count > 0 && case.cover.share < T::from_f64(config.min_support_abrupt);
    if !(is_long || is_abrupt) {
        return Ok(());
    }
    let mut on_cone = Mean::default();
    for (block, lane) in inliers(blocks, fit.inliers, MAX_PLACES) {
        let [gu, gv] = block.gradient_at(lane, edge.residuals.curve.axis());
        if let Some(at) = camera.project(&UnitVec3::assume_unit(block.ray(lane))) {
            on_cone.add(edge.contrast([at.u, at.v], [-gv, gu]));
        }
    }
    // A terminator fades, and the rim of another object does not.
    let kept = |beside: &Mean| beside.count > 0 && beside.mean::<T>() >= on_cone.mean::<T>() * T::from_f64(CONTRAST);
    refuse_if((is_long && kept(&smooth)) || (is_abrupt && kept(&near)), Verdict::Departure)
}

/// The parts of an edge next to the cone that continue a run of inliers.
struct Continuation<T> {
    /// Length of the smooth part, in pixels.
    away: T,
    /// Contrast of the smooth part.
    smooth: Mean,
    /// Contrast of the first boxes, smooth or not.
    near: Mean,
}

/// Sum and number of contrasts, in counts.
#[derive(Default)]
struct Mean {
    sum: i32,
    count: i32,
}

impl Mean {
    fn add(&mut self, seen: Option<i32>) {
        self.sum += seen.unwrap_or(0);
        self.count += i32::from(seen.is_some());
    }
    fn mean<T: Real>(&self) -> T {
        T::from_i32(self.sum) / T::from_i32(self.count.max(1))
    }
}
