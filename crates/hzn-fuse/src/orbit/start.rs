//! The first estimates of the orbit: each picture shows where the Earth is, and the told altitude how far.

use hzn_core::ellipsoid::EARTH_MEAN_RADIUS_M;
use hzn_nav::frames::{Cam, Rotation, Vehicle};
use nalgebra::{DMatrix, Vector3};

use super::dynamics::{Motion, carried};
use super::problem::{axis, position};
use super::sights::{Attitudes, Sight, towards_earth};
use crate::error::Error;

/// Shortest time between two knots, s. The accelerations that the dynamics do not have move the satellite by a few
/// metres in this time.
const KNOT_S: f64 = 300.0;
/// The velocity at a knot comes from the pictures within this time before and after it, s: less than a tenth of an
/// orbit.
const WINDOW_S: f64 = 400.0;
/// Altitude of a picture that was told none, km: the dynamics find the right one from the time of an orbit.
const ALTITUDE_KM: f64 = 600.0;
/// Fewest pictures. Each has two numbers, and an orbit has six.
pub(super) const FEWEST: usize = 6;
/// Smallest turn of the direction to the Earth in the flight, rad. A shorter arc determines no orbit.
const SMALLEST_ARC_RAD: f64 = 0.03;

/// Returns the position from which the limb's axis has a direction.
fn position_of(down: &Vector3<f64>, altitude_km: f64) -> Option<Vector3<f64>> {
    let distance_m = EARTH_MEAN_RADIUS_M + altitude_km * 1e3;
    let mut up = -down;
    for _ in 0..4 {
        let off = axis(&(up * distance_m))?.into_inner() - down;
        up = (up + off).normalize();
    }
    Some(up * distance_m)
}

/// Returns the times of the knots with the first estimates of their motions.
pub(super) fn knots(
    sights: &[Sight],
    attitudes: &Attitudes,
    mounts: &[Rotation<Cam, Vehicle>],
) -> Result<(Vec<f64>, Vec<Motion>), Error> {
    let place = |sight: &Sight| {
        let down = towards_earth(sight, attitudes, mounts.get(sight.camera)?);
        Some((sight.time_s, position_of(&down, sight.altitude_km.unwrap_or(ALTITUDE_KM))?))
    };
    let places: Vec<(f64, Vector3<f64>)> = sights.iter().filter_map(place).collect();
    let few = |n: usize| {
        Error::unusable(format!(
            "--solve without an inertial unit needs limbs with attitudes from a tenth of an orbit or more, at least \
             {FEWEST}, but there are {n}"
        ))
    };
    let Some((_, begin)) = places.first().filter(|_| places.len() >= FEWEST) else { return Err(few(places.len())) };
    let arc = places.iter().map(|(_, p)| begin.angle(p)).fold(0.0, f64::max);
    if arc < SMALLEST_ARC_RAD {
        return Err(Error::unusable(format!(
            "--solve without an inertial unit: the flight covers {:.1}° of an orbit, which determines none; 2° are \
             needed, and a whole orbit is better",
            arc.to_degrees()
        )));
    }
    let mut times_s: Vec<f64> = Vec::new();
    for (time_s, _) in &places {
        if times_s.last().is_none_or(|last| time_s - last >= KNOT_S) {
            times_s.push(*time_s);
        }
    }
    let mut motions: Vec<Motion> = Vec::with_capacity(times_s.len());
    for time_s in &times_s {
        let own = motion(&places, *time_s);
        let carried_on = |last: &Motion| carried(last, time_s - times_s.get(motions.len() - 1).unwrap_or(time_s));
        let next = own.or_else(|| motions.last().map(carried_on)).ok_or_else(|| few(places.len()))?;
        motions.push(next);
    }
    Ok((times_s, motions))
}

/// Returns the motion at a time: a parabola through the positions around it. `None` with fewer than three.
fn motion(places: &[(f64, Vector3<f64>)], time_s: f64) -> Option<Motion> {
    let near: Vec<_> = places.iter().filter(|(t, _)| (t - time_s).abs() <= WINDOW_S).collect();
    let span_s = near.last()?.0 - near.first()?.0;
    if near.len() < 3 || span_s < 0.1 * WINDOW_S {
        return None;
    }
    let t = |i: usize| near.get(i).map_or(0.0, |(t, _)| (t - time_s) / WINDOW_S);
    let design = DMatrix::from_fn(near.len(), 3, |i, j| t(i).powi(j as i32));
    let values = DMatrix::from_fn(near.len(), 3, |i, j| near.get(i).map_or(0.0, |(_, p)| p[j]));
    let found = design.svd(true, true).solve(&values, 1e-9).ok()?;
    let row = |i: usize| Vector3::new(found[(i, 0)], found[(i, 1)], found[(i, 2)]);
    let (x, v) = (row(0), row(1) / WINDOW_S);
    let out = Motion::new(x.x, x.y, x.z, v.x, v.y, v.z);
    (position(&out).norm() > 0.9 * EARTH_MEAN_RADIUS_M).then_some(out)
}
