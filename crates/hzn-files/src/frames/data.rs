//! The rows of a frames.csv.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

use hzn_core::Prior;
use hzn_core::body::{self, PriorError};
use hzn_core::frames::{Rotation, UnitVec3};
use hzn_core::real::Real;
use serde::{Deserialize, Serialize};

use crate::Problem;

/// One row: the prior of one picture. Recordings store it as JSON, without what their rows have already: name, line and
/// time.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct FrameData {
    /// Name of the picture.
    #[serde(skip)]
    pub file: String,
    /// Line of the row in the file, from 1.
    #[serde(skip)]
    pub line: usize,
    /// Time in seconds: `time_s`, or `utc` since 1970 if `time_s` is empty.
    #[serde(skip)]
    pub time_s: Option<f64>,
    /// `utc` in seconds since 1970.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub utc_s: Option<f64>,
    /// Altitude in kilometres: geodetic above WGS-84 for `earth`, else above the radius.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub altitude_km: Option<f64>,
    /// Position in the fixed frame of the body (for the Earth ECEF), kilometres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_km: Option<[f64; 3]>,
    /// Prior attitude, from the camera to the fixed frame, scalar first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub q_fixed_from_camera_wxyz: Option<[f64; 4]>,
    /// 1-sigma of that attitude in degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attitude_sigma_deg: Option<f64>,
    /// Direction to the Sun in the camera frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sun_camera: Option<[f64; 3]>,
    /// Rate of rotation of the camera in the camera frame, rad/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_rad_s: Option<[f64; 3]>,
    /// Direction of the body's north pole in the camera frame, for a body whose position is fitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pole_camera: Option<[f64; 3]>,
    /// Distance of the camera from the body's centre, kilometres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range_km: Option<f64>,
    /// 1-sigma of that distance, kilometres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range_sigma_km: Option<f64>,
    /// Orientations of the second and third body, by name.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub other_bodies: Vec<Orientation>,
}

/// The orientation of a body that is not the first one of the sensor.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Orientation {
    /// Name of the body, see [`Kind::name`](hzn_core::body::Kind::name).
    pub body: String,
    /// Rotation from the camera to the axes of the body, scalar first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub q_fixed_from_camera_wxyz: Option<[f64; 4]>,
    /// Direction of its north pole in the camera frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pole_camera: Option<[f64; 3]>,
}

/// Largest difference of a quaternion's length from 1.
const MAX_LENGTH_ERROR: f64 = 0.01;

impl FrameData {
    /// Converts the row to a prior of the pipeline, in metres and radians. `altitude_km` of the row overrides
    /// `default_altitude_km`.
    pub fn to_prior<T: Real>(&self, default_altitude_km: Option<f64>) -> Prior<T> {
        Prior {
            altitude_m: self.altitude_km.or(default_altitude_km).map(|km| T::from_f64(km * 1e3)),
            position_m: self.position_km.map(|p| p.map(|km| T::from_f64(km * 1e3))),
            fixed_from_camera: self
                .q_fixed_from_camera_wxyz
                .and_then(|q| Rotation::assume_from_quaternion(q.map(T::from_f64))),
            attitude_sigma_rad: self.attitude_sigma_deg.map(|deg| T::from_f64(deg.to_radians())),
            level: None,
            // The engine adds it, because the ephemeris is not part of this crate.
            sun_elevation_rad: None,
            sun: self.sun_camera.and_then(|s| UnitVec3::try_new(s.map(T::from_f64))),
            last: None,
            rate_rad_s: self.rate_rad_s.map(|rate| rate.map(T::from_f64)),
            pole: self.pole_camera.and_then(|pole| UnitVec3::try_new(pole.map(T::from_f64))),
            range_m: self.range_km.map(|km| T::from_f64(km * 1e3)),
            range_sigma_m: self.range_sigma_km.map(|km| T::from_f64(km * 1e3)),
        }
    }

    /// Returns the row as the body number `which` of a sensor uses it. Position, distance and attitude belong to the
    /// first body; an ellipsoid further back has only the orientation of its own columns.
    ///
    /// # Errors
    /// The attitude of that body is not a rotation.
    pub fn for_body(&self, which: usize, body: &body::Config) -> Result<Cow<'_, Self>, PriorError> {
        if which == 0 || !body.is_ellipsoid() {
            return self.check_attitude().map(|()| Cow::Borrowed(self));
        }
        let own = self.other_bodies.iter().find(|other| other.body == body.kind.name()).cloned().unwrap_or_default();
        let row = Self {
            q_fixed_from_camera_wxyz: own.q_fixed_from_camera_wxyz,
            pole_camera: own.pole_camera,
            position_km: None,
            altitude_km: None,
            range_km: None,
            range_sigma_km: None,
            ..self.clone()
        };
        row.check_attitude().map(|()| Cow::Owned(row))
    }

    fn check_attitude(&self) -> Result<(), PriorError> {
        let length = |q: [f64; 4]| q.iter().map(|x| x * x).sum::<f64>().sqrt();
        match self.q_fixed_from_camera_wxyz {
            Some(q) if (length(q) - 1.0).abs() > MAX_LENGTH_ERROR => Err(PriorError::Attitude),
            _ => Ok(()),
        }
    }
}

