//! Reads a frames.csv.

use std::collections::{HashMap, HashSet};
use std::io::{self, Read};
use std::path::Path;

use csv::StringRecord;
use hzn_core::body::Kind;

use super::columns::{ATTITUDE, COLUMNS, POLE, POSITION, RATE, SUN};
use super::data::{FrameData, Frames, Orientation, plain_name};
use super::names;
use crate::nearest::nearest;
use crate::quoted::quoted;
use crate::separator::separator_hint;
use crate::unix_lines::UnixLines;
use crate::{Problem, limited, time};

/// Returns the name under which a column is kept, for a known column and for those of a further body: `q_BODY_w` to
/// `q_BODY_z` and `pole_BODY_x` to `pole_BODY_z`, with the name of a kind of body.
fn known_column(name: &str) -> Option<String> {
    let is_body = |rest: &str, ends: &[&str]| {
        ends.iter().any(|end| rest.strip_suffix(end).is_some_and(|body| Kind::ALL.iter().any(|k| k.name() == body)))
    };
    let of_body = name.strip_prefix("q_").is_some_and(|rest| is_body(rest, &["_w", "_x", "_y", "_z"]))
        || name.strip_prefix("pole_").is_some_and(|rest| is_body(rest, &["_x", "_y", "_z"]));
    (COLUMNS.contains(&name) || of_body).then(|| name.to_owned())
}

/// Largest number of rows: 18 hours at 30 pictures a second. They need less than 1 GB of memory.
const MAX_ROWS: usize = 2_000_000;

/// Reads a frames.csv.
///
/// # Errors
/// The file cannot be read, the column `file` is missing, a cell is not a finite number, a vector is incomplete, or a
/// picture has two rows.
pub fn load(path: &Path) -> Result<Frames, Problem> {
    read(open(path)?, path, Belongs::ToPicture, |_| true)
}

/// Reads the frames.csv of a vehicle with several cameras, as [`load`] does. Its rows belong to times and not to
/// pictures: attitude and directions are in the axes of the vehicle, and the column `file` is not needed.
///
/// # Errors
/// The errors are those of [`load`]; also a row without a time, or one that is not later than the row before it.
pub fn load_vehicle(path: &Path) -> Result<Frames, Problem> {
    in_order(read(open(path)?, path, Belongs::ToTime, |_| true)?)
}

/// Reads a frames.csv as [`load`] does, but keeps only the rows of these pictures. All other rows are checked and
/// counted ([`Frames::unused`]), so that a table of a million pictures needs no memory for the pictures that are not
/// processed. Whether two of the other rows name the same picture is not checked.
///
/// # Errors
/// The errors are those of [`load`].
pub fn load_for(path: &Path, pictures: impl IntoIterator<Item = String>) -> Result<Frames, Problem> {
    let pictures: HashSet<String> = pictures.into_iter().map(|name| plain_name(&name).to_owned()).collect();
    let mut frames = read(open(path)?, path, Belongs::ToPicture, |file| pictures.contains(plain_name(file)))?;
    let others: Vec<&str> = frames.unused.first.iter().map(|row| row.file.as_str()).collect();
    frames.unused.other_names = names::describe(&others, pictures.iter().map(String::as_str));
    Ok(frames)
}

fn open(path: &Path) -> Result<impl Read + use<>, Problem> {
    limited::open(path, limited::TABLE_BYTES).map_err(|e| match e.kind() {
        io::ErrorKind::NotFound => Problem::new(path, "no such file"),
        _ => cannot_read(path, &e),
    })
}

fn cannot_read(path: &Path, error: &io::Error) -> Problem {
    Problem::new(path, format!("cannot be read: {error}"))
}

/// Reads a frames.csv as [`load`] does, but from text; `path` is only used in messages.
///
/// # Errors
/// The errors are those of [`load`].
pub fn parse(text: &str, path: &Path) -> Result<Frames, Problem> {
    read(text.as_bytes(), path, Belongs::ToPicture, |_| true)
}

/// Reads the frames.csv of a vehicle as [`load_vehicle`] does, but from text; `path` is only used in messages.
///
/// # Errors
/// The errors are those of [`load_vehicle`].
pub fn parse_vehicle(text: &str, path: &Path) -> Result<Frames, Problem> {
    in_order(read(text.as_bytes(), path, Belongs::ToTime, |_| true)?)
}

/// Refuses rows that are not in the order of their times.
fn in_order(frames: Frames) -> Result<Frames, Problem> {
    let mut before: Option<f64> = None;
    for row in &frames.rows {
        match (row.time_s, before) {
            (None, _) => return Err(frames.problem(row, "time_s, utc: empty; a row of a vehicle needs its time")),
            (Some(time_s), Some(last)) if time_s <= last => {
                let what = format!("time_s: {time_s} is not later than the row before it; sort the rows by time");
                return Err(frames.problem(row, what));
            }
            (time_s, _) => before = time_s,
        }
    }
    Ok(frames)
}

/// What a row belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Belongs {
    /// The picture that `file` names.
    ToPicture,
    /// A time of the vehicle. `file` is only used in messages.
    ToTime,
}

