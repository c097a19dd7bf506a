//! The formats of calibration files, and what they cannot express.

use std::fmt;

use hzn_core::camera::{Config, Model, Projection};

/// A format of calibration files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// `[camera]` of a sensor.toml.
    Sensor,
    /// A Kalibr camchain with one camera, `cam0`.
    Kalibr,
    /// OpenCV's YAML, as its calibration sample writes it.
    OpenCv,
    /// The same as XML of OpenCV's FileStorage.
    OpenCvXml,
    /// The same as JSON of OpenCV's FileStorage.
    OpenCvJson,
    /// A EuRoC `sensor.yaml`, without the camera's pose on its vehicle.
    Euroc,
    /// ROS's camera_info, as camera_info_manager reads it (YAML).
    Ros,
    /// Foxglove's CameraCalibration (JSON).
    Foxglove,
}

/// Error of a lens that the format cannot express.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnsupportedLens {
    /// The part of the lens that the format cannot express.
    pub what: &'static str,
    /// The format.
    pub format: Format,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Sensor => "sensor.toml",
            Self::Kalibr => "Kalibr camchain",
            Self::OpenCv => "OpenCV YAML",
            Self::OpenCvXml => "OpenCV XML",
            Self::OpenCvJson => "OpenCV JSON",
            Self::Euroc => "EuRoC sensor.yaml",
            Self::Ros => "ROS camera_info",
            Self::Foxglove => "Foxglove CameraCalibration",
        })
    }
}

impl fmt::Display for UnsupportedLens {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the format {} cannot express {}", self.format, self.what)
    }
}

impl std::error::Error for UnsupportedLens {}

/// Refuses the lenses that only Kalibr can express: the projections with coefficients of their own.
pub(super) fn refuse_own_projection(c: &Config, format: Format) -> Result<(), UnsupportedLens> {
    match c.model.projection() {
        Projection::Angle | Projection::Plane => Ok(()),
        Projection::Own => Err(unsupported_projection(c, format)),
    }
}

pub(super) fn unsupported_projection(c: &Config, format: Format) -> UnsupportedLens {
    let what = match c.model {
        Model::DoubleSphere => "the double sphere lens",
        Model::Eucm => "the enhanced unified camera model",
        other => other.name(),
    };
    UnsupportedLens { what, format }
}
