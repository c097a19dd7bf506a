//! Results over time, and the search for conspicuous pictures.

use std::collections::HashMap;

use hzn_core::status::Status;
use hzn_mcap::Row;

use super::cause::{Cause, Group};
use super::diagnosis::FitFacts;
use super::quantity::angle_deg;
use super::sigma_parts::SigmaParts;
use super::steady_edge::{EdgeCells, SteadyEdges};

/// Results by picture and body: those of the file, of the current parameters, of the parameters before, and of the
/// sensor that is compared with.
#[derive(Debug, Clone, Default)]
pub struct ResultHistory {
    recorded: Vec<Vec<Row>>,
    /// The file's results come from the current parameters.
    recorded_is_current: bool,
    current: HashMap<usize, Processed>,
    /// Results of the parameters before, for pictures that have no current result yet.
    previous: HashMap<usize, Vec<Row>>,
    other: HashMap<usize, Vec<Row>>,
    generation: u64,
    /// The edges of the pictures with a current result.
    steady: SteadyEdges,
}

/// Results of a picture, with the causes and the fits of its bodies.
#[derive(Debug, Clone, Default)]
pub struct Processed {
    /// Results of the bodies.
    pub rows: Vec<Row>,
    /// Cause of each result.
    pub causes: Vec<Cause>,
    /// Fit of each body's longest edge, if there is one.
    pub fits: Vec<Option<FitFacts>>,
    /// Sources of each result's sigma, if there is an answer.
    pub sigma_parts: Vec<Option<SigmaParts>>,
    /// Where the picture has edges.
    pub edges: EdgeCells,
}

