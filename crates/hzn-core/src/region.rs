//! The part of the picture that counts: the picture itself, cut by the image circle and by masked polygons.

use crate::camera;
use crate::error::{ConfigError, Limit, between, require};

/// Most corners of one polygon.
pub const MAX_CORNERS: usize = 16;
/// Most polygons.
pub const MAX_POLYGONS: usize = 8;

/// Corners (x, y) of a polygon in pixels; the last is joined to the first.
pub type Polygon = heapless::Vec<[f64; 2], MAX_CORNERS>;

/// `[mask]` of sensor.toml.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct Config {
    /// Up to 8 polygons of 3 to 16 corners each; what lies inside is never lit, and its outline never an edge.
    pub polygons_px: heapless::Vec<Polygon, MAX_POLYGONS>,
}

impl Config {
    pub(crate) fn check(&self, camera: &camera::Config) -> Result<(), ConfigError> {
        let reach = f64::from(camera.width.max(camera.height)) * 4.0;
        for polygon in &self.polygons_px {
            let n = polygon.len();
            require(n >= 3, "mask.polygons_px", n as f64, Limit::Rule("a polygon needs at least 3 corners"))?;
            for corner in polygon {
                between("mask.polygons_px", corner[0], -reach, reach)?;
                between("mask.polygons_px", corner[1], -reach, reach)?;
            }
        }
        Ok(())
    }
}