fn read(
    contents: impl Read,
    path: &Path,
    belongs: Belongs,
    is_wanted: impl Fn(&str) -> bool,
) -> Result<Frames, Problem> {
    // The reader skips the byte-order mark that spreadsheet programs write first.
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(UnixLines::new(contents));
    let header = reader.headers().map_err(|e| translate_csv_error(&e, path))?.clone();
    let mut frames = Frames::new(path);
    let columns = Columns::find(&header, path, belongs, &mut frames.warnings)?;
    let mut record = StringRecord::new();
    while reader.read_record(&mut record).map_err(|e| translate_csv_error(&e, path))? {
        if frames.rows.len() + frames.unused.rows == MAX_ROWS {
            return Err(Problem::new(
                path,
                format!("has more than {MAX_ROWS} rows; divide the pictures into several runs"),
            ));
        }
        let row = Row::new(&record, &columns, path, belongs)?;
        let data = row.read()?;
        let data = FrameData { time_s: data.time_s.or(data.utc_s), ..data };
        if !is_wanted(&row.file) {
            frames.leave_out(data);
            continue;
        }
        if let Some(before) = frames.get(&row.file).filter(|_| belongs == Belongs::ToPicture) {
            return Err(row.problem("file", &format!("is also in line {}; each picture has only one row", before.line)));
        }
        frames.push(data);
    }
    Ok(frames)
}

fn translate_csv_error(error: &csv::Error, path: &Path) -> Problem {
    let line = error.position().map(|p| p.line() as usize);
    let what = match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("this row has {len} cells, but the header has {expected_len} columns")
        }
        csv::ErrorKind::Utf8 { .. } => "is not UTF-8 text".to_owned(),
        csv::ErrorKind::Io(e) => return cannot_read(path, e),
        _ => format!("not valid CSV: {error}"),
    };
    let problem = Problem::new(path, what);
    match line {
        Some(line) => problem.at_line(line),
        None => problem,
    }
}

/// The known columns of a file: their names and places.
struct Columns {
    places: HashMap<String, usize>,
    /// The bodies that have columns of their own.
    bodies: Vec<BodyColumns>,
}

/// The names of the columns of a further body.
struct BodyColumns {
    body: &'static str,
    q: [String; 4],
    pole: [String; 3],
}

/// Returns how a position is written, for a column of latitude or longitude; `None` for another column.
fn geodetic_hint(name: &str) -> Option<String> {
    let name = name.trim().to_ascii_lowercase();
    let is_angle = ["lat", "lon", "lng"].iter().any(|start| name.starts_with(start));
    is_angle.then(|| "; a position is x_km, y_km, z_km (ECEF, WGS-84), and altitude_km alone is enough".to_owned())
}

/// Returns where the sigma of an altitude or a position is told; `None` for another column.
fn sigma_hint(name: &str) -> Option<String> {
    let name = name.trim().to_ascii_lowercase();
    let is_of = ["altitude", "position", "alt_"].iter().any(|start| name.starts_with(start));
    (is_of && name.contains("sigma"))
        .then(|| "; one for all pictures is body.altitude_sigma_km in sensor.toml".to_owned())
}

impl Columns {
    /// Finds the columns by the header. Unknown columns give warnings.
    fn find(
        header: &StringRecord,
        path: &Path,
        belongs: Belongs,
        warnings: &mut Vec<Problem>,
    ) -> Result<Self, Problem> {
        let mut columns = HashMap::new();
        for (i, name) in header.iter().enumerate() {
            let Some(known) = known_column(name) else {
                let nearest = nearest(name, COLUMNS.iter().copied()).map(|n| format!("; did you mean {n}?"));
                let hint = geodetic_hint(name).or_else(|| sigma_hint(name)).or(nearest).unwrap_or_default();
                let what = format!("unknown column, not used{hint}");
                warnings.push(Problem::new(path, what).at_line(1).in_field(name));
                continue;
            };
            if columns.insert(known, i).is_some() {
                return Err(Problem::new(path, "this column exists twice").at_line(1).in_field(name));
            }
        }
        match belongs {
            Belongs::ToPicture if !columns.contains_key("file") => Err(without_file_column(header, path)),
            Belongs::ToTime if !["time_s", "utc"].iter().any(|name| columns.contains_key(*name)) => {
                let what = "has neither time_s nor utc; the rows of a vehicle belong to times";
                Err(Problem::new(path, what).at_line(1))
            }
            _ => Ok(Self::new(columns)),
        }
    }

    fn new(places: HashMap<String, usize>) -> Self {
        let names = |kind: &Kind| {
            let body = kind.name();
            let q = ["w", "x", "y", "z"].map(|end| format!("q_{body}_{end}"));
            BodyColumns { body, q, pole: ["x", "y", "z"].map(|end| format!("pole_{body}_{end}")) }
        };
        let exist = |of: &BodyColumns| of.q.iter().chain(&of.pole).any(|name| places.contains_key(name));
        let bodies = Kind::ALL.iter().map(names).filter(exist).collect();
        Self { places, bodies }
    }

