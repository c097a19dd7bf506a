//! The limb in view of a design, as points one pixel apart.

use core::f64::consts::TAU;

use hzn_core::camera::Camera;
use hzn_core::frames::UnitVec3;
use hzn_core::pixel::ImagePoint;
use nalgebra::Vector3;

use super::design::Design;

/// Number of steps around the cone to find its visible segments; a segment between two steps is missed.
const STEPS: usize = 16_384;
/// Largest number of points on a visible segment of the limb. On longer segments the points are more than a pixel
/// apart.
const MAX_POINTS: f64 = 20_000.0;

/// A point of the limb in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LimbSample {
    pub(super) point: ImagePoint<f64>,
    /// Length of limb from the point before, in pixels; `None` at the first point of a segment.
    pub(super) step_px: Option<f64>,
}

impl Design {
    /// Returns the limb in view as points one pixel apart.
    pub(super) fn sample_limb(&self, camera: &Camera<f64>, half_angle_rad: f64) -> Vec<LimbSample> {
        let e = Vector3::from(self.axis());
        let b1 = e.cross(&Vector3::ith(e.iamin(), 1.0)).normalize();
        let b2 = e.cross(&b1);
        let (sin, cos) = half_angle_rad.sin_cos();
        sample(camera, &|azimuth| {
            let (s, c) = azimuth.sin_cos();
            e * cos + (b1 * c + b2 * s) * sin
        })
    }
}

/// Returns the points of a closed curve of directions that are in view, one pixel apart.
pub(super) fn sample(camera: &Camera<f64>, direction: &impl Fn(f64) -> Vector3<f64>) -> Vec<LimbSample> {
    let (w, h) = (f64::from(camera.width()), f64::from(camera.height()));
    let project = |azimuth: f64| {
        let p = camera.project(&UnitVec3::try_new(direction(azimuth).into())?)?;
        (p.u >= -0.5 && p.v >= -0.5 && p.u <= w - 0.5 && p.v <= h - 0.5).then_some(p)
    };
    let mut samples = Vec::new();
    for azimuths in visible_segments(&project) {
        let points: Vec<(f64, ImagePoint<f64>)> = azimuths.iter().filter_map(|&a| Some((a, project(a)?))).collect();
        // Each entry has (arc length, azimuth) along the segment.
        let mut arc = 0.0;
        let mut along_segment = Vec::with_capacity(points.len());
        for (i, (azimuth, p)) in points.iter().enumerate() {
            if let Some((_, before)) = i.checked_sub(1).and_then(|j| points.get(j)) {
                arc += (p.u - before.u).hypot(p.v - before.v);
            }
            along_segment.push((arc, *azimuth));
        }
        let count = arc.round().clamp(1.0, MAX_POINTS);
        let spacing = arc / count;
        let mut pairs = along_segment.windows(2);
        let mut pair = pairs.next();
        for i in 0..count as usize {
            let target = (i as f64 + 0.5) * spacing;
            while pair.is_some_and(|s| s[1].0 < target) {
                pair = pairs.next();
            }
            let Some([(a0, phi0), (a1, phi1)]) = pair else { break };
            let azimuth = phi0 + (phi1 - phi0) * (target - a0) / (a1 - a0).max(1e-12);
            if let Some(point) = project(azimuth) {
                samples.push(LimbSample { point, step_px: (i > 0).then_some(spacing) });
            }
        }
    }
    samples
}

/// Returns the visible ranges of azimuth as rising azimuths in radians. Bisection locates their ends.
fn visible_segments(project: &impl Fn(f64) -> Option<ImagePoint<f64>>) -> Vec<Vec<f64>> {
    let azimuth = |i: usize| TAU * i as f64 / STEPS as f64;
    let visible: Vec<bool> = (0..STEPS).map(|i| project(azimuth(i)).is_some()).collect();
    let Some(start) = visible.iter().position(|v| !v) else {
        return vec![(0..=STEPS).map(azimuth).collect()];
    };
    let end = |mut inside: f64, mut outside: f64| {
        for _ in 0..40 {
            let mid = 0.5 * (inside + outside);
            if project(mid).is_some() { inside = mid } else { outside = mid }
        }
        inside
    };
    let mut segments = Vec::new();
    let mut segment: Vec<f64> = Vec::new();
    for i in start..start + STEPS {
        let (here, next) = (visible[i % STEPS], visible[(i + 1) % STEPS]);
        if !here && next {
            segment.push(end(azimuth(i + 1), azimuth(i)));
        }
        if next {
            segment.push(azimuth(i + 1));
        } else if here {
            segment.push(end(azimuth(i), azimuth(i + 1)));
            segments.push(core::mem::take(&mut segment));
        }
    }
    segments
}
