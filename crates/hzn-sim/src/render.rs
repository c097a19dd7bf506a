//! The picture of a scene.
//!
//! One ray is followed a pixel. Where the limb passes through the pixel or close by, brightness is averaged
//! over the pixel with the tangent height taken as linear across it; a sharp limb's share of the pixel is exact.

use hzn_core::camera::{self, Camera};
use hzn_core::ellipsoid::LimbCone;
use hzn_core::frames::{Cam, UnitVec3};
use hzn_core::pixel::ImagePoint;
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::counter::{Counter, Stream};
use crate::detector::Plane;
use crate::error::SceneError;
use crate::globe::{Globe, Sight, View};
use crate::height::LimbHeight;
use crate::infrared::Warmth;
use crate::motion::Motion;
use crate::optics::Optics;
use crate::picture::Picture;
use crate::pose::Pose;
use crate::scene::{Band, Light, Profile, Scene, Sky, World};
use crate::texture::{CloudField, smoothstep};
use crate::visible::Visible;
use crate::visible::air::Prepared;
use crate::visible::discs::Canvas;
use crate::visible::shade::Shader;

/// Pixels this close to the limb are averaged.
const NEAR_PX: f64 = 3.0;
/// Every how many pixels of a row a ray is asked of the lens, away from the limb.
const STRIDE: usize = 8;
/// Points across a pixel where it is averaged by sampling.
const SAMPLES: i32 = 5;

impl Scene {
    /// The picture.
    ///
    /// # Errors
    /// A camera that [`Camera::try_new`] refuses, or a position that is not outside the body.
    pub fn render(&self) -> Result<Picture, SceneError> {
        let camera = Camera::<f64>::try_new(&self.camera)?;
        let mut light = self.light()?;
        for plane in &mut light {
            self.expose(plane, &camera);
        }
        let blur = |plane: Plane| through_circle(plane.blurred(self.detector.psf_sigma_px), &camera);
        let light: Vec<Plane> = light.into_iter().map(blur).collect();
        Ok(self.detector.expose(&light, self.seed))
    }

