//! The plain world: a body with clouds and a bright band, lit or not, in front of a sky with stars.
//!
//! Each pixel follows one ray. If the limb passes through the pixel or close to it, the brightness is averaged over the
//! pixel, with a linear tangent height across it. For a sharp limb the body's share of the pixel is exact.

mod edge;
mod light;

use hzn_core::camera::Camera;
use hzn_core::frames::{Cam, UnitVec3};
use hzn_core::pixel::ImagePoint;
use nalgebra::Vector3;

use crate::counter::{Counter, Stream};
use crate::error::SceneError;
use crate::globe::{Globe, RayHit, View};
use crate::height::LimbHeight;
use crate::image_circle::lens_without_circle;
use crate::pose::Pose;
use crate::scene::{Band, Profile, Scene, Sky, World};
use crate::texture::{CellCache, CloudField, smoothstep};
use crate::visible::air::PreparedAir;

pub(crate) use edge::half_plane_share;

use edge::Edge;
use light::PreparedLight;

/// Distance from the limb in pixels within which pixels are averaged.
const NEAR_PX: f64 = 3.0;
/// Step in pixels along a row between the rays that the lens computes, away from the limb.
const STRIDE: usize = 8;

/// A scene, prepared for rendering pixel by pixel.
#[derive(Debug, Clone)]
pub(crate) struct Painter {
    /// The lens, also beyond its image circle if possible.
    camera: Camera<f64>,
    globe: Globe,
    view: View,
    edge: Edge,
    light: PreparedLight,
    /// The air of a visible world. Its limb still shines beyond the terminator.
    air: Option<PreparedAir>,
    surface: f32,
    clouds: Option<CloudField>,
    band: Option<Band>,
    sky: f32,
    /// Larger of the two angles that a pixel in the middle covers, radians.
    pixel_rad: f64,
    height: LimbHeight,
    /// Largest absolute [`RayHit::miss`] of pixels that may have the limb within [`NEAR_PX`].
    near: f64,
    radius_km: f32,
}

impl Painter {
    pub(crate) fn try_new(scene: &Scene) -> Result<Self, SceneError> {
        let camera = lens_without_circle(&scene.camera)?;
        let height = LimbHeight::new(scene);
        let globe = Globe::new(&scene.body).raised(height.reference_m);
        let view = View::try_new(globe, &scene.pose).ok_or(SceneError::Pose)?;
        let (fx, fy) = camera.focal_px();
        let pixel_rad = 1.0 / fx.min(fy);
        let reach_px = match scene.profile {
            Profile::Sharp => NEAR_PX,
            // A steep profile has all its light within a few pixels, and all of them need averaging.
            Profile::Exponential { .. } => 2.0 * NEAR_PX,
        };
        Ok(Self {
            // Off the axis a pixel can cover a larger angle than in the middle.
            near: 2.0 * reach_px * pixel_rad * view.miss_per_rad()
                // To first order, the miss is twice the height in units of the radius.
                + 2.2 * height.largest_departure_m() / globe.b_m,
            edge: Edge::new(scene.profile),
            light: PreparedLight::try_new(scene, globe)?,
            air: match &scene.world {
                World::Visible(world) => Some(PreparedAir::new(&world.air, globe.a_m)),
                World::Plain | World::Infrared(_) | World::Ellipsoid(_) => None,
            },
            surface: scene.disc.surface as f32,
            clouds: scene.disc.clouds.map(|c| CloudField::new(&c, globe.a_m)),
            band: scene.disc.band,
            sky: scene.sky.brightness as f32,
            pixel_rad,
            radius_km: (globe.a_m / 1e3) as f32,
            camera,
            globe,
            view,
            height,
        })
    }

    /// Converts a unit direction from ECEF to the camera frame.
    pub(crate) fn to_camera(&self, ecef: [f64; 3]) -> Option<UnitVec3<Cam, f64>> {
        self.view.to_camera(ecef.into())
    }

    /// Returns the limb height in metres at the latitude where this ray (ECEF, unit) meets or passes the body.
    pub(crate) fn limb_height_m(&self, ecef: [f64; 3]) -> f64 {
        let lat = |cam: UnitVec3<Cam, f64>| self.latitude_rad(&self.view.intersect(cam.xyz()));
        self.height.height_m(self.to_camera(ecef).map_or(0.0, lat))
    }

    /// Returns the share of light that falls where this ray meets or passes the body, 0 to 1.
    pub(crate) fn lit_share(&self, ray: &UnitVec3<Cam, f64>) -> f32 {
        let hit = self.view.intersect(ray.xyz());
        let point = self.view.point(&hit);
        match (&self.air, &self.light) {
            (Some(air), PreparedLight::Sun { direction, .. }) => {
                let mu0 = self.view.normal(&point).dot(direction) as f32;
                air.sunlight(air.sun_path(mu0), air.density_ratio(self.height.reference_m as f32))[1]
            }
            _ => self.light.share(&self.view, &hit, &point),
        }
    }

    /// Returns the same scene from another pose.
    pub(crate) fn with_pose(&self, pose: &Pose) -> Self {
        let view = View::try_new(self.globe, pose).unwrap_or_else(|| self.view.clone());
        Self { view, ..self.clone() }
    }

