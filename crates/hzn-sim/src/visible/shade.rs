//! The light along one ray: ground, clouds and air.

use std::sync::Arc;

use hzn_core::camera::Camera;
use hzn_core::pixel::ImagePoint;
use nalgebra::Vector3;

use super::Visible;
use super::air::PreparedAir;
use super::ground::Soil;
use crate::globe::{Globe, RayHit, View};
use crate::pose::Pose;
use crate::texture::{CellCache, CloudField};

/// Step in pixels along a row between the rays that the lens computes. Between them rays are interpolated, accurate to
/// a hundredth of a pixel.
const STRIDE: usize = 8;
/// Largest tangent height range of a pixel, in metres, that needs only one ray. A larger range is averaged over several
/// rays.
const MAX_PIXEL_RANGE_M: f64 = 2500.0;
/// Height of the cloud tops above the ground for the sunlight on them, metres.
const CLOUD_TOP_M: f32 = 6000.0;
/// Light of the whole sky on the ground as a fraction of the Sun's light, by channel.
const SKYLIGHT: [f32; 3] = [0.03, 0.05, 0.09];

/// Texture values that were drawn for the ray before.
#[derive(Debug, Default)]
struct TextureCache {
    clouds: CellCache,
    soil: [CellCache; 2],
}

/// Colour and light of the rays of one camera.
#[derive(Debug, Clone)]
pub(crate) struct Shader {
    camera: Camera<f64>,
    pub(crate) globe: Globe,
    pub(crate) view: View,
    pub(crate) air: PreparedAir,
    soil: Soil,
    clouds: Option<Arc<CloudField>>,
    /// Direction to the Sun in ECEF.
    pub(crate) sun: Vector3<f64>,
    /// Direction to the Sun in the camera frame.
    sun_cam: Vector3<f64>,
    pixel_rad: f64,
    radius_km: f32,
    /// Number of rays along each side of a pixel close to the limb.
    samples: u32,
    /// Largest absolute [`RayHit::miss`] that counts as close to the limb.
    near: f64,
}

impl Shader {
    /// Returns `None` if the position is not outside the globe.
    pub(crate) fn try_new(
        world: &Visible,
        camera: Camera<f64>,
        globe: Globe,
        pose: &Pose,
        sun: Vector3<f64>,
    ) -> Option<Self> {
        let view = View::try_new(globe, pose)?;
        let (fx, fy) = camera.focal_px();
        let pixel_rad = 1.0 / fx.min(fy);
        let air = PreparedAir::new(&world.air, globe.a_m);
        let away_m = Vector3::from(pose.position_m).norm();
        let limb_m = (away_m * away_m - globe.b_m * globe.b_m).max(0.0).sqrt();
        let pixel_m = limb_m * pixel_rad;
        Some(Self {
            samples: (pixel_m / MAX_PIXEL_RANGE_M).ceil().clamp(1.0, 6.0) as u32,
            near: 2.0 * (air.top_m + 3.0 * pixel_m) / globe.b_m,
            soil: Soil::new(&world.ground, globe.a_m),
            clouds: (!world.clear).then(|| Arc::new(CloudField::new(&world.clouds, globe.a_m))),
            sun_cam: view.to_camera(sun).map_or(Vector3::z(), |s| s.xyz().into()),
            radius_km: (globe.a_m / 1e3) as f32,
            camera,
            globe,
            view,
            air,
            sun,
            pixel_rad,
        })
    }

    /// Returns the same shader for another pose.
    pub(crate) fn with_pose(&self, pose: &Pose) -> Self {
        let view = View::try_new(self.globe, pose).unwrap_or_else(|| self.view.clone());
        let sun_cam = view.to_camera(self.sun).map_or(Vector3::z(), |s| s.xyz().into());
        Self { view, sun_cam, ..self.clone() }
    }

    /// Adds `weight` times the light of one row of pixels.
    pub(crate) fn render_row(&self, v: f64, weight: f32, row: &mut [[f32; 3]]) {
        let ray = |u: f64| self.camera.ray(ImagePoint { u, v }).map(|r| Vector3::from(r.direction().xyz()));
        let mut next = ray(0.0);
        let cache = &mut TextureCache::default();
        for (block, pixels) in row.chunks_mut(STRIDE).enumerate() {
            let start = (block * STRIDE) as f64;
            let (first, last) = (next, ray(start + STRIDE as f64));
            next = last;
            for (i, p) in pixels.iter_mut().enumerate() {
                let s = match (first, last) {
                    (Some(a), Some(b)) => Some(a + (b - a) * (i as f64 / STRIDE as f64)),
                    _ => ray(start + i as f64),
                };
                let Some(s) = s else { continue };
                let hit = self.view.intersect(s.into());
                let light = if self.samples > 1 && hit.miss.abs() < self.near {
                    self.average_light(start + i as f64, v, cache)
                } else {
                    self.colour(&s, &hit, cache)
                };
                for c in 0..3 {
                    p[c] += weight * light[c];
                }
            }
        }
    }

