//! A configuration that was accepted, with everything that follows from it.

use crate::base::error::ConfigError;
use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::config::{Config, Mount};
use crate::geometry::camera::Camera;
use crate::geometry::frames::{Cam, Rotation, Vehicle};
use crate::geometry::pixel::ImagePoint;
use crate::image::region::Region;
use crate::model::body::{self, Expected, Prior, PriorError};

/// Diameter of the smallest disc whose position is fitted, pixels.
const SMALLEST_DISC_PX: f64 = 8.0;
/// Without a known distance, the search finds discs down to this part of the picture's shorter side.
// The size decides how dense the search lines are, and every line costs work; therefore it is a part of the picture.
const SIDES: f64 = 40.0;
/// Intervals on each side of the picture, at whose ends the border is compared with the predicted limb. The inside of a
/// limb is convex, so that the corners alone decide in a picture without distortion.
const BORDER_STEPS: i32 = 16;
/// A body fills the picture if its limb is farther outside than this many sigmas of the attitude.
const FILLS_SIGMAS: f64 = 5.0;

/// A checked configuration with everything that follows from it: lens, region, mounting. It takes some kilobytes. The
/// lists that a picture needs are in a [`Workspace`](super::Workspace); [`Horizon`](super::Horizon) holds both.
///
/// # Frames and units
///
/// Answers are in the camera frame [`Cam`](crate::frames::Cam): x right, y down, z along the optical axis. The
/// [`Config`] has kilometres and degrees; everything that a sensor takes or returns has metres and radians.
///
/// # Example
///
/// A flight computer keeps the sensor and its lists apart, because the lists can stand in a `static`:
///
/// ```
/// use hzn_core::camera::{self, Model};
/// use hzn_core::image::{Grey, Layout};
/// use hzn_core::observer::Unobserved;
/// use hzn_core::{Config, FlightWorkspace, Prior, Sensor};
///
/// let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 64, 48, 60.0));
/// config.body.altitude_km = Some(230.0);
/// let sensor = Sensor::<f32>::new(&config)?;
/// let mut workspace = Box::new(FlightWorkspace::new());
///
/// let data = [0u8; 64 * 48];
/// let picture = Grey::try_new(&data, Layout::packed(64, 48, 1, 8))?;
/// let expected = sensor.expect(&Prior::default())?;
/// let report = sensor.process(&mut workspace, &picture, &expected, &Unobserved);
/// assert!(report.solution.is_none());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor<T> {
    pub(super) config: Config,
    pub(super) camera: Camera<T>,
    pub(super) region: Region<T>,
    pub(super) vehicle_from_camera: Option<Rotation<Cam, Vehicle, T>>,
}
impl<T: Real> Sensor<T> {
    /// Makes a sensor. Checks the whole configuration first.
    ///
    /// # Errors
    /// Returns the first field that is out of its limits.
    // Not inlined: the temporary values, some kilobytes, must not lie on the caller's stack.
    #[inline(never)]
    pub fn new(config: &Config) -> Result<Self, ConfigError> {
        let camera = Self::check(config)?;
        Ok(Self::from_checked(config, camera))
    }

    /// Checks the whole configuration, and returns its camera.
    // A function of its own, and so is the next one: their temporary values lie on the stack one after the other.
    #[inline(never)]
    pub(super) fn check(config: &Config) -> Result<Camera<T>, ConfigError> {
        config.check()?;
        Camera::try_new(&config.camera)
    }

    /// Makes the sensor of a configuration that was checked.
    #[inline(never)]
    pub(super) fn from_checked(config: &Config, camera: Camera<T>) -> Self {
        let turn = |m: Mount| Rotation::assume_from_quaternion(m.q_vehicle_from_camera_wxyz.map(T::from_f64));
        Self {
            region: Region::new(&config.mask, &camera),
            vehicle_from_camera: config.mount.and_then(turn),
            camera,
            config: copy_of(config),
        }
    }

    /// Returns the configuration.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Returns the camera with its lens.
    pub fn camera(&self) -> &Camera<T> {
        &self.camera
    }

    /// Returns the part of the picture that counts.
    pub fn region(&self) -> &Region<T> {
        &self.region
    }

    /// Checks the prior of a picture and computes the expected cone of the body, or of the first of several bodies.
    ///
    /// Without any altitude, `gates.altitude_limits_km` gives a wide expected half-angle: the middle of these limits,
    /// with half of their distance as 1-sigma.
    ///
    /// # Errors
    /// The altitude or the position is impossible.
    pub fn expect(&self, frame: &Prior<T>) -> Result<Expected<T>, PriorError> {
        self.expect_body(0, frame)
    }

    /// Does the same as [`Self::expect`], for the body number `which` of [`Config::each_body`], from 0.
    ///
    /// # Errors
    /// The altitude or the position is impossible, or there is no body of this number.
    pub fn expect_body(&self, which: usize, frame: &Prior<T>) -> Result<Expected<T>, PriorError> {
        let body = self.config.each_body().get(which).ok_or(PriorError::NoBody)?;
        if frame.camera_temperature_c.is_some_and(|at| !self.camera.accepts_temperature(at)) {
            return Err(PriorError::Temperature);
        }
        let smallest = self.config.fits_position(body).then(|| self.smallest_half_angle_rad());
        let expected = match Expected::try_new(body, frame, smallest) {
            Err(PriorError::NoAltitude) => self.expect_between(body, frame, smallest)?,
            expected => expected?,
        };
        let expected = Expected { which: which as u8, ..expected };
        if cfg!(feature = "position") {
            self.check_disc(&expected)?;
            self.check_limb_in_view(&expected)?;
        }
        Ok(expected)
    }