    /// Light on every pixel before blur and exposure: one plane, or three for colours.
    fn light(&self) -> Result<Vec<Plane>, SceneError> {
        let (w, h) = (usize::from(self.camera.width), usize::from(self.camera.height));
        let camera = beyond_circle(&self.camera)?;
        let (fx, fy) = camera.focal_px();
        let pixel_rad = 1.0 / fx.min(fy);
        let motion = self.motion.filter(|m| m.matters(pixel_rad));
        let poses = |row: usize| match &motion {
            Some(motion) => motion.poses(&self.pose, row as f64, h, pixel_rad),
            None => vec![self.pose],
        };
        let mut planes = match &self.world {
            World::Plain => {
                let painter = Painter::try_new(self)?;
                let mut data = vec![0.0f32; w * h];
                data.par_chunks_mut(w).enumerate().for_each(|(y, row)| match &motion {
                    None => painter.row(y as f64, row),
                    Some(_) => {
                        let poses = poses(y);
                        let mut one = vec![0.0f32; w];
                        for pose in &poses {
                            painter.turned(pose).row(y as f64, &mut one);
                            row.iter_mut().zip(&one).for_each(|(sum, p)| *sum += p / poses.len() as f32);
                        }
                    }
                });
                painter.draw_stars(&self.sky, w, &mut data);
                vec![Plane { width: w, data }]
            }
            World::Infrared(world) => {
                let globe = Globe::of(&self.body);
                let warmth = Warmth::try_new(world, camera, globe, &self.pose).ok_or(SceneError::Pose)?;
                let mut data = vec![0.0f32; w * h];
                data.par_chunks_mut(w).enumerate().for_each(|(y, row)| match &motion {
                    None => warmth.row(y as f64, 1.0, row),
                    Some(_) => {
                        let poses = poses(y);
                        poses.iter().for_each(|p| warmth.turned(p).row(y as f64, 1.0 / poses.len() as f32, row));
                    }
                });
                vec![Plane { width: w, data }]
            }
            World::Visible(world) => self.visible(world, camera, motion.as_ref())?,
        };
        for plane in &mut planes {
            plane.data.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
                for f in &self.foreground {
                    f.draw_row(y, row);
                }
            });
        }
        if let World::Visible(world) = &self.world
            && world.sun_in_view
        {
            self.glare(world, &mut planes)?;
        }
        // A grey camera sees the mean of the colours; a coloured one of a grey world, three times the same.
        if self.detector.colour {
            while planes.len() < 3 {
                planes.extend(planes.first().cloned());
            }
        } else if let [r, g, b] = planes.as_mut_slice() {
            r.data.iter_mut().zip(&g.data).zip(&b.data).for_each(|((r, g), b)| *r = (*r + g + b) / 3.0);
            planes.truncate(1);
        }
        Ok(planes)
    }

    /// The shader of a visible world from the scene's own pose.
    fn shader(&self, world: &Visible, camera: Camera<f64>) -> Result<Shader, SceneError> {
        let up = Vector3::from(self.pose.position_m);
        let sun = match self.light {
            Light::Sun { direction, .. } => Vector3::from(direction),
            Light::Full | Light::Sector { .. } => up,
        };
        let sun = sun.try_normalize(1e-12).ok_or(SceneError::Sun)?;
        Shader::try_new(world, camera, Globe::of(&self.body), &self.pose, sun).ok_or(SceneError::Pose)
    }

    /// Earth, sky, and what stands in it.
    fn visible(&self, world: &Visible, camera: Camera<f64>, motion: Option<&Motion>) -> Result<Vec<Plane>, SceneError> {
        let (w, h) = (usize::from(self.camera.width), usize::from(self.camera.height));
        let (fx, fy) = camera.focal_px();
        let pixel_rad = 1.0 / fx.min(fy);
        let shader = self.shader(world, camera)?;
        let mut pixels = vec![[0.0f32; 3]; w * h];
        pixels.par_chunks_mut(w).enumerate().for_each(|(y, row)| match motion {
            None => shader.row(y as f64, 1.0, row),
            Some(motion) => {
                let poses = motion.poses(&self.pose, y as f64, h, pixel_rad);
                poses.iter().for_each(|p| shader.turned(p).row(y as f64, 1.0 / poses.len() as f32, row));
            }
        });
        // Points and discs of the sky: from the poses of the middle row.
        let poses =
            motion.map_or_else(|| vec![self.pose], |m| m.poses(&self.pose, 0.5 * (h as f64 - 1.0), h, pixel_rad));
        let weight = 1.0 / poses.len() as f32;
        let mut canvas = Canvas { width: w, pixels: &mut pixels };
        for pose in &poses {
            let shader = shader.turned(pose);
            shader.draw_stars(&mut canvas, weight, world, world.ground.seed);
            if let Some(moon) = self.moon_ecef_m {
                shader.draw_moon(&mut canvas, weight, moon, self.pose.position_m);
            }
            if world.sun_in_view {
                shader.draw_sun(&mut canvas, weight);
            }
        }
        Ok((0..3).map(|c| Plane { width: w, data: pixels.iter().map(|p| p[c]).collect() }).collect())
    }

    /// Stray light of the Sun, which no part of the vehicle hides but one in front of the Sun itself.
    fn glare(&self, world: &Visible, planes: &mut [Plane]) -> Result<(), SceneError> {
        if self.optics == Optics::default() {
            return Ok(());
        }
        let shader = self.shader(world, beyond_circle(&self.camera)?)?;
        let hidden = shader.sun_point().is_some_and(|p| self.foreground.iter().any(|f| f.contains([p.u, p.v])));
        let width = usize::from(self.camera.width);
        let mut pixels = vec![[0.0f32; 3]; width * usize::from(self.camera.height)];
        shader.draw_glare(&mut Canvas { width, pixels: &mut pixels }, &self.optics, hidden);
        for (c, plane) in planes.iter_mut().enumerate() {
            plane.data.iter_mut().zip(&pixels).for_each(|(p, add)| *p += add[c]);
        }
        Ok(())
    }

    /// Fall-off towards the corners, and the exposure.
    fn expose(&self, plane: &mut Plane, camera: &Camera<f64>) {
        let (exposure, lost) = (self.exposure as f32, self.optics.vignetting as f32);
        if exposure == 1.0 && lost == 0.0 {
            return;
        }
        let w = plane.width;
        let (middle, right, bottom) = (camera.principal_point(), w as f64 - 0.5, plane.height() as f64 - 0.5);
        let far2 = [(-0.5, -0.5), (right, -0.5), (-0.5, bottom), (right, bottom)]
            .map(|(x, y)| (x - middle.u) * (x - middle.u) + (y - middle.v) * (y - middle.v))
            .into_iter()
            .fold(1.0, f64::max);
        plane.data.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
            let dy2 = (y as f64 - middle.v) * (y as f64 - middle.v);
            for (x, p) in row.iter_mut().enumerate() {
                let dx = x as f64 - middle.u;
                *p *= exposure * (1.0 - lost * ((dx * dx + dy2) / far2) as f32);
            }
        });
    }
}

