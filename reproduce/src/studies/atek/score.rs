//! Figures of a flight against its truth.

use hzn_fuse::Fused;
use hzn_fuse::input::Body;
use hzn_fuse::results::Kind;
use hzn_fuse::truth::{Miss, compare};
use hzn_nav::frames::{Rotation, Vector, Vehicle};
use hzn_sim::Scenario;

/// Times at which the tables are read, s.
const AT_S: [f64; 2] = [300.0, 430.0];
/// Latest time of the first attitude in a flight that counts, s: the tables are read at T+300 s.
pub(super) const LATEST_START_S: f64 = 280.0;
/// χ² of three axes at 5σ of one: its probability is 5.7e-7.
const FIVE_SIGMA: f64 = 31.8;

pub(super) const PICTURE_HEAD: [&str; 11] = [
    "seed",
    "settings",
    "start",
    "3σ at the start",
    "3σ at T+300 s",
    "error",
    "3σ at T+430 s",
    "error",
    "limb and Sun, unaided / aided",
    "TRIAD, unaided / aided",
    "σ of the limb",
];

pub(super) fn paper_row() -> Vec<String> {
    let sigmas = ["[BB]", "table 3", "", "6°", "1.1°", "", "1.8°", ""];
    let angles = ["4.2° / 0.6° (largest)", "3.4° / 0.6° (largest)", "0.9° (3σ)"];
    sigmas.into_iter().chain(angles).map(String::from).collect()
}

fn misses(scene: &Scenario, fused: &Fused) -> anyhow::Result<Vec<Miss>> {
    let truth: Vec<_> = scene.path()?.vehicle_rows([0.0, scene.capture.to_s], 10.0).collect();
    Ok(compare(&fused.epochs, &truth))
}

