//! The ring test: around the corner of a chessboard the brightness changes four times.

use super::grey::Grey;
use super::saddle::Saddle;

/// A saddle that has passed the ring test.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    /// Place in the picture that was searched, in pixels.
    pub(super) at: [f32; 2],
    /// Directions of the two edges, as unit vectors. Turning from the first to the second by less than half a turn,
    /// from x towards y, one passes a bright square.
    pub(super) edges: [[f32; 2]; 2],
}

/// Number of samples around the ring.
pub(super) const SAMPLES: usize = 24;
/// Radius of the ring in pixels: the blur must not reach it, and squares of 8 pixels must contain it.
const RADIUS: f32 = 4.0;
/// Largest bend of an edge at the corner, in radians: opposite changes of brightness lie half a turn apart. A pixel of
/// error on each side of the ring is 2/4 rad.
const MAX_BEND: f32 = 0.5;
/// Smallest angle between the two edges, in radians (20°): a board that is tilted more has squares that are too narrow.
const MIN_ANGLE: f32 = 0.35;
/// Smallest contrast of the four parts of the ring, as a part of the range of brightness on the ring.
const MIN_CONTRAST: f32 = 0.25;

/// Returns the places of the samples about the middle of the ring, in pixels.
pub(super) fn offsets() -> [[f32; 2]; SAMPLES] {
    core::array::from_fn(|n| {
        let (sin, cos) = angle(n as f32).sin_cos();
        [RADIUS * cos, RADIUS * sin]
    })
}

/// Tests a saddle of a blurred picture; `offsets` are those of [`offsets`].
pub(super) fn test(blurred: &Grey, offsets: &[[f32; 2]; SAMPLES], saddle: &Saddle) -> Option<Candidate> {
    let at = refine(blurred, saddle);
    let (right, bottom) = (blurred.width() as f32 - 1.5, blurred.height() as f32 - 1.5);
    if at[0] < RADIUS || at[1] < RADIUS || at[0] + RADIUS > right || at[1] + RADIUS > bottom {
        return None;
    }
    let ring = offsets.map(|[u, v]| blurred.between(at[0] + u, at[1] + v));
    let (low, high) = ring.iter().fold((f32::MAX, f32::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
    // On the saddle itself the brightness is in the middle; so it is for uneven light too.
    let middle = blurred.between(at[0], at[1]);
    let range = high - low;
    if !(range > 0.0) {
        return None;
    }
    let changes = changes(&ring, middle)?;
    let strong = (0..4).all(|n| {
        let extreme = extreme_between(&ring, middle, changes[n].0, changes[(n + 1) % 4].0);
        extreme > MIN_CONTRAST * range
    });
    let bend = |n: usize| (wrap(changes[n + 2].0 - changes[n].0) - SAMPLES as f32 / 2.0).abs();
    let limit = MAX_BEND * SAMPLES as f32 / core::f32::consts::TAU;
    if !strong || bend(0) > limit || bend(1) > limit {
        return None;
    }
    // After a rise the ring is bright up to the next change.
    let first = usize::from(!changes[0].1);
    let direction = |n: usize| {
        let (a, b) = (angle(changes[n % 4].0), angle(changes[(n + 2) % 4].0));
        let (x, y) = (a.cos() - b.cos(), a.sin() - b.sin());
        let length = x.hypot(y);
        [x / length, y / length]
    };
    let edges = [direction(first), direction(first + 1)];
    let sin = edges[0][0] * edges[1][1] - edges[0][1] * edges[1][0];
    (sin.abs() > MIN_ANGLE.sin()).then_some(Candidate { at, edges })
}

fn angle(sample: f32) -> f32 {
    sample * core::f32::consts::TAU / SAMPLES as f32
}

fn wrap(samples: f32) -> f32 {
    samples.rem_euclid(SAMPLES as f32)
}

/// Returns the four places where the ring crosses the middle, each with whether the brightness rises there; `None` if
/// there are not exactly four.
fn changes(ring: &[f32; SAMPLES], middle: f32) -> Option<[(f32, bool); 4]> {
    let mut found = [(0.0, false); 4];
    let mut count = 0;
    for n in 0..SAMPLES {
        let (a, b) = (ring[n] - middle, ring[(n + 1) % SAMPLES] - middle);
        if (a > 0.0) != (b > 0.0) {
            *found.get_mut(count)? = (n as f32 + a / (a - b), b > 0.0);
            count += 1;
        }
    }
    (count == 4).then_some(found)
}

/// Returns the largest distance from the middle between two changes.
fn extreme_between(ring: &[f32; SAMPLES], middle: f32, from: f32, to: f32) -> f32 {
    let length = wrap(to - from) as usize;
    (0..=length).map(|k| (ring[(from as usize + 1 + k) % SAMPLES] - middle).abs()).fold(0.0, f32::max)
}

/// Moves the place to the saddle of the second-order surface through nine pixels, by a pixel at most.
fn refine(picture: &Grey, saddle: &Saddle) -> [f32; 2] {
    let (x, y) = (saddle.x, saddle.y);
    let at = |i: usize, j: usize| picture.at(x + i - 1, y + j - 1);
    let (gx, gy) = (0.5 * (at(2, 1) - at(0, 1)), 0.5 * (at(1, 2) - at(1, 0)));
    let (xx, yy) = (at(0, 1) + at(2, 1) - 2.0 * at(1, 1), at(1, 0) + at(1, 2) - 2.0 * at(1, 1));
    let xy = 0.25 * (at(0, 0) + at(2, 2) - at(2, 0) - at(0, 2));
    let det = xx * yy - xy * xy;
    let (dx, dy) = ((xy * gy - yy * gx) / det, (xy * gx - xx * gy) / det);
    let within = |d: f32| if d.is_finite() { d.clamp(-1.0, 1.0) } else { 0.0 };
    [x as f32 + within(dx), y as f32 + within(dy)]
}
