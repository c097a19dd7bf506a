//! The state at the start: an attitude from directions or a star tracker, position and velocity from the receiver.

use hzn_core::ellipsoid::EARTH_MEAN_RADIUS_M;
use hzn_nav::frames::{Covariance, Fixed, Rotation, Vector, Vehicle};
use hzn_nav::options::CameraOptions;
use hzn_nav::strapdown::Nominal;

use crate::data::Flight;
use crate::error::Error;
use crate::events::Source;
use crate::input::{Body, Fix, Inputs, Seen};
use crate::reference::limb_axis;
use crate::results::Begin;
use crate::settings::Settings;
use crate::start::{DeadReckoning, Sight, Sighted, attitude};

/// Acceleration that a vehicle may have between a fix and the start, m/s²: 10 g.
const ACCELERATION_M_S2: f64 = 100.0;
/// Speed in a low orbit: the sigma of a velocity that nobody measures, m/s.
const ORBIT_M_S: f64 = 7.8e3;
/// Longest time from a fix to the start, s.
const FIX_S: f64 = 5.0;

/// The state at the start.
pub(super) struct Found {
    pub(super) state: Nominal,
    pub(super) covariance_rad2: Covariance<Fixed>,
    pub(super) position_sigma_m: f64,
    pub(super) velocity_sigma_m_s: f64,
    pub(super) begin: Begin,
}

/// Looks for the first attitude: a star tracker's, or that of the directions in a window.
pub(super) fn first_attitude(
    flight: &Flight<'_>,
    settings: &Settings,
    cameras: &[CameraOptions],
    reckoning: &DeadReckoning,
) -> Result<Found, Error> {
    let mut sights: Vec<Sight> = Vec::new();
    let mut bodies: Vec<Body> = Vec::new();
    let mut contradicts = false;
    let mut without_reference: Vec<Body> = Vec::new();
    let mut without_place: Vec<f64> = Vec::new();
    for event in flight.events {
        let Some(fix) = place_near(flight.inputs, event.time_s) else {
            without_place.extend(matches!(event.source, Source::Attitude(_)).then_some(event.time_s));
            continue;
        };
        let found = match event.source {
            Source::Gnss(_) => None,
            Source::Attitude(index) => {
                let seen = flight.inputs.attitudes.get(index);
                seen.and_then(|a| Some((a.fixed_from_vehicle?, Covariance::isotropic(a.sigma_rad.powi(2)), 0, 0.0)))
            }
            Source::Camera(camera, index) => {
                let seen = flight.inputs.recordings.get(camera).and_then(|r| r.seen.get(index));
                let sight = seen.and_then(|seen| {
                    let options = cameras.get(camera)?;
                    let receiver = || limb_axis(seen.body, &fix.position_m).filter(|_| flight.inputs.has_receiver());
                    let reference = seen.reference.or_else(receiver)?;
                    let sigma_rad = sight_sigma(seen, Some(options));
                    let on_vehicle = options.mount * seen.axis;
                    Some(Sight { time_s: event.time_s, camera, body: seen.body, on_vehicle, reference, sigma_rad })
                });
                let Some(sight) = sight.filter(|s| s.on_vehicle.is_finite()) else {
                    without_reference.extend(seen.filter(|seen| seen.axis.is_finite()).map(|seen| seen.body));
                    continue;
                };
                if !bodies.contains(&sight.body) {
                    bodies.push(sight.body);
                }
                sights.retain(|s| s.time_s > event.time_s - settings.start.window_s);
                sights.push(sight);
                match without_one_camera(&sights, reckoning) {
                    Sighted::Attitude(w, count) => Some((w.attitude, w.covariance_rad2, count, w.chi2)),
                    Sighted::Contradiction => {
                        contradicts = true;
                        None
                    }
                    Sighted::Nothing => None,
                }
            }
        };
        let Some((attitude, covariance_rad2, directions, chi2)) = found else { continue };
        let begin = Begin { time_s: event.time_s, directions, chi2 };
        return Ok(found_at(begin, attitude, covariance_rad2, &fix, &flight.inputs.gnss, settings));
    }
    if let ([first_s, ..], false) = (without_place.as_slice(), contradicts) {
        return Err(without_position(*first_s, without_place.len(), &flight.inputs.gnss));
    }
    Err(no_attitude(&bodies, &without_reference, contradicts, settings))
}