/// A frames.csv that was read.
#[derive(Debug, Clone, Default)]
pub struct Frames {
    /// The file.
    pub path: PathBuf,
    /// Rows in the file's order.
    pub rows: Vec<FrameData>,
    /// Warnings, which do not stop the run.
    pub warnings: Vec<Problem>,
    by_file: HashMap<String, usize>,
}

/// Returns the name of a picture without `./`, which `find . -name '*.png'` puts before it.
fn plain_name(mut file: &str) -> &str {
    while let Some(rest) = file.strip_prefix("./") {
        file = rest;
    }
    file
}

impl Frames {
    /// Creates a file without rows.
    pub(super) fn new(path: &Path) -> Self {
        Self { path: path.to_owned(), ..Self::default() }
    }

    /// Appends a row. Its picture must not have a row yet.
    pub(super) fn push(&mut self, row: FrameData) {
        self.by_file.insert(plain_name(&row.file).to_owned(), self.rows.len());
        self.rows.push(row);
    }

    /// Returns the row of the picture with this name.
    pub fn get(&self, file: &str) -> Option<&FrameData> {
        self.by_file.get(plain_name(file)).and_then(|&i| self.rows.get(i))
    }

    /// Returns whether any picture has a time. The file is then the only clock of the sequence.
    pub fn has_times(&self) -> bool {
        self.rows.iter().any(|row| row.time_s.is_some())
    }

    /// Returns the problem with a row that hzn-core refused, with the refused value.
    pub fn problem_of_prior(&self, row: &FrameData, error: PriorError) -> Problem {
        let value = match error {
            PriorError::Altitude => row.altitude_km.map(|h| format!("{h}")),
            PriorError::Position => row.position_km.map(|[x, y, z]| format!("{x}, {y}, {z}")),
            PriorError::AttitudeSigma => row.attitude_sigma_deg.map(|deg| format!("{deg}")),
            PriorError::Rate => row.rate_rad_s.map(|[x, y, z]| format!("{x}, {y}, {z}")),
            PriorError::Attitude => row.q_fixed_from_camera_wxyz.map(|[w, x, y, z]| format!("{w}, {x}, {y}, {z}")),
            PriorError::Range => row.range_km.map(|km| format!("{km}")),
            PriorError::RangeSigma => row.range_sigma_km.map(|km| format!("{km}")),
            _ => None,
        };
        let refused = value.map(|value| format!(", not {value}")).unwrap_or_default();
        self.problem(row, format!("{error}{refused}"))
    }

    /// Returns a problem with one row. It names the line and the picture.
    pub fn problem(&self, row: &FrameData, what: impl std::fmt::Display) -> Problem {
        Problem::new(&self.path, format!("{what}")).at_line(row.line).in_field(row.file.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recording_stores_the_values_that_are_known() {
        let wxyz = Some([1.0, 0.0, 0.0, 0.0]);
        let moon = Orientation { body: "moon".into(), q_fixed_from_camera_wxyz: wxyz, pole_camera: None };
        let row = FrameData {
            file: "a.png".into(),
            line: 7,
            time_s: Some(1.5),
            altitude_km: Some(230.5),
            q_fixed_from_camera_wxyz: wxyz,
            other_bodies: vec![moon],
            ..FrameData::default()
        };
        let text = serde_json::to_string(&row).unwrap();
        let stored = r#"{"altitude_km":230.5,"q_fixed_from_camera_wxyz":[1.0,0.0,0.0,0.0],"other_bodies":["#;
        let other = r#"{"body":"moon","q_fixed_from_camera_wxyz":[1.0,0.0,0.0,0.0]}]}"#;
        assert_eq!(text, format!("{stored}{other}"));
        let read: FrameData = serde_json::from_str(&text).unwrap();
        assert_eq!(read, FrameData { file: String::new(), line: 0, time_s: None, ..row });
        assert_eq!(serde_json::to_string(&FrameData::default()).unwrap(), "{}");
    }
}
