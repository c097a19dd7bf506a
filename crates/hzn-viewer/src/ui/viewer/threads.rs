//! Messages between the window and its threads.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::Viewer;
use super::changes::Leave;
use super::request_key::RequestKey;
use super::sequence_work::SequenceWork;
use crate::model::cause::Cause;
use crate::model::settings::Layer;
use crate::model::sigma_parts::SigmaParts;
use crate::model::steady_edge::EdgeCells;
use crate::model::{Place, Processed, ResultHistory, Sequence, Session, View, autosave};
use crate::ui::panels::Panel;
use crate::work::SensorText;
use crate::work::check::Check;
use crate::work::frame_view::Outcome;
use crate::work::open;
use crate::work::sweep::{self, Sweep};
use crate::work::{FrameRequest, FrameView, Setup};

/// Number of pictures that are decoded in advance.
const AHEAD: usize = 4;
/// Longest wait of the window for an answer, from the request on, so that the answer appears in the same frame as the
/// change. The rest of the 16 ms of a displayed frame is enough to lay out the window and to hand it over.
const AT_ONCE: Duration = Duration::from_millis(10);
/// The same while the sequence is played: the picture was decoded in advance, and nothing else has to be drawn until it
/// is there.
const AT_ONCE_PLAYING: Duration = Duration::from_millis(40);

impl Viewer {
    /// Takes all messages of the threads.
    pub(in crate::ui) fn poll(&mut self, ctx: &egui::Context) {
        let opening_events: Vec<open::Event> = self.opening.iter().flat_map(|o| o.events.try_iter()).collect();
        self.notice_navigation();
        for event in opening_events {
            // An opening that ended has no further events.
            if self.opening.is_some() {
                self.handle_opening(event);
            }
        }
        let frame_views: Vec<FrameView> = self.engine.answers().collect();
        for frame_view in frame_views {
            self.take_frame(frame_view);
        }
        self.textures.take(self.frame_view.as_ref(), ctx);
        let sweep_events = self.sweep.as_mut().map(Sweep::events).unwrap_or_default();
        for event in sweep_events {
            self.handle_sweep(event);
        }
        self.poll_background();
        self.poll_check();
        self.poll_companions();
        self.poll_lens();
        self.take_finished_jobs();
        self.poll_path_dialog();
        self.reload_unchanged(ctx);
    }

    /// Waits a short time for the answer to the last request, after the panels were drawn. A slow answer comes with a
    /// later frame of the window.
    pub(in crate::ui) fn wait(&mut self, ctx: &egui::Context) {
        if self.wait_until(self.requested_at + AT_ONCE, ctx) {
            // The columns were drawn before the answer came, so they are drawn again.
            ctx.request_repaint();
        }
    }

    /// Waits a short time for the next picture of a sequence that is played, before anything is drawn. So the window is
    /// drawn once for each picture.
    pub(in crate::ui) fn wait_for_next(&mut self, ctx: &egui::Context) {
        self.wait_until(self.requested_at + AT_ONCE_PLAYING, ctx);
    }

    /// Waits for the answer to the last request. Returns true if there is a new one.
    fn wait_until(&mut self, until: Instant, ctx: &egui::Context) -> bool {
        let mut new = false;
        while !self.is_settled() && self.requested.is_some() {
            let Some(frame_view) = self.engine.wait(until.saturating_duration_since(Instant::now())) else { break };
            self.take_frame(frame_view);
            new = true;
        }
        if new {
            self.textures.take(self.frame_view.as_ref(), ctx);
        }
        new
    }

    /// Takes over a processed picture.
    fn take_frame(&mut self, frame_view: FrameView) {
        let entry = self.sequence.entries.get(frame_view.index);
        if entry.is_none_or(|entry| entry.name != frame_view.name) {
            // The pictures of a growing sequence have moved since the request.
            return;
        }
        if let Some(outcome) = frame_view.answers.first()
            && self.session.as_ref().is_some_and(|s| s.version() == frame_view.version)
            && !outcome.bodies.is_empty()
        {
            let processed = Processed {
                rows: outcome.bodies.iter().map(|b| b.row.clone()).collect(),
                // Each body has its place in the list, also one that was not looked for.
                causes: outcome.bodies.iter().map(|b| b.cause.unwrap_or_else(|| Cause::from_row(&b.row))).collect(),
                fits: outcome.bodies.iter().map(|b| b.fit).collect(),
                sigma_parts: outcome
                    .bodies
                    .iter()
                    .map(|b| b.solution().and_then(|s| SigmaParts::of_answer(s, &b.edges)))
                    .collect(),
                edges: edge_cells(&frame_view, outcome),
            };
            self.rows.set_current(frame_view.index, processed);
        }
        self.frame_view = Some(frame_view);
        self.open_due_wizard();
    }

