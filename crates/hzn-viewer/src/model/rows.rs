//! Results over time: the quantities that can be plotted, and the search for conspicuous pictures.

use std::collections::HashMap;

use hzn_core::status::Status;
use hzn_mcap::Row;
use hzn_sim::truth::Truth;

/// Results by picture and body: those of the file, and those of the current parameters.
#[derive(Debug, Clone, Default)]
pub struct ResultHistory {
    recorded: Vec<Vec<Row>>,
    current: HashMap<usize, Vec<Row>>,
}

impl ResultHistory {
    /// Appends the file's result for a body of picture `index`. Pictures may lack results.
    pub fn record(&mut self, index: usize, row: Row) {
        if self.recorded.len() <= index {
            self.recorded.resize(index + 1, Vec::new());
        }
        if let Some(rows) = self.recorded.get_mut(index) {
            rows.push(row);
        }
    }
    /// Stores the results of a picture with the current parameters.
    pub fn set_current(&mut self, index: usize, rows: Vec<Row>) {
        self.current.insert(index, rows);
    }
    /// Drops the results of the current parameters, because the parameters have changed.
    pub fn clear_current(&mut self) {
        self.current.clear();
    }
    /// Returns the number of pictures with results of the current parameters.
    pub fn current_len(&self) -> usize {
        self.current.len()
    }
    /// Returns the number of pictures, up to the last one with a result.
    pub fn len(&self) -> usize {
        self.current.keys().map(|i| i + 1).max().unwrap_or(0).max(self.recorded.len())
    }
    /// Returns true if there are no results.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Returns the file's result for a body of a picture.
    pub fn recorded(&self, index: usize, body: usize) -> Option<&Row> {
        self.recorded.get(index)?.get(body)
    }
    /// Returns the newest result: the one of the current parameters, or else the file's.
    pub fn newest(&self, index: usize, body: usize) -> Option<&Row> {
        match self.current.get(&index) {
            Some(rows) => rows.get(body),
            None => self.recorded(index, body),
        }
    }
    /// Returns the newest results of all pictures and bodies, in order.
    pub fn all(&self) -> impl Iterator<Item = &Row> {
        (0..self.len()).flat_map(|i| match self.current.get(&i) {
            Some(rows) => rows.iter(),
            None => self.recorded.get(i).map(|r| r.iter()).unwrap_or_default(),
        })
    }

    /// Returns the next picture after `from` (before it with `back`) whose status is not `ok`. The search wraps around.
    pub fn next_refused(&self, from: usize, back: bool, body: usize) -> Option<usize> {
        let n = self.len();
        let nth = |k: usize| if back { (from + n - k % n) % n } else { (from + k) % n };
        (1..=n).map(nth).find(|&i| self.newest(i, body).is_some_and(|r| r.status != Status::Ok))
    }

    /// Returns the pictures, the worst first: refused pictures, then the others in falling order of `badness`. Pictures
    /// without a `badness` are left out.
    pub fn worst(&self, body: usize, badness: impl Fn(&Row) -> Option<f64>) -> Vec<usize> {
        let rate = |i: usize| {
            let row = self.newest(i, body)?;
            let bad = if row.status == Status::Ok { badness(row)? } else { f64::INFINITY };
            Some((i, bad))
        };
        let mut rated: Vec<(usize, f64)> = (0..self.len()).filter_map(rate).collect();
        rated.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        rated.into_iter().map(|(i, _)| i).collect()
    }
}

/// A quantity that can be plotted over time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quantity {
    /// Name of the quantity.
    pub name: &'static str,
    /// Unit of the quantity.
    pub unit: &'static str,
    /// Lines of the plot: the name and the value of each.
    pub lines: &'static [(&'static str, RowValue)],
}

/// Function that returns a value of a result, possibly compared with the truth.
pub type RowValue = fn(&Row, Option<&Truth>) -> Option<f64>;