/// Says why the attitudes of a star tracker do not begin a flight: the receiver has no position there.
fn without_position(first_s: f64, count: usize, fixes: &[Fix]) -> Error {
    let times = fixes.iter().map(|fix| fix.time_s).filter(|t| t.is_finite());
    let [from_s, to_s] = times.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], t| [a.min(t), b.max(t)]);
    Error::unusable(format!(
        "no first attitude: the star tracker has {count}, the first at {first_s:.1} s, but the receiver has no \
         position within {FIX_S} s of one (its fixes are from {from_s:.1} to {to_s:.1} s). Give attitudes or \
         directions at times with a position, or leave out --gnss for the attitude alone"
    ))
}

/// Says why there is no first attitude.
fn no_attitude(bodies: &[Body], without_reference: &[Body], contradicts: bool, settings: &Settings) -> Error {
    if contradicts {
        return Error::unusable(
            "no first attitude: the directions contradict each other by more than their sigmas. Are the mounts right \
             (also their signs), the clocks, and the UTC that the recordings were made with?",
        );
    }
    let seen = bodies.iter().map(|b| b.name()).collect::<Vec<_>>().join(" and ");
    let window_s = settings.start.window_s;
    let seen = match bodies {
        [] => format!("within {window_s} s the recordings have no direction at a time with a position"),
        [_] => format!("within {window_s} s the recordings have only {seen}"),
        _ => format!("the recordings have {seen}, but never within {window_s} s and far enough from one line"),
    };
    let lost = match without_reference {
        [] => String::new(),
        [first, ..] => format!(
            ". Not used are {} directions, the first to the {}, whose rows do not say where the body is (columns \
             axis_e_x, axis_e_y, axis_e_z): a run with positions and utc in frames.csv writes them",
            without_reference.len(),
            first.name()
        ),
    };
    Error::unusable(format!(
        "no first attitude: {seen}{lost}. Two directions are needed, for example limb and Sun (bodies = [\"earth\", \
         \"sun\"] in sensor.toml), or a star tracker (--attitude FILE); a longer window is [start] window_s in \
         fuse.toml"
    ))
}

/// Returns the state at the start, with position and velocity of a fix near it.
fn found_at(
    begin: Begin,
    attitude: Rotation<Vehicle, Fixed>,
    covariance_rad2: Covariance<Fixed>,
    fix: &Fix,
    fixes: &[Fix],
    settings: &Settings,
) -> Found {
    let dt = begin.time_s - fix.time_s;
    let [position, told] = settings.fix_sigmas(fix);
    let (moved, velocity, drift) = if fix.velocity_m_s.is_finite() {
        (fix.velocity_m_s, told, 0.0)
    } else {
        let (moved, sigma) = by_difference(fixes, fix, position).unwrap_or((Vector::zeros(), ORBIT_M_S));
        (moved, sigma, sigma * dt)
    };
    let state =
        Nominal { time_s: begin.time_s, attitude, velocity_m_s: moved, position_m: fix.position_m + moved * dt };
    Found {
        state,
        covariance_rad2,
        position_sigma_m: position.hypot(drift).hypot(0.5 * ACCELERATION_M_S2 * dt * dt),
        velocity_sigma_m_s: velocity.hypot(ACCELERATION_M_S2 * dt.abs()),
        begin,
    }
}