/// The lens without its image circle, or with a wider one, as far as it stays monotone: the scene goes on beyond the
/// circle, so that the blur takes light from there, as a stop close to the detector would have it.
fn beyond_circle(config: &camera::Config) -> Result<Camera<f64>, SceneError> {
    let with = |theta_max_deg| Camera::try_new(&camera::Config { theta_max_deg, ..config.clone() });
    let wider = config.theta_max_deg.map(|deg| deg + 3.0);
    with(None).or_else(|_| with(wider)).or_else(|_| with(config.theta_max_deg)).map_err(SceneError::from)
}

/// No light reaches what is beyond the image circle.
fn through_circle(mut light: Plane, camera: &Camera<f64>) -> Plane {
    if let Some((c, a, b)) = camera.image_circle_px() {
        let w = light.width;
        light.data.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
            let dy = (y as f64 - c.v) / b;
            for (x, p) in row.iter_mut().enumerate() {
                let dx = (x as f64 - c.u) / a;
                if dx * dx + dy * dy > 1.0 {
                    *p = 0.0;
                }
            }
        });
    }
    light
}

/// A scene, prepared for asking pixel by pixel.
#[derive(Debug, Clone)]
pub(crate) struct Painter {
    /// The lens, beyond its image circle too where it can be.
    camera: Camera<f64>,
    globe: Globe,
    view: View,
    edge: Edge,
    lamp: Lamp,
    /// The air of a visible world, whose limb goes on to shine beyond the terminator.
    air: Option<Prepared>,
    surface: f32,
    clouds: Option<CloudField>,
    band: Option<Band>,
    sky: f32,
    /// Larger of the two angles a pixel in the middle covers, radians.
    pixel_rad: f64,
    height: LimbHeight,
    /// [`Sight::miss`] of pixels that may have the limb within [`NEAR_PX`].
    near: f64,
    radius_km: f32,
}

