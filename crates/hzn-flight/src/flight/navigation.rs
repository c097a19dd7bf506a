//! Values from navigation: altitude, position, velocity and rate of rotation.
//!
//! A position is moved from its time to the exposure with its velocity and the acceleration of free fall in the
//! rotating frame of the Earth, a = −μ r/|r|³ − 2 ω × v − ω × (ω × r); a velocity is refused for other bodies. The next
//! term of the series is the change of the acceleration; in low orbit it moves the position by 1.5 m in ten seconds and
//! by 0.3 km in a minute.

use hzn_core::Prior;
use hzn_core::real::Real;

use super::clock::Clock;
use super::validity::{Refusal, Validity};
use crate::attitude::OMEGA;
use crate::bytes::Reader;
use crate::messages::{Code, Navigation};

/// Gravitational parameter of the Earth, m³/s² (WGS-84).
const MU: f32 = 3.986_004_4e14;

/// The values of a telecommand.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Values {
    pub(super) prior: Prior<f32>,
    /// The motion of the camera; `None` if the values hold for any time.
    pub(super) motion: Option<Motion>,
}

/// Time and motion of the values from navigation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Motion {
    pub(super) validity: Validity,
    pub(super) velocity_m_s: Option<[f32; 3]>,
}

impl Values {
    /// Returns whether the values have expired at an exposure.
    pub(super) fn has_expired(&self, exposure_us: u64) -> bool {
        self.motion.is_some_and(|motion| motion.validity.has_expired(exposure_us))
    }

    /// Returns the values at an exposure.
    pub(super) fn at(&self, exposure_us: u64) -> Prior<f32> {
        let moved = |position: [f32; 3]| match self.motion {
            Some(Motion { validity, velocity_m_s: Some(velocity) }) => {
                move_freely(position, velocity, validity.age_s(exposure_us))
            }
            _ => position,
        };
        Prior { position_m: self.prior.position_m.map(moved), ..self.prior }
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

/// Places of the first numbers of the vectors in [`Navigation`].
const POSITION: u16 = 4;
const VELOCITY: u16 = 7;
const RATE: u16 = 10;

/// Reads the arguments of [`crate::messages::Function::SetKnown`].
pub(super) fn read_prior(from: &mut Reader<'_>) -> Result<Values, Refusal> {
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
    Ok(Values { prior: prior(altitude_m, position_m, rate)?, motion: None })
}

/// Reads the arguments of [`crate::messages::Function::Navigate`], which arrived at `now_us`.
pub(super) fn read_navigation(from: &mut Reader<'_>, clock: &Clock, now_us: u64) -> Result<Values, Refusal> {
    let n = Navigation::read(from).filter(|_| from.rest().is_empty()).ok_or((Code::Arguments, 0))?;
    let position_m = [n.position_x_m, n.position_y_m, n.position_z_m];
    let rate = [n.rate_x_rad_s, n.rate_y_rad_s, n.rate_z_rad_s];
    let velocity_m_s = known_vector([n.velocity_x_m_s, n.velocity_y_m_s, n.velocity_z_m_s], VELOCITY)?;
    let prior = prior(n.altitude_m, position_m, rate)?;
    let motion = Motion { validity: Validity::read(n.epoch, n.expires_s, clock, now_us)?, velocity_m_s };
    // Nearly twice the escape speed of the Earth, so it is an error of the sender.
    let is_fast = |x: &f32| x.abs() >= 2e4;
    let fastest = velocity_m_s.and_then(|v| (VELOCITY..).zip(v).find(|(_, x)| is_fast(x)));
    // A velocity without a position moves nothing.
    let moves_nothing = velocity_m_s.is_some() && prior.position_m.is_none();
    let checks = [(moves_nothing, POSITION), (fastest.is_some(), fastest.map_or(0, |(place, _)| place))];
    match checks.iter().find(|(is_wrong, _)| *is_wrong) {
        Some((_, place)) => Err((Code::Refused, *place)),
        None => Ok(Values { prior, motion: Some(motion) }),
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
        // Miri takes half an hour for all of them.
        let steps = if cfg!(miri) { 200 } else { 20_000 };
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
}
