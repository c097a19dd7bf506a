//! An edge that goes on smoothly next to the fitted cone counts against it: a limb does not bend away from itself.

use super::shape::Curve;
use super::Config;
use crate::block::{Block, LANES};
use crate::camera::Camera;
use crate::contour::Scene;
use crate::frames::UnitVec3;
use crate::image::Pixels;
use crate::pipeline::Observer;
use crate::real::Real;

/// Length of edge whose points are taken together, pixels: a direction is then known to a few degrees.
const BOX_PX: f64 = 16.0;
/// Most boxes that are looked at beyond each end of the inliers.
const BOXES: usize = 24;
/// Gaps up to this length do not end a run of inliers, pixels.
const GAP_PX: f64 = 12.0;
/// The edge's contrast is read so far to each side, pixels.
const ASIDE_PX: f64 = 3.0;

/// The longest run of inliers: its first and last point and its length in pixels.
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
                Some(run) if !(gap > T::of(GAP_PX).most(step)) => {
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

/// A stretch of edge: where its middle is, and how far off the cone.
#[derive(Clone, Copy)]
struct Stretch<T> {
    at: [T; 2],
    off: T,
    length: T,
    points: i32,
}

/// What there is to look at.
struct Edge<'a, 'b, T, P, O> {
    blocks: &'a [Block<T>],
    points: usize,
    curve: &'a Curve<T>,
    camera: &'a Camera<T>,
    scene: &'a Scene<'b, T, P, O>,
}

impl<T: Real, P: Pixels, O: Observer<T>> Edge<'_, '_, T, P, O> {
    fn block(&self, place: usize) -> Option<(&Block<T>, usize)> {
        (place < self.points).then_some(())?;
        Some((self.blocks.get(place / LANES)?, place % LANES))
    }

    /// The points from `place` on, in the direction `ahead`, over a box; and the place after them.
    fn stretch(&self, place: &mut Option<usize>, ahead: bool) -> Option<Stretch<T>> {
        let mut sum = Stretch { at: [T::ZERO; 2], off: T::ZERO, length: T::ZERO, points: 0 };
        while sum.length < T::of(BOX_PX) || sum.points == 0 {
            let here = (*place)?;
            let Some((block, lane)) = self.block(here) else { break };
            let Some(at) = self.camera.project(&UnitVec3::assume_unit(block.ray(lane))) else { break };
            // The step to the point before in the order of the walk.
            let step = if ahead { Some((block, lane)) } else { self.block(here + 1) };
            sum.length += step.map_or(T::ZERO, |(b, l)| b.step_px[l]);
            sum.at = [sum.at[0] + at.u, sum.at[1] + at.v];
            sum.off += self.curve.distance(block, lane);
            sum.points += 1;
            *place = if ahead { Some(here + 1) } else { here.checked_sub(1) };
        }
        if sum.points == 0 {
            return None;
        }
        let n = T::of_i32(sum.points);
        Some(Stretch { at: sum.at.map(|x| x / n), off: sum.off / n, ..sum })
    }

    /// Difference in brightness across the edge at `at`, whose direction is (dx, dy), counts.
    fn contrast(&self, at: [T; 2], [dx, dy]: [T; 2]) -> Option<i32> {
        let norm = (dx * dx + dy * dy).sqrt().most(T::of(1e-6));
        let side = |px: f64| {
            let half = T::of(0.5);
            let x = (at[0] - dy / norm * T::of(px) + half).to_i32();
            let y = (at[1] + dx / norm * T::of(px) + half).to_i32();
            let (x, y) = (u16::try_from(x).ok()?, u16::try_from(y).ok()?);
            let counts = self.scene.region.contains(x, y) && !self.scene.region.masked(x, y);
            counts.then(|| i32::from(self.scene.brightness(x, y)))
        };
        Some((side(ASIDE_PX)? - side(-ASIDE_PX)?).abs())
    }
}

/// How long the edge goes on smoothly beside the cone, as a part of the longest run of inliers, where it keeps its contrast;
/// `noise_px` is the noise from point to point.
///
/// Smooth is a turn from box to box of less than `select.departure_turn_deg` and what the noise of the boxes' places makes.
pub(super) fn departure<T: Real, P: Pixels, O: Observer<T>>(
    blocks: &[Block<T>],
    points: u32,
    curve: &Curve<T>,
    noise_px: T,
    scene: &Scene<'_, T, P, O>,
    camera: &Camera<T>,
    config: &Config,
) -> T {
    let edge = Edge { blocks, points: points as usize, curve, camera, scene };
    let Some(run) = longest(blocks) else { return T::ZERO };
    let off_cone = (noise_px * T::of(3.0)).most(T::of(config.rival_floor_px) * T::of(3.0));
    let (mut away, mut beside) = (T::ZERO, Mean::default());
    let turn = T::of(config.departure_turn_deg.to_radians());
    for ahead in [false, true] {
        let end = if ahead { run.last } else { run.first };
        // Two boxes within the run give the direction in which it ends.
        let inside = |boxes: usize| {
            let mut place = Some(end);
            let mut found = None;
            for _ in 0..boxes {
                found = edge.stretch(&mut place, !ahead);
            }
            found
        };
        let (Some(mut before), Some(last)) = (inside(2), inside(1)) else { continue };
        let mut heading = [last.at[0] - before.at[0], last.at[1] - before.at[1]];
        before = last;
        let mut place = if ahead { Some(end + 1) } else { end.checked_sub(1) };
        for _ in 0..BOXES {
            let Some(now) = edge.stretch(&mut place, ahead) else { break };
            let ahead_of = [now.at[0] - before.at[0], now.at[1] - before.at[1]];
            let length = |v: [T; 2]| (v[0] * v[0] + v[1] * v[1]).sqrt();
            let cross = heading[0] * ahead_of[1] - heading[1] * ahead_of[0];
            let dot = heading[0] * ahead_of[0] + heading[1] * ahead_of[1];
            // Means of n points, two differences of them: 4 √6 σ/√n over the box.
            let n = T::of_i32(now.points.max(1)).sqrt();
            let blur = noise_px * T::of(4.0 * 2.449_489_743) / (n * length(ahead_of).most(T::one()));
            if !(cross.abs().atan2(dot) <= turn + blur) {
                break;
            }
            if now.off.abs() > off_cone {
                away += now.length;
                beside.add(edge.contrast(now.at, ahead_of));
            }
            (before, heading) = (now, ahead_of);
        }
    }
    if away < T::of(2.0 * BOX_PX) {
        return T::ZERO;
    }
    let mut on_cone = Mean::default();
    for (block, lane) in super::inliers(blocks, super::LOOKS) {
        let [gu, gv] = block.gradient_at(lane, curve.axis());
        if let Some(at) = camera.project(&UnitVec3::assume_unit(block.ray(lane))) {
            on_cone.add(edge.contrast([at.u, at.v], [-gv, gu]));
        }
    }
    // A terminator fades, and the rim of something else does not.
    if beside.count == 0 || beside.mean::<T>() < on_cone.mean::<T>() * T::of(config.departure_contrast) {
        return T::ZERO;
    }
    away / run.length.most(T::one())
}

/// Contrasts in counts.
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
        T::of_i32(self.sum) / T::of_i32(self.count.max(1))
    }
}
