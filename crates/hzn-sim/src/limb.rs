//! The limb as a line in the picture: its position, its visible segments, and edge points on it without rendering.

use hzn_core::camera::Camera;
use hzn_core::ellipsoid::LimbCone;
use hzn_core::frames::{Cam, UnitVec3};
use hzn_core::pixel::ImagePoint;
use nalgebra::Vector3;

use crate::edge_errors::EdgeErrors;
pub use crate::edge_errors::{EdgeNoise, LimbPoint};
use crate::ellipsoid::EllipsoidOutline;
use crate::error::SceneError;
use crate::globe::{Globe, View};
use crate::painter::Painter;
use crate::scene::{Scene, World};

impl Scene {
    /// Returns the tangent heights above the ellipsoid in kilometres, for rays in the camera frame. The camera has its
    /// pose at the middle of the exposure. For a camera inside the body the list is empty.
    pub fn tangent_heights_km(&self, rays: impl IntoIterator<Item = [f64; 3]>) -> Vec<f64> {
        let Some(view) = View::try_new(Globe::new(&self.body), &self.pose) else { return Vec::new() };
        rays.into_iter().map(|ray| view.tangent_height_m(&view.intersect(ray)) * 1e-3).collect()
    }
}

/// The exact limb of a scene, without a lens.
#[derive(Debug, Clone, Copy)]
pub struct LimbCircle {
    axis: Vector3<f64>,
    east: Vector3<f64>,
    third: Vector3<f64>,
    cot2_east: f64,
    cot2_meridian: f64,
}

impl LimbCircle {
    /// Returns the limb of the scene's body, raised by its limb height. If the limb height depends on latitude, this is
    /// the limb at `body.limb_height_km`.
    ///
    /// # Errors
    /// Fails if the camera is not outside the body and its limb height.
    pub fn new(scene: &Scene) -> Result<Self, SceneError> {
        Self::from_height(scene, scene.body.limb_height_km * 1e3)
    }

    fn from_height(scene: &Scene, height_m: f64) -> Result<Self, SceneError> {
        let globe = Globe::new(&scene.body).raised(height_m);
        let cone = LimbCone::try_new(scene.pose.position_m, globe.a_m, globe.b_m).ok_or(SceneError::Pose)?;
        let (axis, east) = (Vector3::from(cone.axis.xyz()), Vector3::from(cone.east.xyz()));
        let (cot2_east, cot2_meridian) = (cone.cot2_east, cone.cot2_meridian);
        Ok(Self { axis, east, third: axis.cross(&east), cot2_east, cot2_meridian })
    }

    /// Returns the unit direction (ECEF) of the limb at an azimuth about its axis: 0 is east, π/2 is axis × east.
    pub fn ray_fixed(&self, azimuth_rad: f64) -> [f64; 3] {
        let (sin, cos) = libm::sincos(azimuth_rad);
        // The half-angle α at this azimuth follows exactly from cot² α = cot² α_E cos² φ + cot² α_M sin² φ.
        let cot = (self.cot2_east * cos * cos + self.cot2_meridian * sin * sin).sqrt();
        (self.axis * cot + self.east * cos + self.third * sin).normalize().into()
    }

    /// Returns the azimuth of a direction (ECEF) about the axis, in radians from −π to π.
    pub fn azimuth_rad(&self, direction_fixed: [f64; 3]) -> f64 {
        let d = Vector3::from(direction_fixed);
        libm::atan2(d.dot(&self.third), d.dot(&self.east))
    }
}

/// An uninterrupted visible segment of the limb.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Segment {
    /// (azimuth in radians, arc length from the start of the segment in pixels), both rising.
    samples: Vec<(f64, f64)>,
}

impl Segment {
    pub(crate) fn length_px(&self) -> f64 {
        self.samples.last().map_or(0.0, |s| s.1)
    }
    /// Returns the azimuth at an arc length.
    fn azimuth_rad(&self, arc_px: f64) -> f64 {
        let i = self.samples.partition_point(|s| s.1 < arc_px).clamp(1, self.samples.len() - 1);
        let ((a0, s0), (a1, s1)) = (self.samples[i - 1], self.samples[i]);
        if s1 > s0 { a0 + (a1 - a0) * (arc_px - s0) / (s1 - s0) } else { a0 }
    }
}

/// The limb of the Earth or of a sphere, with its light.
struct GlobeOutline<'a> {
    scene: &'a Scene,
    circle: LimbCircle,
    painter: Painter,
}