    /// Returns the mean light over a pixel.
    fn average_light(&self, u: f64, v: f64, cache: &mut TextureCache) -> [f32; 3] {
        let mut sum = [0.0; 3];
        let n = self.samples;
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let [du, dv] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(n) - 0.5);
            let Some(ray) = self.camera.ray(ImagePoint { u: u + du, v: v + dv }) else { continue };
            let s = Vector3::from(ray.direction().xyz());
            let light = self.colour(&s, &self.view.intersect(s.into()), cache);
            for c in 0..3 {
                sum[c] += light[c];
            }
        }
        sum.map(|x| x / (n * n) as f32)
    }

    /// Returns the light along one ray.
    #[inline]
    fn colour(&self, s: &Vector3<f64>, hit: &RayHit, cache: &mut TextureCache) -> [f32; 3] {
        let air = &self.air;
        let cos = s.dot(&self.sun_cam) as f32;
        let phase = 0.75 * (1.0 + cos * cos);
        if hit.miss > 0.0 {
            let height_m = self.view.tangent_height_m(hit);
            if height_m > air.top_m {
                return [0.0; 3];
            }
            let mu0 = self.view.normal(&self.view.point(hit)).dot(&self.sun) as f32;
            let (depth, density_ratio) = (air.limb_depth(height_m as f32), air.density_ratio(height_m as f32));
            return air.glow(depth, PreparedAir::transmission(depth), density_ratio, air.sun_path(mu0), phase);
        }
        let point = self.view.point(hit);
        let normal = self.view.normal(&point);
        let mu0 = normal.dot(&self.sun) as f32;
        let (range_m, mu) = self.view.range_m_and_incidence(hit, &point);
        let sun_path = air.sun_path(mu0);
        let depth = air.ground_depth(mu as f32);
        let transmission = PreparedAir::transmission(depth);
        let glow = air.glow(depth, transmission, 1.0, sun_path, phase);
        // In deep night, or under air that hides the ground, only the air is visible.
        if mu0 < -0.15 || depth[0] > 5.0 {
            return glow;
        }
        let footprint_km = ((range_m * 1e-3 * self.pixel_rad / mu.max(0.02)) as f32).min(self.radius_km);
        let sunlight = air.sunlight(sun_path, 1.0);
        let day = ((mu0 + 0.1) * 3.0).clamp(0.0, 1.0);
        let cloud = self.clouds.as_ref().and_then(|c| c.sample(&point, footprint_km, &mut cache.clouds));
        let (cover, bright) = cloud.unwrap_or((0.0, 0.0));
        let mut light = [0.0f32; 3];
        if cover < 0.99 {
            let (colour, sea) = self.soil.sample(&point, &normal, footprint_km, &mut cache.soil);
            let glint = if sea > 0.0 && mu0 > 0.0 { sea * self.glint(s, &normal, mu as f32) } else { 0.0 };
            for c in 0..3 {
                let sky = SKYLIGHT[c] * day;
                light[c] = (1.0 - cover) * (colour[c] * (sunlight[c] * mu0.max(0.0) + sky) + glint * sunlight[c]);
            }
        }
        if cover > 0.0 {
            let above = air.sunlight(sun_path, air.density_ratio(CLOUD_TOP_M));
            // A cloud is not a flat sheet: a low Sun lights its sides.
            let lit = ((mu0 + 0.08) / 1.08).max(0.0);
            for c in 0..3 {
                light[c] += cover * bright * (above[c] * lit + SKYLIGHT[c] * day);
            }
        }
        core::array::from_fn(|c| glow[c] + light[c] * transmission[c])
    }

    /// Returns the reflection of the Sun in a rough sea.
    fn glint(&self, s: &Vector3<f64>, normal: &Vector3<f64>, mu: f32) -> f32 {
        let Some(normal) = self.view.to_camera(*normal) else { return 0.0 };
        let half = (self.sun_cam - s).normalize();
        let cos = Vector3::from(normal.xyz()).dot(&half).max(0.0) as f32;
        if cos < 0.9 {
            return 0.0;
        }
        let grazing = (1.0 - mu).powi(5);
        (0.02 + 0.98 * grazing).min(0.5) * 12.0 * libm::powf(cos, 250.0)
    }

    /// Returns the share of light from a distant source that passes the air along the ray `s`, by channel; 0 behind the
    /// globe.
    pub(crate) fn transmission(&self, s: &Vector3<f64>) -> [f32; 3] {
        let hit = self.view.intersect((*s).into());
        if hit.miss <= 0.0 {
            return [0.0; 3];
        }
        let height_m = self.view.tangent_height_m(&hit);
        if height_m > self.air.top_m || s.dot(&self.down_cam()) <= 0.0 {
            return [1.0; 3];
        }
        PreparedAir::transmission(self.air.limb_depth(height_m as f32))
    }

    /// Returns a direction that points roughly downward, in the camera frame.
    fn down_cam(&self) -> Vector3<f64> {
        self.view.to_camera(-self.view.up()).map_or(Vector3::z(), |d| d.xyz().into())
    }

    pub(crate) fn camera(&self) -> &Camera<f64> {
        &self.camera
    }
}
