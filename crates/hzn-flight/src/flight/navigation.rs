//! Values from navigation: altitude, position, velocity and rate of rotation, with their time and their expiry.
//!
//! A position is moved from its time to the exposure with its velocity and the acceleration of free fall in the
//! rotating frame of the Earth, a = −μ r/|r|³ − 2 ω × v − ω × (ω × r); a velocity is refused for other bodies. The next
//! term of the series is the change of the acceleration; in low orbit it moves the position by 1.5 m in ten seconds and
//! by 0.3 km in a minute.

use hzn_core::body::Last;
use hzn_core::real::Real;
use hzn_core::{Prior, Sequence};

use super::clock::Clock;
use crate::bytes::Reader;
use crate::cuc::Cuc;
use crate::messages::{Code, Navigation, NavigationState};

/// Gravitational parameter of the Earth, m³/s² (WGS-84).
const MU: f32 = 3.986_004_4e14;
/// Rate of rotation of the Earth, rad/s (WGS-84).
const OMEGA: f32 = 7.292_115e-5;
/// Largest distance of the time of the values from the time of their telecommand, s. More is an error of the sender.
const LARGEST_AGE_S: f32 = 3600.0;

/// What is known when a picture comes.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Known {
    /// The values from navigation.
    pub(super) prior: Prior<f32>,
    /// The motion of the camera; `None` if the values hold for any time.
    pub(super) motion: Option<Motion>,
    /// The last answer, and the time when its picture was exposed, µs since the start.
    pub(super) last: Option<(Last<f32>, u64)>,
    /// The earlier answer that answers are compared with, with the turn since then.
    pub(super) turns: Sequence<f32>,
    /// The time when the newest picture was exposed, µs since the start.
    pub(super) seen_us: Option<u64>,
    /// The threshold that the last picture proposes for the next one, in counts.
    pub(super) level: Option<u16>,
}

/// Time and motion of the values from navigation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Motion {
    epoch_us: u64,
    pub(super) velocity_m_s: Option<[f32; 3]>,
    expires_s: Option<f32>,
}

impl Motion {
    /// Returns the time from the values to the exposure, s; negative if the exposure was before.
    pub(super) fn age_s(&self, exposure_us: u64) -> f32 {
        // The difference is taken in whole numbers, because an f32 of microseconds has steps of 256 µs after an hour.
        // It has a sign, because values may be predicted.
        exposure_us.wrapping_sub(self.epoch_us).cast_signed() as f32 * 1e-6
    }
    fn has_expired(&self, exposure_us: u64) -> bool {
        // In both directions, because a prediction is as uncertain as an old value.
        self.expires_s.is_some_and(|limit| self.age_s(exposure_us).abs() > limit)
    }
}

impl Known {
    /// Returns the prior of a picture; `None` if the values from navigation have expired.
    pub(super) fn at(&self, exposure_us: u64) -> Option<Prior<f32>> {
        let age_s = |last_us: u64| exposure_us.saturating_sub(last_us) as f32 * 1e-6;
        let last = self.last.map(|(last, last_us)| Last { age_s: age_s(last_us), ..last });
        let prior = Prior { last, ..self.prior };
        let Some(motion) = self.motion else { return Some(prior) };
        if motion.has_expired(exposure_us) {
            return None;
        }
        let moved = |position: [f32; 3]| match motion.velocity_m_s {
            Some(velocity) => move_freely(position, velocity, motion.age_s(exposure_us)),
            None => position,
        };
        Some(Prior { position_m: prior.position_m.map(moved), ..prior })
    }

    /// Returns the values from navigation as they are sent with a picture; `None` if there are none.
    pub(super) fn state_at(&self, picture: u32, exposure_us: u64) -> Option<NavigationState> {
        let prior = self.at(exposure_us);
        let state = if prior.is_some() { NavigationState::USED } else { NavigationState::EXPIRED };
        // Expired values are sent as they came, so that the ground sees what was not used.
        let prior = prior.unwrap_or(self.prior);
        if prior.altitude_m.is_none() && prior.position_m.is_none() && prior.rate_rad_s.is_none() {
            return None;
        }
        const UNKNOWN: [f32; 3] = [f32::NAN; 3];
        Some(NavigationState {
            picture,
            state,
            age_s: self.motion.map_or(f32::NAN, |motion| motion.age_s(exposure_us)),
            altitude_m: prior.altitude_m.unwrap_or(f32::NAN),
            position_m: prior.position_m.unwrap_or(UNKNOWN),
            velocity_m_s: self.motion.and_then(|motion| motion.velocity_m_s).unwrap_or(UNKNOWN),
            rate_rad_s: prior.rate_rad_s.unwrap_or(UNKNOWN),
        })
    }
}