    fn handle_opening(&mut self, event: open::Event) {
        match event {
            open::Event::Opened(_) if self.has_changes() && self.restoring.is_none() => {
                // The user went on with his work while the files were opened.
                self.opening = None;
                self.changes.question = Some(Leave::Sequence(Box::new(self.request.clone())));
            }
            open::Event::Opened(opened) => self.begin_sequence(*opened),
            open::Event::Pictures(path, pictures) => {
                self.engine.set_recording(pictures);
                self.sequence.recording = Some(path);
            }
            open::Event::Frames(frames) => {
                for (entry, rows) in frames {
                    let index = self.sequence.len();
                    self.sequence.entries.push(entry);
                    for row in rows {
                        self.rows.record(index, row);
                    }
                }
                self.take_added();
            }
            open::Event::End { cut_off, note } => self.complete_sequence(cut_off, note),
            open::Event::Failed(why) => {
                self.opening = None;
                if self.restoring.take().is_some() {
                    self.add_note("The changes of the earlier window are kept; the next window offers them again.");
                }
                self.add_problem(why);
            }
        }
    }

    /// Replaces the sequence by one that was opened, which has no pictures yet.
    fn begin_sequence(&mut self, opened: open::Opened) {
        self.sequence = Sequence {
            title: opened.title,
            inputs: self.request.inputs.clone(),
            folder: opened.folder,
            ..Sequence::default()
        };
        (self.rows, self.truth) = (ResultHistory::default(), opened.truth);
        (self.frame_view, self.requested, self.sweep) = (None, None, None);
        (self.mask, self.circle, self.calibration) = (None, None, None);
        (self.worst, self.body) = (0, 0);
        self.view = View::FIT;
        self.unscrolled = vec![Panel::Answer, Panel::Stages];
        (self.group, self.chosen_candidate, self.seen_version) = (None, None, 0);
        self.work = SequenceWork::default();
        (self.checking, self.damaged) = (None, Vec::new());
        // Messages about the previous sequence are removed; newer messages stay.
        self.toasts.remove_first(self.messages_before);
        self.search_companions();
        self.playback.go(self.request.frame, usize::MAX);
        self.begin_following();
        self.engine.open(self.request.inputs.clone());
        self.begin_sensor(opened.sensor);
        for note in opened.notes {
            self.add_note(note);
        }
    }

    /// Replaces the session by that of the new pictures. The old one ends with its pictures, because saving would
    /// otherwise write into the folder of another flight. Only a file that the user opened himself stays.
    fn begin_sensor(&mut self, found: Option<SensorText>) {
        // A form or a path that is still being entered belongs to the old pictures.
        (self.wizard, self.wizard_is_due) = (None, false);
        self.cancel_save();
        (self.changes.agreed, self.changes.is_sensor_kept, self.changes.dropped_corners) = (None, false, None);
        self.path_dialog.take_if(|dialog| dialog.purpose.writes());
        // A sensor that is compared belongs to the old pictures, too.
        self.other = None;
        let is_named = self.request.sensor.is_some();
        let found = found.map(|s| Session::new(&s.text, &s.home, s.as_read).completed_from(&s.on_file));
        let found = found.map(|s| if is_named { s.opened_by_user() } else { s });
        let kept = self.session.take().filter(Session::is_opened_by_user);
        if let Some((session, path)) = self.restoring.take() {
            let _ = std::fs::remove_file(path);
            self.session = Some(session);
        } else if let Some(session) = found {
            self.session = Some(session);
        } else if let Some(session) = kept {
            let home = autosave::absolute(session.home());
            self.session = Some(session);
            self.changes.is_sensor_kept = true;
            self.add_note(format!("There is no sensor.toml. The one that you opened stays: {}", home.display()));
        } else {
            self.add_note(
                "There is no sensor.toml, so the pictures are shown but not processed. Make one in the panel \
                 “Stages”, open one, or drop it on the window.",
            );
        }
    }

