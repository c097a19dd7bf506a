//! The receiver against the positions that the recordings were made with.
//!
//! A row of a recording has the axis of the limb from outside and the altitude: together they are the position that the
//! sensor was told. If it was another one than the receiver's at this time, one of them is wrong, or a clock is.

use hzn_core::ellipsoid::{WGS84_A_M, WGS84_B_M, geodetic};
use hzn_nav::frames::{Fixed, Vector};
use nalgebra::Vector3;

use super::motion::receiver_at;
use super::receiver::median;
use crate::input::{Body, Fix, Recording, Seen};
use crate::reference::limb_axis;
use crate::results::ReceiverLag;
use crate::settings::Settings;

/// 1-sigma of a told altitude, m: the default of `body.altitude_sigma_km`.
const TOLD_SIGMA_M: f64 = 500.0;
/// 1-sigma of the place below the vehicle, m: a limb that is higher on one side turns the axis. It is the default sigma
/// of the limb height.
const BELOW_SIGMA_M: f64 = 7000.0;
/// Distance of the told positions from the receiver's that is told, m. A limb that is 1 km higher on one side turns the
/// axis by as much as 4 km of distance from a low orbit; more is a coarse or a wrong position.
const TOLD_APART_M: f64 = 5000.0;
/// Fewest pictures of a camera.
const FEWEST: usize = 5;
/// Sigmas above which positions do not belong to one place.
const APART: f64 = 4.0;
/// Largest part of the mean difference across the path, as a share of the part along it, if a lag is the cause. A
/// horizontal difference with any other cause points as well along the path once in a hundred times.
const ALONG: f64 = 0.02;
/// Sigmas of the mean difference across the path that are noise.
const NOISE: f64 = 3.0;
/// Largest difference of clocks that is looked for, s.
const LAG_S: f64 = 60.0;
/// 1-sigma of the limb's axis from outside, rad: the recordings and the receiver have it for limb heights that are
/// 10 km apart.
const AXIS_SIGMA_RAD: f64 = 5e-6;

/// How the positions of a recording lie against those of the receiver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Place {
    /// They agree, or the recording does not have them.
    Agrees,
    /// They agree if the receiver's times are this much later, s.
    Lag(f64),
    /// They lie apart by this distance, m (median).
    Apart(f64),
    /// They lie apart by this distance, m (median), which a limb that is higher on one side could explain, but only
    /// just.
    Near(f64),
}

/// Compares the positions of a recording with those of the receiver.
pub(super) fn place(recording: &Recording, fixes: &[Fix], settings: &Settings) -> Place {
    let limbs: Vec<&Seen> = recording.seen.iter().filter(|s| s.body == Body::Limb && s.reference.is_some()).collect();
    // The clocks may differ by what the filter expects, and the receiver has an error of its own.
    let clock_s = settings.camera(&recording.name).clock_s.sigma;
    let Some(now) = misses(&limbs, recording.clock_offset_s, fixes, 0.0) else { return Place::Agrees };
    let sigma_m = |speed_m_s: f64| TOLD_SIGMA_M.hypot(clock_s * speed_m_s).hypot(settings.gnss.position_sigma_m);
    let share = |all: &[Miss]| {
        let apart = all.iter().filter(|m| m.miss_m.norm() > APART * sigma_m(m.velocity_m_s.norm())).count();
        apart as f64 / all.len() as f64
    };
    let rest_m = median(now.iter().map(|m| m.miss_m.norm())).unwrap_or(0.0);
    if let Some(fit) = best_lag(&limbs, recording.clock_offset_s, fixes)
        && fit.lag_s.abs() > APART * fit.sigma_s.hypot(clock_s)
        && fit.rest_m < TOLD_SIGMA_M.max(0.2 * rest_m)
    {
        return Place::Lag(fit.lag_s);
    }
    let distance_m = median(now.iter().map(|m| m.distance_m)).unwrap_or(0.0);
    let moved_m = median(now.iter().map(|m| clock_s * m.velocity_m_s.norm() * BELOW_SIGMA_M / TOLD_SIGMA_M));
    if share(&now) > 0.5 {
        Place::Apart(distance_m)
    } else if distance_m > TOLD_APART_M.hypot(APART * moved_m.unwrap_or(0.0)) + settings.gnss.position_sigma_m {
        Place::Near(distance_m)
    } else {
        Place::Agrees
    }
}

