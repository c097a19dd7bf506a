//! The way of a picture from memory to its science packet, and the event of a picture that does not come.

use hzn_core::body::{Expected, Last};
use hzn_core::gates::FixedEdge;
use hzn_core::status::Status;
use hzn_core::{Prior, Report, Sequence, Step, Tracker};
use hzn_twice::KeptTwice;

use super::{Flight, HeadBuffers, longest_edge};
use crate::board::{Board, Picture};
use crate::messages::{Event, Mode};
use crate::view::{Before, Seen, StuckPlaces, Viewer};

impl<B: Board> Flight<'_, B> {
    /// Sends an event if the camera should have sent a picture by now. Only flight mode expects pictures.
    pub(super) fn watch_camera(&mut self, now_us: u64) {
        if self.mode == Mode::Flight
            && let Some(waited_us) = self.camera.becomes_silent(now_us)
        {
            self.is_gap = true;
            let waited_ms = u32::try_from(waited_us / 1000).unwrap_or(u32::MAX);
            self.send_event(Event::CameraSilent, waited_ms, self.number);
        }
    }

    /// Processes a picture and sends its answer. A picture of the wrong size, or with an impossible prior, gets an
    /// event instead of an answer.
    #[inline(never)]
    pub(super) fn process_picture(&mut self, picture: Picture) {
        if picture.lost > 0 {
            self.state.lost = self.state.lost.saturating_add(picture.lost);
            self.send_event(Event::Overrun, picture.lost, 0);
        }
        // What changed since the last picture is made anew in time for this one.
        self.check_memory(None);
        // A picture without an answer is a gap for the next one.
        let is_gap = core::mem::replace(&mut self.is_gap, true) || picture.lost > 0;
        if self.mode == Mode::Safe {
            // There are no stored parameters any more, so that the sensor is that of another camera.
            self.state.refused = self.state.refused.saturating_add(1);
            return;
        }
        if !self.check_size(picture.bytes) {
            return;
        }
        let prior = self.prior_at(picture.exposure_us);
        let Some(expected) = self.expect_limb(&prior) else { return };
        let mut expected = KeptTwice::new(expected);
        expected.complete();
        let (mut tracker, step) = (self.tracker(is_gap), self.step_to(&prior, picture.exposure_us));
        let start = self.board.now_us();
        // The request stays until it is met, because this picture may be incomplete or stuck.
        let wanted = self.dump_edges;
        let edge = &mut self.buffers.edge;
        let Some(workspace) = self.workspace.as_deref_mut() else { return };
        let before = Before { expected: expected.get(), tracker: &mut tracker, step: &step };
        let mut viewer = Viewer::new(self.sensor.get(), before, workspace, edge, wanted);
        self.board.show(&mut viewer);
        let seen = viewer.into_seen();
        let Some((mut report, stuck)) = self.accept(seen) else { return };
        // A bit may have changed during the calculation.
        if !self.check_memory(Some(&mut expected)) {
            self.state.refused = self.state.refused.saturating_add(1);
            return;
        }
        // After the check, because a new copy of a changed value would hide the change.
        let turns = self.compare_with_turn(&step, &mut report, stuck.is_none());
        self.remember(&report, picture.exposure_us, stuck.is_none(), (turns, tracker));
        // Without this, 3 of 5643 answers to such pictures were false, where the altitude is known to 100 km.
        if let Some(stuck) = stuck {
            self.state.stuck = self.state.stuck.saturating_add(1);
            self.send_event(Event::StuckPixels, stuck.stuck, stuck.places);
            return;
        }
        self.is_gap = report.is_suspect;
        let done_us = self.board.now_us();
        let calculation_us = u32::try_from(done_us.saturating_sub(start)).unwrap_or(u32::MAX);
        // Before the packets are sent, because they have this number.
        self.count_picture(report.status, calculation_us);
        self.send_answer(&report, picture.exposure_us, done_us);
        if wanted {
            self.send_longest_edge(picture.exposure_us);
        }
        self.since_housekeeping = self.since_housekeeping.saturating_add(1);
        if self.since_housekeeping >= self.operations.get().housekeeping_every {
            self.send_housekeeping();
        }
    }

    /// Sends the edge that a command asked for.
    fn send_longest_edge(&mut self, exposure_us: u64) {
        self.dump_edges = false;
        let HeadBuffers { line, edge, .. } = &mut *self.buffers;
        let time = line.clock.at(exposure_us);
        longest_edge::send(edge, line, &mut self.board, time, self.number);
    }

    /// Returns whether a picture with this number of bytes has the size of the camera. Refuses it otherwise.
    fn check_size(&mut self, bytes: usize) -> bool {
        let camera = self.sensor.get().camera();
        let expected_bytes = usize::from(camera.width()) * usize::from(camera.height());
        if bytes != expected_bytes {
            self.state.refused = self.state.refused.saturating_add(1);
            self.send_event(Event::WrongSize, bytes as u32, expected_bytes as u32);
        }
        bytes == expected_bytes
    }

    /// Returns the report of a picture, with the stuck pixels at its limb. Refuses an incomplete picture.
    fn accept(&mut self, seen: Seen) -> Option<(Report<f32>, Option<StuckPlaces>)> {
        match seen {
            Seen::Whole(report, stuck) => return Some((report, stuck)),
            Seen::Part(pixels) => {
                // The camera has more, so this always refuses.
                self.check_size(pixels);
            }
            Seen::Refused(why) => {
                self.state.refused = self.state.refused.saturating_add(1);
                self.send_event(Event::RowsRefused, why as u32, 0);
            }
        }
        None
    }

    /// Remembers what a picture says about the next one: its threshold, and its direction if that may be believed.
    fn remember(
        &mut self,
        report: &Report<f32>,
        exposure_us: u64,
        is_believed: bool,
        (turns, tracker): (Sequence<f32>, Tracker<f32>),
    ) {
        let mut known = self.known.get().clone();
        (known.turns, known.tracker, known.seen_us) = (turns, tracker, Some(exposure_us));
        // The threshold is kept in any case, because it comes from the whole picture. A stuck direction would let the
        // gate of the rate refuse the next, right one.
        known.level = report.next_level;
        if let Some(s) = report.solution.as_ref().filter(|_| is_believed && !report.is_suspect) {
            let last = Last { axis: s.axis, sigma_rad: s.covariance.sigma_max_rad(), age_s: 0.0 };
            known.last = Some((last, exposure_us));
        }
        self.known.set(known);
        self.known.complete();
    }

    /// Returns where the limb is looked for first, for `track.full_every`. It is empty for a picture that is searched
    /// fully: after a gap, by its number as in `hzn run`, and if a command asked for it or for its edges.
    fn tracker(&self, is_gap: bool) -> Tracker<f32> {
        let full_every = self.sensor.get().config().track.full_every;
        let is_full = is_gap || self.mode != Mode::Flight || self.dump_edges;
        if is_full || self.number.is_multiple_of(full_every.into()) {
            return Tracker::default();
        }
        self.known.get().tracker.clone()
    }

    /// Returns what is known of the turn since the picture before.
    fn step_to(&self, prior: &Prior<f32>, exposure_us: u64) -> Step<f32> {
        let before = self.known.get().seen_us;
        let after_s = before.map(|before| exposure_us.wrapping_sub(before).cast_signed() as f32 * 1e-6);
        Step::from_prior(prior, after_s)
    }

    /// Compares the answer with the turn of the vehicle and the picture with earlier ones, see `gates.fixed_edge`. An
    /// event says if its edge stays in the picture. Returns what the next picture is compared with.
    fn compare_with_turn(&mut self, step: &Step<f32>, report: &mut Report<f32>, is_believed: bool) -> Sequence<f32> {
        let mut turns = self.known.get().turns.clone();
        let gates = self.sensor.get().config().gates;
        // Asked for each picture, because the board may remember it then.
        let repeats = self.board.repeats_picture(report.solution.as_ref()) && report.solution.is_some();
        if !is_believed {
            turns.see(step, None, &gates);
            return turns;
        }
        let is_fixed = turns.judge(step, report, &gates);
        if repeats {
            turns.judge_repeat(report, &gates);
        }
        if is_fixed || repeats && gates.fixed_edge != FixedEdge::Off {
            // The number that this picture will have.
            self.send_event(Event::FixedEdge, self.number.wrapping_add(1), u32::from(report.is_suspect));
        }
        turns
    }

    /// Returns the expected limb of a picture, from the values of navigation and the last answer. Refuses the picture
    /// if these are impossible.
    fn expect_limb(&mut self, prior: &Prior<f32>) -> Option<Expected<f32>> {
        // A picture that comes row by row has no other threshold, unless the parameters fix it.
        let prior = Prior { level: self.known.get().level, ..*prior };
        let expected = self.sensor.get().expect(&prior).ok();
        if expected.is_none() {
            self.state.refused = self.state.refused.saturating_add(1);
            self.send_event(Event::KnownRefused, 0, 0);
        }
        expected
    }

    /// Adds a processed picture to the counters.
    fn count_picture(&mut self, status: Status, calculation_us: u32) {
        let state = &mut self.state;
        // It does not stop at its largest value, because the ground puts packets together by this number.
        self.number = self.number.wrapping_add(1);
        state.pictures = state.pictures.saturating_add(1);
        state.answers = state.answers.saturating_add(u32::from(status == Status::Ok));
        state.last_status = status as u8;
        state.last_us = calculation_us;
        state.longest_us = state.longest_us.max(calculation_us);
    }
}
