//! Processes the whole sequence by itself: after opening, and again a moment after each change.

use std::sync::Arc;
use std::time::{Duration, Instant};

use hzn_core::status::Status;

use super::Viewer;
use crate::model::Session;
use crate::work::Setup;
use crate::work::background::{self, Background, Event, Slot, Task};

/// Time from a change to the start of the work, so that a slider that moves does not start it with every step.
const AFTER_CHANGE: Duration = Duration::from_millis(300);

fn slot(session: &Session, is_session: bool) -> Option<Slot> {
    let config = Arc::clone(session.config()?);
    Some(Slot { is_session, setup: Setup { config, version: session.version() } })
}

impl Viewer {
    /// Notices a change of the parameters: the results so far become the earlier ones.
    pub(super) fn notice_version(&mut self) {
        let Some(session) = &self.session else { return };
        if self.seen_version != session.version() {
            self.seen_version = session.version();
            // A recording holds the results of its own sensor.toml.
            let as_recorded = self.sequence.recording.is_some()
                && self.sequence.altitude_shift_km == 0.0
                && session.path().is_none()
                && !session.is_changed();
            self.rows.begin_version(as_recorded);
        }
    }

    /// Returns true if every picture of the recording has an answer with these parameters. Then there is nothing to
    /// find out.
    fn is_recorded(&self) -> bool {
        let answered = |i| self.rows.current(i, self.body).is_some_and(|r| r.status == Status::Ok);
        (0..self.sequence.len()).all(answered)
    }

    /// Returns the sensors whose results are missing.
    fn missing_slots(&self) -> Vec<Slot> {
        let (session, other) = self.work.complete;
        let own = self.session.as_ref().and_then(|s| slot(s, true));
        let compared = self.other.as_ref().and_then(|(_, s)| slot(s, false));
        let own = own.filter(|s| session != Some(s.setup.version) && !self.is_recorded());
        let compared = compared.filter(|s| other != Some(s.setup.version));
        own.into_iter().chain(compared).collect()
    }

    /// Starts the work on the whole sequence if it is due.
    pub(in crate::ui) fn drive_background(&mut self, ctx: &egui::Context) {
        let version = |s: &Session| s.config().map(|_| s.version());
        let wanted =
            (self.session.as_ref().and_then(version), self.other.as_ref().and_then(|(_, session)| version(session)));
        let is_known = self.sequence.complete || self.follow.is_open;
        if !is_known || !background::has_pictures(&self.sequence) {
            return;
        }
        if self.work.wanted != wanted {
            if self.work.wanted.1 != wanted.1 {
                self.rows.clear_other();
            }
            self.work.wanted = wanted;
            (self.work.running, self.work.stopped) = (None, false);
            self.work.due = Some(Instant::now() + AFTER_CHANGE);
        }
        if self.work.stopped || (self.work.due.is_none() && !self.follow.is_open) {
            return;
        }
        let left = self.work.due.map_or(Duration::ZERO, |due| due.saturating_duration_since(Instant::now()));
        if !left.is_zero() {
            return ctx.request_repaint_after(left);
        }
        self.work.due = None;
        if self.follow.is_open {
            let own = self.session.as_ref().and_then(|s| slot(s, true));
            return self.work_on_added(own.into_iter().collect());
        }
        let slots = self.missing_slots();
        if !slots.is_empty() {
            let task = Task {
                sequence: self.sequence.clone(),
                slots,
                from: self.playback.frame(),
                flight: self.flight,
                only: None,
            };
            self.work.running = Some(Background::start(task, Arc::clone(&self.wake)));
        }
    }

    /// Takes the results of the background work.
    pub(super) fn poll_background(&mut self) {
        let events = self.work.running.as_mut().map(Background::events).unwrap_or_default();
        let (session, other) = self.work.wanted;
        for event in events {
            match event {
                Event::Session(index, version, processed) if session == Some(version) => {
                    self.rows.set_current(index, processed);
                }
                Event::Other(index, version, rows) if other == Some(version) => self.rows.set_other(index, rows),
                Event::End => {
                    self.work.running = None;
                    if !self.follow.is_open {
                        self.work.complete = self.work.wanted;
                    }
                }
                _ => {}
            }
        }
    }

    /// Starts the work on all pictures at once.
    pub(in crate::ui) fn process_again(&mut self) {
        if self.session.is_none() {
            return self.add_note("Open a sensor.toml first.");
        }
        (self.work.complete, self.work.running, self.work.stopped) = ((None, None), None, false);
        self.work.due = Some(Instant::now());
    }

    /// Stops the work on all pictures until the next change.
    pub(in crate::ui) fn stop_background(&mut self) {
        (self.work.running, self.work.stopped) = (None, true);
    }

    /// Returns true while pictures are processed in the background, or if that is about to begin, and while results of
    /// other commands are read.
    pub fn is_working(&self) -> bool {
        let processing = !self.work.stopped && (self.work.running.is_some() || self.work.due.is_some());
        processing || self.companions.is_reading()
    }
}
