//! The rule by which a picture shows a limb.

use core::f64::consts::TAU;

use hzn_core::body::Kind;
use hzn_core::camera::Camera;
use hzn_core::frames::{Cam, UnitVec3};
use hzn_core::pixel::ImagePoint;
use nalgebra::Vector3;

use super::scene::SkyDisc;
use crate::error::SceneError;
use crate::globe::{Globe, View};
use crate::limb::ProjectedLimb;
use crate::scene::{Light, Scene};

/// Visible limb that is enough in every picture, pixels. A smaller disc and a smaller picture need less:
/// [`OUTLINE_SHARE`] and [`SIDE_SHARE`].
pub const LIMB_IN_VIEW_PX: f64 = 50.0;
/// Share of the outline that is enough. Half of an outline is lit at every phase.
pub const OUTLINE_SHARE: f64 = 0.25;
/// Visible limb that is enough, divided by the shorter side of the picture.
pub const SIDE_SHARE: f64 = 0.5;

/// Number of steps around an outline.
const STEPS: i32 = 720;

impl Scene {
    /// Returns whether the picture shows a limb: at least the smallest of [`LIMB_IN_VIEW_PX`], [`OUTLINE_SHARE`] of the
    /// whole outline and [`SIDE_SHARE`] of the shorter side of the picture is in the picture, lit and not hidden.
    /// `kind` selects the scene's own body, or Sun or Moon next to it.
    ///
    /// # Errors
    /// Fails like [`Scene::body_truth`].
    pub fn has_limb(&self, kind: Kind) -> Result<bool, SceneError> {
        match self.sky_disc(kind)? {
            Some(disc) => {
                let outline = SkyOutline::try_new(self, kind, &disc)?;
                Ok(self.is_enough(outline.visible_px(), |azimuth_rad| outline.project(azimuth_rad)))
            }
            None => {
                let limb = ProjectedLimb::try_new(self)?;
                Ok(self.is_enough(limb.visible_px(), |azimuth_rad| limb.project(azimuth_rad)))
            }
        }
    }

    /// Returns whether this length of a visible limb is enough. `project` gives the outline by azimuth.
    fn is_enough(&self, visible_px: f64, project: impl Fn(f64) -> Option<ImagePoint<f64>>) -> bool {
        let side_px = f64::from(self.camera.width.min(self.camera.height));
        // The whole outline costs as much as the visible part, and only a short one is measured.
        visible_px >= LIMB_IN_VIEW_PX.min(SIDE_SHARE * side_px)
            || visible_px > 0.0 && visible_px >= OUTLINE_SHARE * outline_px(project)
    }

    /// Returns the length in pixels of the limb that is in the picture, lit and not hidden. `kind` selects the scene's
    /// own body, or Sun or Moon next to it.
    ///
    /// # Errors
    /// Fails like [`Scene::body_truth`].
    pub fn visible_px(&self, kind: Kind) -> Result<f64, SceneError> {
        match self.sky_disc(kind)? {
            Some(disc) => Ok(SkyOutline::try_new(self, kind, &disc)?.visible_px()),
            None => self.visible_limb_px(),
        }
    }
}

/// Returns the points of an outline at even steps of azimuth, the first one again at the end.
fn around<P>(point: impl Fn(f64) -> P) -> impl Iterator<Item = P> {
    (0..=STEPS).map(move |i| point(TAU * f64::from(i) / f64::from(STEPS)))
}

/// Returns the lengths between successive points that both exist, pixels.
fn chords_px(points: impl Iterator<Item = Option<ImagePoint<f64>>>) -> impl Iterator<Item = f64> {
    let mut last: Option<ImagePoint<f64>> = None;
    points.filter_map(move |point| {
        let before = core::mem::replace(&mut last, point);
        before.zip(point).map(|(q, p)| libm::hypot(p.u - q.u, p.v - q.v))
    })
}

/// Returns the length of a whole outline, lit or not, in the picture or beyond its borders, pixels. The lens may not
/// reach all of it: per azimuth, the rest counts as much as the part that the lens reaches.
fn outline_px(project: impl Fn(f64) -> Option<ImagePoint<f64>>) -> f64 {
    let (count, length_px) = chords_px(around(project)).fold((0, 0.0), |(n, sum), px| (n + 1, sum + px));
    length_px * f64::from(STEPS) / f64::from(count.max(1))
}

/// The outline of Sun or Moon through the lens of a scene.
struct SkyOutline<'a> {
    scene: &'a Scene,
    camera: Camera<f64>,
    view: View,
    centre: Vector3<f64>,
    across: [Vector3<f64>; 2],
    tangent: f64,
    /// Direction to the Sun, if the body does not shine by itself.
    sun: Option<Vector3<f64>>,
}

impl<'a> SkyOutline<'a> {
    fn try_new(scene: &'a Scene, kind: Kind, disc: &SkyDisc) -> Result<Self, SceneError> {
        let centre = Vector3::from(disc.direction);
        let helper = if centre.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
        let a = centre.cross(&helper).normalize();
        Ok(Self {
            scene,
            camera: Camera::try_new(&scene.camera)?,
            view: View::try_new(Globe::new(&scene.body), &scene.pose).ok_or(SceneError::Pose)?,
            centre,
            across: [a, centre.cross(&a)],
            tangent: libm::tan(disc.half_angle_rad),
            sun: match (kind, scene.light) {
                (Kind::Moon, Light::Sun { direction, .. }) => Some(Vector3::from(direction)),
                _ => None,
            },
        })
    }

    /// Returns the unit vector from the centre of the disc to its edge at an azimuth (ECEF).
    fn outward(&self, azimuth_rad: f64) -> Vector3<f64> {
        let (sin, cos) = libm::sincos(azimuth_rad);
        self.across[0] * cos + self.across[1] * sin
    }

    /// Returns the direction of the edge at an azimuth.
    fn ray(&self, azimuth_rad: f64) -> Option<UnitVec3<Cam, f64>> {
        self.view.to_camera((self.centre + self.outward(azimuth_rad) * self.tangent).normalize())
    }

    fn project(&self, azimuth_rad: f64) -> Option<ImagePoint<f64>> {
        self.camera.project(&self.ray(azimuth_rad)?)
    }

    /// Returns the position of the edge at an azimuth if it is lit and neither the vehicle nor the Earth hides it.
    fn project_visible(&self, azimuth_rad: f64) -> Option<ImagePoint<f64>> {
        let ray = self.ray(azimuth_rad)?;
        let p = self.camera.project(&ray)?;
        let lit = self.sun.is_none_or(|sun| sun.dot(&self.outward(azimuth_rad)) > 0.05);
        let behind = self.view.intersect(ray.xyz()).miss <= 0.0;
        (lit && !behind && self.scene.shows(&self.camera, p)).then_some(p)
    }

    fn visible_px(&self) -> f64 {
        chords_px(around(|azimuth_rad| self.project_visible(azimuth_rad))).sum()
    }
}
