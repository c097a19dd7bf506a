//! `frames.csv`: what is known about every picture before it is processed.
//!
//! Columns are found by name. Only `file` is required; an empty cell is an unknown value.
//!
//! | column | meaning |
//! |---|---|
//! | `file` | name of the picture in the folder |
//! | `time_s` | time in seconds, any epoch |
//! | `utc` | the same as ISO 8601; it is used if `time_s` is empty |
//! | `altitude_km` | geodetic above WGS-84 for `earth`, else above the radius |
//! | `x_km`, `y_km`, `z_km` | position in ECEF; it overrides the altitude |
//! | `qw`, `qx`, `qy`, `qz` | prior attitude, camera to ECEF |
//! | `attitude_sigma_deg` | 1σ of that attitude, 5 if it is empty; above 30 the attitude is not used |
//! | `sun_x`, `sun_y`, `sun_z` | direction to the Sun in the camera frame |
//! | `rate_x`, `rate_y`, `rate_z` | rate of rotation of the camera in the camera frame, rad/s; for a rolling shutter |

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use hzn_core::body::{Kind, PriorError};
use hzn_core::ellipsoid::{WGS84_A_M, WGS84_B_M, geodetic};
use hzn_core::frames::{Rotation, UnitVec3};
use hzn_core::real::Real;
use hzn_core::{Config, Prior};

use crate::nearest::nearest;
use crate::{Problem, plausible, time};

/// Names of the columns that are read.
pub const COLUMNS: &[&str] = &[
    "file",
    "time_s",
    "utc",
    "altitude_km",
    "x_km",
    "y_km",
    "z_km",
    "qw",
    "qx",
    "qy",
    "qz",
    "attitude_sigma_deg",
    "sun_x",
    "sun_y",
    "sun_z",
    "rate_x",
    "rate_y",
    "rate_z",
];

/// One row: the prior of one picture.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrameData {
    /// Name of the picture.
    pub file: String,
    /// Line of the row in the file, from 1.
    pub line: usize,
    /// Time in seconds: `time_s`, or `utc` since 1970 if `time_s` is empty.
    pub time_s: Option<f64>,
    /// `utc` in seconds since 1970.
    pub utc_s: Option<f64>,
    /// Altitude in kilometres: geodetic above WGS-84 for `earth`, else above the radius.
    pub altitude_km: Option<f64>,
    /// Position in ECEF, kilometres.
    pub position_km: Option<[f64; 3]>,
    /// Prior attitude, camera to ECEF, scalar first.
    pub camera_to_ecef_wxyz: Option<[f64; 4]>,
    /// 1-sigma of that attitude in degrees.
    pub attitude_sigma_deg: Option<f64>,
    /// Direction to the Sun in the camera frame.
    pub sun_camera: Option<[f64; 3]>,
    /// Rate of rotation of the camera in the camera frame, rad/s.
    pub rate_rad_s: Option<[f64; 3]>,
}

impl FrameData {
    /// Converts the row to a prior of the pipeline, in metres and radians. `altitude_km` of the row overrides
    /// `default_altitude_km`.
    pub fn to_frame<T: Real>(&self, default_altitude_km: Option<f64>) -> Prior<T> {
        Prior {
            altitude_m: self.altitude_km.or(default_altitude_km).map(|km| T::from_f64(km * 1e3)),
            position_m: self.position_km.map(|p| p.map(|km| T::from_f64(km * 1e3))),
            cam_to_ecef: self.camera_to_ecef_wxyz.and_then(|q| Rotation::assume_from_quaternion(q.map(T::from_f64))),
            attitude_sigma_rad: self.attitude_sigma_deg.map(|deg| T::from_f64(deg.to_radians())),
            level: None,
            sun: self.sun_camera.and_then(|s| UnitVec3::try_new(s.map(T::from_f64))),
            last: None,
            rate_rad_s: self.rate_rad_s.map(|rate| rate.map(T::from_f64)),
        }
    }
}

/// Returns the altitude in kilometres of a position (ECEF, kilometres): above WGS-84 for `earth`, else above the
/// radius. The result is `None` for Sun and Moon, because a position relative to the Earth does not give their
/// distance.
pub fn altitude_at_km(position_km: [f64; 3], kind: Kind, radius_km: f64) -> Option<f64> {
    match kind {
        Kind::Earth => Some(geodetic(position_km.map(|km| km * 1e3), WGS84_A_M, WGS84_B_M).0 / 1e3),
        Kind::Sun | Kind::Moon => None,
        _ => Some(position_km.iter().map(|x| x * x).sum::<f64>().sqrt() - radius_km),
    }
}

