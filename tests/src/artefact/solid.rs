//! Objects in space in front of the camera. Their straight edges are great circles for the lens.

use hzn_core::camera::{self, Camera};
use hzn_core::pixel::ImagePoint;
use hzn_sim::detector::Plane;
use hzn_sim::error::SceneError;

use super::shape::{Shape, Spot};

/// An object drawn for a pinhole camera with the lens's focal length and principal point.
pub(super) trait Solid: Send + Sync {
    /// Returns the spot at a point of the pinhole picture. `scale` is the number of its pixels per pixel of the lens.
    fn sample(&self, x: f32, y: f32, scale: f32) -> Spot;
}

/// An object as a lens shows it.
#[derive(Debug, Clone)]
pub(super) struct ProjectedSolid<S> {
    solid: S,
    lens: Camera<f64>,
    focal: [f64; 2],
    centre: [f64; 2],
}

/// Step in pixels along a row between the rays that the lens computes. Between them rays are interpolated, accurate to
/// a twentieth of a pixel.
const STRIDE: usize = 8;
/// Smallest cosine of the angle off the axis. Directions farther off the axis count as this angle, because a pinhole
/// sees no farther.
const MIN_COS: f64 = 0.03;

impl<S: Solid> ProjectedSolid<S> {
    pub(super) fn try_new(solid: S, config: &camera::Config) -> Result<Self, SceneError> {
        let lens = Camera::try_new(config)?;
        let (focal, centre) = ([config.fx_px, config.fy_px], [config.cx_px, config.cy_px]);
        Ok(Self { solid, lens, focal, centre })
    }

    fn ray(&self, u: f64, v: f64) -> Option<[f64; 3]> {
        self.lens.unproject(ImagePoint { u, v }).map(|s| s.xyz())
    }

    /// Returns the spot along a ray that is seen at the point (u, v) of the picture.
    fn sample_ray(&self, [sx, sy, sz]: [f64; 3], u: f64, v: f64) -> Spot {
        let z = sz.max(MIN_COS);
        let (x, y) = (self.focal[0] * sx / z, self.focal[1] * sy / z);
        let radius_px = libm::hypot(u - self.centre[0], v - self.centre[1]);
        let scale = if radius_px > 1.0 { libm::hypot(x, y) / radius_px } else { 1.0 };
        self.solid.sample((x + self.centre[0]) as f32, (y + self.centre[1]) as f32, scale as f32)
    }
}

impl<S: Solid> Shape for ProjectedSolid<S> {
    fn sample(&self, x: f32, y: f32) -> Spot {
        let (u, v) = (f64::from(x), f64::from(y));
        self.ray(u, v).map_or(Spot::default(), |s| self.sample_ray(s, u, v))
    }

    fn paint(&self, plane: &mut Plane) {
        let width = plane.width;
        for (y, row) in plane.data.chunks_mut(width).enumerate() {
            let v = y as f64;
            let mut next = self.ray(0.0, v);
            for (block, pixels) in row.chunks_mut(STRIDE).enumerate() {
                let start = block * STRIDE;
                let (first, last) = (next, self.ray((start + STRIDE) as f64, v));
                next = last;
                for (i, pixel) in pixels.iter_mut().enumerate() {
                    let u = (start + i) as f64;
                    let part = i as f64 / STRIDE as f64;
                    let ray = match (first, last) {
                        (Some(a), Some(b)) => Some([0, 1, 2].map(|k| a[k] + (b[k] - a[k]) * part)),
                        _ => self.ray(u, v),
                    };
                    let spot = ray.map_or(Spot::default(), |s| self.sample_ray(s, u, v));
                    *pixel = *pixel * (1.0 - spot.cover) + spot.light;
                }
            }
        }
    }
}