/// Returns the position in ECEF after `t` seconds of free fall.
fn move_freely(r: [f32; 3], v: [f32; 3], t: f32) -> [f32; 3] {
    let [x, y, z] = r;
    let square = x * x + y * y + z * z;
    // A position of zero length was refused.
    let pull = MU / (square * Real::sqrt(square));
    let [vx, vy, _] = v;
    let a =
        [-pull * x + 2.0 * OMEGA * vy + OMEGA * OMEGA * x, -pull * y - 2.0 * OMEGA * vx + OMEGA * OMEGA * y, -pull * z];
    // `get`, because an index would be a panic path of the flight image.
    core::array::from_fn(|i| match (r.get(i), v.get(i), a.get(i)) {
        (Some(r), Some(v), Some(a)) => r + (v + 0.5 * a * t) * t,
        _ => 0.0,
    })
}

/// Why values from navigation are refused, and the place of the number in [`Navigation`], from 1; 0 for all of them.
pub(super) type Refusal = (Code, u16);

/// Places of the first numbers of the vectors in [`Navigation`].
const POSITION: u16 = 4;
const VELOCITY: u16 = 7;
const RATE: u16 = 10;

/// Reads the arguments of [`crate::messages::Function::SetKnown`].
pub(super) fn read_prior(from: &mut Reader<'_>) -> Result<Known, Refusal> {
    let cut_off = (Code::Arguments, 0);
    let (altitude_m, position_m) = from.f32().zip(from.floats()).ok_or(cut_off)?;
    let rate = match from.rest() {
        // The rate may be left out, because the first version of the telecommand did not have it.
        [] => [f32::NAN; 3],
        _ => from.floats().ok_or(cut_off)?,
    };
    if !from.rest().is_empty() {
        return Err(cut_off);
    }
    Ok(Known { prior: prior(altitude_m, position_m, rate)?, ..Known::default() })
}

/// Returns the time of the values on the board's clock.
fn epoch_us(epoch: u64, clock: &Clock) -> Result<u64, Refusal> {
    let bytes = epoch.to_be_bytes();
    match (bytes, Cuc::from_bytes(bytes)) {
        // No P-field is 0, so that a number of microseconds is never taken for a time code.
        (_, Some(time)) => clock.clock_us(time).ok_or((Code::NoClock, 1)),
        ([0, ..], None) => Ok(epoch),
        _ => Err((Code::Refused, 1)),
    }
}

/// Reads the arguments of [`crate::messages::Function::Navigate`], which arrived at `now_us`.
pub(super) fn read_navigation(from: &mut Reader<'_>, clock: &Clock, now_us: u64) -> Result<Known, Refusal> {
    let n = Navigation::read(from).filter(|_| from.rest().is_empty()).ok_or((Code::Arguments, 0))?;
    let position_m = [n.position_x_m, n.position_y_m, n.position_z_m];
    let rate = [n.rate_x_rad_s, n.rate_y_rad_s, n.rate_z_rad_s];
    let velocity_m_s = known_vector([n.velocity_x_m_s, n.velocity_y_m_s, n.velocity_z_m_s], VELOCITY)?;
    let expires_s = (!n.expires_s.is_nan()).then_some(n.expires_s);
    let motion = Motion { epoch_us: epoch_us(n.epoch, clock)?, velocity_m_s, expires_s };
    let known = Known { prior: prior(n.altitude_m, position_m, rate)?, motion: Some(motion), ..Known::default() };
    // Nearly twice the escape speed of the Earth, so it is an error of the sender.
    let is_fast = |x: &f32| x.abs() >= 2e4;
    let fastest = velocity_m_s.and_then(|v| (VELOCITY..).zip(v).find(|(_, x)| is_fast(x)));
    // A velocity without a position moves nothing.
    let moves_nothing = velocity_m_s.is_some() && known.prior.position_m.is_none();
    let checks = [
        (motion.age_s(now_us).abs() > LARGEST_AGE_S, 1),
        // NaN says that the values do not expire, so that infinity is an error.
        (expires_s.is_some_and(|limit| limit <= 0.0 || limit.is_infinite()), 2),
        (moves_nothing, POSITION),
        (fastest.is_some(), fastest.map_or(0, |(place, _)| place)),
    ];
    match checks.iter().find(|(is_wrong, _)| *is_wrong) {
        Some((_, place)) => Err((Code::Refused, *place)),
        None => Ok(known),
    }
}