impl GlobeOutline<'_> {
    /// Returns the ray (ECEF, unit) of the limb at an azimuth.
    fn ray(&self, azimuth_rad: f64) -> [f64; 3] {
        let mut ray = self.circle.ray_fixed(azimuth_rad);
        if !self.scene.limb_height_by_latitude_km.is_empty() {
            // The limb height moves the tangent point by a few kilometres, and this changes the limb height by metres.
            // Three rounds converge.
            for _ in 0..3 {
                let Ok(circle) = LimbCircle::from_height(self.scene, self.painter.limb_height_m(ray)) else { break };
                ray = circle.ray_fixed(azimuth_rad);
            }
        }
        ray
    }
}

/// The limb of a scene's body.
enum Outline<'a> {
    Globe(Box<GlobeOutline<'a>>),
    Ellipsoid(Box<EllipsoidOutline<'a>>),
}

impl Outline<'_> {
    /// Returns the direction of the limb at an azimuth.
    fn ray(&self, azimuth_rad: f64) -> Option<UnitVec3<Cam, f64>> {
        match self {
            Self::Globe(globe) => globe.painter.to_camera(globe.ray(azimuth_rad)),
            Self::Ellipsoid(ellipsoid) => ellipsoid.ray(azimuth_rad),
        }
    }

    /// Returns whether the limb at an azimuth, where it has this direction, is in sunlight and not hidden by rings.
    fn is_lit(&self, azimuth_rad: f64, direction: &UnitVec3<Cam, f64>) -> bool {
        match self {
            Self::Globe(globe) => globe.painter.lit_share(direction) > 0.5,
            Self::Ellipsoid(ellipsoid) => ellipsoid.is_visible(azimuth_rad),
        }
    }
}

/// Number of azimuths that are looked at together. Over them, a limb of 6000 pixels radius bends by 0.1 pixels.
const BLOCK: usize = 8;

/// The limb of a scene through its lens.
pub(crate) struct ProjectedLimb<'a> {
    scene: &'a Scene,
    camera: Camera<f64>,
    outline: Outline<'a>,
}

impl<'a> ProjectedLimb<'a> {
    pub(crate) fn try_new(scene: &'a Scene) -> Result<Self, SceneError> {
        let camera = Camera::try_new(&scene.camera)?;
        let outline = match &scene.world {
            World::Ellipsoid(body) => {
                let sun = scene.sun_direction()?;
                let outline = EllipsoidOutline::try_new(body, &scene.pose, sun).ok_or(SceneError::Pose)?;
                Outline::Ellipsoid(Box::new(outline))
            }
            World::Plain | World::Visible(_) | World::Infrared(_) => {
                let (circle, painter) = (LimbCircle::new(scene)?, Painter::try_new(scene)?);
                Outline::Globe(Box::new(GlobeOutline { scene, circle, painter }))
            }
        };
        Ok(Self { scene, camera, outline })
    }

    /// Returns the position of the limb at an azimuth in the plane of the picture; `None` if the lens does not reach
    /// there.
    pub(crate) fn project(&self, azimuth_rad: f64) -> Option<ImagePoint<f64>> {
        self.camera.project(&self.outline.ray(azimuth_rad)?)
    }

    fn project_visible(&self, azimuth_rad: f64) -> Option<ImagePoint<f64>> {
        let direction = self.outline.ray(azimuth_rad)?;
        let point = self.camera.project(&direction)?;
        (self.scene.shows(&self.camera, point) && self.outline.is_lit(azimuth_rad, &direction)).then_some(point)
    }

    /// Returns the length of the visible segments, pixels.
    pub(crate) fn visible_px(&self) -> f64 {
        self.visible_segments().iter().map(Segment::length_px).sum()
    }

    /// Returns the visible segments, with their ends located to better than a hundredth of a pixel. A segment shorter
    /// than the step in azimuth, 2π/(4·(width + height)), may be missed; where the lens ends, one of [`BLOCK`] steps.
    pub(crate) fn visible_segments(&self) -> Vec<Segment> {
        // A limb that is a circle around the optical axis gets about two steps per pixel. Elsewhere the steps may be
        // longer, because the arc length is summed over chords.
        let steps = 4 * (usize::from(self.camera.width()) + usize::from(self.camera.height()));
        let azimuth = |i: usize| core::f64::consts::TAU * i as f64 / steps as f64;
        let points = self.sample_visible(steps, azimuth);
        // The loop starts at an invisible azimuth, so that it cuts no segment at azimuth zero. A limb without an
        // invisible azimuth is one segment of a full turn.
        let Some(start) = points.iter().position(Option::is_none) else {
            let turn = points.iter().enumerate().map(|(i, point)| (azimuth(i), *point));
            return vec![measure_segment(turn.chain([(azimuth(steps), points.first().copied().flatten())]))];
        };
        let mut segments = Vec::new();
        let mut current: Vec<(f64, Option<ImagePoint<f64>>)> = Vec::new();
        let end = |visible: f64, hidden: f64| {
            let azimuth_rad = self.bisect_end(visible, hidden);
            (azimuth_rad, self.project(azimuth_rad))
        };
        for i in start..start + steps {
            let (here, next) = (points[i % steps], points[(i + 1) % steps]);
            match (here, next) {
                (None, Some(_)) => current.extend([end(azimuth(i + 1), azimuth(i)), (azimuth(i + 1), next)]),
                (Some(_), Some(_)) => current.push((azimuth(i + 1), next)),
                (Some(_), None) => {
                    current.push(end(azimuth(i), azimuth(i + 1)));
                    segments.push(measure_segment(core::mem::take(&mut current)));
                }
                (None, None) => {}
            }
        }
        segments
    }

