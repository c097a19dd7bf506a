//! Length of a fitted limb in the picture, and the length that its inliers cover.

use super::places::inliers;
use crate::base::linalg::{V3, basis};
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES, sum};
use crate::geometry::camera::Camera;
use crate::geometry::frames::UnitVec3;
use crate::geometry::pixel::ImagePoint;
use crate::image::region::Region;
use crate::stages::covariance::Fused;
use crate::stages::fit::Fit;

/// What the inliers cover of a limb.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cover<T> {
    /// Length along the limb, in pixels.
    pub(crate) length_px: T,
    /// Part of the limb in view, 0 to 1.
    pub(crate) share: T,
}

impl<T: Real> Cover<T> {
    pub(crate) fn new(
        fit: &Fit<T>,
        fused: &Fused<T>,
        blocks: &[Block<T>],
        camera: &Camera<T>,
        region: &Region<T>,
    ) -> Self {
        let limb_px = inliers(blocks, fit.inliers, 1)
            .next()
            .map_or(T::ZERO, |(b, l)| limb_in_view(&fused.e, fused.c, &b.ray(l), camera, region));
        let length_px = covered(&fused.e, blocks);
        Self { length_px, share: (length_px / limb_px.max(T::one())).min(T::one()) }
    }
}

/// Returns the length that the inliers cover along the limb about `e`, in pixels. Each step from one inlier to the next
/// counts with its component along the limb, forwards or backwards. The path along a noisy edge is many times longer.
fn covered<T: Real>(e: &V3<T>, blocks: &[Block<T>]) -> T {
    let mut length = [T::ZERO; LANES];
    // The point before and its weight: the previous lane, or the last lane of the previous block.
    let mut last = [T::ZERO; 4];
    for block in blocks {
        let here = [&block.s[0], &block.s[1], &block.s[2], &block.weight];
        let mut before = [[T::ZERO; LANES]; 4];
        for ((before, here), last) in before.iter_mut().zip(here).zip(&mut last) {
            before[0] = *last;
            before[1..].copy_from_slice(&here[..LANES - 1]);
            *last = here[LANES - 1];
        }
        for l in 0..LANES {
            let (x, y, z) = (block.s[0][l], block.s[1][l], block.s[2][l]);
            let (dx, dy, dz) = (x - before[0][l], y - before[1][l], z - before[2][l]);
            let (ax, ay, az) = (e.y * z - e.z * y, e.z * x - e.x * z, e.x * y - e.y * x);
            let whole = ((dx * dx + dy * dy + dz * dz) * (ax * ax + ay * ay + az * az)).sqrt();
            let along = block.step_px[l] * (dx * ax + dy * ay + dz * az) / whole.max(T::from_f64(1e-20));
            let counts = block.weight[l].min(before[3][l]) > T::ZERO;
            length[l] += if counts { along } else { T::ZERO };
        }
    }
    sum(&length).abs()
}

/// Largest number of steps along the limb to each side.
const STEPS: usize = 48;

/// Returns the length of the limb of the cone (e, c) in the picture, in pixels. The function walks to both sides from
/// the inlier `seen`, until the limb leaves the region or the walk has gone around. Masked parts do not count.
fn limb_in_view<T: Real>(e: &V3<T>, c: T, seen: &V3<T>, camera: &Camera<T>, region: &Region<T>) -> T {
    let sin = (T::one() - c * c).max(T::ZERO).sqrt();
    let (b1, b2) = basis(e);
    let (fx, fy) = camera.focal_px();
    // A step is about a sixteenth of the picture; there are at least eight steps around the cone.
    let wide = T::from_i32(i32::from(region.width().max(region.height())));
    let step = (wide / (T::from_f64(16.0) * (fx + fy) * T::from_f64(0.5) * sin.max(T::from_f64(1e-6))))
        .min(T::from_f64(0.785))
        .max(T::from_f64(0.02));
    let (ss, cs) = step.sin_cos();
    let radial = (seen.dot(&b1), seen.dot(&b2));
    let norm = (radial.0 * radial.0 + radial.1 * radial.1).sqrt().max(T::from_f64(1e-12));
    let start = (radial.0 / norm, radial.1 / norm);
    let at = |(x, y): (T, T)| -> Option<ImagePoint<T>> {
        let p = camera.project(&UnitVec3::assume_unit(e * c + (b1 * x + b2 * y) * sin))?;
        let (half, zero) = (T::from_f64(0.5), T::ZERO);
        (p.u >= zero && p.v >= zero).then_some(())?;
        let (x, y) = ((p.u + half).to_i32(), (p.v + half).to_i32());
        let (Ok(x), Ok(y)) = (u16::try_from(x), u16::try_from(y)) else { return None };
        region.contains(x, y).then_some(p)
    };
    let masked = |p: &ImagePoint<T>| region.masked(p.u.to_i32() as u16, p.v.to_i32() as u16);
    let half_turn = T::from_f64(core::f64::consts::PI);
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
                // The last piece, which the border cuts, counts as half a step.
                if let (Some(a), None) = (before, now)
                    && !masked(&a)
                {
                    length += step * sin * (fx + fy) * T::from_f64(0.25);
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Makes points about a circle of 0.5 rad at every half degree; every other point is `off` radians aside. 600
    /// pixels are one radian.
    fn edge(off: f64) -> [Block<f64>; 4] {
        let mut blocks = [Block::EMPTY; 4];
        let mut before: Option<V3<f64>> = None;
        for i in 0..4 * LANES {
            let alpha = 0.5 + if i % 2 == 1 { off } else { 0.0 };
            let (sin, cos) = libm::sincos(alpha);
            let (y, x) = libm::sincos(i as f64 * 0.5f64.to_radians());
            let ray = V3::new(x * sin, y * sin, cos);
            let (block, lane) = (&mut blocks[i / LANES], i % LANES);
            for (k, v) in [ray.x, ray.y, ray.z].into_iter().enumerate() {
                block.s[k][lane] = v;
            }
            block.weight[lane] = 1.0;
            block.step_px[lane] = before.map_or(0.0, |b| 600.0 * (ray - b).dot(&(ray - b)).sqrt());
            before = Some(ray);
        }
        blocks
    }

    #[test]
    fn noise_makes_no_limb_longer() {
        let axis = V3::new(0.0, 0.0, 1.0);
        let arc = 600.0 * libm::sin(0.5) * 15.5f64.to_radians();
        for off in [0.0, 0.002, 0.01] {
            let blocks = edge(off);
            assert!((covered(&axis, &blocks) / arc - 1.0).abs() < 0.02, "{off}: {} of {arc}", covered(&axis, &blocks));
        }
        let way: f64 = edge(0.01).iter().flat_map(|b| b.step_px).sum();
        assert!(way > 2.0 * arc, "{way}");
    }

    #[test]
    fn rejected_points_cover_nothing() {
        let mut blocks = edge(0.0);
        let whole = covered(&V3::new(0.0, 0.0, 1.0), &blocks);
        blocks[1].weight = [0.0; LANES];
        let rest = covered(&V3::new(0.0, 0.0, 1.0), &blocks);
        assert!((whole - rest - 9.0 * whole / 31.0).abs() < 1e-6 * whole, "{rest} of {whole}");
    }
}
