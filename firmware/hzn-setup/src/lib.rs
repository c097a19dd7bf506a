//! What the sensor does once, or once a picture, and not once a point: compiled for size, where the rest is compiled
//! for speed (the profile in `firmware/Cargo.toml`). hzn-core's functions are generic, so they are compiled as the
//! crate is that calls them.

#![no_std]
#![forbid(unsafe_code)]

use hzn_core::body::{Expected, PriorError};
use hzn_core::error::ConfigError;
use hzn_core::{Config, Prior, Sensor};

/// As [`Sensor::new`].
///
/// # Errors
/// The first field out of its limits.
#[inline(never)]
pub fn sensor(config: &Config) -> Result<Sensor<f32>, ConfigError> {
    Sensor::new(config)
}

/// As [`Sensor::expect`].
///
/// # Errors
/// An altitude or a position that cannot be.
#[inline(never)]
pub fn expect(sensor: &Sensor<f32>, frame: &Prior<f32>) -> Result<Expected<f32>, PriorError> {
    sensor.expect(frame)
}