/// All quantities that can be plotted.
pub const QUANTITIES: &[Quantity] = &[
    Quantity {
        name: "Axis",
        unit: "",
        lines: &[("x", |r, _| r.axis_x), ("y", |r, _| r.axis_y), ("z", |r, _| r.axis_z)],
    },
    Quantity { name: "3 sigma", unit: "deg", lines: &[("3σ", |r, _| Some(3.0 * r.sigma_max_deg?))] },
    Quantity {
        name: "Error",
        unit: "deg",
        lines: &[("error", error_deg), ("3σ", |r, t| t.and(Some(3.0 * r.sigma_max_deg?)))],
    },
    Quantity { name: "RMS", unit: "px", lines: &[("rms", |r, _| r.rms_px)] },
    Quantity {
        name: "Points",
        unit: "",
        lines: &[("edge points", |r, _| r.edge_points.map(f64::from)), ("inliers", |r, _| r.inliers.map(f64::from))],
    },
    Quantity { name: "Half-angle", unit: "deg", lines: &[("fitted", |r, _| r.half_angle_deg)] },
    Quantity {
        name: "Altitude",
        unit: "km",
        lines: &[("estimated", |r, _| r.altitude_est_km), ("given", |r, _| r.altitude_km)],
    },
    Quantity { name: "Threshold", unit: "counts", lines: &[("threshold", |r, _| r.level.map(f64::from))] },
    Quantity { name: "Roll, pitch", unit: "deg", lines: &[("roll", |r, _| r.roll_deg), ("pitch", |r, _| r.pitch_deg)] },
    Quantity { name: "Time", unit: "µs", lines: &[("processing", |r, _| r.elapsed_us)] },
];

/// Returns the angle between an answer and the truth, in degrees.
pub fn error_deg(row: &Row, truth: Option<&Truth>) -> Option<f64> {
    Some(angle_deg(row.axis()?, truth?.axis()?.xyz()))
}

/// Returns the angle between two directions, in degrees. It is also accurate for small angles.
pub fn angle_deg(a: [f64; 3], b: [f64; 3]) -> f64 {
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    cross.iter().map(|c| c * c).sum::<f64>().sqrt().atan2(dot).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_mcap::RowMeta;

    fn row(index: u64, sigma: Option<f64>) -> Row {
        let meta = RowMeta { index, file: format!("{index}"), time_s: None, body: "earth".into(), altitude_km: None };
        let mut row = Row::unprocessed(&meta, Status::Unreadable, "");
        row.status = if sigma.is_some() { Status::Ok } else { Status::NoLimb };
        row.sigma_max_deg = sigma;
        row
    }

    fn rows() -> ResultHistory {
        let mut rows = ResultHistory::default();
        for (i, sigma) in [Some(0.1), None, Some(0.3), Some(0.2), None].into_iter().enumerate() {
            rows.record(i, row(i as u64, sigma));
        }
        rows
    }

    #[test]
    fn refused_frames_are_found_both_ways_around() {
        let rows = rows();
        assert_eq!(rows.next_refused(1, false, 0), Some(4));
        assert_eq!(rows.next_refused(4, false, 0), Some(1));
        assert_eq!(rows.next_refused(0, true, 0), Some(4));
        assert_eq!(ResultHistory::default().next_refused(0, false, 0), None);
        assert_eq!(rows.next_refused(0, false, 1), None, "there is no second body");
    }

    #[test]
    fn the_worst_come_first() {
        assert_eq!(rows().worst(0, |r| r.sigma_max_deg), [1, 4, 2, 3, 0]);
    }

    #[test]
    fn new_results_come_before_the_files_until_cleared() {
        let mut rows = rows();
        rows.set_current(1, vec![row(1, Some(0.5))]);
        assert_eq!(rows.newest(1, 0).unwrap().status, Status::Ok);
        assert_eq!(rows.recorded(1, 0).unwrap().status, Status::NoLimb);
        assert_eq!(rows.next_refused(0, false, 0), Some(4));
        rows.set_current(7, vec![row(7, None)]);
        assert_eq!((rows.len(), rows.all().count()), (8, 6));
        rows.clear_current();
        assert_eq!((rows.next_refused(0, false, 0), rows.len()), (Some(1), 5));
    }

    #[test]
    fn small_angles_are_exact() {
        let e = 1e-9f64;
        assert!((angle_deg([0.0, 0.0, 1.0], [e.sin(), 0.0, e.cos()]) / e.to_degrees() - 1.0).abs() < 1e-6);
        assert!((angle_deg([1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]) - 180.0).abs() < 1e-12);
    }

    #[test]
    fn every_quantity_has_a_line_and_an_own_name() {
        let names: std::collections::HashSet<_> = QUANTITIES.iter().map(|q| q.name).collect();
        assert_eq!(names.len(), QUANTITIES.len());
        assert!(QUANTITIES.iter().all(|q| !q.lines.is_empty()));
    }
}
