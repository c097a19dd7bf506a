//! What is known when a picture comes.

use hzn_core::body::{Kind, Last};
use hzn_core::{Prior, Sequence, Tracker};

use super::attitude::TimedAttitude;
use super::navigation::Values;
use crate::messages::{AttitudeState, NavigationState};

/// What is known when a picture comes.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Known {
    /// Altitude, position, velocity and rate.
    pub(super) navigation: Values,
    /// The attitude and the Sun.
    pub(super) attitude: Option<TimedAttitude>,
    /// The last answer, and the time when its picture was exposed, µs since the start.
    pub(super) last: Option<(Last<f32>, u64)>,
    /// The earlier answer that answers are compared with, with the turn since then.
    pub(super) turns: Sequence<f32>,
    /// Where the last picture has its limb, for `track.full_every`.
    pub(super) tracker: Tracker<f32>,
    /// The time when the newest picture was exposed, µs since the start.
    pub(super) seen_us: Option<u64>,
    /// The threshold that the last picture proposes for the next one, in counts.
    pub(super) level: Option<u16>,
}

/// The ages of values that have expired, s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Expired {
    pub(super) navigation_s: Option<f32>,
    pub(super) attitude_s: Option<f32>,
}

impl Known {
    /// Returns what has expired at an exposure.
    pub(super) fn expired_at(&self, exposure_us: u64) -> Expired {
        let motion = self.navigation.motion.map(|motion| motion.validity);
        let attitude = self.attitude.filter(|_| self.has_attitude_expired(exposure_us));
        Expired {
            navigation_s: motion.filter(|motion| motion.has_expired(exposure_us)).map(|it| it.age_s(exposure_us)),
            attitude_s: attitude.map(|attitude| attitude.validity.age_s(exposure_us)),
        }
    }

    /// Returns whether the attitude and the Sun are out of date. They are, too, when the rate that moved them is:
    /// without it they would stay behind while the vehicle turns.
    fn has_attitude_expired(&self, exposure_us: u64) -> bool {
        let navigation = &self.navigation;
        let is_rate_lost = navigation.prior.rate_rad_s.is_some() && navigation.has_expired(exposure_us);
        self.attitude.is_some_and(|attitude| is_rate_lost || attitude.validity.has_expired(exposure_us))
    }

    /// Returns the prior of a picture of this body, without the values that have expired.
    pub(super) fn at(&self, exposure_us: u64, body: Kind) -> Prior<f32> {
        let age_s = |last_us: u64| exposure_us.saturating_sub(last_us) as f32 * 1e-6;
        let last = self.last.map(|(last, last_us)| Last { age_s: age_s(last_us), ..last });
        let is_known = !self.navigation.has_expired(exposure_us);
        let prior = if is_known { self.navigation.at(exposure_us) } else { Prior::default() };
        let prior = Prior { last, ..prior };
        match self.attitude.filter(|_| !self.has_attitude_expired(exposure_us)) {
            Some(TimedAttitude { values, validity }) => {
                values.moved(prior.rate_rad_s, validity.age_s(exposure_us), body).added_to(prior)
            }
            None => prior,
        }
    }

    /// Returns the values from navigation as they are sent with a picture; `None` if there are none.
    pub(super) fn navigation_at(&self, picture: u32, exposure_us: u64) -> Option<NavigationState> {
        let Values { prior, motion } = &self.navigation;
        if prior.altitude_m.is_none() && prior.position_m.is_none() && prior.rate_rad_s.is_none() {
            return None;
        }
        let has_expired = self.navigation.has_expired(exposure_us);
        // Expired values are sent as they came, so that the ground sees what was not used.
        let prior = if has_expired { *prior } else { self.navigation.at(exposure_us) };
        const UNKNOWN: [f32; 3] = [f32::NAN; 3];
        Some(NavigationState {
            picture,
            state: if has_expired { NavigationState::EXPIRED } else { NavigationState::USED },
            age_s: motion.map_or(f32::NAN, |motion| motion.validity.age_s(exposure_us)),
            altitude_m: prior.altitude_m.unwrap_or(f32::NAN),
            position_m: prior.position_m.unwrap_or(UNKNOWN),
            velocity_m_s: motion.and_then(|motion| motion.velocity_m_s).unwrap_or(UNKNOWN),
            rate_rad_s: prior.rate_rad_s.unwrap_or(UNKNOWN),
        })
    }

    /// Returns the attitude and the Sun as they are sent with a picture of this body; `None` if there are none.
    pub(super) fn attitude_at(&self, picture: u32, exposure_us: u64, body: Kind) -> Option<AttitudeState> {
        let TimedAttitude { values, validity } = self.attitude?;
        let (has_expired, age_s) = (self.has_attitude_expired(exposure_us), validity.age_s(exposure_us));
        let rate = self.navigation.prior.rate_rad_s;
        let shown = if has_expired { values } else { values.moved(rate, age_s, body) };
        let state = if has_expired { AttitudeState::EXPIRED } else { AttitudeState::USED };
        let (q, sigma_rad, sun) = shown.numbers();
        Some(AttitudeState { picture, state, age_s, q, sigma_rad, sun })
    }
}
