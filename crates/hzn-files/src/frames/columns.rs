//! The columns of frames.csv. The reader finds its cells by these names, and the JSON schema is made of them.

use serde_json::{Map, Value, json};

/// Columns of the position. They belong together, as those of the other vectors.
pub(super) const POSITION: [&str; 3] = ["x_km", "y_km", "z_km"];
pub(super) const ATTITUDE: [&str; 4] = ["qw", "qx", "qy", "qz"];
pub(super) const SUN: [&str; 3] = ["sun_x", "sun_y", "sun_z"];
pub(super) const RATE: [&str; 3] = ["rate_x", "rate_y", "rate_z"];
pub(super) const POLE: [&str; 3] = ["pole_x", "pole_y", "pole_z"];

/// The values that a cell can have.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Cell {
    /// The name of a picture.
    Name,
    /// A time in UTC.
    Utc,
    /// Any finite number.
    Number,
    /// A number of at least this value.
    AtLeast(f64),
    /// A number above 0.
    Positive,
    /// A component of a unit quaternion. Its length may differ a little from 1.
    OfUnit,
}

struct Column {
    name: &'static str,
    cell: Cell,
    doc: &'static str,
}

macro_rules! columns {
    ($($name:literal, $cell:expr, $doc:literal;)*) => {
        /// Names of the columns that are read.
        pub const COLUMNS: &[&str] = &[$($name),*];
        const ALL: &[Column] = &[$(Column { name: $name, cell: $cell, doc: $doc }),*];
    };
}

columns! {
    "file", Cell::Name, "Name of the picture; `./` before it does not count.";
    "time_s", Cell::Number, "Time in seconds, any epoch.";
    "utc", Cell::Utc,
        "Time in UTC (ISO 8601). It is the time if `time_s` is empty, and gives the positions of Sun and Moon.";
    "altitude_km", Cell::AtLeast(-1.0), "Altitude in kilometres: above WGS-84 for `earth`, else above the radius.";
    "x_km", Cell::Number, "Position in ECEF, x, kilometres; used instead of the altitude.";
    "y_km", Cell::Number, "Position in ECEF, y, kilometres; used instead of the altitude.";
    "z_km", Cell::Number, "Position in ECEF, z, kilometres; used instead of the altitude.";
    "qw", Cell::OfUnit,
        "Prior attitude, camera to ECEF, or to the axes of an ellipsoid: component w; the length is 1.";
    "qx", Cell::OfUnit,
        "Prior attitude, camera to ECEF, or to the axes of an ellipsoid: component x; the length is 1.";
    "qy", Cell::OfUnit,
        "Prior attitude, camera to ECEF, or to the axes of an ellipsoid: component y; the length is 1.";
    "qz", Cell::OfUnit,
        "Prior attitude, camera to ECEF, or to the axes of an ellipsoid: component z; the length is 1.";
    "attitude_sigma_deg", Cell::Positive, "1-sigma of that attitude, degrees.";
    "sun_x", Cell::Number, "Direction to the Sun in the camera frame, x.";
    "sun_y", Cell::Number, "Direction to the Sun in the camera frame, y.";
    "sun_z", Cell::Number, "Direction to the Sun in the camera frame, z.";
    "rate_x", Cell::Number, "Rate of rotation of the camera relative to the Earth, camera axis x, rad/s.";
    "rate_y", Cell::Number, "Rate of rotation of the camera relative to the Earth, camera axis y, rad/s.";
    "rate_z", Cell::Number, "Rate of rotation of the camera relative to the Earth, camera axis z, rad/s.";
    "pole_x", Cell::Number, "Direction to the north pole of a body of revolution in the camera frame, x.";
    "pole_y", Cell::Number, "Direction to the north pole of a body of revolution in the camera frame, y.";
    "pole_z", Cell::Number, "Direction to the north pole of a body of revolution in the camera frame, z.";
    "range_km", Cell::Positive, "Distance of the camera from the body's centre, kilometres.";
    "range_sigma_km", Cell::Positive, "1-sigma of that distance, kilometres.";
    "camera_temperature_c", Cell::Number,
        "Temperature of the camera, degrees Celsius, for the lens of camera.temperature.";
}

/// Returns the JSON schema of a row, in the draft 2020-12. An empty cell is null.
pub fn schema() -> Value {
    let number = || json!(["number", "null"]);
    let property = |column: &Column| {
        let mut value = match column.cell {
            Cell::Name => json!({"type": "string", "minLength": 1}),
            Cell::Utc => json!({"type": ["string", "null"], "format": "date-time"}),
            Cell::Number => json!({"type": number()}),
            Cell::AtLeast(least) => json!({"type": number(), "minimum": least}),
            Cell::Positive => json!({"type": number(), "exclusiveMinimum": 0}),
            Cell::OfUnit => json!({"type": number(), "minimum": -1.01, "maximum": 1.01}),
        };
        value["description"] = json!(column.doc);
        (column.name.to_owned(), value)
    };
    let of_body = |doc: &str| json!({"type": number(), "description": doc});
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "frames.csv",
        "description": "A row of frames.csv. An empty cell is null.",
        "type": "object",
        "required": ["file"],
        "properties": ALL.iter().map(property).collect::<Map<_, _>>(),
        "patternProperties": {
            "^q_[a-z0-9-]+_[wxyz]$":
                of_body("Orientation of the second and third body, by its name, for example `q_enceladus_w`."),
            "^pole_[a-z0-9-]+_[xyz]$":
                of_body("Direction to the north pole of the second and third body, by its name."),
        },
        "dependentRequired": together(),
        "additionalProperties": false,
    })
}

/// Returns the other components of a vector for each of its columns.
fn together() -> Map<String, Value> {
    let vectors: [&[&str]; 5] = [&POSITION, &ATTITUDE, &SUN, &RATE, &POLE];
    let others = |names: &[&str], name: &str| json!(names.iter().filter(|n| **n != name).collect::<Vec<_>>());
    let of_vector = |names: &&[&str]| names.iter().map(|n| ((*n).to_owned(), others(names, n))).collect::<Vec<_>>();
    vectors.iter().flat_map(of_vector).collect()
}
