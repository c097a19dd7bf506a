//! The packets of a picture, within the bit budget. The science packet comes last, so that the ground knows then that
//! the picture is complete.

use hzn_core::Report;

use super::Flight;
use crate::answer::PictureAnswer;
use crate::board::Board;
use crate::layout;
use crate::messages::{AttitudeState, Event, Exposure, NavigationState};
use crate::packet::{Apid, OVERHEAD};
use crate::parameters::Parameters;

impl<B: Board> Flight<'_, B> {
    /// Sends the answer to the picture that was counted last, if the bit budget allows it. The board gets it in any
    /// case.
    pub(super) fn send_answer(&mut self, report: &Report<f32>, exposure_us: u64, done_us: u64) {
        let (known, body) = (self.known.get(), self.body());
        let navigation = known.navigation_at(self.number, exposure_us);
        let attitude = known.attitude_at(self.number, exposure_us, body);
        let exposure = self.exposure(navigation.as_ref(), exposure_us, done_us);
        // Sent before it is kept, so that a slow disk does not delay the packets.
        self.send_within_budget(report, &exposure, navigation, attitude);
        let is_kept = self.board.keep_answer(&exposure, report);
        // Reported at the first one, because a full disk would otherwise send an event for each picture.
        if !is_kept && self.keeps_answers {
            self.send_event(Event::AnswersNotKept, self.number, 0);
        }
        self.keeps_answers = is_kept;
    }

    fn send_within_budget(
        &mut self,
        report: &Report<f32>,
        exposure: &Exposure,
        navigation: Option<NavigationState>,
        attitude: Option<AttitudeState>,
    ) {
        let mut answer = PictureAnswer::from_report(report, self.sensor.get().config());
        if self.operations.get().integrity == 0 {
            answer.integrity = None;
        }
        let exposure_us = exposure.exposure_us;
        // All packets or none, because without the science packet the others belong to no answer.
        if !self.has_budget(&answer, [navigation.is_some(), attitude.is_some()], exposure.done_us) {
            self.state.decimated = self.state.decimated.saturating_add(1);
            return;
        }
        if let Some(navigation) = navigation {
            self.send_at(exposure_us, Apid::Navigation, |out| navigation.write(out));
        }
        if let Some(attitude) = attitude {
            self.send_at(exposure_us, Apid::Attitude, |out| attitude.write(out));
        }
        let picture = self.number;
        if let Some(position) = answer.position {
            self.send_at(exposure_us, Apid::Position, |out| {
                out.u32(picture);
                position.write(out);
            });
        }
        if let Some(integrity) = answer.integrity {
            self.send_at(exposure_us, Apid::Integrity, |out| {
                out.u32(picture);
                integrity.write(out);
            });
        }
        for edge in answer.edges.iter().flatten() {
            self.send_at(exposure_us, Apid::Candidate, |out| {
                out.u32(picture);
                edge.write(out);
            });
        }
        self.send_at(exposure_us, Apid::Science, |out| {
            exposure.write(out);
            answer.write_science(out);
        });
    }

    fn exposure(&self, navigation: Option<&NavigationState>, exposure_us: u64, done_us: u64) -> Exposure {
        let config = self.sensor.get().config();
        // The altitude that was used, so that values that have expired do not count.
        let known_m = navigation.filter(|n| n.state == NavigationState::USED).map(|n| n.altitude_m);
        let altitude_m = known_m.filter(|h| !h.is_nan()).or(config.body.altitude_km.map(|h| (h * 1000.0) as f32));
        Exposure {
            picture: self.number,
            exposure_us,
            done_us,
            calculation_us: self.state.last_us,
            body: Parameters::body_number(config),
            altitude_m: altitude_m.unwrap_or(f32::NAN),
        }
    }

    /// Returns whether the bit budget has room for all packets of a picture, and counts them.
    fn has_budget(&mut self, answer: &PictureAnswer, has: [bool; 2], now_us: u64) -> bool {
        let [has_navigation, has_attitude] = has.map(usize::from);
        let Some(rate) = self.operations.get().science_bits_s else { return true };
        let counts = [
            (Apid::Science, 1),
            (Apid::Candidate, answer.edges.iter().flatten().count()),
            (Apid::Position, usize::from(answer.position.is_some())),
            (Apid::Integrity, usize::from(answer.integrity.is_some())),
            (Apid::Navigation, has_navigation),
            (Apid::Attitude, has_attitude),
        ];
        let bytes = counts.map(|(apid, count)| count * (OVERHEAD + layout::user_bytes(apid).unwrap_or(0)));
        self.budget.allows(8 * bytes.iter().sum::<usize>() as u32, rate, now_us)
    }
}
