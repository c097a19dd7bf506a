//! Specific force against the acceleration that the receiver sees.
//!
//! The length of a change of the velocity does not need the attitude. Where the vehicle is pushed, the lengths show the
//! unit of the accelerometers and the clocks; where it falls freely, they show a bias. A push is taken along one axis
//! of the vehicle, so that wrong gyros do not look like wrong accelerometers.

use super::motion::{Reckoning, felt_m_s};
use super::receiver::median;
use crate::finding::{Cause, Finding, Level, Source};
use crate::input::Fix;
use crate::settings::Settings;

/// Standard gravity, m/s².
const G_M_S2: f64 = 9.80665;
/// Largest difference of clocks that is looked for, and the steps of the search, s.
const LAG_S: [f64; 2] = [60.0, 0.25];
/// Fewest pushed intervals, so that one wrong fix decides nothing.
const FEWEST: usize = 5;
/// Relative error that the samples of a unit have, besides its scale: the push changes between two samples.
const COARSE: f64 = 0.02;

/// An interval between two fixes.
struct Interval {
    span_s: [f64; 2],
    /// Change of the velocity by forces, m/s.
    felt_m_s: f64,
    sigma_m_s: f64,
}

/// What the comparison says.
#[derive(Default)]
pub(super) struct Force {
    pub(super) finding: Option<Finding>,
    /// Time by which the inertial unit is late against the receiver, s; `None` if the flight does not show it.
    pub(super) lag_s: Option<f64>,
}

/// Compares the unit with the receiver.
pub(super) fn test(reckoning: &Reckoning, fixes: &[Fix], settings: &Settings) -> Force {
    let Some([from_s, to_s]) = reckoning.span_s() else { return Force::default() };
    let all: Vec<Interval> = fixes
        .windows(2)
        .filter_map(|pair| {
            let [a, b] = pair else { return None };
            let felt_m_s = felt_m_s(a, b)?.norm();
            let sigma_m_s = (settings.fix_sigmas(a)[1] * 2f64.sqrt()).hypot(COARSE * felt_m_s);
            Some(Interval { span_s: [a.time_s, b.time_s], felt_m_s, sigma_m_s })
        })
        .collect();
    let inside = |i: &&Interval| i.span_s[0] >= from_s && i.span_s[1] <= to_s;
    let pushed = |i: &Interval| i.felt_m_s > 20.0 * i.sigma_m_s;
    let seen = |lag_s: f64, i: &Interval| Some(seen_m_s(reckoning, i.span_s.map(|t| t + lag_s))?[0]);
    let fallen = |i: &Interval| Some(seen_m_s(reckoning, i.span_s)?[1]);
    let under_thrust: Vec<&Interval> = all.iter().filter(inside).filter(|i| pushed(i)).collect();
    let falling: Vec<&Interval> = all.iter().filter(inside).filter(|i| i.felt_m_s < 3.0 * i.sigma_m_s).collect();
    let misfit = |lag_s: f64, scale: f64| {
        let one = |i: &Interval| Some(((seen(lag_s, i)? * scale - i.felt_m_s) / i.sigma_m_s).powi(2).min(400.0));
        let costs: Vec<f64> = all.iter().filter_map(one).collect();
        costs.iter().sum::<f64>() / costs.len().max(1) as f64
    };
    let ratio = median(under_thrust.iter().filter_map(|i| Some(seen(0.0, i)? / i.felt_m_s))).unwrap_or(1.0);
    // A wrong unit makes the biases larger, too; gravity that was added makes the ratio wrong.
    let finding = known_unit(ratio).map(|name| unit(ratio, name)).or_else(|| bias(&falling, &fallen, settings));
    if finding.is_some() {
        return Force { finding, lag_s: None };
    }
    if under_thrust.len() >= FEWEST {
        let lag_s = best_lag(|lag_s| misfit(lag_s, 1.0));
        let costs = [misfit(0.0, 1.0), misfit(lag_s, 1.0), misfit(0.0, 1.0 / ratio)];
        if lag_s.abs() > LAG_S[1] && costs[1] < costs[2] && costs[1] < 0.3 * costs[0] {
            // The clocks differ; the other tests say which one is wrong.
            return Force { finding: None, lag_s: Some(lag_s) };
        }
        if (ratio - 1.0).abs() > 0.1 {
            return Force { finding: Some(unit(ratio, "is their unit or their scale right?")), lag_s: None };
        }
        return Force { finding: None, lag_s: Some(0.0) };
    }
    Force::default()
}

