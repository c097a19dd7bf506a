//! The part of a predicted limb that the picture shows.

use crate::base::linalg::{V3, basis};
use crate::base::real::Real;
use crate::geometry::camera::Camera;
use crate::geometry::frames::UnitVec3;
use crate::geometry::pixel::{ImagePoint, Pixel};
use crate::image::region::Region;
use crate::model::work;

/// Number of azimuths at which the limb is projected to find what is in view.
const STEPS: usize = 48;
/// Neighbours along the limb are at least so many pixels apart: the direction of the edge follows from their distance.
const LEAST_STEP_PX: f64 = 3.0;
/// Smallest number of places. Fewer say nothing about the limb.
const LEAST: i32 = 16;
/// Distance of a place from the border of the picture, pixels: the pixels around an edge point that are always read,
/// and one more.
const MARGIN_PX: u16 = 3;

/// The predicted limb of one picture.
pub(super) struct Limb<'a, T> {
    camera: &'a Camera<T>,
    region: &'a Region<T>,
    /// Distance from the border of the picture that places keep, pixels.
    margin_px: u16,
    /// Axis and two directions across it, times the cosine and the sine of the half-angle.
    centre: V3<T>,
    across: [V3<T>; 2],
}

/// Points of the limb at even steps of azimuth; `None` where it is not in view.
type Points<T> = [Option<ImagePoint<T>>; STEPS];

impl<'a, T: Real> Limb<'a, T> {
    /// `frame_px` is the width of a dark frame that the picture may have.
    pub(super) fn new(
        camera: &'a Camera<T>,
        region: &'a Region<T>,
        frame_px: u16,
        e: &V3<T>,
        [cos, sin]: [T; 2],
    ) -> Self {
        let (right, down) = basis(e);
        // With the second direction inverted, the limb is passed with the body on the left, as the follower does.
        let across = [right * sin, down * -sin];
        Self { camera, region, margin_px: frame_px.saturating_add(MARGIN_PX), centre: e * cos, across }
    }

    /// Returns the point at an azimuth, if it is in view.
    fn at(&self, (cos, sin): (T, T)) -> Option<ImagePoint<T>> {
        let [right, down] = &self.across;
        let point = self.camera.project(&UnitVec3::assume_unit(self.centre + right * cos + down * sin))?;
        let Pixel { x, y } = pixel_of(point)?;
        (self.region.is_inside_by(x, y, self.margin_px) && !self.region.masked(x, y)).then_some(point)
    }

    fn points(&self, from: T, step: T) -> Points<T> {
        let (mut sin, mut cos) = from.sin_cos();
        let (turn_sin, turn_cos) = step.sin_cos();
        core::array::from_fn(|_| {
            let point = self.at((cos, sin));
            (cos, sin) = (cos * turn_cos - sin * turn_sin, cos * turn_sin + sin * turn_cos);
            point
        })
    }

    /// Returns points in view: first at steps over the whole limb, and then over the part in view only. The flag says
    /// whether the last point is followed by the first one.
    fn in_view(&self) -> Option<(Points<T>, bool)> {
        let step = T::from_f64(core::f64::consts::TAU / STEPS as f64);
        // The first point is where the limb is nearest to the optical axis, so that a camera with a small field of view
        // sees at least this one.
        let [right, down] = &self.across;
        let from = down.z.atan2(right.z);
        let all = self.points(from, step);
        let (mut gap, mut widest, mut after) = (0, 0, 0);
        for (k, point) in all.iter().chain(&all).enumerate() {
            gap = if point.is_some() { 0 } else { gap + 1 };
            if gap > widest {
                (widest, after) = (gap, k + 1);
            }
        }
        match widest {
            0 => Some((all, true)),
            _ if widest > STEPS => None,
            _ => {
                // From the last point of the gap to its first one the limb enters the picture and leaves it.
                let steps = STEPS - widest + 1;
                let from = from + step * T::from_i32(after as i32 - 1);
                Some((self.points(from, step * T::from_i32(steps as i32) / T::from_i32(STEPS as i32 - 1)), false))
            }
        }
    }

    /// Writes about `most` places along the limb into `places`, in order with the body on the left. Returns their
    /// number; `None` if there are too few.
    ///
    /// The places lie on straight lines between the points. Of a limb all around the picture, these lines are 0.2 % of
    /// its radius inside, which is far less than the search reaches.
    pub(super) fn places(&self, most: u16, places: &mut [Pixel], cost: &mut u32) -> Option<usize> {
        *cost += 2 * STEPS as u32 * (work::PLACE + self.region.mask_cost());
        let (points, is_closed) = self.in_view()?;
        let next = |k: usize| if k + 1 < STEPS { points.get(k + 1) } else { points.first().filter(|_| is_closed) };
        let lines = || points.iter().enumerate().filter_map(|(k, p)| (*p).zip(next(k).copied().flatten()));
        let length = |(p, q): (ImagePoint<T>, ImagePoint<T>)| {
            let (du, dv) = (q.u - p.u, q.v - p.v);
            (du * du + dv * dv).sqrt()
        };
        let all_px = lines().fold(T::ZERO, |sum, line| sum + length(line));
        let wanted = (all_px / T::from_f64(LEAST_STEP_PX)).to_i32().min(most.into());
        if wanted < LEAST {
            return None;
        }
        let step_px = all_px / T::from_i32(wanted);
        // Distance from the end of the line before to the next place.
        let (mut left_px, mut count) = (step_px * T::from_f64(0.5), 0);
        for (p, q) in lines() {
            let length_px = length((p, q));
            while left_px < length_px {
                let part = left_px / length_px;
                left_px += step_px;
                let point = ImagePoint { u: p.u + (q.u - p.u) * part, v: p.v + (q.v - p.v) * part };
                let pixel = pixel_of(point).filter(|p| !self.region.masked(p.x, p.y));
                if let (Some(pixel), Some(place)) = (pixel, places.get_mut(count)) {
                    *place = pixel;
                    count += 1;
                }
            }
            left_px -= length_px;
        }
        *cost += wanted as u32 * (work::READ + self.region.mask_cost());
        (count >= LEAST as usize).then_some(count)
    }
}

/// Returns the pixel that a point lies in.
fn pixel_of<T: Real>(point: ImagePoint<T>) -> Option<Pixel> {
    let half = T::from_f64(0.5);
    let (x, y) = ((point.u + half).floor().to_i32(), (point.v + half).floor().to_i32());
    Some(Pixel { x: u16::try_from(x).ok()?, y: u16::try_from(y).ok()? })
}
