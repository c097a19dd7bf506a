//! Suspicions: errors that would explain what the directions contradict, each tried with its own adjustment.

use hzn_nav::filter::chi2_limit;
use nalgebra::{DVector, Matrix3, Vector3};

use super::faults::Fault;
use super::motion::Reckoning;
use super::problem::Problem;
use super::state::State;
use crate::finding::{Cause, Finding, Level, Source};
use crate::input::Sample;

/// Probabilities with which a right flight exceeds the limits of one suspicion: of `doubtful` (3σ) and of `contradicts`
/// (4σ).
const RARE: [f64; 2] = [2.7e-3, 6.3e-5];
/// Largest difference of clocks, and the step of the search, s.
const LAG_S: (f64, f64) = (60.0, 1.0);
/// Largest error of the UTC, and the step of the search, s: the Sun moves by 2.5° in a step.
const UTC_S: (f64, f64) = (43_200.0, 600.0);
/// Independent values of a search: a wrong one among them is as rare as one without a search.
const SEARCHED: f64 = 100.0;

/// A suspicion.
struct Suspect {
    cause: Cause,
    source: Source,
    kind: Kind,
}

enum Kind {
    /// Errors that are free: the first one, their number, and the sigma that they get.
    Free(usize, usize, f64),
    /// The same, after a search over the values of a first one: largest value and step.
    Searched(usize, f64, (f64, f64)),
    /// Rates that are multiplied by a matrix.
    Gyro(Matrix3<f64>),
    /// A fault without a size.
    Fault(Fault),
}

/// A suspicion that was tried.
struct Tried {
    suspect: Suspect,
    /// By how much χ² is smaller.
    gain: f64,
    /// The limits of `gain` for doubt and for contradiction.
    limits: [f64; 2],
    state: State,
    /// Another value of the searched error that explains as much.
    other_value: Option<f64>,
}

/// Tries all suspicions; returns what explains the directions best, if anything explains them better than no error
/// does.
pub(super) fn test(problem: &Problem, samples: &[Sample], max_step_s: f64, names: &[String]) -> Option<Finding> {
    let none = DVector::zeros(problem.shared.len());
    let (_, cost) = problem.adjust(problem.begin(none)?);
    let suspects = suspects(problem, names);
    let tried = suspects.into_iter().filter_map(|suspect| try_out(problem, suspect, samples, max_step_s, cost));
    // What a cause gains is measured by how far it is above its own limit, so that a cause with more errors has no
    // advantage.
    let above = |t: &Tried| t.gain - t.limits[0];
    let best = tried.max_by(|a, b| above(a).total_cmp(&above(b)))?;
    let level = match best.gain {
        gain if gain > best.limits[1] => Level::Contradicts,
        gain if gain > best.limits[0] => Level::Doubtful,
        _ => return None,
    };
    let what = format!(
        "{}; it explains the directions better by {:.0} in chi-square, a right flight exceeds {:.0} once in 370 times",
        words(problem, &best, names),
        best.gain,
        best.limits[0]
    );
    Some(Finding { level, cause: best.suspect.cause, source: best.suspect.source, what })
}

/// Returns all suspicions.
fn suspects(problem: &Problem, names: &[String]) -> Vec<Suspect> {
    let s = problem.shared;
    let mut all = Vec::new();
    let mut add = |cause: Cause, source: Source, kind: Kind| all.push(Suspect { cause, source, kind });
    for (number, name) in names.iter().enumerate() {
        let camera = || Source::Camera(name.clone());
        add(Cause::Mount, camera(), Kind::Free(s.mount(number), 3, 3.0));
        add(Cause::CameraClock, camera(), Kind::Searched(s.clock(number), LAG_S.0, LAG_S));
    }
    for fault in Fault::of_cameras(names.len()) {
        let cause = if fault.is_mirrored() { Cause::Lens } else { Cause::Mount };
        let one = fault.cameras().filter(|cameras| cameras.len() == 1);
        let name = one.and_then(|cameras| names.get(*cameras.first()?));
        let source = name.map_or(Source::Cameras, |name| Source::Camera(name.clone()));
        add(cause, source, Kind::Fault(fault));
    }
    add(Cause::CameraClock, Source::Cameras, Kind::Searched(s.clocks(), LAG_S.0, LAG_S));
    add(Cause::GyroBias, Source::Imu, Kind::Free(s.bias(), 3, 0.1));
    add(Cause::GyroScale, Source::Imu, Kind::Free(s.scale(), 3, 0.5));
    add(Cause::LimbHeight, Source::Cameras, Kind::Free(s.height(), 1, 300.0));
    if problem.looks.iter().any(|look| look.is_celestial) {
        add(Cause::Utc, Source::Cameras, Kind::Searched(s.utc(), UTC_S.0, UTC_S));
    }
    if problem.tracked.is_empty() {
        add(Cause::GyroAxes, Source::Imu, Kind::Free(s.unit(), 3, 3.0));
    } else {
        add(Cause::TrackerFrame, Source::StarTracker, Kind::Free(s.tracker(), 3, 3.0));
        for fault in [Fault::InvertedTracker, Fault::ScalarLastTracker, Fault::InertialTracker] {
            add(Cause::TrackerFrame, Source::StarTracker, Kind::Fault(fault));
        }
    }
    let degree = 1f64.to_radians();
    add(Cause::GyroUnit, Source::Imu, Kind::Gyro(Matrix3::identity() * degree));
    add(Cause::GyroUnit, Source::Imu, Kind::Gyro(Matrix3::identity() / degree));
    let axes = signed_permutations().into_iter().filter(|m| *m != Matrix3::identity());
    axes.for_each(|matrix| add(Cause::GyroAxes, Source::Imu, Kind::Gyro(matrix)));
    all
}

