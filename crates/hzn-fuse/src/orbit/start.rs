//! The first estimates of the orbit: each picture shows where the Earth is, and the told altitude how far.

use core::f64::consts::TAU;

use hzn_core::ellipsoid::EARTH_MEAN_RADIUS_M;
use hzn_nav::frames::{Cam, Rotation, Vehicle};
use hzn_nav::gravity::EARTH_RATE_RAD_S;
use nalgebra::{DMatrix, Rotation3, Vector3};

use super::dynamics::{GM_M3_S2, Motion, carried};
use super::problem::{axis, position};
use super::sights::{Attitudes, Sight, towards_earth};
use crate::error::Error;

/// Shortest time between two knots, s. The accelerations that the dynamics do not have move the satellite by a few
/// metres in this time.
const KNOT_S: f64 = 300.0;
/// The velocity at a knot comes from the pictures within this part of a circular orbit, before and after it.
const WINDOW: f64 = 0.07;
/// A longer part of an orbit, for pictures that are farther apart: the parabola through them is then rough, but the
/// descent begins from it.
const LONG_WINDOW: f64 = 0.2;
/// Altitude of a picture that was told none, km: the dynamics find the right one from the time of an orbit.
const ALTITUDE_KM: f64 = 600.0;
/// Fewest pictures. Each has two numbers, and an orbit has six.
pub(super) const FEWEST: usize = 6;
/// Smallest part of an orbit. The position from a shorter arc is wrong by hundreds of kilometres, more than a sigma can
/// describe.
const SMALLEST_ARC: f64 = 0.1;
/// Smallest turn between two pictures that counts, rad: above the noise of a direction.
const STEP_RAD: f64 = 0.02;

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
    let sparse = |time_s: f64, position: &Vector3<f64>| {
        Error::unusable(format!(
            "--solve without an inertial unit: near {time_s:.0} s there are fewer than three pictures with a limb \
             within {:.0} s before and after; take pictures more often",
            LONG_WINDOW * period_s(position)
        ))
    };
    if places.len() < FEWEST {
        return Err(few(places.len()));
    }
    let turns = turns(&places);
    if turns < SMALLEST_ARC {
        return Err(Error::unusable(format!(
            "--solve without an inertial unit: the flight covers {turns:.2} of an orbit, which determines none; \
             {SMALLEST_ARC} is needed, and a whole orbit is better"
        )));
    }
    let (mut times_s, mut at_knots): (Vec<f64>, Vec<Vector3<f64>>) = Default::default();
    for (time_s, place) in &places {
        if times_s.last().is_none_or(|last| time_s - last >= KNOT_S) {
            times_s.push(*time_s);
            at_knots.push(*place);
        }
    }
    let mut motions: Vec<Motion> = Vec::with_capacity(times_s.len());
    for (time_s, place) in times_s.iter().zip(&at_knots) {
        let own = motion(&places, *time_s, WINDOW * period_s(place));
        let carried_on = |last: &Motion| carried(last, time_s - times_s.get(motions.len() - 1).unwrap_or(time_s), 0.0);
        let rough = || motion(&places, *time_s, LONG_WINDOW * period_s(place));
        let next = own.or_else(|| motions.last().map(carried_on)).or_else(rough);
        motions.push(next.ok_or_else(|| sparse(*time_s, place))?);
    }
    Ok((times_s, motions))
}

/// Returns the time of a circular orbit through a position, s.
fn period_s(position: &Vector3<f64>) -> f64 {
    TAU * (position.norm().powi(3) / GM_M3_S2).sqrt()
}

/// Returns the turn of the direction to the Earth among the stars, in turns: the sum over the pictures, so that it also
/// counts more than one orbit.
fn turns(places: &[(f64, Vector3<f64>)]) -> f64 {
    let inertial = |(time_s, place): &(f64, Vector3<f64>)| {
        Rotation3::from_axis_angle(&Vector3::z_axis(), EARTH_RATE_RAD_S * time_s) * place
    };
    // Between pictures that are close, noise would add up: so far steps are taken.
    let mut last = places.first().map(inertial);
    let mut sum = 0.0;
    for place in places.iter().map(inertial) {
        let angle = last.map_or(0.0, |last| last.angle(&place));
        if angle > STEP_RAD {
            sum += angle;
            last = Some(place);
        }
    }
    sum / TAU
}

/// Returns the motion at a time: a parabola through the positions within a window around it. `None` with fewer than
/// three.
fn motion(places: &[(f64, Vector3<f64>)], time_s: f64, window_s: f64) -> Option<Motion> {
    let near: Vec<_> = places.iter().filter(|(t, _)| (t - time_s).abs() <= window_s).collect();
    let span_s = near.last()?.0 - near.first()?.0;
    if near.len() < 3 || span_s < 0.1 * window_s {
        return None;
    }
    let t = |i: usize| near.get(i).map_or(0.0, |(t, _)| (t - time_s) / window_s);
    let design = DMatrix::from_fn(near.len(), 3, |i, j| t(i).powi(j as i32));
    let values = DMatrix::from_fn(near.len(), 3, |i, j| near.get(i).map_or(0.0, |(_, p)| p[j]));
    let found = design.svd(true, true).solve(&values, 1e-9).ok()?;
    let row = |i: usize| Vector3::new(found[(i, 0)], found[(i, 1)], found[(i, 2)]);
    let (x, v) = (row(0), row(1) / window_s);
    let out = Motion::new(x.x, x.y, x.z, v.x, v.y, v.z);
    (position(&out).norm() > 0.9 * EARTH_MEAN_RADIUS_M).then_some(out)
}