/// Returns the time by which the receiver is late against the positions of a recording, with what is known of its
/// sigma; `None` if the recording does not have them, or if they lie apart in a way that no lag explains.
pub(super) fn lag(camera: usize, recording: &Recording, fixes: &[Fix]) -> Option<ReceiverLag> {
    let limbs: Vec<&Seen> = recording.seen.iter().filter(|s| s.body == Body::Limb && s.reference.is_some()).collect();
    let fit = best_lag(&limbs, recording.clock_offset_s, fixes)?;
    let speed_m_s =
        median(limbs.iter().filter_map(|s| Some(receiver_at(fixes, s.time_s + recording.clock_offset_s)?.1.norm())))?;
    // Coarse positions differ across the path, too, and that is in the sigma of the fit.
    let Lag { lag_s, sigma_s, .. } = fit;
    sigma_s.is_finite().then_some(ReceiverLag { camera, lag_s, sigma_s, speed_m_s })
}

/// Returns the lag that explains the differences best.
fn best_lag(limbs: &[&Seen], clock_s: f64, fixes: &[Fix]) -> Option<Lag> {
    // A fit with a constant difference sees a lag by the bend of the path only, which a short arc hardly has.
    along_the_path(limbs, clock_s, fixes).or_else(|| {
        // A straight fit finds small lags; the grid finds those for which the vehicle moves on a curve.
        let starts = (-12..=12).map(|k| LAG_S / 12.0 * f64::from(k));
        let fits = starts.filter_map(|from_s| fitted(limbs, clock_s, fixes, from_s));
        fits.filter(|fit| fit.lag_s.abs() <= LAG_S).min_by(|a, b| a.rest_m.total_cmp(&b.rest_m))
    })
}

/// The told position of a picture against that of the receiver. The components across the vertical count by the ratio
/// of the sigmas.
struct Miss {
    /// Told minus measured, m.
    miss_m: Vector3<f64>,
    /// The vertical.
    up: Vector3<f64>,
    velocity_m_s: Vector3<f64>,
    /// The whole distance, m.
    distance_m: f64,
    /// The receiver's distance from the Earth's centre, m.
    radius_m: f64,
}

/// Returns the differences, with the receiver's positions of a later time; `None` if there are too few.
fn misses(limbs: &[&Seen], clock_s: f64, fixes: &[Fix], lag_s: f64) -> Option<Vec<Miss>> {
    let miss = |seen: &&Seen| {
        let (position_m, velocity_m_s) = receiver_at(fixes, seen.time_s + clock_s + lag_s)?;
        let axis = limb_axis(Body::Limb, &position_m)?;
        let up = position_m.try_normalize(1.0)?;
        let across = (axis - seen.reference?) * position_m.norm();
        let (height_m, _) = geodetic(position_m.xyz(), WGS84_A_M, WGS84_B_M);
        let higher_m = seen.altitude_km.map_or(0.0, |km| km * 1e3 - height_m);
        let weighted = |v: Vector<Fixed>| {
            let along = up * v.dot(&up);
            (along + (v - along) * (TOLD_SIGMA_M / BELOW_SIGMA_M)).into_inner()
        };
        let miss: Vector<_> = across - up * across.dot(&up) + up * higher_m;
        let distance_m = miss.norm();
        let (miss_m, velocity_m_s, up) = (weighted(miss), weighted(velocity_m_s), up.into_inner());
        Some(Miss { miss_m, up, velocity_m_s, distance_m, radius_m: position_m.norm() })
    };
    let all: Vec<Miss> = limbs.iter().filter_map(miss).collect();
    (all.len() >= FEWEST).then_some(all)
}

