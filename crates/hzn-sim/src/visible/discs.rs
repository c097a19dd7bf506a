//! Sun, Moon and stars behind the air, and the stray light of the Sun in the lens.

use hzn_core::body::{AU_KM, MOON_RADIUS_KM, SUN_RADIUS_KM};
use hzn_core::frames::UnitVec3;
use hzn_core::pixel::ImagePoint;
use nalgebra::Vector3;
use rayon::prelude::*;

use super::Visible;
use super::shade::Shader;
use crate::counter::{Counter, Stream};
use crate::optics::{GHOSTS, Optics};
use crate::texture::{CellCache, Relief, smoothstep};

/// Number of rays along each side of a pixel of a disc.
const SAMPLES: i32 = 4;
/// Brightness of the Sun's disc. The real Sun is 46 000 times as bright as white paper in its light, but a larger value
/// would only saturate. The bloom describes the light that the optics spread.
const SUN: f32 = 20.0;
/// Reflectance of the Moon's bright and dark ground.
const MOON: [f32; 2] = [0.16, 0.08];

/// An unfinished picture: pixels with three channels.
pub(crate) struct Canvas<'a> {
    pub(crate) width: usize,
    pub(crate) pixels: &'a mut [[f32; 3]],
}

impl Canvas<'_> {
    fn add(&mut self, x: i64, y: i64, light: [f32; 3]) {
        if x >= 0
            && y >= 0
            && (x as usize) < self.width
            && let Some(pixel) = self.pixels.get_mut(y as usize * self.width + x as usize)
        {
            for c in 0..3 {
                pixel[c] += light[c];
            }
        }
    }
}

/// A disc in the sky.
struct Disc {
    centre: Vector3<f64>,
    half_angle: f64,
}

impl Disc {
    /// Returns two unit vectors perpendicular to the centre and to each other.
    fn perpendicular(&self) -> [Vector3<f64>; 2] {
        let helper = if self.centre.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
        let a = self.centre.cross(&helper).normalize();
        [a, self.centre.cross(&a)]
    }
}

impl Shader {
    /// Returns the Sun's position in the plane of the picture, inside the picture or not; `None` if the lens does not
    /// reach it.
    pub(crate) fn sun_point(&self) -> Option<ImagePoint<f64>> {
        self.camera().project(&self.view.to_camera(self.sun)?)
    }

    /// Returns the share of the Sun's light that passes the Earth and its air, by channel.
    pub(crate) fn sun_transmission(&self) -> [f32; 3] {
        let Some(centre) = self.view.to_camera(self.sun) else { return [0.0; 3] };
        let disc = Disc { centre: centre.xyz().into(), half_angle: SUN_RADIUS_KM / AU_KM };
        let [a, b] = disc.perpendicular();
        let mut sum = [0.0f32; 3];
        for i in 0..16 {
            let r = disc.half_angle * ((f64::from(i) + 0.5) / 16.0).sqrt();
            let (sin, cos) = libm::sincos(2.399_963 * f64::from(i));
            let transmission = self.transmission(&(disc.centre + (a * cos + b * sin) * r).normalize());
            for c in 0..3 {
                sum[c] += transmission[c] / 16.0;
            }
        }
        sum
    }

    /// Adds the Sun's disc, which is darker towards its limb.
    pub(crate) fn draw_sun(&self, canvas: &mut Canvas<'_>, weight: f32) {
        let Some(centre) = self.view.to_camera(self.sun) else { return };
        let disc = Disc { centre: centre.xyz().into(), half_angle: SUN_RADIUS_KM / AU_KM };
        self.draw_disc(canvas, weight, &disc, |_, r2| {
            let edge = (1.0 - r2).max(0.0).sqrt() as f32;
            [SUN * (0.4 + 0.6 * edge); 3]
        });
    }

