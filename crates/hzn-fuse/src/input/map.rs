//! The columns of tables that others wrote: `--map`.

use hzn_files::suggestion;

use super::columns::{Column, Columns, TABLES};
use crate::error::Error;

/// A column under another name or in another unit.
#[derive(Debug, Clone, PartialEq)]
struct Entry {
    table: &'static str,
    /// The column's own name.
    column: &'static str,
    /// Its name in the file.
    theirs: String,
    /// Size of the file's unit in that of the column.
    factor: f64,
}

/// Names and units of the columns in tables that others wrote.
///
/// ```
/// use hzn_fuse::input::{self, Map};
///
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("imu.csv");
/// std::fs::write(&path, "t,wx,wy,wz,ax,ay,az\n0,0,0,90,0,0,1\n10000,0,0,90,0,0,1\n")?;
/// let map = Map::parse(["imu:time=t,us", "imu:gyro=wx:wy:wz,deg/s", "imu:accel=ax:ay:az,g"])?;
/// let samples = input::imu(&path, &map)?;
/// assert_eq!(samples[1].imu.time_s, 0.01);
/// assert!((samples[1].imu.gyro_rad_s.xyz()[2] - 90f64.to_radians()).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Map {
    entries: Vec<Entry>,
}

impl Map {
    /// Reads entries `TABLE:NAME=COLUMN,UNIT`. TABLE is `imu`, `gnss`, `attitude` or `direction`. NAME is that of a
    /// column without its unit, such as `time` or `gyro_x`, or of several, such as `gyro`, for which COLUMN is `A:B:C`.
    /// Without a unit the column has that of its name.
    ///
    /// # Errors
    /// A table, a name or a unit is unknown, or a name or a column comes twice.
    pub fn parse<'a>(texts: impl IntoIterator<Item = &'a str>) -> Result<Self, Error> {
        let mut map = Self::default();
        for text in texts {
            map.add(text).map_err(|why| Error::unusable(format!("--map {text}: {why}")))?;
        }
        Ok(map)
    }

    fn add(&mut self, text: &str) -> Result<(), String> {
        let form = "TABLE:NAME=COLUMN or TABLE:NAME=COLUMN,UNIT is expected, for example imu:time=t_us,us";
        let (table, rest) = text.split_once(':').ok_or(form)?;
        let tables = TABLES.map(|t| t.table);
        let columns = TABLES.into_iter().find(|t| t.table == table);
        let columns = columns.ok_or_else(|| format!("there is no table {table}{}", suggestion(table, &tables)))?;
        let (name, theirs) = rest.split_once('=').ok_or(form)?;
        let meant = columns.meant_by(name);
        let Some(first) = meant.first() else {
            return Err(format!("{table} has no {name}{}", suggestion(name, &columns.names())));
        };
        let (theirs, factor) = split_unit(theirs, first, name)?;
        let names: Vec<&str> = if meant.len() == 1 { vec![theirs] } else { theirs.split(':').collect() };
        if names.len() != meant.len() {
            let of = meant.iter().map(|c| c.quantity).collect::<Vec<_>>();
            let what =
                format!("{name} has {} columns ({}), but {} given", of.len(), of.join(", "), counted(names.len()));
            return Err(format!("{what}; write them as A:B:C"));
        }
        for (column, theirs) in meant.into_iter().zip(names) {
            self.push(columns, column, theirs.trim(), factor)?;
        }
        Ok(())
    }

    fn push(&mut self, columns: &Columns, column: &Column, theirs: &str, factor: f64) -> Result<(), String> {
        if theirs.is_empty() {
            return Err(format!("the column of {} is left out", column.quantity));
        }
        let mut others = self.entries.iter().filter(|e| e.table == columns.table);
        if let Some(other) = others.clone().find(|e| e.column == column.name) {
            return Err(format!("{} was mapped before, to {}", column.quantity, other.theirs));
        }
        if let Some(other) = others.find(|e| e.theirs == theirs) {
            return Err(format!("the column {theirs} was mapped before, to {}", other.column));
        }
        let theirs = theirs.to_owned();
        self.entries.push(Entry { table: columns.table, column: column.name, theirs, factor });
        Ok(())
    }

    /// Returns the name of a column in the file, and the size of its unit.
    pub(super) fn theirs(&self, columns: &Columns, column: &Column) -> (String, f64) {
        let own = self.entries.iter().find(|e| e.table == columns.table && e.column == column.name);
        own.map_or_else(|| (column.name.to_owned(), 1.0), |e| (e.theirs.clone(), e.factor))
    }

    /// Returns whether a table has entries.
    pub fn has(&self, table: &str) -> bool {
        self.entries.iter().any(|e| e.table == table)
    }
}

/// Splits a unit off the column, and returns the column and the size of the unit. `name` is that in the map.
fn split_unit<'a>(text: &'a str, column: &Column, name: &str) -> Result<(&'a str, f64), String> {
    let Some((theirs, unit)) = text.rsplit_once(',') else { return Ok((text, 1.0)) };
    let units = column.measure.units();
    if let Some((_, factor)) = units.iter().find(|(known, _)| *known == unit.trim()) {
        return Ok((theirs, *factor));
    }
    if units.is_empty() {
        return Err(format!("{name} has no unit, but {unit:?} is given"));
    }
    let known = units.iter().map(|(known, _)| *known).collect::<Vec<_>>().join(", ");
    Err(format!("the unit {unit:?} is unknown; {name} can be in {known}"))
}

fn counted(n: usize) -> String {
    if n == 1 { "1 is".to_owned() } else { format!("{n} are") }
}
