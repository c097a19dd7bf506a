//! Noise of an edge from point to point, measured before the fit.

use crate::base::linalg::V3;
use crate::base::median;
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};

/// Largest number of points that are measured, evenly along the edge. It gives the median to about 10 %.
const MOST: usize = 64;

/// Measures the noise from point to point across the edge, in pixels. For each of up to 64 points, the method takes the
/// distance from the middle between its two neighbours. For independent errors, the median of these distances is
/// 0.6745 √1.5 times sigma. The curvature of the limb, spacing²/2R, and smooth deviations do not contribute.
///
/// d = s_b − (s_a + s_c)/2 is projected on the normal n = s_b × (s_f − s_e) of the edge. The points e and f, which are
/// eight points before and after, give the direction of the edge. A direction from adjacent points would depend on
/// their noise. The derivative of s·n by (u, v) converts the result to pixels. The method uses only differences of rays
/// close to each other, so single precision suffices.
pub(super) fn point_to_point<T: Real>(blocks: &[Block<T>], count: u32) -> T {
    let every = (count as usize / MOST).max(1);
    let mut all = heapless::Vec::<T, MOST>::new();
    let mut most = T::ZERO;
    for b in (ALONG..(count as usize).saturating_sub(ALONG)).step_by(every) {
        let Some(second) = second_difference(blocks, b) else { continue };
        most = most.max(second);
        if all.push(second).is_err() {
            break;
        }
    }
    // A median and not an RMS, because the outliers are still among the points here.
    median::median_of_reals(&all, most) * T::from_f64(1.0 / (0.6745 * 1.224_744_871))
}

/// Number of points to each side from which the direction of the edge is computed.
const ALONG: usize = 8;

/// Returns the distance of point `b` from the middle between its neighbours, across the edge, in pixels.
fn second_difference<T: Real>(blocks: &[Block<T>], b: usize) -> Option<T> {
    let (before, at, after) = (ray_in_range(blocks, b - 1)?, ray_in_range(blocks, b)?, ray_in_range(blocks, b + 1)?);
    let normal = at.cross(&(ray_in_range(blocks, b + ALONG)? - ray_in_range(blocks, b - ALONG)?));
    let [gu, gv] = blocks.get(b / LANES)?.gradient_at(b % LANES, &normal);
    let off = (at - before) - (after - at);
    let size = (gu * gu + gv * gv).sqrt();
    (size > T::ZERO).then(|| (off.dot(&normal) * T::from_f64(0.5) / size).abs())
}

/// Returns the ray of a point if it is inside the range of the lens.
fn ray_in_range<T: Real>(blocks: &[Block<T>], i: usize) -> Option<V3<T>> {
    let (block, lane) = (blocks.get(i / LANES)?, i % LANES);
    block.m.iter().any(|m| m[lane] != T::ZERO).then(|| block.ray(lane))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Rng;
    use crate::geometry::block::Lit;
    use crate::geometry::camera::{self, Camera};
    use crate::geometry::pixel::ImagePoint;
    use crate::stages::rays;
    use std::vec;

    /// Measures the noise of points on an arc of `radius_px`, `spacing_px` apart, displaced across it by up to
    /// `half_width_px`.
    fn measured<T: Real>(radius_px: f64, spacing_px: f64, half_width_px: f64) -> f64 {
        let config = camera::Config::ideal(camera::Model::Pinhole, 1024, 768, 2133.0);
        let camera = Camera::<T>::try_new(&config).unwrap();
        let mut rng = Rng::new(5);
        let count = 400;
        let mut blocks = vec![Block::<T>::default(); count / LANES];
        for i in 0..count {
            let angle = (i as f64 - 200.0) * spacing_px / radius_px;
            let noise = (f64::from(rng.below(20_001)) / 1e4 - 1.0) * half_width_px;
            let (sin, cos) = angle.sin_cos();
            let (u, v) = (512.0 + (radius_px + noise) * sin, 384.0 + radius_px - (radius_px + noise) * cos);
            blocks[i / LANES].set_point(i % LANES, ImagePoint { u: T::from_f64(u), v: T::from_f64(v) }, Lit::Below);
        }
        rays::to_rays(&camera, &mut blocks);
        point_to_point(&blocks, count as u32).to_f64()
    }

    #[test]
    fn noise_is_measured_and_a_bend_is_not() {
        // Uniform noise of half-width h has sigma h/√3. The median of its second differences is 0.9 of the median for
        // normal noise.
        for half_width_px in [1.0, 4.0, 20.0] {
            let ratio = measured::<f32>(3000.0, 1.0, half_width_px) / (half_width_px / 3f64.sqrt());
            assert!((0.75..1.35).contains(&ratio), "{half_width_px} px: {ratio}");
        }
        // There remain the sagitta 1/2R between neighbours 1 px apart, and the rounding of rays in single precision.
        assert!(measured::<f64>(200.0, 1.0, 0.0) < 4e-3);
        assert!(measured::<f32>(3000.0, 1.0, 0.0) < 2e-3);
    }
}