/// A lag with its sigma, and what it leaves.
struct Lag {
    lag_s: f64,
    sigma_s: f64,
    rest_m: f64,
}

/// Returns the lag alone, without a constant difference, if it explains the horizontal difference: its mean has the
/// direction of the path, and the length says the lag. The noise of the single positions is in the mean by its root of
/// their number, so that the receiver's does not decide.
fn along_the_path(limbs: &[&Seen], clock_s: f64, fixes: &[Fix]) -> Option<Lag> {
    let mut lag_s = 0.0;
    for _ in 0..4 {
        let all = misses(limbs, clock_s, fixes, lag_s)?;
        let sum = |of: &dyn Fn(&Miss) -> f64| all.iter().map(of).sum::<f64>();
        let information = sum(&|m| m.velocity_m_s.norm_squared());
        if !(information > 0.0) {
            return None;
        }
        lag_s += sum(&|m| m.velocity_m_s.dot(&m.miss_m)) / information;
    }
    if lag_s.abs() > LAG_S {
        return None;
    }
    let all = misses(limbs, clock_s, fixes, lag_s)?;
    let n = all.len() as f64;
    let across = |m: &Miss| m.miss_m - m.up * m.miss_m.dot(&m.up);
    let mean_across = all.iter().map(across).sum::<Vector3<f64>>() / n;
    let speed_m_s = median(all.iter().map(|m| m.velocity_m_s.norm()))?;
    let left_m = mean_across.norm();
    let rest_m = median(all.iter().map(|m| m.miss_m.norm()))?;
    // Across the path, nothing may be left but the errors of the single positions and of the limb's axis.
    let radius_m = median(all.iter().map(|m| m.radius_m))?;
    let error_m = (rest_m / n.sqrt()).hypot(AXIS_SIGMA_RAD * radius_m * TOLD_SIGMA_M / BELOW_SIGMA_M);
    let is_along = left_m < (ALONG * lag_s.abs() * speed_m_s).max(NOISE * error_m);
    is_along.then(|| Lag { lag_s, sigma_s: left_m.hypot(error_m) / speed_m_s, rest_m })
}

/// Fits a lag and a constant difference, from a first lag on.
fn fitted(limbs: &[&Seen], clock_s: f64, fixes: &[Fix], from_s: f64) -> Option<Lag> {
    let mut lag_s = from_s;
    let mut sigma_s = f64::INFINITY;
    for _ in 0..4 {
        let all = misses(limbs, clock_s, fixes, lag_s)?;
        let n = all.len() as f64;
        let mean = |of: &dyn Fn(&Miss) -> Vector3<f64>| all.iter().map(of).sum::<Vector3<f64>>() / n;
        let (mean_miss, mean_velocity) = (mean(&|m| m.miss_m), mean(&|m| m.velocity_m_s));
        let (mut information, mut moment) = (0.0, 0.0);
        for m in &all {
            let velocity = m.velocity_m_s - mean_velocity;
            information += velocity.norm_squared();
            moment += velocity.dot(&(m.miss_m - mean_miss));
        }
        if !(information > 0.0) {
            return None;
        }
        lag_s += moment / information;
        // What the fit leaves says how the told positions err. They err in common over many pictures, so that their
        // number does not help.
        let left = |m: &Miss| {
            (m.miss_m - mean_miss - (m.velocity_m_s - mean_velocity) * (moment / information)).norm_squared()
        };
        let left_m = (all.iter().map(left).sum::<f64>() / n).sqrt();
        sigma_s = left_m / (information / n).sqrt();
    }
    let rest_m = median(misses(limbs, clock_s, fixes, lag_s)?.iter().map(|m| m.miss_m.norm()))?;
    Some(Lag { lag_s, sigma_s, rest_m })
}