    /// Returns the cell of a column; `None` if it is empty or the column is missing.
    fn cell<'a>(&self, record: &'a StringRecord, name: &str) -> Option<&'a str> {
        self.places.get(name).and_then(|&i| record.get(i)).filter(|c| !c.is_empty())
    }
}

/// Returns the problem of a header without the column `file`. A header in one cell has another separator.
fn without_file_column(header: &StringRecord, path: &Path) -> Problem {
    if header.iter().all(str::is_empty) {
        let what = "is empty; its first line names the columns, for example file,time_s,altitude_km";
        return Problem::new(path, what);
    }
    let found: Vec<&str> = header.iter().collect();
    let hint = separator_hint(header);
    let what =
        format!("the column `file` is missing (found: {}); it names the picture of each row{hint}", found.join(", "));
    Problem::new(path, what).at_line(1)
}

/// The row that is being read.
struct Row<'a> {
    record: &'a StringRecord,
    columns: &'a Columns,
    path: &'a Path,
    line: usize,
    file: String,
}

impl<'a> Row<'a> {
    fn new(record: &'a StringRecord, columns: &'a Columns, path: &'a Path, belongs: Belongs) -> Result<Self, Problem> {
        let line = record.position().map_or(0, |p| p.line() as usize);
        let file = columns.cell(record, "file").unwrap_or_default().to_owned();
        let row = Self { record, columns, path, line, file };
        if row.file.is_empty() && belongs == Belongs::ToPicture {
            return Err(row.problem("file", "is empty; it must name the picture"));
        }
        Ok(row)
    }

    /// Reads the cells. The direction to the Sun and the pole must have a length above 0.
    fn read(&self) -> Result<FrameData, Problem> {
        let data = FrameData {
            file: self.file.clone(),
            line: self.line,
            time_s: self.number("time_s")?,
            utc_s: self.utc()?,
            altitude_km: self.number("altitude_km")?,
            position_km: self.vector(POSITION)?,
            q_fixed_from_camera_wxyz: self.vector(ATTITUDE)?,
            attitude_sigma_deg: self.number("attitude_sigma_deg")?,
            sun_camera: self.vector(SUN)?,
            rate_rad_s: self.vector(RATE)?,
            pole_camera: self.vector(POLE)?,
            range_km: self.number("range_km")?,
            range_sigma_km: self.number("range_sigma_km")?,
            camera_temperature_c: self.number("camera_temperature_c")?,
            other_bodies: self.other_bodies()?,
        };
        self.check_direction(&SUN.join(", "), data.sun_camera)?;
        self.check_direction(&POLE.join(", "), data.pole_camera)?;
        Ok(data)
    }

    fn check_direction(&self, columns: &str, v: Option<[f64; 3]>) -> Result<(), Problem> {
        let has_none = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt() < 1e-9;
        match v {
            Some(v) if has_none(v) => {
                Err(self.problem(columns, "has no direction; leave the cells empty if it is not known"))
            }
            _ => Ok(()),
        }
    }

    /// Reads the orientations of further bodies.
    fn other_bodies(&self) -> Result<Vec<Orientation>, Problem> {
        let read = |BodyColumns { body, q, pole }: &BodyColumns| {
            let pole_camera = self.vector(pole.each_ref().map(String::as_str))?;
            self.check_direction(&pole.join(", "), pole_camera)?;
            let q_fixed_from_camera_wxyz = self.vector(q.each_ref().map(String::as_str))?;
            Ok(Orientation { body: (*body).to_owned(), q_fixed_from_camera_wxyz, pole_camera })
        };
        self.columns.bodies.iter().map(read).collect()
    }

    fn cell(&self, column: &str) -> Option<&'a str> {
        self.columns.cell(self.record, column)
    }

    fn problem(&self, column: &str, what: &str) -> Problem {
        let field = if self.file.is_empty() { column.to_owned() } else { format!("{} {column}", self.file) };
        Problem::new(self.path, what).at_line(self.line).in_field(field)
    }

    fn number(&self, column: &str) -> Result<Option<f64>, Problem> {
        let Some(cell) = self.cell(column) else { return Ok(None) };
        match cell.parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(Some(x)),
            _ if cell.contains(',') && cell.replacen(',', ".", 1).parse::<f64>().is_ok() => {
                Err(self.problem(column, &format!("{} has a decimal comma; write a point", quoted(cell))))
            }
            _ => Err(self.problem(
                column,
                &format!("{} is not a finite number; leave the cell empty if it is not known", quoted(cell)),
            )),
        }
    }

    fn utc(&self) -> Result<Option<f64>, Problem> {
        let Some(cell) = self.cell("utc") else { return Ok(None) };
        let what = format!("{} is not a UTC time; write it as 2020-11-20T08:30:00Z", quoted(cell));
        time::unix_seconds(cell).map(Some).ok_or_else(|| self.problem("utc", &what))
    }

    /// Reads a vector; `None` if all of its cells are empty.
    fn vector<const N: usize>(&self, names: [&str; N]) -> Result<Option<[f64; N]>, Problem> {
        let mut out = [0.0; N];
        let mut missing = Vec::new();
        for (slot, name) in out.iter_mut().zip(names) {
            match self.number(name)? {
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
mod tests;