    /// Adds the Moon with its phase. `ecef_m` is its position from the Earth's centre in ECEF, `from_m` the camera's
    /// position.
    pub(crate) fn draw_moon(&self, canvas: &mut Canvas<'_>, weight: f32, ecef_m: [f64; 3], from_m: [f64; 3]) {
        let to = Vector3::from(ecef_m) - Vector3::from(from_m);
        let Some(centre) = self.view.to_camera(to.normalize()) else { return };
        let Some(sun) = self.view.to_camera(self.sun) else { return };
        let disc = Disc { centre: centre.xyz().into(), half_angle: libm::asin(MOON_RADIUS_KM * 1e3 / to.norm()) };
        let sun = Vector3::from(sun.xyz());
        let mut cache = CellCache::default();
        let maria = Relief::new([1500.0, 60.0], 0.6, MOON_RADIUS_KM * 1e3, 5);
        let [a, b] = disc.perpendicular();
        self.draw_disc(canvas, weight, &disc, |[x, y], r2| {
            let depth = (1.0 - r2).max(0.0).sqrt();
            let normal = a * x + b * y - disc.centre * depth;
            let (mu0, mu) = (normal.dot(&sun).max(0.0) as f32, depth as f32);
            let dark = smoothstep((0.5 + 0.4 * maria.sample(&normal, 20.0, &mut cache)).clamp(0.0, 1.0));
            let albedo = MOON[0] + (MOON[1] - MOON[0]) * dark;
            // This is the law of Lommel and Seeliger: a full moon is not darker towards its limb.
            let light = albedo * 2.0 * mu0 / (mu0 + mu + 1e-3);
            [light, light * 0.98, light * 0.94]
        });
    }

