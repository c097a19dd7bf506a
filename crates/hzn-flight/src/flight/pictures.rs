//! The way of a picture from memory to its science packet.

use core::cell::RefCell;

use hzn_core::body::{Expected, Last};
use hzn_core::image::{Grey, Layout};
use hzn_core::status::Status;
use hzn_twice::KeptTwice;

use super::longest_edge::EdgeWatch;
use super::stuck::StuckWatch;
use super::{Buffers, Flight, Known};
use crate::board::{Board, Picture};
use crate::messages::Event;

impl<B: Board> Flight<'_, B> {
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
        let Some(layout) = self.check_size(picture.bytes) else { return };
        let Some(expected) = self.expect_limb(picture.exposure_us) else { return };
        let mut expected = KeptTwice::new(expected);
        expected.complete();
        let start = self.board.now_us();
        let wanted = core::mem::take(&mut self.dump_edges);
        let bytes = self.board.pixels().get(..picture.bytes).unwrap_or_default();
        let Ok(grey) = Grey::try_new(bytes, layout) else { return };
        self.buffers.edge.clear();
        let watch = EdgeWatch {
            wanted,
            longest: RefCell::new(&mut self.buffers.edge),
            stuck: RefCell::new(StuckWatch::new(bytes, self.sensor.get().camera())),
        };
        let report = self.sensor.get().process(self.workspace, &grey, expected.get(), &watch);
        let stuck = report.solution.as_ref().and_then(|s| watch.stuck.into_inner().found(s.candidate));
        // A bit may have changed during the calculation.
        if !self.check_memory(Some(&mut expected)) {
            self.state.refused = self.state.refused.saturating_add(1);
            return;
        }
        if let Some(stuck) = stuck {
            self.state.stuck = self.state.stuck.saturating_add(1);
            self.send_event(Event::StuckPixels, stuck.stuck, stuck.places);
            return;
        }
        if let Some(s) = &report.solution {
            let last = Last { axis: s.axis, sigma_rad: s.covariance.sigma_max_rad(), age_s: 0.0 };
            self.known.set(Known { last: Some((last, picture.exposure_us)), ..self.known.get().clone() });
            self.known.complete();
        }
        let done_us = self.board.now_us();
        let calculation_us = u32::try_from(done_us.saturating_sub(start)).unwrap_or(u32::MAX);
        self.count_picture(report.status, calculation_us);
        self.send_answer(&report, picture.exposure_us, done_us);
        if wanted {
            let Buffers { line, edge, .. } = &mut *self.buffers;
            let time = line.clock.at(picture.exposure_us);
            edge.send(line, &mut self.board, time, self.number);
        }
        self.since_housekeeping = self.since_housekeeping.saturating_add(1);
        if self.since_housekeeping >= self.operations.housekeeping_every {
            self.send_housekeeping();
        }
    }

    /// Returns the layout of a picture with this number of bytes. Refuses the picture if the camera has another size.
    fn check_size(&mut self, bytes: usize) -> Option<Layout> {
        let camera = self.sensor.get().camera();
        let expected_bytes = usize::from(camera.width()) * usize::from(camera.height());
        if bytes == expected_bytes {
            return Some(Layout::packed(camera.width().into(), camera.height().into(), 1, 8));
        }
        self.state.refused = self.state.refused.saturating_add(1);
        self.send_event(Event::WrongSize, bytes as u32, expected_bytes as u32);
        None
    }

    /// Returns the expected limb of a picture, from the values of navigation and the last answer. Refuses the picture
    /// if these are impossible.
    fn expect_limb(&mut self, exposure_us: u64) -> Option<Expected<f32>> {
        let prior = self.prior_at(exposure_us);
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
        self.number = self.number.wrapping_add(1);
        state.pictures = state.pictures.saturating_add(1);
        state.answers = state.answers.saturating_add(u32::from(status == Status::Ok));
        state.last_status = status as u8;
        state.last_us = calculation_us;
        state.longest_us = state.longest_us.max(calculation_us);
    }
}
