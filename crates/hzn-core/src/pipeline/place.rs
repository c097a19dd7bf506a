//! A place for a sensor, which is empty until a configuration is accepted.

use super::prepared::{self, PreparedError};
use super::sensor::Sensor;
use crate::base::error::ConfigError;
use crate::base::packed::Packed;
use crate::base::real::Real;
use crate::config::Config;
use crate::geometry::camera::Camera;

/// A place for a [`Sensor`]: an empty one is all zeros, so in a `static` it takes no flash.
///
/// [`Horizon`](super::Horizon) has one together with its lists. Use this type if several sensors share one
/// [`Workspace`](super::Workspace).
///
/// ```
/// use hzn_core::camera::{self, Model};
/// use hzn_core::{Config, SensorPlace};
/// use static_cell::ConstStaticCell;
///
/// static PLACES: ConstStaticCell<[SensorPlace<f32>; 2]> =
///     ConstStaticCell::new([SensorPlace::empty(), SensorPlace::empty()]);
///
/// let [left, right] = PLACES.try_take().ok_or("the sensors are in use")?;
/// left.configure(&Config::new(camera::Config::ideal(Model::Pinhole, 64, 48, 60.0)))?;
/// assert!(left.sensor().is_some() && right.sensor().is_none());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
// A list of at most one element and not an `Option`: the tag of an `Option` is a value that one of the sensor's bytes
// never has, and need not be zero. One such byte would put the whole static, lists included, into flash.
#[derive(Debug, Clone)]
pub struct SensorPlace<T>(heapless::Vec<Sensor<T>, 1>);

impl<T: Real> SensorPlace<T> {
    /// Makes an empty place.
    pub const fn empty() -> Self {
        Self(heapless::Vec::new())
    }

    /// Makes a sensor with this configuration here. Checks the whole configuration first: if it is refused, nothing
    /// changes.
    ///
    /// # Errors
    /// Returns the first field that is out of its limits.
    // Not inlined: its temporary values must not stay on the stack while a picture is processed. There is no `Result`
    // of a sensor, because it would be on the stack a second time.
    #[inline(never)]
    pub fn configure(&mut self, config: &Config) -> Result<(), ConfigError> {
        self.put(config, Sensor::check(config)?);
        Ok(())
    }

    /// Puts the sensor of a configuration that was checked here.
    // A function of its own: the sensor on its way into its place must not be on the stack during the check.
    #[inline(never)]
    fn put(&mut self, config: &Config, camera: Camera<T>) {
        self.0.clear();
        // The list has room, because it is empty.
        let _ = self.0.push(Sensor::from_checked(config, camera));
    }

    /// Makes the sensor that [`Sensor::prepare`] wrote here. If the bytes are refused, nothing changes.
    ///
    /// # Errors
    /// The bytes are not those of a sensor for this program, or they were changed.
    #[inline(never)]
    pub fn load(&mut self, bytes: &[u8]) -> Result<(), PreparedError> {
        prepared::check::<T>(bytes)?;
        self.put_prepared(bytes);
        Ok(())
    }

    /// Puts the sensor of bytes that were checked here.
    #[inline(never)]
    fn put_prepared(&mut self, bytes: &[u8]) {
        self.0.clear();
        let mut from = prepared::values(bytes);
        let _ = self.0.push(Sensor::unpack(&mut from));
        if let Some(sensor) = self.0.first_mut() {
            sensor.read_lists(&mut from);
        }
    }

    /// Returns the sensor; `None` if the place is empty.
    pub fn sensor(&self) -> Option<&Sensor<T>> {
        self.0.first()
    }
}

impl<T: Real> Default for SensorPlace<T> {
    fn default() -> Self {
        Self::empty()
    }
}