impl Painter {
    pub(crate) fn try_new(scene: &Scene) -> Result<Self, SceneError> {
        let camera = beyond_circle(&scene.camera)?;
        let height = LimbHeight::of(scene);
        let globe = Globe::of(&scene.body).raised(height.reference_m);
        let view = View::try_new(globe, &scene.pose).ok_or(SceneError::Pose)?;
        let (fx, fy) = camera.focal_px();
        let pixel_rad = 1.0 / fx.min(fy);
        let reach_px = match scene.profile {
            Profile::Sharp => NEAR_PX,
            // Steep profiles have all their light within a few pixels, and all of them need averaging.
            Profile::Exponential { .. } => 2.0 * NEAR_PX,
        };
        Ok(Self {
            // Off the axis a pixel can cover more than in the middle.
            near: 2.0 * reach_px * pixel_rad * view.miss_per_rad()
                // To first order: twice the height in units of the radius.
                + 2.2 * height.largest_departure_m() / globe.b_m,
            edge: Edge::new(scene.profile),
            lamp: Lamp::try_new(scene, globe)?,
            air: match &scene.world {
                World::Visible(world) => Some(Prepared::new(&world.air, globe.a_m)),
                World::Plain | World::Infrared(_) => None,
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

    /// A direction given in ECEF (unit) as the camera sees it.
    pub(crate) fn to_camera(&self, ecef: [f64; 3]) -> Option<UnitVec3<Cam, f64>> {
        self.view.to_camera(ecef.into())
    }

    /// Height of the limb in metres at the latitude where this ray (ECEF, unit) meets or passes the body.
    pub(crate) fn limb_height_m(&self, ecef: [f64; 3]) -> f64 {
        let lat = |cam: UnitVec3<Cam, f64>| self.latitude_rad(&self.view.look(cam.xyz()));
        self.height.at_m(self.to_camera(ecef).map_or(0.0, lat))
    }

    /// How much light falls where this ray (ECEF, unit) meets or passes the body, 0 to 1.
    pub(crate) fn lit(&self, ecef: [f64; 3]) -> f32 {
        self.to_camera(ecef).map_or(0.0, |cam| {
            let sight = self.view.look(cam.xyz());
            let point = self.view.point(&sight);
            match (&self.air, &self.lamp) {
                (Some(air), Lamp::Sun { direction, .. }) => {
                    let mu0 = self.view.normal(&point).dot(direction) as f32;
                    air.sunlight(air.sun_path(mu0), air.thin(self.height.reference_m as f32))[1]
                }
                _ => self.lamp.at(&self.view, &sight, &point),
            }
        })
    }

    /// The same from another attitude.
    fn turned(&self, pose: &Pose) -> Self {
        let view = View::try_new(self.globe, pose).unwrap_or_else(|| self.view.clone());
        Self { view, ..self.clone() }
    }

    /// One row of pixels.
    ///
    /// Away from the limb a ray interpolated between every [`STRIDE`]th one is good to a hundredth of a pixel, which
    /// no cloud shows; close to it every pixel gets its own.
    fn row(&self, v: f64, row: &mut [f32]) {
        let ray = |x: usize| self.camera.ray(ImagePoint { u: x as f64, v }).map(|r| Vector3::from(r.direction().xyz()));
        let mut next = ray(0);
        for (block, pixels) in row.chunks_mut(STRIDE).enumerate() {
            let start = block * STRIDE;
            let (first, last) = (next, ray(start + STRIDE));
            next = last;
            for (i, p) in pixels.iter_mut().enumerate() {
                *p = match (first, last) {
                    (Some(a), Some(b)) => self.roughly((a + (b - a) * (i as f64 / STRIDE as f64)).into(), start + i, v),
                    _ => self.exactly(start + i, v),
                };
            }
        }
    }

    /// A pixel whose ray is about `s`.
    #[inline(always)]
    fn roughly(&self, s: [f64; 3], x: usize, v: f64) -> f32 {
        let sight = self.view.look(s);
        if sight.miss.abs() <= self.near {
            return self.exactly(x, v);
        }
        let cover = if sight.miss <= 0.0 { 1.0 } else { self.edge.at(self.above_limb_m(&sight)) };
        self.blend(cover, &sight)
    }

    /// A pixel with its own ray, averaged over its area.
    fn exactly(&self, x: usize, v: f64) -> f32 {
        // Where the lens sees nothing is sky, so that no dark rim is blurred inward.
        let Some(ray) = self.camera.ray(ImagePoint { u: x as f64, v }) else { return self.sky };
        let sight = self.view.look(ray.direction().xyz());
        let gradient = self.view.tangent_height_gradient(&sight, &ray.jacobian());
        self.blend(self.edge.mean(self.above_limb_m(&sight), gradient), &sight)
    }

    /// Tangent height of a ray above the limb height at its latitude, metres.
    #[inline(always)]
    fn above_limb_m(&self, sight: &Sight) -> f64 {
        let above_reference = self.view.tangent_height_m(sight);
        if !self.height.varies() {
            return above_reference;
        }
        above_reference + self.height.reference_m - self.height.at_m(self.latitude_rad(sight))
    }

    /// Geodetic latitude of the point that a ray meets or passes, radians.
    fn latitude_rad(&self, sight: &Sight) -> f64 {
        libm::asin(self.view.normal(&self.view.point(sight)).z.clamp(-1.0, 1.0))
    }

    /// Sky and body, the body with weight `cover`.
    #[inline(always)]
    fn blend(&self, cover: f32, sight: &Sight) -> f32 {
        if cover <= 1e-4 {
            return self.sky;
        }
        self.sky + cover * (self.body(sight) - self.sky)
    }

    /// Brightness of the body where the ray meets or passes it.
    fn body(&self, sight: &Sight) -> f32 {
        let point = self.view.point(sight);
        let lit = self.lamp.at(&self.view, sight, &point);
        if lit <= 0.0 {
            return self.sky;
        }
        let air = self.band.map_or(0.0, |b| {
            let depth_km = (-self.above_limb_m(sight) * 1e-3).max(0.0);
            let fade = ((b.depth_km - depth_km) / b.fade_km.max(1e-6) + 0.5).clamp(0.0, 1.0);
            smoothstep(fade as f32)
        });
        let ground = match &self.clouds {
            Some(clouds) if air < 1.0 => {
                let (range_m, cos) = self.view.range_m_and_incidence(sight, &point);
                let footprint_km = (range_m * 1e-3 * self.pixel_rad / cos.max(1e-3)) as f32;
                clouds.over(self.surface, &point, footprint_km.min(self.radius_km))
            }
            _ => self.surface,
        };
        let bright = self.band.map_or(ground, |b| ground + air * (b.brightness as f32 - ground));
        self.sky + lit * (bright - self.sky)
    }

    /// Adds the stars that are neither behind the body nor outside the picture, each spread over four pixels.
    fn draw_stars(&self, sky: &Sky, width: usize, data: &mut [f32]) {
        let draws = Counter::new(sky.seed, Stream::Stars);
        for i in 0..u64::from(sky.stars) {
            let [a, b, c] = [3 * i, 3 * i + 1, 3 * i + 2].map(|j| draws.uniform(j));
            let z = 2.0 * a - 1.0;
            let (sin, cos) = libm::sincos(core::f64::consts::TAU * b);
            let r = (1.0 - z * z).sqrt();
            let Some(cam) = self.view.to_camera(Vector3::new(r * cos, r * sin, z)) else { continue };
            let Some(p) = self.camera.project(&cam) else { continue };
            let seen = 1.0 - self.edge.at(self.above_limb_m(&self.view.look(cam.xyz())));
            // Evenly distributed in magnitude over five magnitudes.
            let light = sky.star_brightness as f32 * libm::exp(-4.6 * c) as f32 * seen;
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

/// The limb's profile, prepared: the body's share of the light by tangent height above the limb height.
#[derive(Debug, Clone, Copy)]
enum Edge {
    Sharp,
    Exponential { per_m: f64, knee_m: f64 },
}

impl Edge {
    fn new(profile: Profile) -> Self {
        match profile {
            Profile::Exponential { scale_km } if scale_km > 0.0 => {
                let scale_m = scale_km * 1e3;
                Self::Exponential { per_m: 1.0 / scale_m, knee_m: -core::f64::consts::LN_2 * scale_m }
            }
            _ => Self::Sharp,
        }
    }

    /// Share at a height in metres above the limb.
    #[inline(always)]
    fn at(&self, height_m: f64) -> f32 {
        match *self {
            Self::Sharp => f32::from(u8::from(height_m <= 0.0)),
            Self::Exponential { per_m, knee_m } => {
                let scales = ((height_m - knee_m) * per_m) as f32;
                // Less than a millionth of the light is none.
                if scales > 14.0 { 0.0 } else { libm::expf(-scales.max(0.0)) }
            }
        }
    }

    /// Mean share over a pixel with this height in its middle and this gradient in metres a pixel.
    fn mean(&self, height_m: f64, [gu, gv]: [f64; 2]) -> f32 {
        match self {
            Self::Sharp => {
                let slope = libm::hypot(gu, gv);
                if slope > 0.0 {
                    half_plane(-height_m / slope, gu / slope, gv / slope) as f32
                } else {
                    self.at(height_m)
                }
            }
            Self::Exponential { .. } => {
                let mut sum = 0.0;
                for i in 0..SAMPLES {
                    for j in 0..SAMPLES {
                        let [du, dv] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(SAMPLES) - 0.5);
                        sum += self.at(height_m + gu * du + gv * dv);
                    }
                }
                sum / (SAMPLES * SAMPLES) as f32
            }
        }
    }
}

/// Share of a unit square that lies in a half plane whose border, with normal (nx, ny), passes `inside` beyond the
/// square's middle (positive when the middle is inside).
fn half_plane(inside: f64, nx: f64, ny: f64) -> f64 {
    let (a, b) = (nx.abs().max(ny.abs()), nx.abs().min(ny.abs()));
    // The share is the integral of a trapezoid: a box of width a smoothed by one of width b.
    let d = inside.abs();
    let share = if d <= 0.5 * (a - b) {
        0.5 + d / a
    } else {
        let rest = (0.5 * (a + b) - d).max(0.0);
        1.0 - if rest > 0.0 { rest * rest / (2.0 * a * b) } else { 0.0 }
    };
    if inside >= 0.0 { share } else { 1.0 - share }
}

/// [`Light`], prepared.
#[derive(Debug, Clone)]
enum Lamp {
    Full,
    Sun {
        direction: Vector3<f64>,
        twilight_rad: f64,
    },
    Sector {
        axis: Vector3<f64>,
        east: Vector3<f64>,
        south: Vector3<f64>,
        centre_rad: f64,
        half_width_rad: f64,
        fade_rad: f64,
    },
}

impl Lamp {
    fn try_new(scene: &Scene, globe: Globe) -> Result<Self, SceneError> {
        Ok(match scene.light {
            Light::Full => Self::Full,
            Light::Sun { direction, twilight_rad } => {
                let direction = Vector3::from(direction).try_normalize(1e-12).ok_or(SceneError::Sun)?;
                Self::Sun { direction, twilight_rad }
            }
            Light::Sector { centre_rad, half_width_rad, fade_rad } => {
                let cone = LimbCone::try_new(scene.pose.position_m, globe.a_m, globe.b_m).ok_or(SceneError::Pose)?;
                let (axis, east) = (Vector3::from(cone.axis.xyz()), Vector3::from(cone.east.xyz()));
                Self::Sector { axis, east, south: axis.cross(&east), centre_rad, half_width_rad, fade_rad }
            }
        })
    }

    /// How much of the light falls where the ray meets the body, 0 to 1.
    #[inline(always)]
    fn at(&self, view: &View, sight: &Sight, point: &Vector3<f64>) -> f32 {
        let x = match self {
            Self::Full => return 1.0,
            Self::Sun { direction, twilight_rad } => {
                let elevation = libm::asin(view.normal(point).dot(direction).clamp(-1.0, 1.0));
                elevation / twilight_rad.max(1e-9)
            }
            Self::Sector { east, south, axis, centre_rad, half_width_rad, fade_rad } => {
                let ray = view.direction(sight);
                let across = ray - axis * ray.dot(axis);
                let off = libm::atan2(across.dot(south), across.dot(east)) - centre_rad;
                let off = (off - core::f64::consts::TAU * (off / core::f64::consts::TAU).round()).abs();
                (half_width_rad - off) / fade_rad.max(1e-9)
            }
        };
        smoothstep((x + 0.5).clamp(0.0, 1.0) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_plane_equals_counting() {
        for (angle, d) in [(0.0f64, 0.2), (0.3, -0.35), (0.785, 0.6), (1.2, 0.05), (2.0, -0.1), (4.0, 0.49)] {
            let (ny, nx) = angle.sin_cos();
            let n = 1000;
            let inside = (0..n * n)
                .filter(|i| {
                    let [x, y] = [i % n, i / n].map(|k| (f64::from(k) + 0.5) / f64::from(n) - 0.5);
                    x * nx + y * ny <= d
                })
                .count();
            let share = inside as f64 / f64::from(n * n);
            assert!((half_plane(d, nx, ny) - share).abs() < 2e-3, "{angle} {d}");
        }
    }

    #[test]
    fn half_brightness_is_at_the_limb_height() {
        let edge = Edge::new(Profile::Exponential { scale_km: 7.0 });
        assert!((edge.at(0.0) - 0.5).abs() < 1e-6 && edge.at(-1e4) == 1.0);
        assert!((edge.at(7e3) - 0.5 / core::f32::consts::E).abs() < 1e-6);
    }
}
