//! Whether limbs, attitudes and the motion in the Earth's gravity agree.

use hzn_core::ellipsoid::EARTH_MEAN_RADIUS_M;
use hzn_nav::gravity::EARTH_RATE_RAD_S;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::case::{Case, Solution};
use super::dynamics::GM_M3_S2;
use super::problem::axis;
use super::told;
use crate::finding::{Cause, Finding, Level, Source, Verdict};
use crate::input::Attitude;
use crate::results::{Counts, Epoch, Solved};
use crate::verdict::lens;

/// Share of the limbs that count less from which on the inputs contradict each other.
const LOWERED: f64 = 0.2;
/// Sigmas of its prior from which on an estimated error contradicts it.
const SIGMAS: f64 = 4.0;
/// Sigmas of the sum of the squares from which on the told covariances are doubtful, and the mean square from which on
/// they contradict the pictures.
const SQUARES: [f64; 2] = [4.0, 2.0];
/// Lowest perigee above the mean radius, km: below it the air ends an orbit within one turn.
const PERIGEE_KM: f64 = 100.0;
/// Angle between the axes of the orbit and those of told positions from which on a frame or a clock is wrong: in sigmas
/// of the orbit, and in rad. Positions may come from old elements, which are some kilometres off.
const POSITIONS: [f64; 2] = [4.0, 2e-3];

/// How well the solution explains the limbs.
struct Fit {
    numbers: f64,
    square: f64,
    lowered: f64,
}

impl Fit {
    fn of(solution: &Solution) -> Self {
        let n = solution.sights.len().max(1) as f64;
        let errors = &solution.adjusted.errors;
        let lowered = errors.iter().filter(|e| e.weight < 1.0).count() as f64 / n;
        let square = errors.iter().map(|e| e.cost).sum();
        Self { numbers: (2.0 * n - 6.0).max(1.0), square, lowered }
    }

    /// Returns the mean square of an error over its covariance; 1 is ideal.
    fn mean(&self) -> f64 {
        self.square / self.numbers
    }

    fn is_doubtful(&self) -> bool {
        self.square > self.numbers + SQUARES[0] * (2.0 * self.numbers).sqrt()
    }

    fn contradicts(&self) -> bool {
        self.lowered > LOWERED || (self.is_doubtful() && self.mean() > SQUARES[1])
    }
}

/// Returns the verdict over an orbit.
pub(super) fn verdict(
    case: &Case<'_>,
    solution: &Solution,
    names: &[String],
    (epochs, solved): (&[Epoch], &Solved),
) -> Verdict {
    let fit = Fit::of(solution);
    let mut priors = priors(case, solution, names);
    priors.extend(names.iter().filter_map(|name| lens(solved, name)));
    let is_orbit = perigee_km(epochs).is_some_and(|km| km > PERIGEE_KM);
    let mut findings = Vec::new();
    if fit.contradicts() || !priors.is_empty() || !is_orbit || !solution.adjusted.is_converged {
        findings.extend(tracker(case, &fit));
    }
    findings.extend(priors);
    if !is_orbit {
        let what = match perigee_km(epochs) {
            Some(km) => format!("the perigee is {km:.0} km above the ground"),
            None => "the vehicle is not bound to the Earth".to_owned(),
        };
        findings.push(finding(
            Level::Contradicts,
            (Cause::Unknown, Source::All),
            format!(
                "the limbs and attitudes give no orbit: {what}. The vehicle is under thrust or falls, or the \
                     attitudes are of another frame"
            ),
        ));
    }
    if fit.contradicts() {
        findings.push(finding(
            Level::Contradicts,
            (Cause::Unknown, Source::All),
            format!(
                "limbs, attitudes and the Earth's gravity contradict each other: the mean square of their errors is \
                 {:.1} instead of 1, and {:.0} % of the limbs are too far off. Check the frame and the times \
                 of the attitudes, and the mounts",
                fit.mean(),
                100.0 * fit.lowered
            ),
        ));
    } else if fit.is_doubtful() {
        findings.push(finding(
            Level::Doubtful,
            (Cause::Covariance, Source::Cameras),
            format!(
                "the limbs differ from the orbit by more than their covariances: the mean square is {:.2} instead of 1",
                fit.mean()
            ),
        ));
    }
    findings.extend(told::altitudes(case, solution, epochs));
    findings.extend(told_positions(solution, names, epochs));
    Verdict::new(findings)
}

fn finding(level: Level, (cause, source): (Cause, Source), what: String) -> Finding {
    Finding { level, cause, source, what }
}

/// Returns the height of the perigee at the end; `None` if the motion is not bound.
fn perigee_km(epochs: &[Epoch]) -> Option<f64> {
    let state = epochs.last()?.state;
    let x = state.position_m.into_inner();
    let v = state.velocity_m_s.into_inner() + Vector3::new(0.0, 0.0, EARTH_RATE_RAD_S).cross(&x);
    let semi_axis_m = 1.0 / (2.0 / x.norm() - v.norm_squared() / GM_M3_S2);
    let eccentricity = (v.cross(&x.cross(&v)) / GM_M3_S2 - x.normalize()).norm();
    (semi_axis_m > 0.0).then_some((semi_axis_m * (1.0 - eccentricity) - EARTH_MEAN_RADIUS_M) * 1e-3)
}

