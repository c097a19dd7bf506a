//! The limbs of the pictures with the attitudes at their times.

use hzn_nav::filter::{DirectionMeasurement, UsableDirection, basis};
use hzn_nav::frames::{Cam, Fixed, Rotation, Vector, Vehicle};
use nalgebra::{Matrix2, Matrix3, SMatrix, Vector3};

use crate::input::{Attitude, Body, Inputs};
use crate::results::Counts;
use crate::solve::{Lens, without_lens};

/// Largest turn between two attitudes of the table, rad. Within it the vehicle turns at a constant rate.
const LARGEST_TURN_RAD: f64 = 0.5;
/// Smallest white noise of a direction as a share of its sigma: without any, a direction would be a condition.
const LEAST_WHITE: f64 = 0.01;

/// The attitudes of the star tracker in the order of time.
pub(super) struct Attitudes {
    pub(super) rows: Vec<(f64, Rotation<Vehicle, Fixed>, f64)>,
}

/// The attitude at a time, and between which rows it is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Between {
    pub(super) row: usize,
    /// The share of the next row.
    pub(super) part: f64,
}

impl Attitudes {
    /// Takes the usable rows, and counts the others.
    pub(super) fn new(all: &[Attitude], counts: &mut Counts) -> Self {
        let mut rows = Vec::with_capacity(all.len());
        let mut unusable = 0;
        for one in all {
            match one.fixed_from_vehicle {
                Some(q) if one.time_s.is_finite() && one.sigma_rad.is_finite() && one.sigma_rad > 0.0 => {
                    rows.push((one.time_s, q, one.sigma_rad));
                }
                _ => unusable += 1,
            }
        }
        counts.add_unusable("attitude", "time, quaternion or sigma is not a number, or the sigma is 0", unusable);
        rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        let before = rows.len();
        rows.dedup_by(|a, b| a.0 == b.0);
        counts.add_unusable("attitude", "the time is that of another row", before - rows.len());
        Self { rows }
    }

    /// Returns between which rows a time is; `None` outside the table, and where the vehicle turned too far.
    pub(super) fn between(&self, time_s: f64) -> Option<Between> {
        let next = self.rows.partition_point(|(t, ..)| *t <= time_s);
        let row = next.checked_sub(1)?;
        let (before, q, _) = self.rows.get(row)?;
        if *before == time_s {
            return Some(Between { row, part: 0.0 });
        }
        let (after, to, _) = self.rows.get(next)?;
        (q.angle_to(to) < LARGEST_TURN_RAD).then(|| Between { row, part: (time_s - before) / (after - before) })
    }

    /// Returns the attitude between two rows, carried on past them for a small shift of the clock.
    pub(super) fn at(&self, between: Between, shift_s: f64) -> Option<Rotation<Vehicle, Fixed>> {
        let (t, q, _) = self.rows.get(between.row)?;
        let (first, second) = match self.rows.get(between.row + 1) {
            Some(next) => ((*t, *q), (next.0, next.1)),
            None => {
                let before = self.rows.get(between.row.checked_sub(1)?)?;
                ((before.0, before.1), (*t, *q))
            }
        };
        let span_s = second.0 - first.0;
        let next_s = self.rows.get(between.row + 1).map_or(0.0, |next| between.part * (next.0 - t));
        let part = (t + next_s + shift_s - first.0) / span_s;
        let turn = (second.1 * first.1.inverse()).scaled_axis();
        let is_steady = first.1.angle_to(&second.1) < LARGEST_TURN_RAD;
        if !is_steady {
            return Some(*q);
        }
        Some(Rotation::from_scaled_axis(turn * part) * first.1)
    }
}

/// The limb of one picture.
#[derive(Debug, Clone)]
pub(super) struct Sight {
    pub(super) time_s: f64,
    pub(super) camera: usize,
    pub(super) between: Between,
    pub(super) measured: Vector<Cam>,
    pub(super) by_limb_height: Vector<Cam>,
    pub(super) altitude_km: Option<f64>,
    /// The direction of the axis from the position that the sensor was told.
    pub(super) told: Option<Vector<Fixed>>,
    /// Symmetric root of the covariance of the slow error, rad.
    pub(super) root: Matrix3<f64>,
    /// Derivative of the measured axis by the error of the lens, if that is unknown.
    pub(super) by_lens: Option<Matrix3<f64>>,
    /// Two axes across the direction over the noise.
    pub(super) across: SMatrix<f64, 2, 3>,
}

/// Returns the limbs of all recordings in the order of time. Of each camera it is told whether it has a slow error, and
/// its lens if that is unknown.
pub(super) fn sights(
    inputs: &Inputs,
    attitudes: &Attitudes,
    (has_slow, lenses): (&[bool], &[Option<&Lens>]),
    counts: &mut Counts,
) -> Vec<Sight> {
    let mut out: Vec<Sight> = Vec::new();
    for (camera, recording) in inputs.recordings.iter().enumerate() {
        for seen in recording.seen.iter().filter(|seen| seen.body == Body::Limb) {
            let time_s = seen.time_s + recording.clock_offset_s;
            let Some(between) = attitudes.between(time_s) else {
                counts.add_unusable(recording.name.clone(), "there is no attitude at the time of the picture", 1);
                continue;
            };
            let mut measurement = DirectionMeasurement {
                camera,
                body: 0,
                measured: seen.axis,
                // It is not used: the position is what is looked for.
                reference: Vector::new(0.0, 0.0, 1.0),
                covariance_rad2: seen.covariance_rad2,
                common_rad2: seen.common_rad2,
                by_limb_height: seen.by_limb_height,
                is_limb: true,
            };
            let lens = lenses.get(camera).copied().flatten();
            let by_lens = lens.and_then(|lens| without_lens(&mut measurement, lens, seen));
            let usable = measurement.usable();
            let slow = has_slow.get(camera).copied().unwrap_or(false);
            let noise = usable.map(|usable| (usable, whitened(&usable, slow)));
            match noise {
                Ok((usable, Some(across))) => out.push(Sight {
                    time_s,
                    camera,
                    between,
                    measured: usable.measured,
                    by_limb_height: seen.by_limb_height,
                    altitude_km: seen.altitude_km,
                    told: seen.reference,
                    root: usable.slow_root_rad,
                    by_lens,
                    across,
                }),
                Ok((_, None)) => counts.add_unusable(recording.name.clone(), "the covariance is negative", 1),
                Err(why) => counts.add_unusable(recording.name.clone(), why.as_str(), 1),
            }
        }
    }
    out.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    out
}

fn whitened(usable: &UsableDirection, has_slow: bool) -> Option<SMatrix<f64, 2, 3>> {
    let covariance = usable.slow_root_rad * usable.slow_root_rad;
    let white = LEAST_WHITE * covariance.trace().sqrt();
    let axes = basis(usable.measured.as_inner());
    let mut noise = Matrix2::identity() * (white * white) + axes * usable.white_rad2 * axes.transpose();
    if !has_slow {
        noise += axes * covariance * axes.transpose();
    }
    noise.cholesky()?.l().solve_lower_triangular(&axes)
}

/// Returns the direction to the Earth, a unit vector, as a picture shows it.
pub(super) fn towards_earth(sight: &Sight, attitudes: &Attitudes, mount: &Rotation<Cam, Vehicle>) -> Vector3<f64> {
    let attitude = attitudes.at(sight.between, 0.0).unwrap_or_else(Rotation::identity);
    (attitude * *mount * sight.measured).into_inner()
}
