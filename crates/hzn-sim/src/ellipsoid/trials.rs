//! Random pictures of one body, for Monte Carlo runs.

use core::f64::consts::TAU;

use hzn_core::camera::{self, Camera};
use nalgebra::{UnitQuaternion, Vector3};

use super::body::Ellipsoid;
use crate::counter::{Counter, Stream};
use crate::detector::Detector;
use crate::error::SceneError;
use crate::pose::Pose;
use crate::scene::{Light, Scene, World};

/// Random scenes of one body through one lens: each seed gives another range, attitude, phase and noise.
///
/// # Example
///
/// A picture of Enceladus whose disc is 8 px to 4000 px wide, with its truth:
///
/// ```
/// use hzn_core::camera::{Config, Model};
/// use hzn_sim::{Detector, Ellipsoid, Trials};
///
/// let trials = Trials {
///     body: Ellipsoid::named("enceladus"),
///     camera: Config::ideal(Model::Pinhole, 256, 256, 2000.0),
///     detector: Detector { read_noise: 0.01, ..Detector::default() },
///     diameter_px: [8.0, 4000.0],
///     phase_deg: [0.0, 160.0],
/// };
/// let scene = trials.scene(42)?;
/// let (picture, truth) = (scene.render()?, scene.truth("", 0.0)?);
/// assert!(picture.width() == 256 && truth.position_km().is_some());
/// # Ok::<(), hzn_sim::SceneError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Trials {
    /// The body.
    pub body: Ellipsoid,
    /// The lens and the size of the picture.
    pub camera: camera::Config,
    /// The detector.
    pub detector: Detector,
    /// Smallest and largest diameter of the disc in pixels; every factor between them is equally likely. The focal
    /// length in the middle of the picture counts.
    pub diameter_px: [f64; 2],
    /// Smallest and largest phase angle, degrees; every angle between them is equally likely.
    pub phase_deg: [f64; 2],
}

impl Trials {
    /// Returns the scene of a seed. The camera sees the body from a random direction. The whole disc is in the picture
    /// if it fits; otherwise the middle of the picture is near the sunlit limb.
    ///
    /// # Errors
    /// Fails if the camera is invalid, or if a disc of the drawn diameter cannot be seen: the camera would be inside.
    pub fn scene(&self, seed: u64) -> Result<Scene, SceneError> {
        let draws = Counter::new(seed, Stream::Trials);
        let draw = |i: u64| draws.uniform(i);
        let between = |[low, high]: [f64; 2], x: f64| low + (high - low) * x;
        let focal_px = {
            let (fx, fy) = Camera::<f64>::try_new(&self.camera)?.focal_px();
            fx.min(fy)
        };
        let [small, large] = self.diameter_px;
        let diameter_px = small * libm::pow(large / small, draw(0));
        let radius_m = self.body.mean_radius_km() * 1e3;
        // The half-angle of a pinhole's disc of this size in the middle of the picture; the sine keeps the camera
        // outside.
        let half_angle = libm::atan(0.5 * diameter_px / focal_px);
        let range_m = radius_m / libm::sin(half_angle);
        let z = 2.0 * draw(1) - 1.0;
        let (sin, cos) = libm::sincos(TAU * draw(2));
        let flat = (1.0 - z * z).max(0.0).sqrt();
        let from_body = Vector3::new(flat * cos, flat * sin, z);
        let (sunward, _) = perpendicular(&from_body, TAU * draw(3));
        let (sin, cos) = libm::sincos(between(self.phase_deg, draw(4)).to_radians());
        let sun = from_body * cos + sunward * sin;
        let (w, h) = (f64::from(self.camera.width), f64::from(self.camera.height));
        let room_px = 0.5 * w.min(h) - 0.55 * diameter_px;
        // Distance of the centre from the middle of the picture, and its direction from the Sun's side.
        let (away_px, turn) = if room_px > 0.0 {
            (room_px * draw(5).sqrt(), TAU * draw(6))
        } else {
            // The sunlit limb is within a quarter of the picture's side of its middle.
            (0.5 * diameter_px + 0.25 * w.min(h) * (2.0 * draw(5) - 1.0), (draw(6) - 0.5) * 1.2)
        };
        let towards = UnitQuaternion::new(from_body * turn) * sunward;
        let aim = -from_body + towards * (away_px / focal_px);
        let pose = pose(from_body * range_m, aim.normalize(), TAU * draw(7));
        Ok(Scene {
            world: World::Ellipsoid(Box::new(self.body.clone())),
            light: Light::Sun { direction: sun.into(), twilight_rad: 0.0 },
            detector: self.detector,
            seed,
            ..Scene::new(self.camera.clone(), pose)
        })
    }
}

/// Returns two unit vectors perpendicular to a unit vector and to each other, turned by an angle about it.
fn perpendicular(axis: &Vector3<f64>, turn_rad: f64) -> (Vector3<f64>, Vector3<f64>) {
    let helper = if axis.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
    let a = helper.cross(axis).normalize();
    let b = axis.cross(&a);
    let (sin, cos) = libm::sincos(turn_rad);
    (a * cos + b * sin, b * cos - a * sin)
}

/// Returns the pose of a camera at a position that looks along `axis`, turned by `roll_rad` about it.
fn pose(position_m: Vector3<f64>, axis: Vector3<f64>, roll_rad: f64) -> Pose {
    let (right, down) = perpendicular(&axis, roll_rad);
    Pose::from_axes(position_m.into(), [right, down, axis].map(Into::into))
}