impl ResultHistory {
    /// Appends the file's result for a body of picture `index`. Pictures may lack results.
    pub fn record(&mut self, index: usize, row: Row) {
        self.generation += 1;
        if self.recorded.len() <= index {
            self.recorded.resize(index + 1, Vec::new());
        }
        if let Some(rows) = self.recorded.get_mut(index) {
            rows.push(row);
        }
    }
    /// Stores the results of a picture with the current parameters.
    pub fn set_current(&mut self, index: usize, processed: Processed) {
        self.generation += 1;
        // A picture that is shown is processed twice.
        if !self.current.contains_key(&index) {
            self.steady.add(&processed.edges);
        }
        self.current.insert(index, Processed { edges: EdgeCells::default(), ..processed });
    }
    /// Forgets the results of the first pictures. The others count from 0 again.
    pub fn forget_first(&mut self, count: usize) {
        fn shift<T>(results: &mut HashMap<usize, T>, by: usize) {
            *results = results.drain().filter_map(|(index, result)| Some((index.checked_sub(by)?, result))).collect();
        }
        self.generation += 1;
        self.recorded.drain(..count.min(self.recorded.len()));
        shift(&mut self.current, count);
        shift(&mut self.previous, count);
        shift(&mut self.other, count);
    }
    /// Begins with other parameters: the results so far become the previous ones. `as_recorded` is true if the
    /// parameters are those of the file's results.
    pub fn begin_version(&mut self, as_recorded: bool) {
        self.previous.extend(self.current.drain().map(|(index, processed)| (index, processed.rows)));
        self.recorded_is_current = as_recorded;
        self.generation += 1;
        self.steady = SteadyEdges::default();
    }
    /// Returns a number that changes with every change of the results.
    pub fn generation(&self) -> u64 {
        self.generation
    }
    /// Returns how often the pictures with a current result have an edge at the same pixels.
    pub fn steady(&self) -> &SteadyEdges {
        &self.steady
    }
    /// Stores the results of the sensor that is compared with.
    pub fn set_other(&mut self, index: usize, rows: Vec<Row>) {
        self.other.insert(index, rows);
    }
    /// Drops the results of the sensor that is compared with.
    pub fn clear_other(&mut self) {
        self.other.clear();
    }
    /// Returns the result of the sensor that is compared with.
    pub fn other(&self, index: usize, body: usize) -> Option<&Row> {
        self.other.get(&index)?.get(body)
    }
    /// Returns the number of pictures with a result of the sensor that is compared with.
    pub fn other_len(&self) -> usize {
        self.other.len()
    }
    /// Returns the number of pictures that were processed with the current parameters.
    pub fn current_len(&self) -> usize {
        self.current.len()
    }
    /// Returns the number of pictures, up to the last one with a result.
    pub fn len(&self) -> usize {
        let last = |rows: &HashMap<usize, Vec<Row>>| rows.keys().map(|i| i + 1).max().unwrap_or(0);
        let current = self.current.keys().map(|i| i + 1).max().unwrap_or(0);
        current.max(last(&self.previous)).max(self.recorded.len())
    }
    /// Returns true if there are no results.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Returns the file's result for a body of a picture.
    pub fn recorded(&self, index: usize, body: usize) -> Option<&Row> {
        self.recorded.get(index)?.get(body)
    }
    /// Returns the result of the current parameters.
    pub fn current(&self, index: usize, body: usize) -> Option<&Row> {
        match self.current.get(&index) {
            Some(processed) => processed.rows.get(body),
            None => self.recorded(index, body).filter(|_| self.recorded_is_current),
        }
    }
    /// Returns the result of earlier parameters: the file's, or else the one before the last change.
    pub fn earlier(&self, index: usize, body: usize) -> Option<&Row> {
        if self.recorded_is_current {
            return None;
        }
        self.recorded(index, body).or_else(|| self.previous.get(&index)?.get(body))
    }
    /// Returns the newest result: the one of the current parameters, or else the one before the last change, or else
    /// the file's.
    pub fn newest(&self, index: usize, body: usize) -> Option<&Row> {
        let before = || self.previous.get(&index).and_then(|rows| rows.get(body));
        self.current(index, body).or_else(before).or_else(|| self.recorded(index, body))
    }
    /// Returns the cause of the newest result.
    pub fn cause(&self, index: usize, body: usize) -> Option<Cause> {
        let current = self.current.get(&index).and_then(|p| p.causes.get(body)).copied();
        current.or_else(|| self.newest(index, body).map(Cause::from_row))
    }
    /// Returns the fits of the current parameters.
    pub fn fits(&self, body: usize) -> impl Iterator<Item = &FitFacts> + Clone {
        self.current.values().filter_map(move |p| p.fits.get(body)?.as_ref())
    }
    /// Returns the sources of the sigma with the current parameters.
    pub fn sigma_parts(&self, index: usize, body: usize) -> Option<SigmaParts> {
        self.current.get(&index)?.sigma_parts.get(body).copied().flatten()
    }
    /// Returns true if a picture has the sources of its sigma.
    pub fn has_sigma_parts(&self, body: usize) -> bool {
        self.current.values().any(|p| p.sigma_parts.get(body).is_some_and(Option::is_some))
    }
    /// Returns the newest results of all pictures and bodies, in order.
    pub fn all(&self) -> impl Iterator<Item = &Row> {
        let most = (0..self.len()).map(|i| self.bodies(i)).max().unwrap_or(0);
        (0..self.len()).flat_map(move |i| (0..most).filter_map(move |body| self.newest(i, body)))
    }
    fn bodies(&self, index: usize) -> usize {
        let previous = self.previous.get(&index).map_or(0, Vec::len);
        let recorded = self.recorded.get(index).map_or(0, Vec::len);
        self.current.get(&index).map_or(0, |p| p.rows.len()).max(previous).max(recorded)
    }

    /// Returns the next picture after `from` (before it with `back`) whose status is not `ok`, within a group if there
    /// is one. The search wraps around.
    pub fn next_refused(&self, from: usize, back: bool, body: usize, group: Option<&Group>) -> Option<usize> {
        let n = self.len();
        let nth = |k: usize| if back { (from + n - k % n) % n } else { (from + k) % n };
        let wanted = |cause: Cause| group.map_or(cause.status != Status::Ok, |g| cause.is_in(g));
        (1..=n).map(nth).find(|&i| self.cause(i, body).is_some_and(wanted))
    }

    /// Returns the pictures with an answer in falling order of `badness`. Pictures without a `badness` are left out.
    pub fn worst(&self, body: usize, badness: impl Fn(&Row) -> Option<f64>) -> Vec<usize> {
        let rate = |i: usize| {
            let row = self.newest(i, body).filter(|row| row.status == Status::Ok)?;
            Some((i, badness(row)?))
        };
        let mut rated: Vec<(usize, f64)> = (0..self.len()).filter_map(rate).collect();
        rated.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        rated.into_iter().map(|(i, _)| i).collect()
    }

