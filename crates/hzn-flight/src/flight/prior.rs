//! The prior of a picture: values that navigation sent, until they expire.

use super::Flight;
use super::attitude::TimedAttitude;
use super::known::{Expired, Known};
use super::navigation::Values;
use super::validity::Refusal;
use crate::board::Board;
use crate::cuc::{Cuc, Epoch};
use crate::messages::{Code, Event};
use hzn_core::Prior;
use hzn_core::body::Kind;

/// Second number of [`Event::KnownExpired`].
const NAVIGATION: u32 = 0;
const ATTITUDE: u32 = 1;

/// First number of [`Event::KnownRefused`].
const TEMPERATURE: u32 = 1;

/// Days from the epoch of the time code, 1958-01-01, to that of UTC, 1970-01-01.
const DAYS_TO_1970: f64 = 4383.0;

/// Returns the part of the year that has passed at a time; `None` if the clock is not correlated. The difference
/// between TAI and UTC, half a minute, does not matter.
fn year_part(time: Cuc) -> Option<f32> {
    let days = time.us as f64 / 86.4e9 - DAYS_TO_1970;
    (time.epoch == Epoch::Tai).then(|| hzn_core::body::year_part(days) as f32)
}

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
        let prior = self.known.get().at(exposure_us, self.body());
        let camera_temperature_c = self.camera_temperature_c();
        Prior { year_part: year_part(self.buffers.line.clock.at(exposure_us)), camera_temperature_c, ..prior }
    }

    /// Returns the temperature of the camera. An event says if the lens cannot have it; the picture then has the lens
    /// of the reference, because a broken thermometer must not cost the answers.
    fn camera_temperature_c(&mut self) -> Option<f32> {
        let told_c = self.board.camera_temperature_c()?;
        let is_possible = self.sensor.get().camera().accepts_temperature(told_c);
        if !is_possible {
            self.send_event(Event::KnownRefused, TEMPERATURE, 0);
        }
        is_possible.then_some(told_c)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_season_follows_from_the_time_code() {
        // 1 July 2021 is 18809 days after 1970.
        let july = Cuc::tai((18_809 + 4383) * 86_400_000_000);
        assert!((year_part(july).unwrap() - 0.4966).abs() < 0.003);
        assert_eq!(year_part(Cuc::since_start(july.us)), None);
    }
}
