//! The rendering of a scene.
//!
//! The painter of each world paints it row by row. This module turns the rows into light on a detector: motion, vehicle
//! parts in view, stray light, fall-off, image circle, exposure.

use hzn_core::camera::Camera;
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::detector::Plane;
use crate::ellipsoid::{Ellipsoid, EllipsoidPainter};
use crate::error::SceneError;
use crate::globe::Globe;
use crate::image_circle::{apply_image_circle, lens_without_circle};
use crate::infrared::{Infrared, InfraredPainter};
use crate::motion::Motion;
use crate::optics::Optics;
use crate::painter::Painter;
use crate::picture::Picture;
use crate::pose::Pose;
use crate::scene::{Light, Scene, World};
use crate::visible::Visible;
use crate::visible::discs::Canvas;
use crate::visible::shade::Shader;

impl Scene {
    /// Renders the picture.
    ///
    /// # Errors
    /// Fails if [`Camera::try_new`] refuses the camera, or if the position is not outside the body.
    pub fn render(&self) -> Result<Picture, SceneError> {
        let light = match &self.halves {
            None => self.light_on_detector()?,
            Some(halves) => {
                let half = |pose| Self { pose, halves: None, ..self.clone() }.light_on_detector();
                let [first, second] = halves.poses(&self.pose).map(half);
                let mut light = first?;
                halves.interleave(&mut light, &second?);
                light
            }
        };
        Ok(self.detector.expose(&light, self.seed))
    }

    /// Returns the light on every pixel with exposure and blur, of one half picture or of a whole one.
    fn light_on_detector(&self) -> Result<Vec<Plane>, SceneError> {
        let camera = Camera::<f64>::try_new(&self.camera)?;
        let mut light = self.light()?;
        for plane in &mut light {
            self.expose(plane, &camera);
        }
        let blur = |plane: Plane| apply_image_circle(plane.blurred(self.detector.psf_sigma_px), &camera);
        Ok(light.into_iter().map(blur).collect())
    }

    /// Returns the light on every pixel before blur and exposure: one plane, or three for colours.
    ///
    /// # Errors
    /// Fails like [`Scene::render`].
    pub fn light(&self) -> Result<Vec<Plane>, SceneError> {
        let camera = lens_without_circle(&self.camera)?;
        let motion = self.motion.filter(|m| m.is_significant(pixel_rad(&camera)));
        let mut planes = match &self.world {
            World::Plain => vec![self.render_plain(&camera, motion.as_ref())?],
            World::Infrared(world) => vec![self.render_infrared(world, camera, motion.as_ref())?],
            World::Visible(world) => self.render_visible(world, camera, motion.as_ref())?,
            World::Ellipsoid(body) => vec![self.render_ellipsoid(body, camera, motion.as_ref())?],
        };
        self.draw_foreground(&mut planes);
        if let World::Visible(world) = &self.world
            && world.sun_in_view
        {
            self.add_glare(world, &mut planes)?;
        }
        self.match_channels(&mut planes);
        Ok(planes)
    }

    /// Renders a body of uniform brightness, and the stars.
    fn render_plain(&self, camera: &Camera<f64>, motion: Option<&Motion>) -> Result<Plane, SceneError> {
        let (w, h) = self.size();
        let painter = Painter::try_new(self)?;
        let mut data = vec![0.0f32; w * h];
        data.par_chunks_mut(w).enumerate().for_each(|(y, row)| match motion {
            None => painter.render_row(y as f64, row),
            Some(motion) => {
                let poses = motion.poses(&self.pose, y as f64, h, pixel_rad(camera));
                let mut one = vec![0.0f32; w];
                for pose in &poses {
                    painter.with_pose(pose).render_row(y as f64, &mut one);
                    row.iter_mut().zip(&one).for_each(|(sum, p)| *sum += p / poses.len() as f32);
                }
            }
        });
        painter.draw_stars(&self.sky, w, &mut data);
        Ok(Plane { width: w, data })
    }

    /// Renders the Earth in the infrared.
    fn render_infrared(
        &self,
        world: &Infrared,
        camera: Camera<f64>,
        motion: Option<&Motion>,
    ) -> Result<Plane, SceneError> {
        let pixel_rad = pixel_rad(&camera);
        let globe = Globe::new(&self.body);
        let painter = InfraredPainter::try_new(world, camera, globe, &self.pose).ok_or(SceneError::Pose)?;
        let data =
            self.render_rows(&painter, InfraredPainter::with_pose, InfraredPainter::render_row, motion, pixel_rad);
        Ok(Plane { width: self.size().0, data })
    }

    /// Renders an ellipsoid in sunlight.
    fn render_ellipsoid(
        &self,
        body: &Ellipsoid,
        camera: Camera<f64>,
        motion: Option<&Motion>,
    ) -> Result<Plane, SceneError> {
        let pixel_rad = pixel_rad(&camera);
        let painter =
            EllipsoidPainter::try_new(body, camera, &self.pose, self.sun_direction()?).ok_or(SceneError::Pose)?;
        let data =
            self.render_rows(&painter, EllipsoidPainter::with_pose, EllipsoidPainter::render_row, motion, pixel_rad);
        Ok(Plane { width: self.size().0, data })
    }

