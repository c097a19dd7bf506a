//! The table of tilts: the direction up in each picture.

use std::path::Path;

use hzn_files::unix_lines::UnixLines;
use hzn_files::{limited, separator_hint};

use crate::exit::{Stop, usage};

/// Specific forces at rest that are no gravity of the Earth's surface, relative to 9.81 m/s²: a vehicle that moves, a
/// scale that is wrong by a twentieth, or another unit.
const TOLERANCE: f64 = 0.05;
const GRAVITY_MPS2: f64 = 9.81;

const COLUMNS: [&str; 4] = ["file", "accel_x_mps2", "accel_y_mps2", "accel_z_mps2"];

/// Reads the table: the name of each picture, and the specific force along the vehicle's axes in m/s².
pub(super) fn read(path: &Path) -> Result<Vec<(String, [f64; 3])>, Stop> {
    let shown = path.display();
    let file = limited::open(path, limited::CAMERA_FILE_BYTES).map_err(|e| usage(format!("{shown}: {e}")))?;
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(UnixLines::new(file));
    let header = reader.headers().map_err(|e| usage(format!("{shown}: {e}")))?.clone();
    let mut places = [0; 4];
    for (place, name) in places.iter_mut().zip(COLUMNS) {
        *place = header.iter().position(|c| c == name).ok_or_else(|| {
            let has = header.iter().collect::<Vec<_>>().join(", ");
            usage(format!("{shown}: the column {name} is missing; the file has {has}{}", separator_hint(&header)))
        })?;
    }
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| usage(format!("{shown}: {e}")))?;
        let line = record.position().map_or(0, csv::Position::line);
        let cell = |place: usize| record.get(place).unwrap_or_default();
        let mut up = [0.0; 3];
        for (value, (place, name)) in up.iter_mut().zip(places.iter().zip(COLUMNS).skip(1)) {
            *value = cell(*place)
                .parse()
                .ok()
                .filter(|x: &f64| x.is_finite())
                .ok_or_else(|| usage(format!("{shown}:{line}: {name}: {:?} is not a number", cell(*place))))?;
        }
        let length = up.iter().map(|x| x * x).sum::<f64>().sqrt();
        if !((length / GRAVITY_MPS2 - 1.0).abs() < TOLERANCE) {
            let what = "the vehicle must be at rest, and the unit m/s²; then it is about 9.81";
            return Err(usage(format!("{shown}:{line}: the specific force is {length:.3} m/s²; {what}")));
        }
        rows.push((cell(places[0]).to_owned(), up));
    }
    Ok(rows)
}

/// Returns the direction up of a picture, by its name with or without folder.
pub(super) fn of_picture(rows: &[(String, [f64; 3])], name: &str) -> Option<[f64; 3]> {
    let base = |name: &str| name.rsplit(['/', '\\']).next().unwrap_or_default().to_owned();
    let exact = rows.iter().find(|(file, _)| file == name);
    exact.or_else(|| rows.iter().find(|(file, _)| base(file) == base(name))).map(|(_, up)| *up)
}
