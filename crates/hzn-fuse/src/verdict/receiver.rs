//! The receiver against itself: units and frames of positions and velocities.

use hzn_nav::frames::Vector;
use hzn_nav::gravity::earth_rate;

use super::motion::FIX_STEP_S;
use crate::finding::{Cause, Finding, Level, Source};
use crate::input::Fix;
use crate::settings::Settings;

/// Smallest and largest distance from the Earth's centre, m: the poles are at 6357 km, the Moon's orbit at 4·10⁸ m.
const DISTANCES_M: [f64; 2] = [6.3e6, 5e8];
/// Ratio of the errors to their sigma above which a velocity does not belong to its positions.
const MISFIT: f64 = 5.0;

/// Tests the positions, then the velocities.
pub(super) fn test(fixes: &[Fix], settings: &Settings) -> Option<Finding> {
    positions(fixes).or_else(|| velocities(fixes, settings))
}

fn finding(cause: Cause, what: String) -> Finding {
    Finding { level: Level::Contradicts, cause, source: Source::Receiver, what }
}

/// Finds positions that are not outside of the Earth.
fn positions(fixes: &[Fix]) -> Option<Finding> {
    let distance_m = median(fixes.iter().map(|fix| fix.position_m.norm()))?;
    let is_usual = |d: f64| (DISTANCES_M[0]..DISTANCES_M[1]).contains(&d);
    if is_usual(distance_m) {
        return None;
    }
    let guess = if is_usual(distance_m * 1e3) {
        "are they in kilometres? x_m, y_m, z_m are in metres"
    } else {
        "x_m, y_m, z_m are ECEF coordinates in metres, not latitude, longitude and height"
    };
    let what =
        format!("the positions of the receiver are {distance_m:.4e} m from the Earth's centre (median): {guess}");
    Some(finding(Cause::ReceiverUnit, what))
}

/// Finds velocities that are not the derivative of the positions.
fn velocities(fixes: &[Fix], settings: &Settings) -> Option<Finding> {
    let mut all = Vec::new();
    for pair in fixes.windows(2) {
        let [a, b] = pair else { continue };
        let dt = b.time_s - a.time_s;
        let numbers = [a.position_m, b.position_m, a.velocity_m_s, b.velocity_m_s];
        if !(dt > 0.0 && dt <= FIX_STEP_S && numbers.iter().all(Vector::is_finite)) {
            continue;
        }
        let moved = (b.position_m - a.position_m) / dt;
        let told = (a.velocity_m_s + b.velocity_m_s) * 0.5;
        let [position, velocity] = settings.fix_sigmas(a);
        // The mean of two velocities is off by an eighth of their difference if the force jumps in between.
        let curved = (b.velocity_m_s - a.velocity_m_s).norm() / 8.0;
        let sigma = (position * 2f64.sqrt() / dt).hypot(velocity).hypot(curved) * 3f64.sqrt();
        let inertial = told - earth_rate().cross(&((a.position_m + b.position_m) * 0.5));
        all.push([(moved - told).norm() / sigma, (moved - inertial).norm() / sigma, moved.norm() / told.norm()]);
    }
    let column = |i: usize| median(all.iter().filter_map(|row| row.get(i).copied()));
    let (misfit, inertial, ratio) = (column(0)?, column(1)?, column(2)?);
    if misfit < MISFIT {
        return None;
    }
    let (cause, guess) = if (500.0..2000.0).contains(&ratio) {
        (Cause::ReceiverUnit, "are they in km/s? vx_mps, vy_mps, vz_mps are in m/s")
    } else if inertial < MISFIT.min(0.3 * misfit) {
        (
            Cause::ReceiverFrame,
            "they are velocities against the stars; velocities against the turning Earth are expected",
        )
    } else if (0.9..1.1).contains(&ratio) {
        (Cause::ReceiverFrame, "their lengths fit, so their axes are probably not those of ECEF")
    } else {
        (Cause::Receiver, "are the columns the right ones?")
    };
    let what = format!(
        "the velocities of the receiver are not the changes of its positions: they differ by {misfit:.0} sigma \
         (median), and the changes are {ratio:.3} times as large: {guess}"
    );
    Some(finding(cause, what))
}

/// Returns the median of the numbers that are finite.
pub(super) fn median(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    let mut all: Vec<f64> = numbers.filter(|x| x.is_finite()).collect();
    let middle = all.len() / 2;
    (!all.is_empty()).then(|| *all.select_nth_unstable_by(middle, f64::total_cmp).1)
}