/// Returns the velocity at a fix from the position of a neighbour, and its 1-sigma: of the two neighbours, that with
/// the smaller sigma. `None` without one.
fn by_difference(fixes: &[Fix], fix: &Fix, position_sigma_m: f64) -> Option<(Vector<Fixed>, f64)> {
    let is_near = |other: &&Fix| {
        let dt = (other.time_s - fix.time_s).abs();
        dt > 0.0 && dt <= FIX_S && other.position_m.is_finite()
    };
    let difference = |other: &Fix| {
        let dt = other.time_s - fix.time_s;
        let noise = position_sigma_m * 2f64.sqrt() / dt.abs();
        ((other.position_m - fix.position_m) / dt, noise.hypot(0.5 * ACCELERATION_M_S2 * dt.abs()))
    };
    fixes.iter().filter(is_near).map(difference).min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Returns the attitude of all sights; if they contradict each other, that of all but one camera's.
fn without_one_camera(sights: &[Sight], reckoning: &DeadReckoning) -> Sighted {
    let all = attitude(sights, reckoning);
    if !matches!(all, Sighted::Contradiction) {
        return all;
    }
    for camera in 0..hzn_nav::layout::MAX_CAMERAS {
        let rest: Vec<Sight> = sights.iter().copied().filter(|s| s.camera != camera).collect();
        let is_other = rest.len() < sights.len();
        if let (true, found @ Sighted::Attitude(..)) = (is_other, attitude(&rest, reckoning)) {
            return found;
        }
    }
    all
}

/// Returns the place of the vehicle near a time. Without a receiver it is somewhere around the Earth: the attitude does
/// not need it.
fn place_near(inputs: &Inputs, time_s: f64) -> Option<Fix> {
    if inputs.has_receiver() {
        return fix_near(&inputs.gnss, time_s);
    }
    Some(Fix {
        time_s,
        position_m: Vector::new(EARTH_MEAN_RADIUS_M, 0.0, 0.0),
        velocity_m_s: Vector::zeros(),
        position_sigma_m: EARTH_MEAN_RADIUS_M,
        velocity_sigma_m_s: ORBIT_M_S,
    })
}

/// Returns the fix that is nearest to a time and agrees with a neighbour.
fn fix_near(fixes: &[Fix], time_s: f64) -> Option<Fix> {
    let agrees = |a: &Fix, b: &Fix| {
        let dt = b.time_s - a.time_s;
        let velocity = if a.velocity_m_s.is_finite() { a.velocity_m_s } else { Vector::zeros() };
        let slack = if velocity == Vector::zeros() { 1e4 * dt.abs() } else { 60.0 * dt * dt };
        (a.position_m + velocity * dt - b.position_m).norm() < 200.0 + slack
    };
    let is_usable = |i: usize, fix: &Fix| {
        let neighbours = [i.checked_sub(1), Some(i + 1)].into_iter().flatten().filter_map(|j| fixes.get(j));
        fix.position_m.is_finite() && neighbours.into_iter().any(|other| agrees(fix, other))
    };
    let near = fixes.iter().enumerate().filter(|(_, fix)| (fix.time_s - time_s).abs() <= FIX_S);
    let usable = near.filter(|(i, fix)| is_usable(*i, fix)).map(|(_, fix)| *fix);
    usable.min_by(|a, b| (a.time_s - time_s).abs().total_cmp(&(b.time_s - time_s).abs()))
}

/// Returns the 1-sigma of a direction on the vehicle, with the errors of mount and limb height.
pub(super) fn sight_sigma(seen: &Seen, camera: Option<&CameraOptions>) -> f64 {
    let own = seen.covariance_rad2.as_inner().symmetric_eigenvalues().max().max(0.0).sqrt();
    let (mount, white) = camera.map_or((0.0, 0.0), |c| (c.misalignment.sigma, c.white_rad));
    // The limb height is known to some kilometres.
    own.hypot(seen.by_limb_height.norm() * 7.0).hypot(mount).hypot(white)
}
