//! Statistics of results.

use std::collections::BTreeMap;

use hzn_core::status::Status;
use hzn_mcap::Row;
use serde_json::{Map, Value, json};

use super::facts::Facts;

/// Statistics of rows. They need memory for four numbers a row.
#[derive(Debug, Default)]
pub(super) struct Summary {
    pub(super) frames: u64,
    /// Number of the last row's picture. A picture of several bodies has one row for each body.
    last: Option<u64>,
    time: Option<(f64, f64)>,
    /// The bodies by name, in the order of their first rows.
    bodies: Vec<(String, BodySummary)>,
}

/// Results of one body.
#[derive(Debug, Default)]
struct BodySummary {
    statuses: BTreeMap<u8, u64>,
    sigma_deg: Vec<f64>,
    rms_px: Vec<f64>,
    elapsed_us: Vec<f64>,
    altitude_km: Vec<f64>,
}

impl Summary {
    /// Counts a row.
    pub(super) fn add(&mut self, row: &Row) {
        if self.last.replace(row.index) != Some(row.index) {
            self.frames += 1;
        }
        if let Some(t) = row.time_s {
            self.time = Some(self.time.map_or((t, t), |(a, b)| (a.min(t), b.max(t))));
        }
        let place = self.bodies.iter().position(|(name, _)| *name == row.body).unwrap_or_else(|| {
            self.bodies.push((row.body.clone(), BodySummary::default()));
            self.bodies.len() - 1
        });
        let found = &mut self.bodies[place].1;
        *found.statuses.entry(row.status as u8).or_default() += 1;
        found.sigma_deg.extend(row.sigma_max_deg);
        found.rms_px.extend(row.rms_px);
        found.elapsed_us.extend(row.elapsed_us);
        found.altitude_km.extend(row.altitude_est_km);
    }

    /// Adds the statistics to the facts about a file.
    pub(super) fn describe(self, out: &mut Facts) {
        out.fact("pictures", self.frames.to_string(), "pictures", self.frames);
        if let Some((a, b)) = self.time {
            out.time(a, b);
        }
        let bodies: Vec<Value> = self.bodies.into_iter().map(|(name, found)| found.describe(name, out)).collect();
        out.key("bodies", bodies);
    }
}

impl BodySummary {
    /// Adds the lines of a body, and returns its JSON object.
    fn describe(self, name: String, out: &mut Facts) -> Value {
        out.line("body", name.clone());
        let rows: u64 = self.statuses.values().sum();
        let mut statuses = Map::new();
        for status in Status::ALL {
            if let Some(n) = self.statuses.get(&(status as u8)) {
                out.line(status.name(), format!("{n} ({:.1} %)", 100.0 * *n as f64 / rows as f64));
                statuses.insert(status.name().to_owned(), json!(n));
            }
        }
        let mut body = json!({"name": name, "statuses": statuses});
        for (name, unit, key, values) in [
            ("sigma", "deg", "sigma_deg", self.sigma_deg),
            ("RMS", "px", "rms_px", self.rms_px),
            ("altitude found", "km", "altitude_km", self.altitude_km),
            ("processing", "us", "processing_us", self.elapsed_us),
        ] {
            let Some(found) = percentiles(values) else { continue };
            let [low, middle, high] = found.map(three_digits);
            out.line(name, format!("median {middle} {unit}, 90 % from {low} to {high}"));
            let [low, middle, high] = found;
            body[key] = json!({"percentile_5": low, "median": middle, "percentile_95": high});
        }
        body
    }
}

/// Formats a number with three significant digits, as a whole number from 100 on. Statistics over pictures are not more
/// accurate.
fn three_digits(x: f64) -> String {
    let before = if x == 0.0 { 0 } else { x.abs().log10().floor() as i32 };
    format!("{x:.*}", (2 - before).clamp(0, 9) as usize)
}

fn percentiles(mut values: Vec<f64>) -> Option<[f64; 3]> {
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    Some([0.05, 0.5, 0.95].map(|p| values[(p * last as f64).round() as usize]))
}