/// Returns all 48 ways to exchange axes and signs.
fn signed_permutations() -> Vec<Matrix3<f64>> {
    let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let signs = (0..8).map(|bits| [0, 1, 2].map(|i| if bits >> i & 1 == 1 { -1.0 } else { 1.0 }));
    let all = signs.flat_map(|sign| orders.map(|order| (order, sign)));
    all.map(|(order, sign)| Matrix3::from_fn(|i, j| if order[i] == j { sign[i] } else { 0.0 })).collect()
}

/// Adjusts with a suspicion.
fn try_out(problem: &Problem, suspect: Suspect, samples: &[Sample], max_step_s: f64, cost: f64) -> Option<Tried> {
    let mut other = problem.clone();
    let none = DVector::zeros(problem.shared.len());
    let (mut freed, mut alternatives) = (0, 1.0);
    let mut begins = Vec::new();
    match &suspect.kind {
        Kind::Free(first, count, sigma) => {
            other.sigmas.iter_mut().skip(*first).take(*count).for_each(|s| *s = *sigma);
            freed = *count;
        }
        Kind::Searched(at, sigma, (largest, step)) => {
            *other.sigmas.get_mut(*at)? = *sigma;
            freed = 1;
            alternatives = SEARCHED;
            begins = searched(&other, *at, *largest, *step);
        }
        Kind::Gyro(matrix) => {
            other = problem.with_reckoning(Reckoning::new(samples, max_step_s, matrix));
            alternatives = SEARCHED;
        }
        Kind::Fault(fault) => {
            fault.mend(&mut other)?;
            if *fault == Fault::InertialTracker {
                alternatives = SEARCHED;
            }
        }
    }
    if begins.is_empty() {
        begins.push(other.begin(none)?);
    }
    let adjusted: Vec<(State, f64)> = begins.into_iter().map(|begin| other.adjust(begin)).collect();
    let ((state, found), other_value) = smallest(adjusted, &suspect.kind)?;
    // A value that was chosen among many must be rarer by their number; without a free error that is all.
    let limits = RARE.map(|p| match freed {
        0 => 2.0 * (alternatives / p).ln(),
        freed => chi2_limit(freed, p / alternatives),
    });
    Some(Tried { suspect, gain: cost - found, limits, state, other_value })
}

/// Most values of a search that are adjusted.
const MOST_ADJUSTED: usize = 3;
/// Difference in χ² up to which two values explain the directions equally well (3σ).
const EQUAL: f64 = 9.0;

/// Of the adjusted states of a search, returns the one with the smallest value among those that explain the directions
/// equally well, and the value of another of these. Limb and Sun, for example, show only how high the Sun is: at two
/// times of a day it is as high.
fn smallest(mut adjusted: Vec<(State, f64)>, kind: &Kind) -> Option<((State, f64), Option<f64>)> {
    let best = adjusted.iter().map(|(_, cost)| *cost).min_by(f64::total_cmp)?;
    adjusted.retain(|(_, cost)| *cost <= best + EQUAL);
    let value = |state: &State| match kind {
        Kind::Searched(at, ..) => state.shared.get(*at).copied().unwrap_or_default(),
        _ => 0.0,
    };
    adjusted.sort_by(|a, b| value(&a.0).abs().total_cmp(&value(&b.0).abs()));
    let mut each = adjusted.into_iter();
    let first = each.next()?;
    let is_other = |(state, _): &(State, f64)| {
        let step = if let Kind::Searched(_, _, (_, step)) = kind { *step } else { 0.0 };
        (value(state) - value(&first.0)).abs() > step
    };
    let other = each.find(is_other).map(|(state, _)| value(&state));
    Some((first, other))
}

/// Returns the states that begin with a value of one error and are better than those with its neighbours, the best
/// first.
fn searched(problem: &Problem, at: usize, largest: f64, step: f64) -> Vec<State> {
    let steps = (largest / step) as i32;
    let begin = |k: i32| {
        let mut shared = DVector::zeros(problem.shared.len());
        shared[at] = step * f64::from(k);
        let state = problem.begin(shared)?;
        let cost = problem.cost(&state);
        Some((state, cost))
    };
    let all: Vec<(State, f64)> = (-steps..=steps).filter_map(begin).collect();
    let cost = |i: Option<usize>| i.and_then(|i| all.get(i)).map_or(f64::INFINITY, |(_, cost)| *cost);
    let is_lowest = |i: &usize| cost(Some(*i)) <= cost(i.checked_sub(1)).min(cost(Some(i + 1)));
    let mut lowest: Vec<usize> = (0..all.len()).filter(is_lowest).collect();
    lowest.sort_by(|a, b| cost(Some(*a)).total_cmp(&cost(Some(*b))));
    lowest.truncate(MOST_ADJUSTED);
    lowest.into_iter().filter_map(|i| all.get(i).map(|(state, _)| state.clone())).collect()
}

