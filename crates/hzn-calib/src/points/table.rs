//! The table of points: `points.csv`.
//!
//! | column | unit | meaning |
//! |---|---|---|
//! | `u_px`, `v_px` | px | place in the picture; pixel centres are at integers |
//! | `azimuth_deg`, `elevation_deg` | degrees | direction of the source; or |
//! | `x`, `y`, `z` | | its unit vector |
//! | `file` | | optional: the picture; each one has a rotation of its own |
//!
//! Azimuth and elevation are angles of a right-handed frame with z forward, x to the right and y down: the unit vector
//! is (cos e sin a, −sin e, cos e cos a). So the azimuth grows to the right and the elevation upwards.

use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};
use std::path::Path;

use csv::{ReaderBuilder, StringRecord, Trim};
use hzn_files::unix_lines::UnixLines;
use hzn_files::{Problem, limited, separator_hint, suggestion};

/// Largest difference of the length of a unit vector from 1.
const MAX_LENGTH_ERROR: f64 = 0.01;
/// All columns.
const COLUMNS: [&str; 8] = ["file", "u_px", "v_px", "azimuth_deg", "elevation_deg", "x", "y", "z"];

/// A point with a known direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Place in the picture (u, v), px.
    pub at_px: [f64; 2],
    /// Unit vector of its direction, in the frame of the table.
    pub direction: [f64; 3],
}

/// The points of one picture, or of all pictures of a camera that does not turn against the frame of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Points {
    /// Name of the picture; `points` without the column `file`.
    pub name: String,
    /// The points.
    pub points: Vec<Point>,
}

/// A table of points.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// The points by picture.
    pub pictures: Vec<Points>,
    /// Number of rows that were left out, because an earlier row of the same picture has the same numbers.
    pub copied_rows: usize,
    /// Pictures that were left out, because all points of an earlier one are the same to the last bit: the name of each
    /// with that of the earlier one.
    pub copied_pictures: Vec<[String; 2]>,
}

impl Table {
    /// Returns a line of text for each kind of copy that was left out.
    ///
    /// A measurement that is there twice says nothing new, and would only make the sigmas of the lens smaller.
    pub fn copies_in_words(&self) -> Vec<String> {
        let rows = (self.copied_rows > 0).then(|| {
            format!(
                "{} rows are earlier rows of the same picture to the last bit; each point counts once",
                self.copied_rows
            )
        });
        let picture = |[copy, first]: &[String; 2]| {
            format!("all points of {copy} are those of {first} to the last bit; the picture counts once")
        };
        rows.into_iter().chain(self.copied_pictures.iter().map(picture)).collect()
    }

    /// Takes each point of a picture, and each picture, only once.
    fn without_copies(mut pictures: Vec<Points>) -> Self {
        let bits =
            |p: &Point| [p.at_px[0], p.at_px[1], p.direction[0], p.direction[1], p.direction[2]].map(f64::to_bits);
        let mut copied_rows = 0;
        for picture in &mut pictures {
            let mut seen = HashSet::new();
            let before = picture.points.len();
            picture.points.retain(|p| seen.insert(bits(p)));
            copied_rows += before - picture.points.len();
        }
        let mut first: HashMap<Vec<[u64; 5]>, String> = HashMap::new();
        let mut copied_pictures = Vec::new();
        pictures.retain(|picture| {
            let mut all: Vec<_> = picture.points.iter().map(bits).collect();
            all.sort_unstable();
            match first.entry(all) {
                Entry::Occupied(earlier) => {
                    copied_pictures.push([picture.name.clone(), earlier.get().clone()]);
                    false
                }
                Entry::Vacant(place) => {
                    place.insert(picture.name.clone());
                    true
                }
            }
        });
        Self { pictures, copied_rows, copied_pictures }
    }
}

/// Columns of the directions.
#[derive(Debug, Clone, Copy)]
enum Direction {
    Angles([usize; 2]),
    Vector([usize; 3]),
}

/// Reads a table; `size_px` is width and height of the pictures.
///
/// # Errors
/// The file cannot be read, a column is missing, or a row has an impossible value. The error names the line and the
/// column.
pub fn load(path: &Path, size_px: [u16; 2]) -> Result<Table, Problem> {
    let text = limited::read_text(path, limited::TABLE_BYTES)
        .map_err(|e| Problem::new(path, format!("cannot be read: {e}")))?;
    parse(&text, path, size_px)
}