fn prior(altitude_m: f32, position_m: [f32; 3], rate_rad_s: [f32; 3]) -> Result<Prior<f32>, Refusal> {
    if altitude_m.is_infinite() {
        return Err((Code::Refused, POSITION - 1));
    }
    Ok(Prior {
        altitude_m: (!altitude_m.is_nan()).then_some(altitude_m),
        position_m: known_vector(position_m, POSITION)?,
        rate_rad_s: known_vector(rate_rad_s, RATE)?,
        ..Prior::default()
    })
}

/// Returns a vector; `None` if all of its numbers are NaN, which means that it is not known. One NaN is an error of the
/// sender; the refusal names its place. `first` is that of the first number.
fn known_vector(v: [f32; 3], first: u16) -> Result<Option<[f32; 3]>, Refusal> {
    let find = |is_wrong: fn(&f32) -> bool| (first..).zip(v).find(|(_, x)| is_wrong(x));
    if v.iter().all(|x| x.is_nan()) {
        return Ok(None);
    }
    if let Some((place, _)) = find(|x| x.is_nan()) {
        return Err((Code::Missing, place));
    }
    match find(|x| x.is_infinite()) {
        Some((place, _)) => Err((Code::Refused, place)),
        None => Ok(Some(v)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integrates the orbit in small steps, in double precision and in an inertial frame.
    fn fly(r: [f64; 3], v: [f64; 3], t: f64) -> [f64; 3] {
        let w = 7.292_115e-5;
        let (mut r, mut v) = (r, [v[0] - w * r[1], v[1] + w * r[0], v[2]]);
        let steps = 20_000;
        let dt = t / f64::from(steps);
        for _ in 0..steps {
            let half: [f64; 3] = core::array::from_fn(|i| r[i] + v[i] * dt / 2.0);
            let d = (half[0] * half[0] + half[1] * half[1] + half[2] * half[2]).sqrt();
            v = core::array::from_fn(|i| v[i] - 3.986_004_4e14 * half[i] / (d * d * d) * dt);
            r = core::array::from_fn(|i| half[i] + v[i] * dt / 2.0);
        }
        let (sin, cos) = (w * t).sin_cos();
        [r[0] * cos + r[1] * sin, r[1] * cos - r[0] * sin, r[2]]
    }

    #[test]
    fn a_position_falls_freely() {
        let (r, v) = ([6.2e6f32, -1.5e6, 2.3e6], [1.1e3f32, 6.9e3, 2.5e3]);
        for (t, most_m) in [(0.0f32, 1.0), (1.0, 2.0), (10.0, 4.0), (-10.0, 4.0), (60.0, 400.0)] {
            let (near, true_m) = (move_freely(r, v, t), fly(r.map(f64::from), v.map(f64::from), f64::from(t)));
            let off = near.iter().zip(true_m).map(|(a, b)| (f64::from(*a) - b).powi(2)).sum::<f64>().sqrt();
            assert!(off <= most_m, "{t} s: {off} m");
        }
    }

    #[test]
    fn values_expire_in_both_directions() {
        let motion = Motion { epoch_us: 50_000_000, velocity_m_s: None, expires_s: Some(20.0) };
        let known = Known { motion: Some(motion), ..Known::default() };
        let is_known = [29_000_000, 31_000_000, 69_000_000, 71_000_000].map(|us| known.at(us).is_some());
        assert_eq!(is_known, [false, true, true, false]);
    }
}
