//! Collects the measurements and computes their medians.

use hzn_core::status::Status;
use serde::Serialize;

use crate::cases::{Case, Picture};
use crate::opencv::{Answer, Recipe};
use crate::sensors::Timed;

/// All measurements.
#[derive(Serialize)]
pub(crate) struct Results {
    pub(crate) machine: String,
    pub(crate) versions: String,
    /// Load of the machine: mean number of runnable processes over the last minute.
    pub(crate) load: String,
    pub(crate) frames: usize,
    pub(crate) rounds: usize,
    pub(crate) cases: Vec<CaseResult>,
}

/// Measurements of one case.
#[derive(Serialize)]
pub(crate) struct CaseResult {
    pub(crate) name: String,
    pub(crate) f32: Times,
    pub(crate) fewer: Times,
    pub(crate) f64: Times,
    pub(crate) warm: Times,
    pub(crate) opencv: Times,
    frames: usize,
    answered: [usize; 4],
    error_deg: [Vec<f64>; 4],
    pub(crate) pixels_percent: Vec<f64>,
    /// Nanoseconds per edge point, warm, with every point kept.
    pub(crate) ns_a_point: Vec<f64>,
}

/// Times of one program in microseconds: the best round of each frame. On a busy machine a longer run is interrupted
/// more often, so a median over rounds would favour the faster program.
#[derive(Serialize, Default)]
pub(crate) struct Times {
    total_us: Vec<f64>,
    /// Stages in the order of first appearance.
    stages_us: Vec<(String, Vec<f64>)>,
}

impl Times {
    pub(crate) fn add_total(&mut self, frame: usize, us: f64) {
        keep_best(&mut self.total_us, frame, us);
    }
    pub(crate) fn add_stage(&mut self, name: &str, frame: usize, us: f64) {
        match self.stages_us.iter_mut().find(|(n, _)| n == name) {
            Some((_, list)) => keep_best(list, frame, us),
            None => {
                let mut list = Vec::new();
                keep_best(&mut list, frame, us);
                self.stages_us.push((name.to_owned(), list));
            }
        }
    }
    pub(crate) fn median(&self) -> f64 {
        median(&self.total_us)
    }
    pub(crate) fn stages_text(&self) -> String {
        let frames = self.total_us.len();
        let one = |(name, us): &(String, Vec<f64>)| {
            // A stage that a frame does not reach took no time there.
            let mut all: Vec<f64> = us.iter().map(|us| if us.is_finite() { *us } else { 0.0 }).collect();
            all.resize(frames.max(us.len()), 0.0);
            format!("{name} {:.1}", median(&all))
        };
        self.stages_us.iter().map(one).collect::<Vec<_>>().join(", ")
    }
}

/// Keeps the smallest time of each frame.
fn keep_best(list: &mut Vec<f64>, frame: usize, us: f64) {
    if list.len() <= frame {
        list.resize(frame + 1, f64::INFINITY);
    }
    if let Some(best) = list.get_mut(frame) {
        *best = best.min(us);
    }
}

pub(crate) fn median(list: &[f64]) -> f64 {
    let mut sorted = list.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    match (sorted.get(n.wrapping_sub(1) / 2), sorted.get(n / 2)) {
        (Some(a), Some(b)) => (a + b) / 2.0,
        _ => f64::NAN,
    }
}

/// Returns the angle between two directions in degrees; the result is accurate for small angles too.
fn angle_deg(a: [f64; 3], b: [f64; 3]) -> f64 {
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let dot: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum();
    cross.iter().map(|x| x * x).sum::<f64>().sqrt().atan2(dot).to_degrees()
}

impl CaseResult {
    pub(crate) fn new(case: &Case) -> Self {
        Self {
            name: case.name.clone(),
            f32: Times::default(),
            fewer: Times::default(),
            f64: Times::default(),
            warm: Times::default(),
            opencv: Times::default(),
            frames: case.frames.len(),
            answered: [0; 4],
            error_deg: Default::default(),
            pixels_percent: Vec::new(),
            ns_a_point: Vec::new(),
        }
    }

    /// Records the answers to a frame: hzn in f32, in f32 with fewer points, in f64, and the recipe.
    pub(crate) fn add_answers(&mut self, frame: &Picture, hzn: [&Timed; 3], theirs: &Answer) {
        let [single, fewer, double] = hzn.map(|t| t.axis.filter(|_| t.status == Status::Ok));
        let axes = [single, fewer, double, theirs.axis];
        for ((axis, count), errors) in axes.into_iter().zip(&mut self.answered).zip(&mut self.error_deg) {
            if let Some(axis) = axis {
                *count += 1;
                errors.push(angle_deg(axis, frame.truth));
            }
        }
    }

    pub(crate) fn add_pixels(&mut self, read: u64, all: u64) {
        self.pixels_percent.push(read as f64 * 100.0 / all as f64);
    }

    pub(crate) fn error_cells(&self) -> [String; 4] {
        [0, 1, 2, 3].map(|i| {
            let worst = self.error_deg[i].iter().copied().fold(f64::NAN, f64::max);
            format!("{:.3} / {worst:.3} ({} of {})", median(&self.error_deg[i]), self.answered[i], self.frames)
        })
    }
}

impl Results {
    pub(crate) fn new(recipe: &Recipe, frames: usize, rounds: usize) -> Self {
        let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let model =
            cpu.lines().find_map(|l| l.strip_prefix("model name")).map(|l| l.trim_start_matches(['\t', ':', ' ']));
        let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
        Self {
            machine: model.unwrap_or("unknown processor").to_owned(),
            versions: recipe.versions.clone(),
            load: load.split_whitespace().next().unwrap_or("unknown").to_owned(),
            frames,
            rounds,
            cases: Vec::new(),
        }
    }

    pub(crate) fn push(&mut self, case: CaseResult) {
        self.cases.push(case);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_and_angles() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), 2.5);
        assert!(median(&[]).is_nan());
        assert!((angle_deg([1.0, 0.0, 0.0], [1.0, 1e-9, 0.0]) - 1e-9f64.to_degrees()).abs() < 1e-20);
    }
}