    /// Returns the light of all pixels. Each row is the mean over the poses of its exposure. `render_row` adds the
    /// light of row v, times a weight.
    fn render_rows<S: Sync, P: Default + Clone + Send>(
        &self,
        painter: &S,
        with_pose: fn(&S, &Pose) -> S,
        render_row: fn(&S, f64, f32, &mut [P]),
        motion: Option<&Motion>,
        pixel_rad: f64,
    ) -> Vec<P> {
        let (w, h) = self.size();
        let mut pixels = vec![P::default(); w * h];
        pixels.par_chunks_mut(w).enumerate().for_each(|(y, row)| match motion {
            None => render_row(painter, y as f64, 1.0, row),
            Some(motion) => {
                let poses = motion.poses(&self.pose, y as f64, h, pixel_rad);
                let weight = 1.0 / poses.len() as f32;
                poses.iter().for_each(|pose| render_row(&with_pose(painter, pose), y as f64, weight, row));
            }
        });
        pixels
    }

    /// Returns the numbers of columns and rows.
    fn size(&self) -> (usize, usize) {
        (usize::from(self.camera.width), usize::from(self.camera.height))
    }

    /// Draws the parts of the vehicle in front of everything.
    fn draw_foreground(&self, planes: &mut [Plane]) {
        for plane in planes {
            plane.data.par_chunks_mut(plane.width).enumerate().for_each(|(y, row)| {
                for f in &self.foreground {
                    f.draw_row(y, row);
                }
            });
        }
    }

    /// Gives the planes the channels of the detector. A grey camera sees the mean of the colours. A colour camera sees
    /// a grey world as three equal planes.
    fn match_channels(&self, planes: &mut Vec<Plane>) {
        if self.detector.colour {
            while planes.len() < 3 {
                planes.extend(planes.first().cloned());
            }
        } else if let [r, g, b] = planes.as_mut_slice() {
            r.data.iter_mut().zip(&g.data).zip(&b.data).for_each(|((r, g), b)| *r = (*r + g + b) / 3.0);
            planes.truncate(1);
        }
    }

    /// Returns the shader of a visible world for the scene's own pose.
    fn shader(&self, world: &Visible, camera: Camera<f64>) -> Result<Shader, SceneError> {
        let up = Vector3::from(self.pose.position_m);
        let sun = match self.light {
            Light::Sun { direction, .. } => Vector3::from(direction),
            Light::Full | Light::Sector { .. } => up,
        };
        let sun = sun.try_normalize(1e-12).ok_or(SceneError::Sun)?;
        Shader::try_new(world, camera, Globe::new(&self.body), &self.pose, sun).ok_or(SceneError::Pose)
    }

    /// Renders the Earth and the sky with stars, Moon and Sun.
    fn render_visible(
        &self,
        world: &Visible,
        camera: Camera<f64>,
        motion: Option<&Motion>,
    ) -> Result<Vec<Plane>, SceneError> {
        let (w, h) = self.size();
        let pixel_rad = pixel_rad(&camera);
        let shader = self.shader(world, camera)?;
        let mut pixels = self.render_rows(&shader, Shader::with_pose, Shader::render_row, motion, pixel_rad);
        // Stars, Moon and Sun use the poses of the middle row.
        let poses =
            motion.map_or_else(|| vec![self.pose], |m| m.poses(&self.pose, 0.5 * (h as f64 - 1.0), h, pixel_rad));
        let weight = 1.0 / poses.len() as f32;
        let mut canvas = Canvas { width: w, pixels: &mut pixels };
        for pose in &poses {
            let shader = shader.with_pose(pose);
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

    /// Adds the stray light of the Sun. A part of the vehicle hides it only if it is in front of the Sun itself.
    fn add_glare(&self, world: &Visible, planes: &mut [Plane]) -> Result<(), SceneError> {
        if self.optics == Optics::default() {
            return Ok(());
        }
        let shader = self.shader(world, lens_without_circle(&self.camera)?)?;
        let hidden = shader.sun_point().is_some_and(|p| self.foreground.iter().any(|f| f.contains([p.u, p.v])));
        let (width, height) = self.size();
        let mut pixels = vec![[0.0f32; 3]; width * height];
        shader.draw_glare(&mut Canvas { width, pixels: &mut pixels }, &self.optics, hidden);
        for (c, plane) in planes.iter_mut().enumerate() {
            plane.data.iter_mut().zip(&pixels).for_each(|(p, add)| *p += add[c]);
        }
        Ok(())
    }

    /// Applies the fall-off towards the corners, and the exposure.
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

/// Returns the larger of the two angles that a pixel in the middle covers, radians.
fn pixel_rad(camera: &Camera<f64>) -> f64 {
    let (fx, fy) = camera.focal_px();
    1.0 / fx.min(fy)
}
