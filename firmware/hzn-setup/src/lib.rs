//! The functions that the sensor calls once, or once per picture, but not once per point. They are compiled for size,
//! the rest for speed (the profile `flight` in `Cargo.toml`). The functions of hzn-core are generic, so they are
//! compiled with the settings of the crate that calls them.

#![no_std]
#![forbid(unsafe_code)]

use hzn_core::body::{Expected, PriorError};
use hzn_core::error::ConfigError;
use hzn_core::prepared::PreparedError;
use hzn_core::{Config, Prior, Sensor, SensorPlace};

/// Same as [`Sensor::new`].
///
/// # Errors
/// Returns the first field that is out of its limits.
#[inline(never)]
pub fn new_sensor(config: &Config) -> Result<Sensor<f32>, ConfigError> {
    Sensor::new(config)
}

/// Same as [`SensorPlace::load`].
///
/// # Errors
/// The bytes are not those of a sensor for this program, or they were changed.
#[inline(never)]
pub fn load(place: &mut SensorPlace<f32>, bytes: &[u8]) -> Result<(), PreparedError> {
    place.load(bytes)
}

/// Same as [`Sensor::expect`].
///
/// # Errors
/// The altitude or the position is impossible.
#[inline(never)]
pub fn expect(sensor: &Sensor<f32>, prior: &Prior<f32>) -> Result<Expected<f32>, PriorError> {
    sensor.expect(prior)
}