/// Says what a suspicion found.
fn words(problem: &Problem, tried: &Tried, names: &[String]) -> String {
    let all = names.join(" and ");
    let name = match &tried.suspect.source {
        Source::Camera(name) => name.as_str(),
        _ => all.as_str(),
    };
    match &tried.suspect.kind {
        Kind::Free(first, ..) => words_of_errors(problem, tried, *first, name),
        Kind::Searched(at, ..) => {
            let value_s = tried.state.shared[*at];
            let [late, early] = ["late", "early"].map(|word| format!("{:.1} s {word}", value_s.abs()));
            if tried.suspect.cause == Cause::Utc {
                let by =
                    |value_s: f64| format!("{:.0} s {}", value_s.abs(), if value_s > 0.0 { "late" } else { "early" });
                let or = tried.other_value.map(|other_s| format!(" (or {}, which explains as much)", by(other_s)));
                let (word, or) = (by(value_s), or.unwrap_or_default());
                return format!("the UTC of the recordings is probably {word}{or}: Sun and Moon are elsewhere");
            }
            let word = if value_s < 0.0 { late } else { early };
            let what = "against the inertial unit: check the times, or give --clock";
            format!("the clock of {name} is probably {word} {what}")
        }
        Kind::Fault(fault) => fault.words(name),
        Kind::Gyro(matrix) if tried.suspect.cause == Cause::GyroAxes => {
            format!("axes or signs of the gyros are probably wrong: {} fit better", axes(matrix))
        }
        Kind::Gyro(_) => "the rates are probably not in rad/s: check gyro_x_radps to gyro_z_radps".into(),
    }
}

/// Says how large a freed error is.
fn words_of_errors(problem: &Problem, tried: &Tried, first: usize, name: &str) -> String {
    let shared = &tried.state.shared;
    if tried.suspect.cause == Cause::LimbHeight {
        return format!("the limb is probably {:.0} km higher than the sensor was told", shared[first]);
    }
    let three = Vector3::new(shared[first], shared[first + 1], shared[first + 2]);
    let off_deg = three.norm().to_degrees();
    match tried.suspect.cause {
        Cause::Mount => {
            let told_deg = problem.sigmas.get(first).map_or(0.0, |s| s.to_degrees());
            let told = if told_deg > 1e-6 { format!("told to {told_deg:.2}") } else { "told as exact".into() };
            format!("the mount of {name} is probably {off_deg:.1} deg off ({told}): check its [mount]")
        }
        Cause::GyroBias => {
            let bias = three.map(|b| b.to_degrees() * 3600.0);
            format!("the gyros probably have a bias of {:.0} {:.0} {:.0} deg/h", bias.x, bias.y, bias.z)
        }
        Cause::GyroScale => {
            let scale = three * 100.0;
            format!("the gyros' scale is probably off by {:.1} {:.1} {:.1} %", scale.x, scale.y, scale.z)
        }
        Cause::TrackerFrame => words_of_tracker(problem, off_deg),
        _ => format!("the inertial unit, or all mounts together, are probably turned by {off_deg:.1} deg"),
    }
}

/// Says what a star tracker that looks turned may be. While the vehicle turns, a wrong clock does the same, and told
/// errors that are too small make a turn of a right one.
fn words_of_tracker(problem: &Problem, off_deg: f64) -> String {
    let turned = format!("the star tracker is probably turned by {off_deg:.2} deg against the vehicle");
    let (Some(first), Some(last)) = (problem.tracked.first(), problem.tracked.last()) else { return turned };
    let rate_deg_s = if last.time_s > first.time_s {
        (last.integrals.turned_rad - first.integrals.turned_rad).to_degrees() / (last.time_s - first.time_s)
    } else {
        first.integrals.rate_rad_s.norm().to_degrees()
    };
    let by_clock_s = off_deg / rate_deg_s;
    let clock = if by_clock_s < LAG_S.0 {
        format!(", or its clock is {by_clock_s:.1} s off, which is as much at a mean rate of {rate_deg_s:.2} deg/s")
    } else {
        String::new()
    };
    format!("{turned}{clock}, or its sigma_deg is told too small")
}

/// Names the rates that fit.
fn axes(matrix: &Matrix3<f64>) -> String {
    let row = |i: usize| {
        let at = (0..3).find(|j| matrix[(i, *j)] != 0.0).unwrap_or(i);
        format!("{}{}", if matrix[(i, at)] < 0.0 { "-" } else { "" }, ["x", "y", "z"][at])
    };
    format!("{}, {}, {}", row(0), row(1), row(2))
}