    /// Computes the expected cone for an altitude that is only known to lie within `gates.altitude_limits_km`: the
    /// middle of the limits, with half of their distance as 1-sigma. A gate holds the limits themselves.
    // Not inlined: the copy of the body must not lie on the caller's stack.
    #[inline(never)]
    fn expect_between(
        &self,
        body: &body::Config,
        frame: &Prior<T>,
        smallest_rad: Option<T>,
    ) -> Result<Expected<T>, PriorError> {
        let limits = self.config.gates.altitude_limits_km.filter(|_| cfg!(feature = "horace"));
        let [low, high] = limits.ok_or(PriorError::NoAltitude)?;
        // Nothing below the limb height has a limb.
        let low = low.max(body.limb_height_km).min(high);
        let mut between = body.clone();
        between.altitude_km = Some(0.5 * (low + high));
        between.altitude_sigma_km = body.altitude_sigma_km.max(0.5 * (high - low));
        Expected::try_new(&between, frame, smallest_rad)
    }

    /// Returns the half-angle of the smallest disc that the search finds without a known distance, radians.
    fn smallest_half_angle_rad(&self) -> T {
        let side = self.camera.width().min(self.camera.height());
        let (fx, fy) = self.camera.focal_px();
        let diameter_px = (T::from_i32(i32::from(side)) / T::from_f64(SIDES)).max(T::from_f64(SMALLEST_DISC_PX));
        diameter_px / (fx + fy)
    }

    /// Refuses a body that is too small in the picture.
    fn check_disc(&self, expected: &Expected<T>) -> Result<(), PriorError> {
        let (fx, fy) = self.camera.focal_px();
        let diameter_px = expected.half_angle_rad() * (fx + fy);
        let is_small =
            expected.target().is_some_and(|t| t.range.is_some()) && diameter_px < T::from_f64(SMALLEST_DISC_PX);
        match is_small {
            true => Err(PriorError::TooSmall { diameter_px_100: (diameter_px * T::from_f64(100.0)).to_i32() }),
            false => Ok(()),
        }
    }

    /// Refuses a body that fills the picture: the position and the attitude say that no part of the limb is near it.
    fn check_limb_in_view(&self, expected: &Expected<T>) -> Result<(), PriorError> {
        let (Some(target), Some((e, attitude_sigma))) = (expected.target(), expected.predicted) else { return Ok(()) };
        let half_angle = expected.half_angle_rad();
        let angle_to_limb = |s: &V3<T>| {
            let scaled = target.scaling.scale(s);
            half_angle - scaled.cross(&e).dot(&scaled.cross(&e)).sqrt().atan2(scaled.dot(&e))
        };
        let (width, height) = (self.camera.width() - 1, self.camera.height() - 1);
        let border = (0..=BORDER_STEPS).flat_map(|i| {
            let along = |side: u16| T::from_i32(i32::from(side) * i / BORDER_STEPS);
            let (u, v) = (along(width), along(height));
            let (zero, right, low) = (T::ZERO, T::from_i32(i32::from(width)), T::from_i32(i32::from(height)));
            [(u, zero), (u, low), (zero, v), (right, v)]
        });
        let rays = border.filter_map(|(u, v)| self.camera.ray(ImagePoint { u, v }));
        // The smallest angle over the border decides: one place near the limb is enough to search the picture.
        let inside = rays.map(|ray| angle_to_limb(ray.direction().v())).reduce(|a, b| a.min(b));
        match inside {
            Some(beyond) if beyond > attitude_sigma * T::from_f64(FILLS_SIGMAS) && beyond > T::ZERO => {
                let deg_100 = |rad: T| (rad * T::from_f64(100.0 * 180.0 / core::f64::consts::PI)).to_i32();
                Err(PriorError::Fills { half_angle_deg_100: deg_100(half_angle), beyond_deg_100: deg_100(beyond) })
            }
            _ => Ok(()),
        }
    }

    /// Returns the camera for one picture, if it differs from the camera of the sensor: it turns while the picture is
    /// read out row by row, has a temperature that changes its lens, or its rays are in the scaled space of the body.
    // Not inlined: its temporary cameras must not be on the stack while a picture is searched.
    #[inline(never)]
    pub(super) fn camera_for(&self, expected: &Expected<T>) -> Option<Camera<T>> {
        let rate = expected.rate_rad_s.filter(|_| self.camera.has_rolling_shutter());
        let temperature = expected.camera_temperature_c.filter(|_| self.camera.has_temperature());
        if let Some(target) = expected.target() {
            return Some(self.camera.with_rate(rate).with_temperature(temperature).with_scaling(target.scaling));
        }
        let differs = rate.is_some() || temperature.is_some();
        differs.then(|| self.camera.with_rate(rate).with_temperature(temperature))
    }
}

/// Returns a copy of a configuration.
// Not inlined: the copy is then made where it stays, and not on the stack first.
#[inline(never)]
fn copy_of(config: &Config) -> Config {
    config.clone()
}
