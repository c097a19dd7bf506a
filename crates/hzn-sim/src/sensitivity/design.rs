//! Camera, body and position of a sensor that does not exist yet.

use core::f64::consts::TAU;

use hzn_core::camera::{self, Camera};
use hzn_core::error::ConfigError;
use hzn_core::frames::UnitVec3;
use hzn_core::pixel::ImagePoint;
use nalgebra::Vector3;

use super::sigmas::Sigmas;

/// Number of steps around the cone to find its visible segments; a segment between two steps is missed.
const STEPS: usize = 16_384;
/// Largest number of points on a visible segment of the limb. On longer segments the points are more than a pixel
/// apart.
const MAX_POINTS: f64 = 20_000.0;

/// A camera above a sphere.
#[derive(Debug, Clone, PartialEq)]
pub struct Design {
    /// The lens and the size of the picture.
    pub camera: camera::Config,
    /// Radius of the body in kilometres, above 0.
    pub radius_km: f64,
    /// Altitude above the body in kilometres; it must be above the limb height.
    pub altitude_km: f64,
    /// 1-sigma of the altitude in kilometres, 0 or more.
    pub altitude_sigma_km: f64,
    /// Height of the visible limb above the surface in kilometres.
    pub limb_height_km: f64,
    /// 1-sigma of the limb height in kilometres, 0 or more.
    pub limb_height_sigma_km: f64,
    /// Angle of the optical axis below the local horizontal in degrees; 90 looks straight down.
    pub depression_deg: f64,
    /// Turn about the optical axis in degrees.
    pub roll_deg: f64,
    /// 1-sigma of an edge point arc_and_azimuth u and arc_and_azimuth v, in pixels.
    pub sigma_px: f64,
    /// Correlation length of the errors arc_and_azimuth the edge in pixels; 0 means white errors.
    pub correlation_px: f64,
}

/// The reason why a design is invalid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DesignError {
    /// The camera is out of its limits.
    #[error(transparent)]
    Camera(#[from] ConfigError),
    /// The camera is not above the limb.
    #[error("the camera at {altitude_km} km is not above the limb at {limb_height_km} km, or the body has no radius")]
    Inside {
        /// Altitude of the camera in kilometres.
        altitude_km: f64,
        /// Height of the limb in kilometres.
        limb_height_km: f64,
    },
}

/// A point of the limb in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LimbSample {
    pub(super) point: ImagePoint<f64>,
    /// Length of limb from the point before, in pixels; `None` at the first point of a segment.
    pub(super) step_px: Option<f64>,
}

impl Design {
    /// Returns the half-angle of the limb's cone in radians: sin α = (R + d)/(R + H).
    ///
    /// # Errors
    /// Fails if the camera is not above the limb.
    pub fn half_angle_rad(&self) -> Result<f64, DesignError> {
        let sin = (self.radius_km + self.limb_height_km) / (self.radius_km + self.altitude_km);
        if self.radius_km > 0.0 && sin > 0.0 && sin < 1.0 {
            Ok(sin.asin())
        } else {
            Err(DesignError::Inside { altitude_km: self.altitude_km, limb_height_km: self.limb_height_km })
        }
    }

    /// Returns the unit direction to the body's centre in the camera frame.
    pub fn axis(&self) -> [f64; 3] {
        let (sd, cd) = self.depression_deg.to_radians().sin_cos();
        let (sr, cr) = self.roll_deg.to_radians().sin_cos();
        [sr * cd, cr * cd, sd]
    }

    /// Returns the angle in degrees from the local horizontal down to the nearest point of the limb.
    ///
    /// # Errors
    /// Fails like [`Self::half_angle_rad`].
    pub fn dip_deg(&self) -> Result<f64, DesignError> {
        Ok(90.0 - self.half_angle_rad()?.to_degrees())
    }

    /// Returns the sigmas of this design; `None` if the limb in view is too short for a direction, or if there is none.
    ///
    /// # Errors
    /// Fails if the camera is invalid or not above the limb.
    pub fn sigmas(&self) -> Result<Option<Sigmas>, DesignError> {
        let half_angle_rad = self.half_angle_rad()?;
        let camera = Camera::try_new(&self.camera)?;
        let samples = self.sample_limb(&camera, half_angle_rad);
        Ok(Sigmas::new(self, &camera, half_angle_rad, &samples))
    }

    /// Returns the limb in view as points one pixel apart.
    pub(super) fn sample_limb(&self, camera: &Camera<f64>, half_angle_rad: f64) -> Vec<LimbSample> {
        let e = Vector3::from(self.axis());
        let b1 = e.cross(&Vector3::ith(e.iamin(), 1.0)).normalize();
        let b2 = e.cross(&b1);
        let (sin, cos) = half_angle_rad.sin_cos();
        let (w, h) = (f64::from(camera.width()), f64::from(camera.height()));
        let project = |azimuth: f64| {
            let (s, c) = azimuth.sin_cos();
            let p = camera.project(&UnitVec3::try_new((e * cos + (b1 * c + b2 * s) * sin).into())?)?;
            (p.u >= -0.5 && p.v >= -0.5 && p.u <= w - 0.5 && p.v <= h - 0.5).then_some(p)
        };
        let mut samples = Vec::new();
        for azimuths in visible_segments(&project) {
            let points: Vec<(f64, ImagePoint<f64>)> = azimuths.iter().filter_map(|&a| Some((a, project(a)?))).collect();
            // Each entry has (arc length, azimuth) arc_and_azimuth the segment.
            let mut arc = 0.0;
            let mut arc_and_azimuth = Vec::with_capacity(points.len());
            for (i, (azimuth, p)) in points.iter().enumerate() {
                if let Some((_, before)) = i.checked_sub(1).and_then(|j| points.get(j)) {
                    arc += (p.u - before.u).hypot(p.v - before.v);
                }
                arc_and_azimuth.push((arc, *azimuth));
            }
            let count = arc.round().clamp(1.0, MAX_POINTS);
            let spacing = arc / count;
            let mut pairs = arc_and_azimuth.windows(2);
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
