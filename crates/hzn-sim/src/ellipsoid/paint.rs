//! The painter of an ellipsoid in sunlight.
//!
//! A pixel far from every edge is one ray. A pixel at the limb or at the edge of a ring is the mean of rays through the
//! middles of equal cells. In each cell at the limb, the body's share is exact for a limb that is straight there.

use hzn_core::camera::Camera;
use hzn_core::pixel::ImagePoint;
use nalgebra::Vector3;

use super::body::Ellipsoid;
use super::haze::Haze;
use super::ring::{self, Ring, RingHit};
use super::surface::PreparedSurface;
use crate::globe::{RayHit, View};
use crate::painter::half_plane_share;
use crate::pose::Pose;
use crate::texture::CellCache;
use crate::visible::air::PreparedAir;

/// Number of cells along each side of a pixel at an edge. The limb of a disc of 8 px bends by 0.002 px within a cell.
const CELLS: i32 = 4;
/// Distance from the limb in pixels within which pixels are averaged.
const NEAR_PX: f64 = 1.5;

/// An ellipsoid from one pose, prepared for rendering.
#[derive(Debug, Clone)]
pub(crate) struct EllipsoidPainter {
    camera: Camera<f64>,
    semi_axes_m: [f64; 3],
    view: View,
    /// Position of the camera, metres.
    position_m: Vector3<f64>,
    sun: Vector3<f64>,
    surface: PreparedSurface,
    haze: Option<(Haze, PreparedAir)>,
    rings: Vec<Ring>,
    background: f32,
    /// Larger of the two angles that a pixel in the middle covers, radians.
    pixel_rad: f64,
}

/// Textures look up the random values of the last point.
type Caches = [CellCache; 2];

impl EllipsoidPainter {
    /// Returns `None` if the position is not outside the surface. `sun` is the unit direction to the Sun.
    pub(crate) fn try_new(body: &Ellipsoid, camera: Camera<f64>, pose: &Pose, sun: Vector3<f64>) -> Option<Self> {
        let semi_axes_m = body.surface_m();
        let radius_m = body.mean_radius_km() * 1e3;
        let (fx, fy) = camera.focal_px();
        Some(Self {
            view: View::from_semi_axes(semi_axes_m, pose)?,
            camera,
            semi_axes_m,
            position_m: pose.position_m.into(),
            sun,
            surface: PreparedSurface::new(&body.surface, radius_m),
            haze: body.haze.map(|haze| (haze, PreparedAir::new(&haze.air(), radius_m))),
            rings: body.rings.clone(),
            background: body.background as f32,
            pixel_rad: 1.0 / fx.min(fy),
        })
    }

    /// Returns the same body from another pose.
    pub(crate) fn with_pose(&self, pose: &Pose) -> Self {
        let view = View::from_semi_axes(self.semi_axes_m, pose).unwrap_or_else(|| self.view.clone());
        Self { view, position_m: pose.position_m.into(), ..self.clone() }
    }

    /// Adds one row of pixels, times `weight`.
    pub(crate) fn render_row(&self, v: f64, weight: f32, row: &mut [f32]) {
        let caches = &mut Caches::default();
        for (x, pixel) in row.iter_mut().enumerate() {
            *pixel += weight * (self.background + self.pixel(ImagePoint { u: x as f64, v }, caches));
        }
    }

    /// Returns the light of a pixel above the background. The sky is black.
    fn pixel(&self, at: ImagePoint<f64>, caches: &mut Caches) -> f32 {
        let Some(ray) = self.camera.unproject(at) else { return 0.0 };
        let hit = self.view.intersect(ray.xyz());
        let ring = self.ring_hit(&hit);
        // Off the axis a pixel can cover a larger angle than in the middle.
        let near_m = 2.0 * NEAR_PX * self.pixel_rad * self.view.approach_distance_m(&hit);
        let height_m = self.view.tangent_height_m(&hit);
        let top_m = self.haze.map_or(0.0, |(_, air)| air.top_m);
        if ring.is_none() && height_m > near_m.max(top_m) {
            return 0.0;
        }
        if height_m.abs() > near_m && !ring.is_some_and(|r| r.from_edge_m < 2.0 * self.pixel_rad * r.range_m) {
            let share = if hit.miss <= 0.0 { 1.0 } else { 0.0 };
            return self.light(&hit, share, ring, caches);
        }
        let middle = |i: i32| (f64::from(i) + 0.5) / f64::from(CELLS) - 0.5;
        let mut sum = 0.0;
        for (i, j) in (0..CELLS).flat_map(|j| (0..CELLS).map(move |i| (i, j))) {
            sum += self.cell(ImagePoint { u: at.u + middle(i), v: at.v + middle(j) }, caches);
        }
        sum / (CELLS * CELLS) as f32
    }