/// Largest plausible distance of a camera, in radii of the body: about twice the Moon's distance from the Earth.
const FARTHEST_RADII: f64 = 120.0;
/// Largest plausible rate of the altitude, in km/s. Objects that fly by the Earth reach 11 to 20 km/s.
const FASTEST_KM_S: f64 = 30.0;

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

impl Frames {
    /// Returns the row of the picture with this name.
    pub fn get(&self, file: &str) -> Option<&FrameData> {
        self.by_file.get(file).and_then(|&i| self.rows.get(i))
    }

    /// Returns whether any picture has a time. The file is then the only clock of the sequence.
    pub fn has_times(&self) -> bool {
        self.rows.iter().any(|row| row.time_s.is_some())
    }

    /// Runs [`Self::check_altitudes`] for every body of a sensor. A warning is returned only once.
    pub fn check_sensor(&self, config: &Config) -> Vec<Problem> {
        let bodies = config.each_body();
        // If Sun or Moon are sought together with the Earth, the altitudes are those above the Earth.
        let only_free = bodies.iter().all(|b| b.half_angle_is_free());
        let mut warnings: Vec<Problem> = Vec::new();
        for body in bodies.iter().filter(|b| only_free || !b.half_angle_is_free()) {
            for warning in self.check_altitudes(body.kind, body.mean_radius_km()) {
                if !warnings.contains(&warning) {
                    warnings.push(warning);
                }
            }
        }
        warnings
    }

    /// Returns warnings for values that are possible but look wrong: altitude and position of a row that differ by more
    /// than 0.1 km, altitudes and positions that are probably in metres, and altitudes that are not used.
    pub fn check_altitudes(&self, kind: Kind, radius_km: f64) -> Vec<Problem> {
        let odd = |row: &FrameData| {
            let own = altitude_at_km(row.position_km?, kind, radius_km)?;
            if own > FARTHEST_RADII * radius_km {
                let what =
                    format!("the position is at {own:.0} km; x_km, y_km, z_km are kilometres: are the values in metres?");
                return Some(self.problem(row, what));
            }
            let h = row.altitude_km?;
            let what = format!("altitude_km is {h} but the position is at {own:.3} km; the position is used");
            ((own - h).abs() > 0.1).then(|| self.problem(row, what))
        };
        let mut warnings: Vec<Problem> = self.rows.iter().filter_map(odd).collect();
        warnings.extend(self.suspect_metres(kind, radius_km));
        if let (Some(what), Some(row)) =
            (plausible::unused_altitude(kind), self.rows.iter().find(|r| r.altitude_km.is_some()))
        {
            warnings.push(self.problem(row, format!("altitude_km {what}")));
        }
        warnings
    }

    /// Returns one warning if altitudes, or their change from row to row, are probably in metres.
    fn suspect_metres(&self, kind: Kind, radius_km: f64) -> Option<Problem> {
        if plausible::unused_altitude(kind).is_some() {
            return None;
        }
        let far = |row: &&FrameData| row.altitude_km.is_some_and(|h| h > plausible::far_km(kind, radius_km));
        if let Some(row) = self.rows.iter().find(far) {
            let h = row.altitude_km.unwrap_or_default();
            let what = format!("altitude_km is {h}, which is implausibly large; is it in metres?");
            return Some(self.problem(row, what));
        }
        let known: Vec<_> = self.rows.iter().filter_map(|r| Some((r, r.time_s?, r.altitude_km?))).collect();
        let rate = |(a, b): (&(_, f64, f64), &(_, f64, f64))| (b.2 - a.2) / (b.1 - a.1);
        let pairs = known.iter().zip(known.iter().skip(1)).filter(|(a, b)| b.1 > a.1);
        let (row, km_s) = pairs.map(|pair| (pair.1.0, rate(pair))).find(|(_, rate)| rate.abs() > FASTEST_KM_S)?;
        let what = format!("altitude_km changes by {km_s:.0} km/s, which is implausible; is it in metres?");
        Some(self.problem(row, what))
    }

