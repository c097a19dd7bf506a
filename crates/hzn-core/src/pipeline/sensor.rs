//! A configuration that was accepted, with everything that follows from it.

use crate::base::error::ConfigError;
use crate::base::real::Real;
use crate::config::{Config, Mount};
use crate::geometry::camera::Camera;
use crate::geometry::frames::{Body, Cam, Rotation};
use crate::image::region::Region;
use crate::model::body::{Expected, Prior, PriorError};

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
#[derive(Debug, Clone)]
pub struct Sensor<T> {
    pub(super) config: Config,
    pub(super) camera: Camera<T>,
    pub(super) region: Region<T>,
    pub(super) cam_to_body: Option<Rotation<Cam, Body, T>>,
}
impl<T: Real> Sensor<T> {
    /// Makes a sensor. Checks the whole configuration first.
    ///
    /// # Errors
    /// Returns the first field that is out of its limits.
    // Not inlined: the temporary values, some kilobytes, must not lie on the caller's stack.
    #[inline(never)]
    pub fn new(config: &Config) -> Result<Self, ConfigError> {
        config.check()?;
        let camera = Camera::try_new(&config.camera)?;
        let turn = |m: Mount| Rotation::assume_from_quaternion(m.q_body_from_camera_wxyz.map(T::from_f64));
        Ok(Self {
            region: Region::new(&config.mask, &camera),
            cam_to_body: config.mount.and_then(turn),
            camera,
            config: config.clone(),
        })
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
        Ok(Expected { which: which as u8, ..Expected::new(body, frame)? })
    }

    /// Returns the camera as it turns while a picture is read out row by row; `None` if the rate is unknown or there is
    /// no rolling shutter.
    pub(super) fn turning(&self, expected: &Expected<T>) -> Option<Camera<T>> {
        let rate = expected.rate_rad_s.filter(|_| self.camera.has_rolling_shutter())?;
        Some(self.camera.with_rate(Some(rate)))
    }
}
