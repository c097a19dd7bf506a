//! Positions and attitudes from a CSV file.

use std::path::{Path, PathBuf};

use hzn_files::{limited, separator_hint};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::earth::{EARTH_RATE, gravity};
use super::point::Point;

/// Rows of a CSV file with the columns `time_s, x_km, y_km, z_km` (ECEF). For `attitude = "table"` it also has
/// `qw, qx, qy, qz` (camera to ECEF). Between rows, positions follow a smooth cubic and attitudes the shortest turn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// Path of the file, relative to the scene.toml.
    pub file: PathBuf,
    /// Text of the file, read by [`Table::read`].
    #[serde(skip)]
    pub text: Option<String>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
struct Row {
    time_s: f64,
    x_km: f64,
    y_km: f64,
    z_km: f64,
    qw: Option<f64>,
    qx: Option<f64>,
    qy: Option<f64>,
    qz: Option<f64>,
}

impl Table {
    /// Reads the file; its path is relative to `folder`.
    ///
    /// # Errors
    /// Fails if the file cannot be read.
    pub fn read(&mut self, folder: &Path) -> Result<(), String> {
        let path = folder.join(&self.file);
        let text = limited::read_text(&path, limited::TABLE_BYTES).map_err(|e| format!("{}: {e}", path.display()))?;
        self.text = Some(text);
        Ok(())
    }

    pub(crate) fn parse_rows(&self, [from_s, to_s]: [f64; 2]) -> Result<TableRows, (String, String)> {
        let file = self.file.display();
        let wrong = |what: String| ("[trajectory] table.file".to_owned(), format!("{file}: {what}"));
        let text = self.text.as_deref().ok_or_else(|| wrong("has not been read".into()))?;
        let mut reader =
            csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
        let mut points: Vec<(f64, Vector3<f64>)> = Vec::new();
        let mut turns = Vec::new();
        for (i, row) in reader.deserialize::<Row>().enumerate() {
            let line = i + 2;
            let row = row.map_err(|e| wrong(format!("row {line}: {e}{}", separator_hint(text.lines().next()))))?;
            if points.last().is_some_and(|(t, _)| row.time_s <= *t) {
                return Err(wrong(format!("row {line}: time_s must rise from row to row")));
            }
            let position_m = Vector3::new(row.x_km, row.y_km, row.z_km) * 1e3;
            if !(row.time_s.is_finite() && position_m.iter().all(|x| x.is_finite())) {
                return Err(wrong(format!("row {line}: time and position must be finite numbers")));
            }
            points.push((row.time_s, position_m));
            match [row.qw, row.qx, row.qy, row.qz] {
                [Some(w), Some(x), Some(y), Some(z)] => {
                    let q = Quaternion::new(w, x, y, z);
                    if (q.norm() - 1.0).abs() > 0.01 {
                        return Err(wrong(format!("row {line}: the quaternion's length must be 1")));
                    }
                    turns.push(UnitQuaternion::from_quaternion(q));
                }
                [None, None, None, None] => {}
                _ => return Err(wrong(format!("row {line}: give all of qw, qx, qy, qz or none"))),
            }
        }
        if points.len() < 2 {
            return Err(wrong("must have two rows or more".into()));
        }
        if !turns.is_empty() && turns.len() != points.len() {
            return Err(wrong("some rows have an attitude and others do not".into()));
        }
        let (first, last) = (points[0].0, points[points.len() - 1].0);
        if from_s < first || to_s > last {
            let what =
                format!("the pictures are from {from_s} s to {to_s} s, but {file} covers only {first} s to {last} s");
            return Err(("[capture]".into(), what));
        }
        Ok(TableRows { points, turns })
    }
}

/// [`Table`], prepared for evaluation.
#[derive(Debug, Clone)]
pub(crate) struct TableRows {
    points: Vec<(f64, Vector3<f64>)>,
    turns: Vec<UnitQuaternion<f64>>,
}

