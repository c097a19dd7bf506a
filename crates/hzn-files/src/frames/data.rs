//! The rows of a frames.csv.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

use hzn_core::Prior;
use hzn_core::body::{self, PriorError};
use hzn_core::frames::{Cam, Rotation, UnitVec3, Vehicle};
use hzn_core::real::Real;
use serde::{Deserialize, Serialize};

use crate::Problem;
use crate::rig::turn_after;

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
    /// Temperature of the camera, °C.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera_temperature_c: Option<f64>,
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
            year_part: self.utc_s.map(|s| T::from_f64(body::year_part(s / 86_400.0))),
            last: None,
            rate_rad_s: self.rate_rad_s.map(|rate| rate.map(T::from_f64)),
            camera_temperature_c: self.camera_temperature_c.map(T::from_f64),
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

    /// Returns the row of a vehicle, whose attitude and directions are in the axes of the vehicle, as the row of a
    /// camera on it.
    #[must_use]
    pub fn seen_by_camera(&self, q_vehicle_from_camera_wxyz: [f64; 4]) -> Self {
        let mount = Rotation::<Cam, Vehicle, f64>::assume_from_quaternion(q_vehicle_from_camera_wxyz);
        // The length of a vector is kept: a rate has one.
        let into_camera = |v: [f64; 3]| {
            let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            let turned = mount.as_ref().zip(UnitVec3::try_new(v)).map(|(mount, v)| mount.inverse().apply(&v).xyz());
            turned.map_or([0.0; 3], |v| v.map(|x| x * length))
        };
        let attitude = |q: Option<[f64; 4]>| q.map(|q| turn_after(q, q_vehicle_from_camera_wxyz));
        let body = |other: &Orientation| Orientation {
            body: other.body.clone(),
            q_fixed_from_camera_wxyz: attitude(other.q_fixed_from_camera_wxyz),
            pole_camera: other.pole_camera.map(into_camera),
        };
        Self {
            q_fixed_from_camera_wxyz: attitude(self.q_fixed_from_camera_wxyz),
            sun_camera: self.sun_camera.map(into_camera),
            rate_rad_s: self.rate_rad_s.map(into_camera),
            pole_camera: self.pole_camera.map(into_camera),
            other_bodies: self.other_bodies.iter().map(body).collect(),
            ..self.clone()
        }
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
    /// The rows that are not in [`Self::rows`], because their pictures are not processed.
    pub unused: Unused,
    by_file: HashMap<String, usize>,
    /// Any row of the file has a time, or gives the distance from the body.
    has_times: bool,
    has_distances: bool,
}

/// The rows of pictures that are not processed.
#[derive(Debug, Clone, Default)]
pub struct Unused {
    /// Number of these rows.
    pub rows: usize,
    /// The first of them, at most [`Self::LISTED`].
    pub first: Vec<FrameData>,
    /// How their names would be those of pictures, in words; `None` if they would not be.
    pub other_names: Option<String>,
}

impl Unused {
    /// Number of rows that are kept for messages.
    pub const LISTED: usize = 3;
}

/// Returns the name of a picture without `./`, which `find . -name '*.png'` puts before it.
pub(super) fn plain_name(mut file: &str) -> &str {
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
        self.see(&row);
        self.rows.push(row);
    }

    /// Counts a row whose picture is not processed.
    pub(super) fn leave_out(&mut self, row: FrameData) {
        self.see(&row);
        self.unused.rows += 1;
        if self.unused.first.len() < Unused::LISTED {
            self.unused.first.push(row);
        }
    }

    fn see(&mut self, row: &FrameData) {
        self.has_times |= row.time_s.is_some();
        self.has_distances |= row.altitude_km.is_some() || row.position_km.is_some() || row.range_km.is_some();
    }

    /// Returns the row of the picture with this name.
    pub fn get(&self, file: &str) -> Option<&FrameData> {
        self.by_file.get(plain_name(file)).and_then(|&i| self.rows.get(i))
    }

    /// Returns the row whose time is nearest to this one, if it is at most `within_s` away. The rows are in the order
    /// of time, as [`load_vehicle`](super::load_vehicle) requires it.
    pub fn nearest(&self, time_s: f64, within_s: f64) -> Option<&FrameData> {
        let at = |i: usize| self.rows.get(i).and_then(|row| Some((row, (row.time_s? - time_s).abs())));
        let after = self.rows.partition_point(|row| row.time_s.is_some_and(|t| t < time_s));
        let both = after.checked_sub(1).and_then(at).into_iter().chain(at(after));
        both.filter(|(_, away_s)| *away_s <= within_s).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(row, _)| row)
    }

    /// Returns the table of a vehicle as the table of a camera on it, see [`FrameData::seen_by_camera`]. The warnings
    /// are left out, because they are those of the file.
    #[must_use]
    pub fn seen_by_camera(&self, q_vehicle_from_camera_wxyz: [f64; 4]) -> Self {
        let rows = self.rows.iter().map(|row| row.seen_by_camera(q_vehicle_from_camera_wxyz)).collect();
        Self { rows, warnings: Vec::new(), ..self.clone() }
    }

    /// Returns whether any row has more than the name and the time of a picture.
    pub fn has_priors(&self) -> bool {
        let bare = |row: &FrameData| FrameData {
            file: row.file.clone(),
            line: row.line,
            time_s: row.time_s,
            utc_s: row.utc_s,
            ..FrameData::default()
        };
        self.rows.iter().any(|row| *row != bare(row))
    }

    /// Returns whether any picture has a time. The file is then the only clock of the sequence.
    pub fn has_times(&self) -> bool {
        self.has_times
    }

    /// Returns whether any picture has an altitude, a position or a distance from the body's centre.
    pub fn has_distances(&self) -> bool {
        self.has_distances
    }

    /// Returns the problem with a row that hzn-core refused, with the refused value.
    pub fn problem_of_prior(&self, row: &FrameData, error: PriorError) -> Problem {
        let value = match error {
            PriorError::Altitude => row.altitude_km.map(|h| format!("{h}")),
            PriorError::Position => row.position_km.map(|[x, y, z]| format!("{x}, {y}, {z}")),
            PriorError::AttitudeSigma => row.attitude_sigma_deg.map(|deg| format!("{deg}")),
            PriorError::Rate => row.rate_rad_s.map(|[x, y, z]| format!("{x}, {y}, {z}")),
            PriorError::Attitude => row.q_fixed_from_camera_wxyz.map(|[w, x, y, z]| format!("{w}, {x}, {y}, {z}")),
            PriorError::Temperature => row.camera_temperature_c.map(|c| format!("{c}")),
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

    #[test]
    fn a_camera_sees_the_vehicles_directions_in_its_own_axes() {
        let half = 0.5f64.sqrt();
        let row = FrameData {
            altitude_km: Some(500.0),
            q_fixed_from_camera_wxyz: Some([1.0, 0.0, 0.0, 0.0]),
            sun_camera: Some([0.0, 1.0, 0.0]),
            rate_rad_s: Some([0.0, 0.02, 0.0]),
            ..FrameData::default()
        };
        // The camera's x axis is the vehicle's y axis.
        let seen = row.seen_by_camera([half, 0.0, 0.0, half]);
        let close = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-15);
        assert!(close(seen.sun_camera.unwrap(), [1.0, 0.0, 0.0]) && close(seen.rate_rad_s.unwrap(), [0.02, 0.0, 0.0]));
        assert_eq!((seen.q_fixed_from_camera_wxyz, seen.altitude_km), (Some([half, 0.0, 0.0, half]), Some(500.0)));
    }
}