    /// Returns the visible ones of the points at `steps` azimuths. Most of a limb lies outside most pictures, so blocks
    /// of azimuths whose two ends lie on the same side outside the picture are not looked at.
    fn sample_visible(&self, steps: usize, azimuth: impl Fn(usize) -> f64) -> Vec<Option<ImagePoint<f64>>> {
        let mut points = vec![None; steps];
        let mut begin = self.project(azimuth(0));
        for first in (0..steps).step_by(BLOCK) {
            let after = (first + BLOCK).min(steps);
            let end = self.project(azimuth(after));
            if !self.is_outside(begin, end) {
                for i in first..after {
                    points[i] = self.project_visible(azimuth(i));
                }
            }
            begin = end;
        }
        points
    }

    /// Returns true if two points near each other are both beyond the lens or on the same side outside the picture.
    fn is_outside(&self, a: Option<ImagePoint<f64>>, b: Option<ImagePoint<f64>>) -> bool {
        let (Some(a), Some(b)) = (a, b) else { return a.is_none() && b.is_none() };
        let beside = |a: f64, b: f64, size: u16| a.max(b) < -0.5 || a.min(b) > f64::from(size) - 0.5;
        beside(a.u, b.u, self.camera.width()) || beside(a.v, b.v, self.camera.height())
    }

    /// Returns the last visible azimuth between a visible and an invisible one.
    fn bisect_end(&self, mut visible: f64, mut hidden: f64) -> f64 {
        for _ in 0..24 {
            let mid = 0.5 * (visible + hidden);
            if self.project_visible(mid).is_some() { visible = mid } else { hidden = mid }
        }
        visible
    }
}

/// Sums the arc length over points by rising azimuth.
fn measure_segment(points: impl IntoIterator<Item = (f64, Option<ImagePoint<f64>>)>) -> Segment {
    let mut last: Option<ImagePoint<f64>> = None;
    let mut arc = 0.0;
    let samples = points.into_iter().filter_map(|(azimuth_rad, point)| {
        let p = point?;
        arc += last.map_or(0.0, |l| libm::hypot(p.u - l.u, p.v - l.v));
        last = Some(p);
        Some((azimuth_rad, arc))
    });
    Segment { samples: samples.collect() }
}

impl Scene {
    /// Returns true if a point is in the picture, neither in the blind centre of the lens nor behind the vehicle.
    pub(crate) fn shows(&self, camera: &Camera<f64>, p: ImagePoint<f64>) -> bool {
        let (w, h) = (f64::from(camera.width()), f64::from(camera.height()));
        let inside = p.u >= -0.5 && p.v >= -0.5 && p.u <= w - 0.5 && p.v <= h - 0.5;
        let blind = camera.blind_centre_px().is_some_and(|(c, a, b)| ((p.u - c.u) / a).hypot((p.v - c.v) / b) < 1.0);
        inside && !blind && !self.foreground.iter().any(|f| f.contains([p.u, p.v]))
    }