impl TableRows {
    pub(crate) fn has_attitudes(&self) -> bool {
        !self.turns.is_empty()
    }

    /// Returns the row before a time, and the position between this row and the next one, 0 to 1.
    fn bracket(&self, time_s: f64) -> (usize, f64) {
        let i = self.points.partition_point(|p| p.0 <= time_s).clamp(1, self.points.len() - 1) - 1;
        let (t0, t1) = (self.points[i].0, self.points[i + 1].0);
        (i, ((time_s - t0) / (t1 - t0)).clamp(0.0, 1.0))
    }

    /// Returns the velocity at a row, from the parabola through the row and its neighbours.
    fn velocity(&self, i: usize) -> Vector3<f64> {
        let slope = |a: usize, b: usize| (self.points[b].1 - self.points[a].1) / (self.points[b].0 - self.points[a].0);
        let last = self.points.len() - 1;
        match i {
            0 => slope(0, 1),
            _ if i == last => slope(last - 1, last),
            _ => {
                let (before, after) =
                    (self.points[i].0 - self.points[i - 1].0, self.points[i + 1].0 - self.points[i].0);
                (slope(i - 1, i) * after + slope(i, i + 1) * before) / (before + after)
            }
        }
    }

    pub(crate) fn point(&self, time_s: f64) -> Point {
        let (i, s) = self.bracket(time_s);
        let h = self.points[i + 1].0 - self.points[i].0;
        let (x0, x1, v0, v1) = (self.points[i].1, self.points[i + 1].1, self.velocity(i), self.velocity(i + 1));
        let position_m = x0 * ((1.0 + 2.0 * s) * (1.0 - s) * (1.0 - s))
            + v0 * (s * (1.0 - s) * (1.0 - s) * h)
            + x1 * (s * s * (3.0 - 2.0 * s))
            + v1 * (s * s * (s - 1.0) * h);
        let velocity_mps = v0 + (v1 - v0) * s;
        // The specific force is the acceleration without gravity. It follows from the change of the velocity in the
        // rotating frame.
        let earth = Vector3::new(0.0, 0.0, EARTH_RATE);
        let acceleration = (v1 - v0) / h + earth.cross(&velocity_mps) * 2.0 + earth.cross(&earth.cross(&position_m));
        Point { position_m, velocity_mps, specific_force_mps2: acceleration - gravity(&position_m) }
    }

    pub(crate) fn fixed_from_camera(&self, time_s: f64) -> UnitQuaternion<f64> {
        let (i, s) = self.bracket(time_s);
        match (self.turns.get(i), self.turns.get(i + 1)) {
            (Some(a), Some(b)) => a.try_slerp(b, s, 1e-9).unwrap_or(*a),
            _ => UnitQuaternion::identity(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(text: &str) -> Result<TableRows, (String, String)> {
        Table { file: "way.csv".into(), text: Some(text.into()) }.parse_rows([0.0, 2.0])
    }

    #[test]
    fn through_the_rows_and_smooth_between() {
        let r = rows("time_s,x_km,y_km,z_km\n0,7000,0,0\n1,7000,7,0\n2,7000,14,0\n").unwrap();
        let p = r.point(0.5);
        assert!((p.position_m - Vector3::new(7e6, 3500.0, 0.0)).norm() < 1e-6);
        assert!((p.velocity_mps - Vector3::new(0.0, 7000.0, 0.0)).norm() < 1e-9);
        assert!(!r.has_attitudes());
    }

    #[test]
    fn what_is_wrong_is_named() {
        let error = |text: &str| rows(text).unwrap_err().1;
        assert!(error("time_s,x_km,y_km,z_km\n0,7000,0,0\n0,7000,0,0\n").contains("row 3: time_s must rise"));
        assert!(error("time_s,x_km,y_km,z_km\n0,7000,0,0\n1,7000,0,0\n").contains("way.csv covers only 0 s to 1 s"));
        assert!(error("time_s,x_km,y_km\n0,7000,0\n").contains("z_km"));
    }
}