    fn draw_disc(
        &self,
        canvas: &mut Canvas<'_>,
        weight: f32,
        disc: &Disc,
        mut light: impl FnMut([f64; 2], f64) -> [f32; 3],
    ) {
        let [a, b] = disc.perpendicular();
        let rim: Vec<ImagePoint<f64>> = (0..16)
            .filter_map(|i| {
                let (sin, cos) = libm::sincos(core::f64::consts::TAU * f64::from(i) / 16.0);
                let ray = disc.centre + (a * cos + b * sin) * (1.1 * libm::tan(disc.half_angle));
                self.camera().project(&UnitVec3::try_new(ray.into())?)
            })
            .collect();
        if rim.is_empty() {
            return;
        }
        let reach = |of: fn(&ImagePoint<f64>) -> f64| {
            let (low, high) =
                rim.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(of(p)), h.max(of(p))));
            (low.floor() as i64 - 1, high.ceil() as i64 + 1)
        };
        let ((x0, x1), (y0, y1)) = (reach(|p| p.u), reach(|p| p.v));
        let (w, h) = (i64::from(self.camera().width()), i64::from(self.camera().height()));
        let sin = libm::sin(disc.half_angle);
        for y in y0.max(0)..=y1.min(h - 1) {
            for x in x0.max(0)..=x1.min(w - 1) {
                let mut sum = [0.0f32; 3];
                for (i, j) in (0..SAMPLES).flat_map(|i| (0..SAMPLES).map(move |j| (i, j))) {
                    let [du, dv] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(SAMPLES) - 0.5);
                    let point = ImagePoint { u: x as f64 + du, v: y as f64 + dv };
                    let Some(s) = self.camera().unproject(point).map(|d| Vector3::from(d.xyz())) else { continue };
                    let (across, behind) = ([s.dot(&a) / sin, s.dot(&b) / sin], s.dot(&disc.centre) <= 0.0);
                    let r2 = across[0] * across[0] + across[1] * across[1];
                    if r2 >= 1.0 || behind {
                        continue;
                    }
                    let (light, transmission) = (light(across, r2), self.transmission(&s));
                    for c in 0..3 {
                        sum[c] += weight * light[c] * transmission[c] / (SAMPLES * SAMPLES) as f32;
                    }
                }
                canvas.add(x, y, sum);
            }
        }
    }

    /// Adds the stars, each spread over four pixels.
    pub(crate) fn draw_stars(&self, canvas: &mut Canvas<'_>, weight: f32, world: &Visible, seed: u64) {
        let draws = Counter::new(seed, Stream::Stars);
        for i in 0..u64::from(world.stars) {
            let [a, b, c] = [3 * i, 3 * i + 1, 3 * i + 2].map(|j| draws.uniform(j));
            let z = 2.0 * a - 1.0;
            let (sin, cos) = libm::sincos(core::f64::consts::TAU * b);
            let r = (1.0 - z * z).sqrt();
            let Some(cam) = self.view.to_camera(Vector3::new(r * cos, r * sin, z)) else { continue };
            let Some(p) = self.camera().project(&cam) else { continue };
            // The stars are evenly distributed over five magnitudes.
            let light = weight * world.star_brightness as f32 * libm::exp(-4.6 * c) as f32;
            let transmission = self.transmission(&cam.xyz().into()).map(|l| l * light);
            let (x, y) = (p.u.floor(), p.v.floor());
            let (fx, fy) = ((p.u - x) as f32, (p.v - y) as f32);
            for (dx, dy, part) in
                [(0, 0, (1.0 - fx) * (1.0 - fy)), (1, 0, fx * (1.0 - fy)), (0, 1, (1.0 - fx) * fy), (1, 1, fx * fy)]
            {
                canvas.add(x as i64 + dx, y as i64 + dy, transmission.map(|l| l * part));
            }
        }
    }

    /// Adds the Sun's stray light in the lens: bloom around the Sun, a veil over the picture, ghosts on the line
    /// through the principal point.
    pub(crate) fn draw_glare(&self, canvas: &mut Canvas<'_>, optics: &Optics, hidden: bool) {
        let Some(direction) = self.view.to_camera(self.sun) else { return };
        let transmission = self.sun_transmission();
        // The light on the lens falls with the Sun's angle off the axis; a Sun behind the camera gives none.
        let on_lens = direction.xyz()[2].max(0.0) as f32;
        if hidden || on_lens <= 0.0 || transmission.iter().all(|&l| l < 1e-4) {
            return;
        }
        let veil = transmission.map(|l| l * on_lens * on_lens * optics.veil as f32);
        let w = canvas.width;
        canvas.pixels.par_iter_mut().for_each(|p| {
            for c in 0..3 {
                p[c] += veil[c];
            }
        });
        let Some(sun) = self.sun_point() else { return };
        let (fx, fy) = self.camera().focal_px();
        let radius_px = (0.5 * (fx + fy) * SUN_RADIUS_KM / AU_KM) as f32;
        let inside = sun.u > -60.0 * f64::from(radius_px)
            && sun.v > -60.0 * f64::from(radius_px)
            && sun.u < w as f64 + 60.0 * f64::from(radius_px)
            && sun.v < (canvas.pixels.len() / w) as f64 + 60.0 * f64::from(radius_px);
        let middle = self.camera().principal_point();
        let diagonal = libm::hypot(w as f64, (canvas.pixels.len() / w) as f64) as f32;
        canvas.pixels.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
            for (x, p) in row.iter_mut().enumerate() {
                let mut light = [0.0f32; 3];
                if inside && optics.bloom > 0.0 {
                    let (dx, dy) = (x as f32 - sun.u as f32, y as f32 - sun.v as f32);
                    let r = (dx * dx + dy * dy).sqrt().max(radius_px) / radius_px;
                    if r < 120.0 {
                        // An aperture with six blades makes six faint spikes.
                        let cos = if r > 1.5 { dx / (r * radius_px) } else { 0.0 };
                        let three = cos * (4.0 * cos * cos - 3.0);
                        let spike = 1.0 + 1.5 * (three * three).powi(24);
                        let fade = (1.0 - r / 120.0) * optics.bloom as f32 * spike / (r * r);
                        light = [fade, fade * 0.96, fade * 0.90];
                    }
                }
                for ghost in &GHOSTS {
                    let (gx, gy) =
                        (middle.u + ghost.along * (sun.u - middle.u), middle.v + ghost.along * (sun.v - middle.v));
                    let r = libm::hypotf(x as f32 - gx as f32, y as f32 - gy as f32) / (ghost.radius * diagonal);
                    if r < 1.1 {
                        let body = 1.0 - smoothstep(((r - 0.85) / 0.25).clamp(0.0, 1.0));
                        let ring = 0.5 + 0.5 * r * r;
                        let strength = optics.ghosts as f32 * ghost.strength * body * ring;
                        for c in 0..3 {
                            light[c] += strength * ghost.colour[c];
                        }
                    }
                }
                for c in 0..3 {
                    p[c] += light[c] * transmission[c];
                }
            }
        });
    }
}