/// Returns a finding for each error of the whole flight that is far from what was told.
fn priors(case: &Case<'_>, solution: &Solution, names: &[String]) -> Vec<Finding> {
    let (places, shared) = (&case.places, &solution.adjusted.estimates.shared);
    let far = |first: Option<usize>, len: usize| {
        let over = |i: usize| (shared.get(i).copied().unwrap_or(0.0) / places.sigmas.get(i).unwrap_or(&1.0)).abs();
        let largest = first.map_or(0.0, |first| (first..first + len).map(over).fold(0.0, f64::max));
        (largest > SIGMAS).then_some(largest)
    };
    let mut out = Vec::new();
    for ((name, mount), clock) in names.iter().zip(&places.mounts).zip(&places.clocks) {
        let source = || Source::Camera(name.clone());
        if let Some(sigmas) = far(*mount, 3) {
            let what = format!("the mount of {name} is {sigmas:.1} sigmas from the told one; check it, or its sigma");
            out.push(finding(Level::Contradicts, (Cause::Mount, source()), what));
        }
        if let Some(sigmas) = far(*clock, 1) {
            let what = format!(
                "the clock of {name} differs from that of the attitudes by {sigmas:.1} sigmas; check its times"
            );
            out.push(finding(Level::Contradicts, (Cause::CameraClock, source()), what));
        }
    }
    if let Some(sigmas) = far(places.height, 1) {
        let what = format!(
            "the limb height is {sigmas:.1} sigmas from the told one; check limb_height_km and the told altitudes"
        );
        out.push(finding(Level::Contradicts, (Cause::LimbHeight, Source::Cameras), what));
    }
    out
}

/// Attitudes as a table in another convention has them.
fn other_conventions(attitudes: &[Attitude]) -> [(&'static str, Vec<Attitude>); 3] {
    let turned = |change: &dyn Fn(f64, UnitQuaternion<f64>) -> UnitQuaternion<f64>| {
        let one = |a: &Attitude| Attitude {
            fixed_from_vehicle: a.fixed_from_vehicle.map(|q| change(a.time_s, q.into_inner()).into()),
            ..*a
        };
        attitudes.iter().map(one).collect::<Vec<_>>()
    };
    let about_pole = |angle: f64| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
    let scalar_last = |q: UnitQuaternion<f64>| {
        // The cells qw, qx, qy, qz hold x, y, z, w.
        UnitQuaternion::from_quaternion(Quaternion::new(q.k, q.w, q.i, q.j))
    };
    [
        (
            "relative to inertial axes, and not to ECEF: turn them with the sidereal time",
            turned(&|time_s, q| about_pole(-EARTH_RATE_RAD_S * time_s) * q),
        ),
        ("from ECEF to the vehicle: invert the quaternions", turned(&|_, q| q.inverse())),
        ("with the scalar last: --map attitude:q=qz:qw:qx:qy names the columns", turned(&|_, q| scalar_last(q))),
    ]
}

/// Returns the finding that the attitudes are of another convention, if one explains the limbs.
fn tracker(case: &Case<'_>, told: &Fit) -> Option<Finding> {
    let solved = |(name, attitudes): (&'static str, Vec<Attitude>)| {
        let solution = case.solve(&attitudes, &mut Counts::default()).ok()?;
        let fit = Fit::of(&solution);
        (!fit.contradicts() && fit.square < 0.5 * told.square).then_some((name, fit.square))
    };
    let all = other_conventions(&case.inputs.attitudes).into_iter().filter_map(solved);
    let (name, _) = all.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let what = format!("the attitudes of the star tracker look as if they were {name}");
    Some(finding(Level::Contradicts, (Cause::TrackerFrame, Source::StarTracker), what))
}

/// Compares the orbit with the positions that the recordings were made with.
fn told_positions(solution: &Solution, names: &[String], epochs: &[Epoch]) -> Option<Finding> {
    let mut worst: Option<(f64, f64, usize)> = None;
    let (mut count, mut beyond) = (0_usize, 0_usize);
    for sight in &solution.sights {
        let next = epochs.partition_point(|e| e.state.time_s < sight.time_s);
        let (Some(told), Some(epoch)) = (sight.told, epochs.get(next)) else { continue };
        let Some(own) = axis(epoch.state.position_m.as_inner()) else { continue };
        let angle = own.angle_rad(&told);
        let sigma_m = epoch.position_covariance_m2.as_inner().symmetric_eigenvalues().max().max(0.0).sqrt();
        let sigma = sigma_m / epoch.state.position_m.norm();
        count += 1;
        beyond += usize::from(angle > (POSITIONS[0] * sigma).max(POSITIONS[1]));
        if worst.is_none_or(|(largest, ..)| angle / sigma > largest) {
            worst = Some((angle / sigma, angle, sight.camera));
        }
    }
    let (sigmas, angle, camera) = worst.filter(|_| count > 0 && 2 * beyond > count)?;
    let name = names.get(camera).cloned().unwrap_or_default();
    Some(finding(
        Level::Contradicts,
        (Cause::ReceiverFrame, Source::Camera(name.clone())),
        format!(
            "the positions that {name} was processed with are up to {:.1}° from the orbit, {sigmas:.0} sigmas: their \
             frame or their times, or the frame of the attitudes, are wrong. Limbs do not show the longitude",
            angle.to_degrees()
        ),
    ))
}