/// Returns the last error before a time.
fn before(misses: &[Miss], time_s: f64) -> Option<&Miss> {
    misses.iter().rev().find(|m| m.time_s <= time_s)
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Returns the cells of a flight through pictures.
pub(super) fn picture_cells(scene: &Scenario, fused: &Fused) -> anyhow::Result<Vec<String>> {
    let misses = misses(scene, fused)?;
    let sigma = |time_s: f64| {
        let epoch = fused.epochs.iter().rev().find(|e| e.state.time_s <= time_s).or(fused.epochs.first());
        epoch.map_or(f64::NAN, |e| 3.0 * e.attitude_sigma_rad().max().to_degrees())
    };
    let error = |time_s: f64| before(&misses, time_s).map_or(f64::NAN, |m| m.attitude_rad.norm().to_degrees());
    let begin_s = fused.begin.map_or(f64::NAN, |b| b.time_s);
    let directions = || fused.innovations.iter().filter(|i| matches!(i.kind, Kind::Direction(_)));
    let limbs = || fused.innovations.iter().filter(|i| i.kind == Kind::Direction(Body::Limb));
    let deg = |x: f64| format!("{x:.2}°");
    let mut cells = vec![format!("T+{begin_s:.0} s"), deg(sigma(begin_s))];
    for time_s in AT_S {
        let is_there = begin_s < time_s;
        cells.push(if is_there { deg(sigma(time_s)) } else { "–".into() });
        cells.push(if is_there { deg(error(time_s)) } else { "–".into() });
    }
    cells.push(format!(
        "{} / {}",
        deg(median(directions().filter_map(|i| i.unaided_rad)).to_degrees()),
        deg(median(directions().filter_map(|i| i.angle_rad)).to_degrees())
    ));
    cells.push(format!(
        "{} / {}",
        deg(median(fused.triads.iter().map(|t| t.unaided_rad)).to_degrees()),
        deg(median(fused.triads.iter().map(|t| t.angle_rad)).to_degrees())
    ));
    cells.push(deg(median(limbs().filter_map(|i| i.sensor_sigma_rad)).to_degrees()));
    Ok(cells)
}

/// The figures of one flight without pictures.
#[derive(Debug, Clone, Copy)]
pub(super) struct Score {
    /// Error of the attitude about each axis (rad) and χ², at each of the times.
    at: [(Vector<Vehicle>, f64); 2],
    /// Whether an axis was beyond 3σ, at each of the times.
    beyond: [f64; 2],
    /// Mean χ² over the flight.
    nees: f64,
    lost: bool,
    restarts: usize,
    /// Errors of the mounts at the end, rad, and their mean χ².
    mounts_rad: f64,
    mounts_nees: f64,
    limb_nis: f64,
    gnss_nis: f64,
}

impl Score {
    /// `None` if the flight began too late.
    pub(super) fn new(scene: &Scenario, fused: &Fused) -> Option<Self> {
        if fused.begin?.time_s > LATEST_START_S {
            return None;
        }
        let misses = misses(scene, fused).ok()?;
        let at = |time_s: f64| before(&misses, time_s).map(|m| (m.attitude_rad, m.nees));
        let beyond = |time_s: f64| {
            let epoch = fused.epochs.iter().rev().find(|e| e.state.time_s <= time_s)?;
            let miss = before(&misses, time_s)?;
            let sigma = epoch.attitude_sigma_rad();
            let error = miss.attitude_rad.xyz();
            let over = error.iter().zip(&sigma).filter(|(e, s)| e.abs() > 3.0 * **s);
            Some(over.count() as f64 / 3.0)
        };
        let last = fused.epochs.last()?;
        let (mut sum, mut nees, mut count) = (0.0, 0.0, 0.0);
        for (one, camera) in scene.by_camera().iter().zip(&last.cameras) {
            let truth = Rotation::assume_from_quaternion(one.true_q_vehicle_from_camera_wxyz())?;
            let error = (camera.mount.inverse() * truth).scaled_axis();
            sum += error.norm_squared();
            nees += error.as_inner().component_div(&camera.misalignment_sigma_rad).norm_squared();
            count += 3.0;
        }
        let nis = |of: &dyn Fn(Kind) -> bool| {
            let taken = || fused.innovations.iter().filter(|i| i.taken && of(i.kind));
            taken().map(|i| i.nis / i.value.len() as f64).sum::<f64>() / taken().count().max(1) as f64
        };
        Some(Self {
            at: [at(AT_S[0])?, at(AT_S[1])?],
            beyond: [beyond(AT_S[0])?, beyond(AT_S[1])?],
            nees: misses.iter().map(|m| m.nees).sum::<f64>() / misses.len() as f64,
            lost: lasts(&misses, |m| m.attitude_rad.norm() > 5f64.to_radians())
                || lasts(&misses, |m| m.nees > FIVE_SIGMA),
            restarts: fused.counts.restarts,
            mounts_rad: (sum / count).sqrt(),
            mounts_nees: nees / count,
            limb_nis: nis(&|k| matches!(k, Kind::Direction(_))),
            gnss_nis: nis(&|k| matches!(k, Kind::Position | Kind::Velocity)),
        })
    }
}

/// Returns whether something lasts for more than 10 s.
fn lasts(misses: &[Miss], is_so: impl Fn(&Miss) -> bool) -> bool {
    let mut since: Option<f64> = None;
    misses.iter().any(|m| {
        since = if is_so(m) { since.or(Some(m.time_s)) } else { None };
        since.is_some_and(|from_s| m.time_s - from_s > 10.0)
    })
}

pub(super) const FLIGHT_HEAD: [&str; 11] = [
    "settings",
    "flights",
    "error at T+300 s: x, y, z",
    "beyond 3σ",
    "error at T+430 s: x, y, z",
    "beyond 3σ",
    "NEES (3)",
    "mounts: RMS, χ²/n",
    "NIS/n of directions",
    "NIS/n of the receiver",
    "lost (new starts)",
];

/// The rows of the flights without pictures.
#[derive(Default)]
pub(super) struct Table {
    rows: Vec<Vec<String>>,
    best_deg: f64,
    lost: usize,
}

impl Table {
    pub(super) fn add(&mut self, name: &str, with_false: bool, scores: Vec<Option<Score>>) {
        let all = scores.len();
        let scores: Vec<Score> = scores.into_iter().flatten().collect();
        let n = scores.len().max(1) as f64;
        let mean = |of: &dyn Fn(&Score) -> f64| scores.iter().map(of).sum::<f64>() / n;
        let rms = |which: usize, axis: usize| mean(&|s| s.at[which].0.xyz()[axis].powi(2)).sqrt().to_degrees();
        let three = |which: usize| format!("{:.2}°, {:.2}°, {:.2}°", rms(which, 0), rms(which, 1), rms(which, 2));
        let beyond = |which: usize| format!("{:.1} %", 100.0 * mean(&|s| s.beyond[which]));
        let lost = scores.iter().filter(|s| s.lost).count();
        let restarts: usize = scores.iter().map(|s| s.restarts).sum();
        let largest = (0..3).map(|axis| rms(0, axis)).fold(0.0, f64::max);
        self.best_deg = if self.rows.is_empty() { largest } else { self.best_deg.min(largest) };
        self.lost = if with_false { self.lost.max(lost) } else { self.lost };
        let mounts = mean(&|s| s.mounts_rad.powi(2)).sqrt().to_degrees();
        self.rows.push(vec![
            if with_false { format!("{name}, false") } else { name.to_owned() },
            format!("{} of {all}", scores.len()),
            three(0),
            beyond(0),
            three(1),
            beyond(1),
            format!("{:.2}", mean(&|s| s.nees)),
            format!("{mounts:.2}°, {:.2}", mean(&|s| s.mounts_nees)),
            format!("{:.2}", mean(&|s| s.limb_nis)),
            format!("{:.2}", mean(&|s| s.gnss_nis)),
            format!("{lost} ({restarts})"),
        ]);
    }

    pub(super) fn rows(&self) -> Vec<Vec<String>> {
        self.rows.clone()
    }

    /// Says what became of the goals.
    pub(super) fn verdict(&self) -> String {
        let met = |is_met: bool| if is_met { "met" } else { "**not met**" };
        format!(
            "Goals: at most 0.1° RMS about each axis at T+300 s: {} ({:.2}°). The error is that of the mounts: \
             attitude and mounts separate only while the vehicle turns against the directions, and under rate control \
             it turns by less than 0.9°/s. No flight lost with false answers: {} ({} lost).",
            met(self.best_deg <= 0.1),
            self.best_deg,
            met(self.lost == 0),
            self.lost
        )
    }
}