    /// Returns the problem with a row that hzn-core refused, with the refused value.
    pub fn refused(&self, row: &FrameData, error: PriorError) -> Problem {
        let given = match error {
            PriorError::Altitude => row.altitude_km.map(|h| format!("{h}")),
            PriorError::Position => row.position_km.map(|[x, y, z]| format!("{x}, {y}, {z}")),
            PriorError::AttitudeSigma => row.attitude_sigma_deg.map(|deg| format!("{deg}")),
            PriorError::Rate => row.rate_rad_s.map(|[x, y, z]| format!("{x}, {y}, {z}")),
            PriorError::NoAltitude | PriorError::BelowLimb { .. } | PriorError::NoBody => None,
        };
        let given = given.map(|given| format!(", not {given}")).unwrap_or_default();
        self.problem(row, format!("{error}{given}"))
    }

    /// Returns a problem with one row. It names the line and the picture.
    pub fn problem(&self, row: &FrameData, what: impl std::fmt::Display) -> Problem {
        Problem::new(&self.path, format!("{what}")).at_line(row.line).in_field(row.file.clone())
    }
}

/// Reads a frames.csv.
///
/// # Errors
/// The file cannot be read, the column `file` is missing, a cell is not a finite number, a vector is incomplete, or a
/// picture has two rows.
pub fn load(path: &Path) -> Result<Frames, Problem> {
    let text = std::fs::read_to_string(path).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => Problem::new(path, "no such file"),
        _ => Problem::new(path, format!("cannot be read: {e}")),
    })?;
    parse(&text, path)
}

/// Reads a frames.csv as [`load`] does, but from text; `path` is only used in messages.
///
/// # Errors
/// The errors are those of [`load`].
pub fn parse(text: &str, path: &Path) -> Result<Frames, Problem> {
    // Spreadsheet programs write a byte-order mark first.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
    let header = reader.headers().map_err(|e| broken(&e, path))?.clone();
    let mut columns: HashMap<&str, usize> = HashMap::new();
    let mut warnings = Vec::new();
    for (i, name) in header.iter().enumerate() {
        if !COLUMNS.contains(&name) {
            let hint =
                nearest(name, COLUMNS.iter().copied()).map(|n| format!("; did you mean {n}?")).unwrap_or_default();
            let what = format!("unknown column, not used{hint}");
            warnings.push(Problem::new(path, what).at_line(1).in_field(name));
        } else if columns.insert(name, i).is_some() {
            return Err(Problem::new(path, "this column exists twice").at_line(1).in_field(name));
        }
    }
    if !columns.contains_key("file") {
        let found: Vec<&str> = header.iter().collect();
        let other =
            [(';', "semicolons"), ('\t', "tabs")].iter().find(|(c, _)| header.iter().any(|name| name.contains(*c)));
        let hint =
            other.map(|(_, what)| format!("; columns are separated by commas here, not by {what}")).unwrap_or_default();
        let what = format!(
            "the column `file` is missing (found: {}); it names the picture of each row{hint}",
            found.join(", ")
        );
        return Err(Problem::new(path, what).at_line(1));
    }
    let mut frames = Frames { path: path.to_owned(), rows: Vec::new(), warnings, by_file: HashMap::new() };
    for record in reader.records() {
        let record = record.map_err(|e| broken(&e, path))?;
        let line = record.position().map_or(0, |p| p.line() as usize);
        let cell = |name: &str| columns.get(name).and_then(|&i| record.get(i)).filter(|c| !c.is_empty());
        let row = Row { path, line, file: cell("file").unwrap_or_default().to_owned() };
        if row.file.is_empty() {
            return Err(row.problem("file", "is empty; it must name the picture"));
        }
        let number = |name: &str| row.number(name, cell(name));
        let data = FrameData {
            file: row.file.clone(),
            line,
            time_s: number("time_s")?,
            utc_s: row.utc(cell("utc"))?,
            altitude_km: number("altitude_km")?,
            position_km: row.vector(["x_km", "y_km", "z_km"], &number)?,
            camera_to_ecef_wxyz: row.vector(["qw", "qx", "qy", "qz"], &number)?,
            attitude_sigma_deg: number("attitude_sigma_deg")?,
            sun_camera: row.vector(["sun_x", "sun_y", "sun_z"], &number)?,
            rate_rad_s: row.vector(["rate_x", "rate_y", "rate_z"], &number)?,
        };
        let length = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        if data.camera_to_ecef_wxyz.is_some_and(|q| (length(&q) - 1.0).abs() > 0.01) {
            return Err(row.problem("qw, qx, qy, qz", "the quaternion's length must be 1"));
        }
        if data.sun_camera.is_some_and(|s| length(&s) < 1e-9) {
            return Err(
                row.problem("sun_x, sun_y, sun_z", "has no direction; leave the cells empty if it is not known")
            );
        }
        if let Some(&first) = frames.by_file.get(&row.file) {
            let before: usize = frames.rows.get(first).map_or(0, |r| r.line);
            return Err(row.problem("file", &format!("is also in line {before}; each picture has only one row")));
        }
        frames.by_file.insert(row.file.clone(), frames.rows.len());
        let time_s = data.time_s.or(data.utc_s);
        frames.rows.push(FrameData { time_s, ..data });
    }
    Ok(frames)
}

