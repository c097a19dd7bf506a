//! The prior of a picture: values that navigation sent, until they expire.

use super::Flight;
use super::navigation::{Known, Refusal};
use crate::board::Board;
use crate::messages::{Code, Event};
use hzn_core::Prior;
use hzn_core::body::Kind;

impl<B: Board> Flight<'_, B> {
    /// Sets the values from navigation for the pictures that follow.
    pub(super) fn set_known(&mut self, read: Result<Known, Refusal>) -> Code {
        let known = match read {
            Ok(known) => known,
            Err((code, place)) => return self.refuse(code, place),
        };
        let sensor = self.sensor.get();
        let is_earth = matches!(sensor.config().body.kind, Kind::Earth | Kind::EarthSphere);
        let moves = known.motion.is_some_and(|motion| motion.velocity_m_s.is_some());
        // They are tried now, so that the ground learns from the acknowledgement that they are impossible, and not by
        // an event for each picture. Free fall is computed with the gravity and the rotation of the Earth.
        if sensor.expect(&known.prior).is_err() || moves && !is_earth {
            return Code::Refused;
        }
        // The last answers and the threshold come from pictures, so that new values from navigation do not replace
        // them.
        let Known { last, level, turns, seen_us, .. } = self.known.get().clone();
        self.known.set(Known { last, level, turns, seen_us, ..known });
        self.known.complete();
        self.has_expired = false;
        Code::Done
    }

    /// Returns the prior of a picture. Values from navigation that are too old are not used; an event says so once.
    pub(super) fn prior_at(&mut self, exposure_us: u64) -> Prior<f32> {
        if let Some(prior) = self.known.get().at(exposure_us) {
            return prior;
        }
        // Once, because the event would otherwise come with every picture.
        if !self.has_expired {
            self.has_expired = true;
            let age_s = self.known.get().motion.map_or(0.0, |motion| motion.age_s(exposure_us).abs());
            self.send_event(Event::KnownExpired, (age_s * 1e3) as u32, 0);
        }
        let last = self.known.get().last;
        Known { last, ..Known::default() }.at(exposure_us).unwrap_or_default()
    }
}