    /// Renders one row of pixels.
    ///
    /// Away from the limb, rays are interpolated between every [`STRIDE`]th one. They are accurate to a hundredth of a
    /// pixel, which is enough for clouds. Close to the limb every pixel has an exact ray.
    pub(crate) fn render_row(&self, v: f64, row: &mut [f32]) {
        let ray = |x: usize| self.camera.ray(ImagePoint { u: x as f64, v }).map(|r| Vector3::from(r.direction().xyz()));
        let mut next = ray(0);
        let cache = &mut CellCache::default();
        for (block, pixels) in row.chunks_mut(STRIDE).enumerate() {
            let start = block * STRIDE;
            let (first, last) = (next, ray(start + STRIDE));
            next = last;
            for (i, p) in pixels.iter_mut().enumerate() {
                *p = match (first, last) {
                    (Some(a), Some(b)) => {
                        self.render_interpolated((a + (b - a) * (i as f64 / STRIDE as f64)).into(), start + i, v, cache)
                    }
                    _ => self.render_exact(start + i, v, cache),
                };
            }
        }
    }

    /// Renders a pixel whose ray is approximately `s`.
    #[inline(always)]
    fn render_interpolated(&self, s: [f64; 3], x: usize, v: f64, cache: &mut CellCache) -> f32 {
        let hit = self.view.intersect(s);
        if hit.miss.abs() <= self.near {
            return self.render_exact(x, v, cache);
        }
        let cover = if hit.miss <= 0.0 { 1.0 } else { self.edge.share(self.height_above_limb_m(&hit)) };
        self.blend(cover, &hit, cache)
    }

    /// Renders a pixel with its exact ray, averaged over the pixel's area.
    fn render_exact(&self, x: usize, v: f64, cache: &mut CellCache) -> f32 {
        // Pixels that the lens does not see are sky, so that no dark rim is blurred inward.
        let Some(ray) = self.camera.ray(ImagePoint { u: x as f64, v }) else { return self.sky };
        let hit = self.view.intersect(ray.direction().xyz());
        let gradient = self.view.tangent_height_gradient(&hit, &ray.jacobian());
        self.blend(self.edge.mean_share(self.height_above_limb_m(&hit), gradient), &hit, cache)
    }

    /// Returns the tangent height of a ray above the limb height at its latitude, metres.
    #[inline(always)]
    fn height_above_limb_m(&self, hit: &RayHit) -> f64 {
        let above_reference = self.view.tangent_height_m(hit);
        if !self.height.is_variable() {
            return above_reference;
        }
        above_reference + self.height.reference_m - self.height.height_m(self.latitude_rad(hit))
    }

    /// Returns the geodetic latitude of the point that a ray meets or passes, radians.
    fn latitude_rad(&self, hit: &RayHit) -> f64 {
        libm::asin(self.view.normal(&self.view.point(hit)).z.clamp(-1.0, 1.0))
    }

    /// Blends sky and body; the body has the weight `cover`.
    #[inline(always)]
    fn blend(&self, cover: f32, hit: &RayHit, cache: &mut CellCache) -> f32 {
        if cover <= 1e-4 {
            return self.sky;
        }
        self.sky + cover * (self.body_brightness(hit, cache) - self.sky)
    }

    /// Returns the brightness of the body where the ray meets or passes it.
    fn body_brightness(&self, hit: &RayHit, cache: &mut CellCache) -> f32 {
        let point = self.view.point(hit);
        let lit = self.light.share(&self.view, hit, &point);
        if lit <= 0.0 {
            return self.sky;
        }
        let air = self.band.map_or(0.0, |b| {
            let depth_km = (-self.height_above_limb_m(hit) * 1e-3).max(0.0);
            let fade = ((b.depth_km - depth_km) / b.fade_km.max(1e-6) + 0.5).clamp(0.0, 1.0);
            smoothstep(fade as f32)
        });
        let ground = match &self.clouds {
            Some(clouds) if air < 1.0 => {
                let (range_m, cos) = self.view.range_m_and_incidence(hit, &point);
                let footprint_km = (range_m * 1e-3 * self.pixel_rad / cos.max(1e-3)) as f32;
                clouds.blend_over(self.surface, &point, footprint_km.min(self.radius_km), cache)
            }
            _ => self.surface,
        };
        let bright = self.band.map_or(ground, |b| ground + air * (b.brightness as f32 - ground));
        self.sky + lit * (bright - self.sky)
    }

    /// Adds the stars that are in the picture and not behind the body, each spread over four pixels.
    pub(crate) fn draw_stars(&self, sky: &Sky, width: usize, data: &mut [f32]) {
        let draws = Counter::new(sky.seed, Stream::Stars);
        for i in 0..u64::from(sky.stars) {
            let [a, b, c] = [3 * i, 3 * i + 1, 3 * i + 2].map(|j| draws.uniform(j));
            let z = 2.0 * a - 1.0;
            let (sin, cos) = libm::sincos(core::f64::consts::TAU * b);
            let r = (1.0 - z * z).sqrt();
            let Some(cam) = self.view.to_camera(Vector3::new(r * cos, r * sin, z)) else { continue };
            let Some(p) = self.camera.project(&cam) else { continue };
            let visible = 1.0 - self.edge.share(self.height_above_limb_m(&self.view.intersect(cam.xyz())));
            // The stars are evenly distributed over five magnitudes.
            let light = sky.star_brightness as f32 * libm::exp(-4.6 * c) as f32 * visible;
            let (x, y) = (p.u.floor(), p.v.floor());
            let (fx, fy) = ((p.u - x) as f32, (p.v - y) as f32);
            for (dx, dy, weight) in [
                (0.0, 0.0, (1.0 - fx) * (1.0 - fy)),
                (1.0, 0.0, fx * (1.0 - fy)),
                (0.0, 1.0, (1.0 - fx) * fy),
                (1.0, 1.0, fx * fy),
            ] {
                let (x, y) = (x + dx, y + dy);
                let inside = x >= 0.0 && y >= 0.0 && x < width as f64;
                let index = if inside { y as usize * width + x as usize } else { usize::MAX };
                if let Some(pixel) = data.get_mut(index) {
                    *pixel += light * weight;
                }
            }
        }
    }
}