    /// Returns the light of a cell of a pixel.
    fn cell(&self, at: ImagePoint<f64>, caches: &mut Caches) -> f32 {
        let Some(ray) = self.camera.ray(at) else { return 0.0 };
        let hit = self.view.intersect(ray.direction().xyz());
        let height_m = self.view.tangent_height_m(&hit);
        let gradient = self.view.tangent_height_gradient(&hit, &ray.jacobian());
        let share = half_plane_share(height_m, gradient.map(|g| g / f64::from(CELLS)));
        let slope2 = gradient[0] * gradient[0] + gradient[1] * gradient[1];
        if !(share > 0.0 && share < 1.0 && slope2 > 0.0) {
            return self.light(&hit, share, self.ring_hit(&hit), caches);
        }
        // The middle of a cell on the limb may miss the body. The middle of the part that the body covers does not.
        let inside_m = 0.5 * f64::from(share) * slope2.sqrt() / f64::from(CELLS);
        let [du, dv] = gradient.map(|g| -(height_m + inside_m) * g / slope2);
        let inside = self.camera.unproject(ImagePoint { u: at.u + du, v: at.v + dv });
        let hit = inside.map_or(hit, |ray| self.view.intersect(ray.xyz()));
        self.light(&hit, share, self.ring_hit(&hit), caches)
    }

    fn ring_hit(&self, hit: &RayHit) -> Option<RingHit> {
        if self.rings.is_empty() {
            return None;
        }
        ring::intersect(&self.rings, &self.position_m, &self.view.direction(hit))
    }

    /// Returns the light along a ray. The body covers the share `share` of it.
    fn light(&self, hit: &RayHit, share: f32, ring: Option<RingHit>, caches: &mut Caches) -> f32 {
        let mut light = 0.0;
        let point = self.view.point(hit);
        let (range_m, mu) = self.view.range_m_and_incidence(hit, &point);
        if share > 0.0 {
            let behind = self.body_light(hit, &point, range_m, mu, caches);
            light += share * in_front(ring.filter(|r| r.range_m < range_m), behind);
        }
        if share < 1.0 {
            let passed = ring.is_some_and(|r| r.range_m < range_m);
            let sky = if passed { 0.0 } else { in_front(ring, 0.0) };
            let hazy = self.sky_light(hit, &point, sky);
            light += (1.0 - share) * in_front(ring.filter(|_| passed), hazy);
        }
        light
    }

    /// Returns the light of the surface where the ray meets it, through the haze in front.
    fn body_light(&self, hit: &RayHit, point: &Vector3<f64>, range_m: f64, scaled_mu: f64, caches: &mut Caches) -> f32 {
        let normal = self.view.normal(point);
        let ray = self.view.direction(hit);
        // In scaled space the ray meets the unit sphere at another angle; both are zero at the limb.
        let mu = if scaled_mu > 0.0 { -ray.dot(&normal) } else { 0.0 };
        let mu0 = normal.dot(&self.sun);
        let footprint_km = (range_m * 1e-3 * self.pixel_rad / mu.max(0.05)) as f32;
        let ground = self.surface.brightness(point, [mu0, mu], footprint_km, caches);
        let Some((haze, air)) = &self.haze else { return ground };
        let (sun_path, depth) = (air.sun_path(mu0 as f32), air.ground_depth(mu as f32));
        let through = PreparedAir::transmission(depth);
        let phase = haze.phase(ray.dot(&self.sun));
        ground * air.sunlight(sun_path, 1.0)[0] * through[0] + air.glow(depth, through, 1.0, sun_path, phase)[0]
    }

    /// Returns the light of the sky through the haze above the limb. `sky` is the light without haze.
    fn sky_light(&self, hit: &RayHit, point: &Vector3<f64>, sky: f32) -> f32 {
        let Some((haze, air)) = &self.haze else { return sky };
        let height_m = self.view.tangent_height_m(hit).max(0.0);
        if height_m > air.top_m {
            return sky;
        }
        let mu0 = self.view.normal(point).dot(&self.sun) as f32;
        let depth = air.limb_depth(height_m as f32);
        let through = PreparedAir::transmission(depth);
        let phase = haze.phase(self.view.direction(hit).dot(&self.sun));
        let density = air.density_ratio(height_m as f32);
        sky * through[0] + air.glow(depth, through, density, air.sun_path(mu0), phase)[0]
    }
}

/// Returns the light from behind a ring, with the light of the ring.
fn in_front(ring: Option<RingHit>, behind: f32) -> f32 {
    ring.map_or(behind, |ring| ring.light + (1.0 - ring.opacity) * behind)
}
