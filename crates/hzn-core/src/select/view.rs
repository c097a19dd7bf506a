//! How much of a fitted limb lies in the picture.

use crate::camera::Camera;
use crate::frames::UnitVec3;
use crate::linalg::{V3, basis};
use crate::pixel::ImagePoint;
use crate::real::Real;
use crate::region::Region;

/// Most steps along the limb to each side.
const STEPS: usize = 48;

/// Length in pixels of the limb of the cone (e, c) in the picture, walked to both sides from the inlier `seen` until
/// it leaves the region or comes around. What a mask covers is not counted.
pub(super) fn limb_in_view<T: Real>(e: &V3<T>, c: T, seen: &V3<T>, camera: &Camera<T>, region: &Region<T>) -> T {
    let sin = (T::one() - c * c).most(T::ZERO).sqrt();
    let (b1, b2) = basis(e);
    let (fx, fy) = camera.focal_px();
    // A step of about a sixteenth of the picture, and at least eight around.
    let wide = T::of_i32(i32::from(region.width().max(region.height())));
    let step =
        (wide / (T::of(16.0) * (fx + fy) * T::of(0.5) * sin.most(T::of(1e-6)))).least(T::of(0.785)).most(T::of(0.02));
    let (ss, cs) = step.sin_cos();
    let radial = (seen.dot(&b1), seen.dot(&b2));
    let norm = (radial.0 * radial.0 + radial.1 * radial.1).sqrt().most(T::of(1e-12));
    let start = (radial.0 / norm, radial.1 / norm);
    let at = |(x, y): (T, T)| -> Option<ImagePoint<T>> {
        let p = camera.project(&UnitVec3::assume_unit(e * c + (b1 * x + b2 * y) * sin))?;
        let (half, zero) = (T::of(0.5), T::ZERO);
        (p.u >= zero && p.v >= zero).then_some(())?;
        let (x, y) = ((p.u + half).to_i32(), (p.v + half).to_i32());
        let (Ok(x), Ok(y)) = (u16::try_from(x), u16::try_from(y)) else { return None };
        region.contains(x, y).then_some(p)
    };
    let masked = |p: &ImagePoint<T>| region.masked(p.u.to_i32() as u16, p.v.to_i32() as u16);
    let half_turn = T::of(core::f64::consts::PI);
    let mut length = T::ZERO;
    for turn in [ss, -ss] {
        let (mut direction, mut before) = (start, at(start));
        let mut angle = T::ZERO;
        for _ in 0..STEPS {
            angle += step;
            if angle > half_turn {
                break;
            }
            let (x, y) = direction;
            direction = (x * cs - y * turn, x * turn + y * cs);
            let now = at(direction);
            let (Some(a), Some(b)) = (before, now) else {
                // The last piece, cut by the border, counts half a step.
                if let (Some(a), None) = (before, now)
                    && !masked(&a)
                {
                    length += step * sin * (fx + fy) * T::of(0.25);
                }
                break;
            };
            if !(masked(&a) || masked(&b)) {
                let (du, dv) = (b.u - a.u, b.v - a.v);
                length += (du * du + dv * dv).sqrt();
            }
            before = now;
        }
    }
    length
}