    /// Compares the current results with those of the other sensor.
    pub fn compare(&self, body: usize) -> Comparison {
        let mut comparison = Comparison::default();
        for index in 0..self.len() {
            let (Some(a), Some(b)) = (self.current(index, body), self.other(index, body)) else { continue };
            comparison.pictures += 1;
            match (a.status == Status::Ok, b.status == Status::Ok) {
                (false, true) => comparison.better += 1,
                (true, false) => comparison.worse += 1,
                (true, true) => {
                    let apart = a.axis().zip(b.axis()).map(|(a, b)| angle_deg(a, b));
                    comparison.largest_deg = apart.into_iter().chain(comparison.largest_deg).reduce(f64::max);
                }
                (false, false) => {}
            }
            if a.status != b.status {
                comparison.changed.push((index, a.status, b.status));
            }
        }
        comparison
    }
}

/// Comparison of two sensors over the sequence.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Comparison {
    /// Number of pictures with results of both.
    pub pictures: usize,
    /// Number of pictures that only the other sensor answers.
    pub better: usize,
    /// Number of pictures that only the session answers.
    pub worse: usize,
    /// Largest angle between the answers of both to a picture, in degrees; `None` if both answer no picture.
    pub largest_deg: Option<f64>,
    /// Pictures whose status differs: index, status of the session, status of the other sensor.
    pub changed: Vec<(usize, Status, Status)>,
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
        assert_eq!(rows.next_refused(1, false, 0, None), Some(4));
        assert_eq!(rows.next_refused(4, false, 0, None), Some(1));
        assert_eq!(rows.next_refused(0, true, 0, None), Some(4));
        assert_eq!(ResultHistory::default().next_refused(0, false, 0, None), None);
        assert_eq!(rows.next_refused(0, false, 1, None), None, "there is no second body");
    }

    #[test]
    fn the_worst_come_first() {
        assert_eq!(rows().worst(0, |r| r.sigma_max_deg), [2, 3, 0], "a refused picture is not an answer");
    }

    #[test]
    fn new_results_come_before_earlier_ones() {
        let mut rows = rows();
        let processed = |rows| Processed { rows, ..Processed::default() };
        rows.begin_version(true);
        assert!(rows.current(0, 0).is_some() && rows.earlier(0, 0).is_none());
        rows.begin_version(false);
        assert!(rows.current(0, 0).is_none() && rows.earlier(0, 0).is_some());
        rows.set_current(1, processed(vec![row(1, Some(0.5))]));
        assert_eq!(rows.newest(1, 0).unwrap().status, Status::Ok);
        assert_eq!(rows.recorded(1, 0).unwrap().status, Status::NoLimb);
        assert_eq!(rows.next_refused(0, false, 0, None), Some(4));
        rows.set_current(7, processed(vec![row(7, None)]));
        assert_eq!((rows.len(), rows.all().count()), (8, 6));
        // After another change, the results so far are the earlier ones.
        rows.begin_version(false);
        assert_eq!(rows.current_len(), 0);
        assert!(rows.current(1, 0).is_none() && rows.current(7, 0).is_none());
        assert_eq!(rows.newest(1, 0).unwrap().status, Status::Ok);
        assert_eq!(rows.earlier(7, 0).unwrap().status, Status::NoLimb);
    }

    #[test]
    fn two_sensors_are_compared_over_all_pictures() {
        let mut rows = rows();
        rows.begin_version(true);
        for (i, sigma) in [Some(0.1), Some(0.1), None, Some(0.2)].into_iter().enumerate() {
            rows.set_other(i, vec![row(i as u64, sigma)]);
        }
        let comparison = rows.compare(0);
        assert_eq!((comparison.pictures, comparison.better, comparison.worse), (4, 1, 1));
        assert_eq!(comparison.changed, [(1, Status::NoLimb, Status::Ok), (2, Status::Ok, Status::NoLimb)]);
        rows.clear_other();
        assert_eq!(rows.compare(0), Comparison::default());
    }
}