    /// Returns `count` points evenly spaced along the visible limb: in the picture, lit, not behind the vehicle. If no
    /// limb is visible, the list is empty. The scene's seed determines the errors.
    ///
    /// # Errors
    /// Fails if the camera, the position or the light is invalid.
    pub fn limb_points(&self, count: usize, noise: EdgeNoise) -> Result<Vec<LimbPoint>, SceneError> {
        let limb = ProjectedLimb::try_new(self)?;
        let segments = limb.visible_segments();
        let total: f64 = segments.iter().map(Segment::length_px).sum();
        if !(total > 0.0) {
            return Ok(Vec::new());
        }
        let spacing = total / count.max(1) as f64;
        let mut points: Vec<LimbPoint> = Vec::with_capacity(count);
        let mut errors = EdgeErrors::new(self.seed, noise);
        let mut before = 0.0;
        let mut number = 0;
        for (index, segment) in segments.iter().enumerate() {
            // The points are in the middle of `count` equal parts of the whole length.
            while number < count && (number as f64 + 0.5) * spacing <= before + segment.length_px() {
                let arc_px = (number as f64 + 0.5) * spacing - before;
                let azimuth_rad = segment.azimuth_rad(arc_px);
                if let Some(exact) = limb.project(azimuth_rad) {
                    let point = errors.disturbed(exact, index, arc_px);
                    points.push(LimbPoint { point, exact, azimuth_rad, segment: index, arc_px });
                }
                number += 1;
            }
            before += segment.length_px();
        }
        Ok(points)
    }

    /// Returns the length in pixels of the limb that is in the picture, lit, and not behind the vehicle.
    ///
    /// # Errors
    /// Fails if the camera, the position or the light is invalid.
    pub fn visible_limb_px(&self) -> Result<f64, SceneError> {
        Ok(ProjectedLimb::try_new(self)?.visible_px())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::foreground::Foreground;
    use crate::pose::{Look, Pose, position_m};
    use hzn_core::camera::{Config, Model};

    fn scene() -> Scene {
        let camera = Config::ideal(Model::Equidistant, 640, 480, 400.0);
        Scene::new(
            camera,
            Pose::looking(position_m(50.0, 7.0, 200.0), Look { depression_rad: 0.25, ..Look::default() }),
        )
    }

    #[test]
    fn points_are_even_and_inside() {
        let points = scene().limb_points(500, EdgeNoise::None).unwrap();
        assert_eq!(points.len(), 500);
        let step = points[1].arc_px - points[0].arc_px;
        for pair in points.windows(2) {
            let chord = libm::hypot(pair[1].exact.u - pair[0].exact.u, pair[1].exact.v - pair[0].exact.v);
            assert!((chord - step).abs() < 1e-2 * step, "{chord} {step}");
        }
        assert!(points.iter().all(|p| p.point == p.exact && p.exact.u > -0.5 && p.exact.u < 639.5));
    }

    #[test]
    fn a_mast_cuts_the_limb_in_two() {
        let mut s = scene();
        let whole = s.visible_limb_px().unwrap();
        s.foreground.push(Foreground {
            polygon_px: vec![[300.0, -10.0], [340.0, -10.0], [340.0, 500.0], [300.0, 500.0]],
            brightness: 0.0,
        });
        let cut = s.visible_limb_px().unwrap();
        assert!((39.9..45.0).contains(&(whole - cut)), "{whole} {cut}");
        let points = s.limb_points(100, EdgeNoise::None).unwrap();
        assert!(points.iter().any(|p| p.segment == 1) && points.iter().all(|p| p.segment < 2));
        assert!(points.iter().all(|p| (p.exact.u - 320.0).abs() > 20.0));
    }

    #[test]
    fn gauss_markov_errors_have_variance_and_length() {
        let noise = EdgeNoise::GaussMarkov { variance_px2: 4.0, correlation_px: 30.0 };
        let (mut square, mut lagged, mut n, mut rho) = (0.0, 0.0, 0.0, 0.0);
        for seed in 0..40 {
            let points = Scene { seed, ..scene() }.limb_points(600, noise).unwrap();
            for pair in points.windows(2) {
                let e = |p: &LimbPoint| p.point.u - p.exact.u;
                square += e(&pair[0]) * e(&pair[0]);
                lagged += e(&pair[0]) * e(&pair[1]);
                n += 1.0;
                rho = libm::exp(-(pair[1].arc_px - pair[0].arc_px) / 30.0);
            }
        }
        assert!((square / n / 4.0 - 1.0).abs() < 0.1, "{}", square / n);
        assert!((lagged / square - rho).abs() < 0.01);
    }

    #[test]
    fn a_full_disc_is_one_closed_segment() {
        let camera = Config::ideal(Model::Equidistant, 384, 288, 92.0);
        let s = Scene::new(camera, Pose::looking(position_m(0.0, 0.0, 600.0), Look::off_nadir(0.0, 0.0, 0.0)));
        let points = s.limb_points(100, EdgeNoise::None).unwrap();
        let r = 92.0 * 66.0f64.to_radians();
        assert!((s.visible_limb_px().unwrap() / (core::f64::consts::TAU * r) - 1.0).abs() < 0.02);
        assert!(points.iter().all(|p| p.segment == 0));
    }
}