/// Reads a table as [`load`] does, but from text; `path` is only used in messages.
///
/// # Errors
/// The errors are those of [`load`].
///
/// # Example
///
/// ```
/// use hzn_calib::points::table;
/// use std::path::Path;
///
/// let text = "u_px,v_px,azimuth_deg,elevation_deg\n959.5,539.5,0,0\n1759.5,539.5,45,0\n";
/// let table = table::parse(text, Path::new("points.csv"), [1920, 1080])?;
/// let right = table.pictures[0].points[1];
/// assert!((right.direction[0] - 0.5_f64.sqrt()).abs() < 1e-12);
///
/// let wrong = table::parse(&text.replace("1759.5", "2759.5"), Path::new("points.csv"), [1920, 1080]);
/// assert!(wrong.unwrap_err().to_string().contains("u_px"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn parse(text: &str, path: &Path, size_px: [u16; 2]) -> Result<Table, Problem> {
    let mut reader =
        ReaderBuilder::new().trim(Trim::All).comment(Some(b'#')).from_reader(UnixLines::new(text.as_bytes()));
    let unreadable = |e: csv::Error| {
        let line = e.position().and_then(|p| usize::try_from(p.line()).ok());
        let problem = Problem::new(path, format!("not a valid table: {e}"));
        line.map_or(problem.clone(), |line| problem.at_line(line))
    };
    let header = reader.headers().map_err(unreadable)?.clone();
    let place = |name: &str| header.iter().position(|h| h == name);
    if let Some(name) = header.iter().find(|h| !COLUMNS.contains(h)) {
        let what = format!("unknown column{}{}", suggestion(name, &COLUMNS), separator_hint(&header));
        return Err(Problem::new(path, what).at_line(1).in_field(name));
    }
    let needed = |name: &'static str| {
        let what = "missing; a table has u_px, v_px, and azimuth_deg, elevation_deg or x, y, z";
        place(name).ok_or_else(|| Problem::new(path, what).at_line(1).in_field(name))
    };
    let pixel = [needed("u_px")?, needed("v_px")?];
    let direction = match (place("azimuth_deg"), place("elevation_deg"), place("x")) {
        (None, None, Some(x)) => Direction::Vector([x, needed("y")?, needed("z")?]),
        (Some(_), _, Some(_)) | (_, Some(_), Some(_)) => {
            let what = "the table has angles and vectors; keep one of the two";
            return Err(Problem::new(path, what).at_line(1).in_field("x"));
        }
        _ => Direction::Angles([needed("azimuth_deg")?, needed("elevation_deg")?]),
    };
    let file = place("file");
    let mut groups: Vec<Points> = Vec::new();
    for record in reader.records() {
        let record = record.map_err(unreadable)?;
        let row = Row { path, record: &record };
        let point = Point { at_px: row.pixel(pixel, size_px)?, direction: row.direction(direction)? };
        let name = file.and_then(|n| record.get(n)).unwrap_or("points");
        match groups.iter_mut().find(|g| g.name == name) {
            Some(group) => group.points.push(point),
            None => groups.push(Points { name: name.to_owned(), points: vec![point] }),
        }
    }
    if groups.is_empty() {
        return Err(Problem::new(path, "the table has no rows"));
    }
    Ok(Table::without_copies(groups))
}

struct Row<'a> {
    path: &'a Path,
    record: &'a StringRecord,
}

impl Row<'_> {
    fn problem(&self, column: &str, what: impl Into<String>) -> Problem {
        let line = self.record.position().and_then(|p| usize::try_from(p.line()).ok()).unwrap_or(0);
        Problem::new(self.path, what).at_line(line).in_field(column)
    }

    fn number(&self, place: usize, column: &str) -> Result<f64, Problem> {
        let text = self.record.get(place).unwrap_or_default();
        let number = text.parse::<f64>().ok().filter(|x| x.is_finite());
        number.ok_or_else(|| self.problem(column, format!("{} is not a finite number", hzn_files::quoted(text))))
    }

    fn pixel(&self, places: [usize; 2], size_px: [u16; 2]) -> Result<[f64; 2], Problem> {
        let mut at = [0.0; 2];
        for k in 0..2 {
            let column = ["u_px", "v_px"][k];
            at[k] = self.number(places[k], column)?;
            let end = f64::from(size_px[k]) - 0.5;
            if !(-0.5..=end).contains(&at[k]) {
                let what = format!(
                    "{} is outside a picture of {} x {} px; are the columns u_px and v_px exchanged?",
                    at[k], size_px[0], size_px[1]
                );
                return Err(self.problem(column, what));
            }
        }
        Ok(at)
    }

    fn direction(&self, columns: Direction) -> Result<[f64; 3], Problem> {
        match columns {
            Direction::Angles([azimuth, elevation]) => {
                let azimuth = self.number(azimuth, "azimuth_deg")?;
                let elevation = self.number(elevation, "elevation_deg")?;
                if elevation.abs() > 90.0 {
                    let what = format!(
                        "{elevation} is not between -90 and 90; are azimuth and elevation exchanged, or not in degrees?"
                    );
                    return Err(self.problem("elevation_deg", what));
                }
                if azimuth.abs() > 360.0 {
                    return Err(self.problem("azimuth_deg", format!("{azimuth} is not between -360 and 360")));
                }
                Ok(from_angles(azimuth, elevation))
            }
            Direction::Vector(places) => {
                let mut v = [0.0; 3];
                for k in 0..3 {
                    v[k] = self.number(places[k], ["x", "y", "z"][k])?;
                }
                let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
                if (length - 1.0).abs() > MAX_LENGTH_ERROR {
                    return Err(self.problem("x", format!("the vector has the length {length:.4}, not 1")));
                }
                Ok(v.map(|x| x / length))
            }
        }
    }
}

/// Returns the unit vector of azimuth and elevation in degrees.
pub fn from_angles(azimuth_deg: f64, elevation_deg: f64) -> [f64; 3] {
    let ((sa, ca), (se, ce)) = (azimuth_deg.to_radians().sin_cos(), elevation_deg.to_radians().sin_cos());
    [ce * sa, -se, ce * ca]
}
