//! The prior of a picture: values that navigation sent, until they expire.

use super::Flight;
use super::attitude::TimedAttitude;
use super::known::{Expired, Known};
use super::navigation::Values;
use super::validity::Refusal;
use crate::board::Board;
use crate::messages::{Code, Event};
use hzn_core::Prior;
use hzn_core::body::Kind;

/// Second number of [`Event::KnownExpired`].
const NAVIGATION: u32 = 0;
const ATTITUDE: u32 = 1;

impl<B: Board> Flight<'_, B> {
    /// Returns the body that the sensor looks for.
    pub(super) fn body(&self) -> Kind {
        self.sensor.get().config().body.kind
    }

    /// Sets the values from navigation for the pictures that follow.
    pub(super) fn set_known(&mut self, read: Result<Values, Refusal>) -> Code {
        let navigation = match read {
            Ok(values) => values,
            Err((code, place)) => return self.refuse(code, place),
        };
        let is_earth = matches!(self.body(), Kind::Earth | Kind::EarthSphere);
        let moves = navigation.motion.is_some_and(|motion| motion.velocity_m_s.is_some());
        // They are tried now, so that the ground learns from the acknowledgement that they are impossible, and not by
        // an event for each picture. Free fall is computed with the gravity and the rotation of the Earth.
        if self.sensor.get().expect(&navigation.prior).is_err() || moves && !is_earth {
            return Code::Refused;
        }
        // What comes from pictures, and the attitude, stay.
        self.replace_known(|known| Known { navigation, ..known });
        self.has_expired.0 = false;
        Code::Done
    }

    /// Sets the attitude and the Sun for the pictures that follow.
    pub(super) fn set_attitude(&mut self, read: Result<Option<TimedAttitude>, Refusal>) -> Code {
        let attitude = match read {
            Ok(attitude) => attitude,
            Err((code, place)) => return self.refuse(code, place),
        };
        self.replace_known(|known| Known { attitude, ..known });
        self.has_expired.1 = false;
        Code::Done
    }

    #[inline(never)]
    fn replace_known(&mut self, change: impl FnOnce(Known) -> Known) {
        let known = change(self.known.get().clone());
        self.known.set(known);
        self.known.complete();
    }

    /// Returns the prior of a picture. Values from navigation that are too old are not used; an event says so once.
    pub(super) fn prior_at(&mut self, exposure_us: u64) -> Prior<f32> {
        let Expired { navigation_s, attitude_s } = self.known.get().expired_at(exposure_us);
        let (is_navigation_told, is_attitude_told) = self.has_expired;
        // Once, because the events would otherwise come with every picture.
        for (age_s, is_told, which) in
            [(navigation_s, is_navigation_told, NAVIGATION), (attitude_s, is_attitude_told, ATTITUDE)]
        {
            if let Some(age_s) = age_s.filter(|_| !is_told) {
                self.send_event(Event::KnownExpired, (age_s.abs() * 1e3) as u32, which);
            }
        }
        self.has_expired = (is_navigation_told || navigation_s.is_some(), is_attitude_told || attitude_s.is_some());
        self.known.get().at(exposure_us, self.body())
    }
}
