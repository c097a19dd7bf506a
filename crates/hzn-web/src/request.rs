//! What the page can ask for.

use serde::Deserialize;

/// A request of the page.
#[derive(Debug, Deserialize)]
#[serde(tag = "call", rename_all = "kebab-case", deny_unknown_fields)]
pub(crate) enum Request {
    /// Write a sensor.toml to start from, as `hzn init` does.
    Start(Known),
    /// Process the picture, as `hzn run` and `hzn explain` do.
    Process(Settings),
}

/// What the user knows about the camera.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Known {
    /// Name of the picture.
    pub(crate) name: String,
    /// Field of view over the whole width, in degrees.
    pub(crate) fov_deg: Option<f64>,
    /// `pinhole` or `fisheye`.
    pub(crate) lens: Option<String>,
    /// Altitude in kilometres.
    pub(crate) altitude_km: Option<f64>,
}

/// The sensor for the picture.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Settings {
    /// Name of the picture.
    pub(crate) name: String,
    /// Text of the sensor.toml.
    pub(crate) sensor_toml: String,
    /// Fixed threshold as a part of full scale, which replaces the one of the text.
    pub(crate) threshold: Option<f64>,
}
