//! The reasons why a scene cannot be rendered.

use hzn_core::error::ConfigError;

/// The reason why a scene cannot be rendered.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// The camera or another part of the sensor's configuration is out of its limits.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The position is not outside the body and its limb height, or the attitude is not a rotation.
    #[error("the camera must be outside the body and its limb height, and its quaternion must not be zero")]
    Pose,
    /// The direction to the Sun has no length.
    #[error("the direction to the Sun must not be zero")]
    Sun,
    /// There is no Moon in the scene.
    #[error("the scene has no Moon")]
    Moon,
    /// The picture cannot be encoded as JPEG.
    #[error("cannot be encoded as JPEG: {0}")]
    Jpeg(String),
}
