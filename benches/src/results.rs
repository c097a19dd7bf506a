//! Collects the measurements and computes their medians.

use serde::Serialize;

use crate::cases::{Case, Picture};
use crate::memory::on_large_pages_mib;
use crate::opencv::{Answer, Recipe};
use crate::sensors::Timed;
use crate::state::State;

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
    pub(crate) growth: Vec<Grown>,
}

/// Time of one case of the growth in microseconds, all flushed.
#[derive(Serialize)]
pub(crate) struct Grown {
    pub(crate) title: String,
    pub(crate) pixels: u64,
    pub(crate) hzn_us: f64,
    pub(crate) recipe_us: f64,
}

/// Measurements of one case.
#[derive(Serialize)]
pub(crate) struct CaseResult {
    pub(crate) title: String,
    /// The programs in the order of the table; the recipe with `lstsq` is [`RECIPE`].
    pub(crate) programs: Vec<ProgramResult>,
    pub(crate) pixels_percent: Vec<f64>,
    /// Nanoseconds per edge point, with every point kept and changing frames.
    pub(crate) ns_a_point: Vec<f64>,
    /// Memory of the frames in MiB, and how much of it lies on pages of 2 MiB: of hzn's and of the recipe's.
    pub(crate) frames_mib: f64,
    pub(crate) large_mib: [f64; 2],
}

/// Place of hzn with its defaults in f32 among the programs, of hzn with fewer points, of hzn in a sequence, of the
/// recipe as one usually writes it, and of the recipe of an expert.
pub(crate) const HZN: usize = 0;
pub(crate) const HZN_FEWER: usize = 1;
pub(crate) const HZN_SEQUENCE: usize = 2;
pub(crate) const RECIPE: usize = 4;
pub(crate) const EXPERT: usize = 6;

/// Measurements of one program.
#[derive(Serialize)]
pub(crate) struct ProgramResult {
    pub(crate) name: String,
    frames: usize,
    /// Points that the fit used, for each frame.
    points: Vec<f64>,
    /// Times in each of [`State::ALL`].
    times: [Times; 3],
    error_deg: Vec<f64>,
}

/// Times in microseconds: the best round of each frame. On a busy machine a longer run is interrupted more often, so a
/// median over rounds would favour the faster program.
#[derive(Serialize, Default)]
pub(crate) struct Times {
    total_us: Vec<f64>,
    /// Stages in the order of first appearance.
    stages_us: Vec<(String, Vec<f64>)>,
}

impl Times {
    fn add_stage(&mut self, name: &str, frame: usize, us: f64) {
        match self.stages_us.iter_mut().find(|(n, _)| n == name) {
            Some((_, list)) => keep_best(list, frame, us),
            None => {
                let mut list = Vec::new();
                keep_best(&mut list, frame, us);
                self.stages_us.push((name.to_owned(), list));
            }
        }
    }
    fn stages_text(&self) -> String {
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

impl ProgramResult {
    pub(crate) fn new(name: impl Into<String>, case: &Case) -> Self {
        Self {
            name: name.into(),
            frames: case.frames.len(),
            points: Vec::new(),
            times: Default::default(),
            error_deg: Vec::new(),
        }
    }

    /// Records a run of hzn on a frame.
    pub(crate) fn add_run(&mut self, number: usize, state: State, run: &Timed) {
        keep_best(&mut self.times[state as usize].total_us, number, run.elapsed_us);
    }
    /// Records the times of hzn's stages on a frame.
    pub(crate) fn add_stages(&mut self, number: usize, state: State, stages: Vec<(&'static str, f64)>) {
        stages.iter().for_each(|(name, us)| self.times[state as usize].add_stage(name, number, *us));
    }
    /// Records a run of the recipe on a frame, with its stages.
    pub(crate) fn add_answer(&mut self, number: usize, state: State, answer: &Answer) {
        let times = &mut self.times[state as usize];
        keep_best(&mut times.total_us, number, answer.total_us);
        answer.stages_us.iter().for_each(|(name, us)| times.add_stage(name, number, *us));
    }
    /// Records what a program found in a frame; every run finds the same.
    pub(crate) fn add_found(&mut self, frame: &Picture, points: u32, axis: Option<[f64; 3]>) {
        self.points.push(points.into());
        if let (Some(axis), Some(truth)) = (axis, frame.truth) {
            self.error_deg.push(angle_deg(axis, truth));
        }
    }

    /// Returns the median over the frames in microseconds.
    pub(crate) fn median_us(&self, state: State) -> f64 {
        median(&self.times[state as usize].total_us)
    }
    /// Returns the median time of each stage as text.
    pub(crate) fn stages_text(&self, state: State) -> String {
        self.times[state as usize].stages_text()
    }
    /// Returns the median number of points.
    pub(crate) fn points(&self) -> f64 {
        median(&self.points)
    }
    /// Returns the errors as text: median and worst in degrees, and the number of frames with an answer.
    pub(crate) fn error_cell(&self) -> String {
        let worst = self.error_deg.iter().copied().fold(f64::NAN, f64::max);
        format!("{:.3} / {worst:.3} ({} of {})", median(&self.error_deg), self.error_deg.len(), self.frames)
    }
}

impl CaseResult {
    pub(crate) fn new(case: &Case, programs: Vec<ProgramResult>) -> Self {
        Self {
            title: case.title.clone(),
            programs,
            pixels_percent: Vec::new(),
            ns_a_point: Vec::new(),
            frames_mib: (case.pixels() * case.frames.len() as u64) as f64 / f64::from(1 << 20),
            large_mib: [on_large_pages_mib(), 0.0],
        }
    }

    /// Returns how many times as fast as the recipe a program is, in a state.
    pub(crate) fn ratio(&self, program: usize, state: State) -> f64 {
        self.ratio_to(RECIPE, program, state)
    }

    /// Returns how many times as fast as a rival a program is, in a state.
    pub(crate) fn ratio_to(&self, rival: usize, program: usize, state: State) -> f64 {
        let time = |i: usize| self.programs.get(i).map_or(f64::NAN, |p| p.median_us(state));
        time(rival) / time(program)
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
            growth: Vec::new(),
        }
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