/// Returns the change of the velocity that the unit sees between two times, m/s: of a push along one axis of the
/// vehicle, and of a force along any.
fn seen_m_s(reckoning: &Reckoning, [from_s, to_s]: [f64; 2]) -> Option<[f64; 2]> {
    let [first_s, last_s] = reckoning.span_s()?;
    // Before its first sample, the unit says nothing.
    (from_s >= first_s && to_s <= last_s).then_some(())?;
    let (from, to) = (reckoning.at(from_s)?, reckoning.at(to_s)?);
    Some([to.pushed_m_s - from.pushed_m_s, (to.velocity_m_s - from.velocity_m_s).norm()])
}

fn best_lag(cost: impl Fn(f64) -> f64) -> f64 {
    let steps = (LAG_S[0] / LAG_S[1]) as i32;
    let lags = (-steps..=steps).map(|k| LAG_S[1] * f64::from(k));
    lags.map(|lag_s| (lag_s, cost(lag_s))).min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0.0, |(lag_s, _)| lag_s)
}

/// Returns the question for a ratio that is that of a known unit.
fn known_unit(ratio: f64) -> Option<&'static str> {
    let is = |unit_m_s2: f64| (ratio * unit_m_s2 - 1.0).abs() < 0.1;
    match ratio {
        _ if is(G_M_S2) => Some("are they in g? accel_x_mps2 to accel_z_mps2 are in m/s²"),
        _ if is(G_M_S2 * 1e-3) => Some("are they in thousandths of g? accel_x_mps2 to accel_z_mps2 are in m/s²"),
        _ => None,
    }
}

fn unit(ratio: f64, guess: &str) -> Finding {
    Finding {
        level: Level::Contradicts,
        cause: Cause::AccelUnit,
        source: Source::Imu,
        what: format!(
            "under thrust the specific forces are {ratio:.4} times what the receiver's velocities tell (median): \
             {guess}"
        ),
    }
}

/// Finds forces in free fall, where an accelerometer shows only its bias.
fn bias(falling: &[&Interval], fallen: &impl Fn(&Interval) -> Option<f64>, settings: &Settings) -> Option<Finding> {
    if falling.len() < FEWEST {
        return None;
    }
    let span = |i: &Interval| i.span_s[1] - i.span_s[0];
    let shown_m_s2 = median(falling.iter().filter_map(|i| Some(fallen(i)? / span(i))))?;
    let felt_m_s2 = median(falling.iter().map(|i| i.felt_m_s / span(i)))?;
    let told_m_s2 = settings.imu.accel_bias_mg.sigma * 1e-3 * G_M_S2;
    // The length of three right biases is above four sigma once in a thousand flights.
    let limit_m_s2 = 4.0 * told_m_s2 + felt_m_s2 + settings.imu.accel_noise_mg_rthz[1] * 1e-3 * G_M_S2;
    if shown_m_s2 < limit_m_s2 {
        return None;
    }
    let guess = if (shown_m_s2 - G_M_S2).abs() < 1.0 {
        "gravity has been added to them; in free fall they must be 0"
    } else {
        "the biases are larger than accel_bias_mg in fuse.toml"
    };
    Some(Finding {
        level: Level::Contradicts,
        cause: Cause::AccelBias,
        source: Source::Imu,
        what: format!("in free fall the specific forces are {shown_m_s2:.2} m/s² (median): {guess}"),
    })
}