    /// Marks the sequence as complete, and tells the user what it lacks.
    fn complete_sequence(&mut self, cut_off: bool, note: Option<String>) {
        self.opening = None;
        self.sequence.complete = true;
        self.end_following();
        self.playback.set_usual_speed(self.sequence.interval_s());
        self.playback.go(self.playback.frame(), self.sequence.len());
        if cut_off {
            let path = self.request.inputs.first().cloned();
            let text = "This recording was not closed: its run was interrupted, or the file was cut off. All complete \
                        pictures are shown.";
            self.toasts.add(text.into(), true, path);
        }
        if self.sequence.is_empty() {
            self.add_problem(format!("{}: contains no picture", self.sequence.title));
        } else if self.sequence.entries.iter().all(|e| e.place == Place::Nowhere) {
            self.add_note(
                "This recording was made without pictures (--no-images): the window shows its results, but cannot \
                 process the pictures again.",
            );
        }
        if let Some(note) = note {
            self.add_problem(note);
        }
        if let Some(recording) = self.sequence.recording.clone() {
            let has_results = self.rows.recorded(0, 0).is_some();
            let (entries, wake) = (self.sequence.entries.clone(), Arc::clone(&self.wake));
            self.checking = Some(Check::start(recording, entries, has_results, wake));
        }
    }

    /// Takes the result of the check of a recording.
    fn poll_check(&mut self) {
        let Some(damaged) = self.checking.as_ref().and_then(Check::end) else { return };
        self.checking = None;
        if let Some(first) = damaged.first() {
            self.add_problem(format!(
                "The recording is damaged: {} pictures lie in damaged parts, the first is picture {}. They may be \
                 wrong; the time line marks them.",
                damaged.len(),
                first + 1
            ));
        }
        self.damaged = damaged;
    }

    fn handle_sweep(&mut self, event: sweep::Event) {
        match event {
            // The results come from the background work, with their causes.
            sweep::Event::Frame { .. } => {}
            sweep::Event::End { file, stopped } => {
                self.sweep = None;
                match file {
                    Some(_) if stopped => self.add_note("Processing was stopped; no file was written."),
                    Some(file) => self.add_note(format!("Written: {}", file.display())),
                    None => {}
                }
            }
            sweep::Event::Failed(why) => {
                self.sweep = None;
                self.add_problem(why);
            }
        }
    }

    /// Requests the picture to show, unless the last request was the same.
    pub(in crate::ui) fn request_frame(&mut self) {
        self.notice_version();
        let index = self.playback.frame();
        let Some(entry) = self.sequence.entries.get(index) else { return };
        let sessions = self.session.iter().chain(self.other.iter().map(|(_, s)| s));
        let setup = |s: &Session| Some(Setup { config: Arc::clone(s.config()?), version: s.version() });
        let setups: Vec<Setup> = sessions.filter_map(setup).collect();
        let key = RequestKey {
            index,
            versions: setups.iter().map(|s| s.version).collect(),
            look: self.settings.look,
            contrast: (self.settings.contrast, self.settings.gamma),
            undistorted: self.settings.undistorted,
            touched: self.settings.shows(Layer::Touched),
            flight: self.flight,
            title: self.sequence.title.clone(),
        };
        if self.requested.as_ref() == Some(&key) {
            return;
        }
        let ahead = |i: usize| Some((i, self.sequence.entries.get(i)?.clone()));
        let request = FrameRequest {
            index,
            entry: entry.clone(),
            setups,
            flight: key.flight,
            look: key.look,
            contrast: key.contrast,
            undistorted: key.undistorted,
            touched: key.touched,
            ahead: (index + 1..=index + AHEAD).filter_map(ahead).collect(),
            since: Instant::now(),
        };
        (self.requested, self.requested_at) = (Some(key), request.since);
        self.engine.request(request);
    }
}

/// Returns where a picture has edges.
fn edge_cells(frame_view: &FrameView, outcome: &Outcome) -> EdgeCells {
    let Ok(picture) = &frame_view.picture else { return EdgeCells::default() };
    let bodies = outcome.bodies.iter().map(|b| (b.edges.as_slice(), b.solution().map(|s| s.candidate)));
    EdgeCells::of([picture.layout.width, picture.layout.height], bodies)
}