fn broken(error: &csv::Error, path: &Path) -> Problem {
    let line = error.position().map(|p| p.line() as usize);
    let what = match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("this row has {len} cells, but the header has {expected_len} columns")
        }
        csv::ErrorKind::Utf8 { .. } => "is not UTF-8 text".to_owned(),
        _ => format!("not valid CSV: {error}"),
    };
    let problem = Problem::new(path, what);
    match line {
        Some(line) => problem.at_line(line),
        None => problem,
    }
}

/// The row that is being read, for messages.
struct Row<'a> {
    path: &'a Path,
    line: usize,
    file: String,
}

impl Row<'_> {
    fn problem(&self, column: &str, what: &str) -> Problem {
        let field = if self.file.is_empty() { column.to_owned() } else { format!("{} {column}", self.file) };
        Problem::new(self.path, what).at_line(self.line).in_field(field)
    }

    fn number(&self, column: &str, cell: Option<&str>) -> Result<Option<f64>, Problem> {
        let Some(cell) = cell else { return Ok(None) };
        match cell.parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(Some(x)),
            _ if cell.contains(',') && cell.replacen(',', ".", 1).parse::<f64>().is_ok() => {
                Err(self.problem(column, &format!("{cell:?} has a decimal comma; write a point")))
            }
            _ => Err(self
                .problem(column, &format!("{cell:?} is not a finite number; leave the cell empty if it is not known"))),
        }
    }

    fn utc(&self, cell: Option<&str>) -> Result<Option<f64>, Problem> {
        let Some(cell) = cell else { return Ok(None) };
        let what = format!("{cell:?} is not a UTC time; write it as 2020-11-20T08:30:00Z");
        time::unix_seconds(cell).map(Some).ok_or_else(|| self.problem("utc", &what))
    }

    fn vector<const N: usize>(
        &self,
        names: [&str; N],
        number: &dyn Fn(&str) -> Result<Option<f64>, Problem>,
    ) -> Result<Option<[f64; N]>, Problem> {
        let mut out = [0.0; N];
        let mut missing = Vec::new();
        for (slot, name) in out.iter_mut().zip(names) {
            match number(name)? {
                Some(x) => *slot = x,
                None => missing.push(name),
            }
        }
        match missing.len() {
            0 => Ok(Some(out)),
            n if n == N => Ok(None),
            _ => Err(self.problem(&missing.join(", "), &format!("missing: {} belong together", names.join(", ")))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Frames, String> {
        parse(text, Path::new("frames.csv")).map_err(|e| e.to_string())
    }

    #[test]
    fn columns_by_name_and_empty_cells() {
        let f = read("altitude_km,file,utc,note\n230,a.png,1970-01-01T00:00:02Z,x\n,b.png,,\n").unwrap();
        assert_eq!(f.get("a.png").unwrap().altitude_km, Some(230.0));
        assert_eq!(f.get("a.png").unwrap().time_s, Some(2.0));
        assert_eq!(f.get("b.png").unwrap().altitude_km, None);
        assert!(f.get("c.png").is_none());
        assert_eq!(f.warnings[0].to_string(), "frames.csv:1: note: unknown column, not used");
    }

    #[test]
    fn rates_go_to_the_frame() {
        let f = read("file,altitude_km,rate_x,rate_y,rate_z\na.png,230,0.1,-0.2,0.3\nb.png,230,,,\n").unwrap();
        assert_eq!(f.rows[0].to_frame::<f64>(None).rate_rad_s, Some([0.1, -0.2, 0.3]));
        assert_eq!(f.rows[1].to_frame::<f64>(None).rate_rad_s, None);
    }

    #[test]
    fn wrong_cells_name_row_and_column() {
        assert_eq!(
            read("file,altitude_km\na.png,230\nb.png,NaN\n").unwrap_err(),
            "frames.csv:3: b.png altitude_km: \"NaN\" is not a finite number; leave the cell empty if it is not known"
        );
        assert_eq!(
            read("file,x_km,y_km,z_km\na.png,1,,3\n").unwrap_err(),
            "frames.csv:2: a.png y_km: missing: x_km, y_km, z_km belong together"
        );
        assert_eq!(
            read("file\na.png\na.png\n").unwrap_err(),
            "frames.csv:3: a.png file: is also in line 2; each picture has only one row"
        );
        assert_eq!(
            read("name,altitude\na,1\n").unwrap_err(),
            "frames.csv:1: the column `file` is missing (found: name, altitude); it names the picture of each row"
        );
        assert_eq!(
            read("file,time_s\na\n").unwrap_err(),
            "frames.csv:2: this row has 1 cells, but the header has 2 columns"
        );
        assert!(read("file,qw,qx,qy,qz\na,2,0,0,0\n").unwrap_err().contains("length must be 1"));
        assert!(
            read("file,sun_x,sun_y,sun_z\na,0,0,0\n").unwrap_err().contains("sun_x, sun_y, sun_z: has no direction")
        );
        // Spreadsheet programs of some countries write semicolons and decimal commas.
        assert!(
            read("file;altitude_km\r\na;1,5\r\n").unwrap_err().ends_with("separated by commas here, not by semicolons")
        );
        assert!(read("file\taltitude_km\n").unwrap_err().ends_with("not by tabs"));
        assert!(
            read("file,altitude_km\na,\"400,5\"\n")
                .unwrap_err()
                .contains("\"400,5\" has a decimal comma; write a point")
        );
    }

    #[test]
    fn altitude_and_position_that_disagree_are_said() {
        let f = read("file,altitude_km,x_km,y_km,z_km\na,400,6778.137,0,0\nb,401,6778.137,0,0\n").unwrap();
        let odd = f.check_altitudes(Kind::Earth, 6371.0);
        assert_eq!(odd.len(), 1);
        assert!(odd[0].to_string().starts_with("frames.csv:3: b: altitude_km is 401 but"), "{}", odd[0]);
    }

    #[test]
    fn altitudes_in_metres_are_suspected_once() {
        let odd = |text: &str, kind| {
            let all = read(text).unwrap().check_altitudes(kind, 6371.0);
            all.iter().map(ToString::to_string).collect::<Vec<_>>()
        };
        // A balloon: no altitude is too large, but the ascent is too fast.
        let balloon = "file,time_s,altitude_km\na,0,300\nb,60,600\nc,120,3900\n";
        let told = odd(balloon, Kind::Earth);
        assert_eq!(told.len(), 1);
        assert!(told[0].starts_with("frames.csv:4: c: altitude_km changes by 55 km/s"), "{told:?}");
        let orbit = odd("file,altitude_km\na,517500\nb,517600\n", Kind::Earth);
        assert_eq!(
            orbit,
            ["frames.csv:2: a: altitude_km is 517500, which is implausibly large; is it in metres?"]
        );
        assert!(odd("file,time_s,altitude_km\na,0,60\nb,1,61.5\nc,1,90\n", Kind::Earth).is_empty());
        let moon = odd("file,altitude_km\na,100\nb,100\n", Kind::Moon);
        assert!(moon.len() == 1 && moon[0].contains("altitude_km is not used: kind = \"moon\""), "{moon:?}");
    }

    #[test]
    fn metres_are_suspected() {
        let f = read("file,x_km,y_km,z_km\na,6778137,0,0\nb,6778.137,0,0\n").unwrap();
        let odd = f.check_altitudes(Kind::Earth, 6371.0);
        assert_eq!(odd.len(), 1);
        assert!(odd[0].to_string().contains("are the values in metres?"), "{}", odd[0]);
    }
}
