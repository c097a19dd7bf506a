//! The state of the window.

mod act;
mod attach;
mod auto;
mod begin;
mod changes;
mod companions;
mod follow;
mod jobs;
mod keep_settings;
mod line;
mod mask_tool;
mod outputs;
mod outside;
mod player;
mod request_key;
mod rig;
mod sequence_work;
mod threads;
mod unsaved;
mod zoom;

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use hzn_files::truth::Truth;
use hzn_fly::link::Address;

use super::calibration_window::CalibrationWindow;
use super::focus_ring::FocusRing;
use super::follow::Follow;
use super::live_view::LiveView;
use super::offered::Offered;
use super::palette_state::Palette;
use super::panels::{Panel, Panels};
use super::path_dialog::PathDialog;
use super::rig_view::RigView;
use super::steady_offer::SteadyOffer;
use super::study_window::StudyWindow;
use super::summary::{Missed, Summary};
use super::textures::Textures;
use super::toast::Toasts;
use super::wizard_form::Wizard;
use crate::model::cause::Group;
use crate::model::{CircleEdit, KeptSettings, MaskEdit, Playback, ResultHistory, Sequence, Session, Settings, View};
use crate::work::check::{Check, Damaged};
use crate::work::companion;
use crate::work::frame_view::BodyResult;
use crate::work::open::{self, Request};
use crate::work::sweep::Sweep;
use crate::work::{Engine, FrameView, Job, Wake};
use changes::Changes;
pub(super) use changes::{Leave, Outside};
use companions::Companions;
pub(super) use outputs::replaced;
use request_key::RequestKey;
use sequence_work::SequenceWork;

/// The window's state.
pub struct Viewer {
    pub(super) settings: Settings,
    /// File of the settings; with `None` they are not stored.
    store: Option<PathBuf>,
    kept: KeptSettings,
    pub(super) sequence: Sequence,
    pub(super) rows: ResultHistory,
    pub(super) truth: HashMap<String, Vec<Truth>>,
    pub(super) session: Option<Session>,
    /// Name and session that the session is compared with.
    pub(super) other: Option<(String, Session)>,
    pub(super) flight: bool,
    pub(super) playback: Playback,
    /// The state of a sequence that grows.
    pub(super) follow: Follow,
    pub(super) view: View,
    pub(super) body: usize,
    /// Candidate that the pointer is on in the column of stages.
    pub(super) pointed: Option<u32>,
    pub(super) frame_view: Option<FrameView>,
    pub(super) toasts: Toasts,
    pub(super) changes: Changes,
    /// Session that comes back once its sequence is open, and the file that keeps it until then.
    restoring: Option<(Session, PathBuf)>,
    /// The window closes at its next frame.
    close_now: bool,
    /// Version of the session that the results belong to.
    seen_version: u64,
    /// Work on the whole sequence in the background.
    pub(super) work: SequenceWork,
    /// Check of a recording, and its pictures that cannot be read.
    checking: Option<Check>,
    pub(super) damaged: Damaged,
    pub(super) wizard: Option<Wizard>,
    /// The form for a first sensor.toml opens once the chosen picture is shown.
    wizard_is_due: bool,
    /// The flight computer whose telemetry is shown instead of pictures.
    pub(super) live: Option<LiveView>,
    /// The rig whose heads are shown instead of one sequence.
    pub(super) rig: Option<RigView>,
    pub(super) study: Option<StudyWindow>,
    /// The calibration on the pictures.
    pub(super) calibration: Option<CalibrationWindow>,
    pub(super) summary: Summary,
    pub(super) missed: Missed,
    /// The plots that the sequence offers.
    pub(super) offered: Offered,
    /// Results of other commands that belong to the sequence.
    pub(super) companions: Companions,
    /// A change of one focal length changes the other one.
    pub(super) linked_focal: bool,
    /// Key that a link opens in the column of stages.
    pub(super) focus_key: Option<&'static str>,
    /// The column of stages scrolls to the diagnosis and marks it, until the next click.
    pub(super) focus_diagnosis: bool,
    /// Plot that was switched on last; the plots scroll to it.
    pub(super) new_plot: Option<String>,
    /// An edge of the vehicle that could be masked.
    pub(super) steady: SteadyOffer,
    pub(super) panels: Panels,
    /// Columns that show their top when they are drawn next, because other pictures were opened.
    unscrolled: Vec<Panel>,
    /// Where the plots over time begin and end on the screen.
    pub(super) plot_span: Option<egui::Rangef>,
    /// Picture under the pointer in the plots.
    pub(super) hovered_frame: Option<usize>,
    /// Group of pictures that the time line shows; `None` shows all.
    pub(super) group: Option<Group>,
    /// Candidate whose residuals are shown; `None` shows those of the answer.
    pub(super) chosen_candidate: Option<u32>,
    /// Opens the dialogs of the system; otherwise paths are typed.
    native_dialogs: bool,
    pub(super) path_dialog: Option<PathDialog>,
    pub(super) mask: Option<MaskEdit>,
    pub(super) circle: Option<CircleEdit>,
    pub(super) showing_help: bool,
    /// The palette while it is open.
    pub(super) palette: Option<Palette>,
    pub(super) focus_ring: FocusRing,
    pub(super) showing_diff: bool,
    pub(super) layers_hidden: bool,
    /// Position in the list of the worst pictures.
    worst: usize,
    request: Request,
    opening: Option<open::Opening>,
    /// Number of messages when the opening began.
    messages_before: usize,
    pub(super) sweep: Option<Sweep>,
    /// Work on files.
    pub(super) jobs: Vec<Job>,
    pub(super) textures: Textures,
    engine: Engine,
    wake: Wake,
    requested: Option<RequestKey>,
    /// Time of the last request.
    requested_at: Instant,
    last: Instant,
    /// Time until the next picture is due, when the window was drawn last.
    planned_wait: Duration,
    /// True once the colours and sizes of the window are set.
    pub(super) styled: bool,
}

impl Viewer {
    /// Creates an empty window. Threads that have something to show call `wake`.
    pub fn new(settings: Settings, store: Option<PathBuf>, wake: Wake) -> Self {
        let changes = Changes::new(store.as_deref());
        Self {
            settings,
            store,
            kept: KeptSettings::default(),
            sequence: Sequence::default(),
            rows: ResultHistory::default(),
            truth: HashMap::new(),
            session: None,
            other: None,
            flight: false,
            playback: Playback::default(),
            follow: Follow::default(),
            view: View::FIT,
            body: 0,
            pointed: None,
            frame_view: None,
            toasts: Toasts::default(),
            changes,
            restoring: None,
            close_now: false,
            seen_version: 0,
            work: SequenceWork::default(),
            checking: None,
            damaged: Damaged::new(),
            wizard: None,
            wizard_is_due: false,
            live: None,
            rig: None,
            study: None,
            calibration: None,
            summary: Summary::default(),
            missed: Missed::default(),
            offered: Offered::default(),
            companions: Companions::default(),
            linked_focal: true,
            focus_key: None,
            focus_diagnosis: false,
            new_plot: None,
            steady: SteadyOffer::default(),
            panels: Panels::default(),
            unscrolled: Vec::new(),
            plot_span: None,
            hovered_frame: None,
            group: None,
            chosen_candidate: None,
            native_dialogs: false,
            path_dialog: None,
            mask: None,
            circle: None,
            showing_help: false,
            palette: None,
            focus_ring: FocusRing::default(),
            showing_diff: false,
            layers_hidden: false,
            worst: 0,
            request: Request::default(),
            opening: None,
            messages_before: 0,
            sweep: None,
            jobs: Vec::new(),
            textures: Textures::default(),
            engine: Engine::start(Arc::clone(&wake)),
            wake,
            requested: None,
            requested_at: Instant::now(),
            last: Instant::now(),
            planned_wait: Duration::ZERO,
            styled: false,
        }
    }

    /// Opens another sequence, or the line to a flight computer.
    pub fn open(&mut self, request: Request) {
        if let [one] = request.inputs.as_slice()
            && Address::is_address(&one.to_string_lossy())
        {
            return self.open_line(&one.to_string_lossy(), &request.computer);
        }
        if let [one] = request.inputs.as_slice()
            && self.open_if_rig(one)
        {
            return;
        }
        (self.live, self.rig) = (None, None);
        self.messages_before = self.toasts.len();
        // A session that waits for its sequence does not come to another one.
        self.restoring = None;
        self.opening = Some(open::start(request.clone(), Arc::clone(&self.wake)));
        for path in &request.inputs {
            self.settings.add_recent(path);
        }
        self.request = request;
    }

    /// Opens files or a folder. The pictures per second of the command line still apply; all else is the default.
    pub(super) fn open_paths(&mut self, inputs: Vec<PathBuf>) {
        // A wrong name changes nothing, so there is no question about changes.
        if let Some(missing) = open::missing(&inputs) {
            return self.add_problem(format!("{}: no such file or folder", missing.display()));
        }
        // A sensor.toml applies to the pictures that are open.
        if let [one] = inputs.as_slice()
            && one.extension().is_some_and(|e| e == "toml")
            && !hzn_files::rig::is_rig(one)
        {
            match Session::open(one) {
                Ok(session) => self.leave(Leave::Sensor(Box::new(session.opened_by_user())), None),
                Err(problem) => self.add_problem(problem.to_string()),
            }
            return;
        }
        if let [one] = inputs.as_slice()
            && companion::kind_of(one).is_some()
        {
            return self.attach(one);
        }
        let request = Request { inputs, fps: self.request.fps, ..Request::default() };
        self.leave(Leave::Sequence(Box::new(request)), None);
    }

    /// Switches to single precision and at most 2048 points, as `FlightHorizon` has.
    pub fn set_flight(&mut self, flight: bool) {
        self.flight = flight;
    }

    /// Returns the picture that is shown, if there is one yet.
    pub fn frame_view(&self) -> Option<&FrameView> {
        self.frame_view.as_ref()
    }
    /// Returns the sequence.
    pub fn sequence(&self) -> &Sequence {
        &self.sequence
    }
    /// Returns the sensor that is tuned.
    pub fn session(&self) -> Option<&Session> {
        self.session.as_ref()
    }
    /// Returns the sensor that is tuned, for changes.
    pub fn session_mut(&mut self) -> Option<&mut Session> {
        self.session.as_mut()
    }
    /// Returns the settings, for changes.
    pub fn settings_mut(&mut self) -> &mut Settings {
        &mut self.settings
    }
    /// Returns true if the screen shows the requested picture, processed with the current parameters.
    pub fn is_settled(&self) -> bool {
        let version = self.session.as_ref().map_or(0, Session::version);
        if let Some(is_settled) = self.rig_is_settled() {
            return is_settled;
        }
        if let Some(live) = &self.live {
            return live.line.live().last.is_some();
        }
        (self.opening.is_none() || self.follow.is_open)
            && self.frame_view.as_ref().is_some_and(|s| s.index == self.playback.frame() && s.version == version)
    }
    /// Returns true if nothing is being opened and there is no picture.
    pub fn is_without_pictures(&self) -> bool {
        self.live.is_none() && self.rig.is_none() && self.opening.is_none() && self.sequence.is_empty()
    }
    /// Returns the number of pictures that are processed with the current parameters.
    pub fn processed(&self) -> usize {
        self.rows.current_len()
    }
    /// Returns the file's result for a picture and the selected body.
    pub fn recorded(&self, frame: usize) -> Option<&hzn_mcap::Row> {
        self.rows.recorded(frame, self.body)
    }
    /// Returns the zoom and the position of the picture.
    pub fn view(&self) -> View {
        self.view
    }
    /// Returns the messages to the user.
    pub fn messages(&self) -> impl Iterator<Item = &str> {
        self.toasts.iter().map(|t| t.text.as_str())
    }
    /// Returns the results of all pictures.
    pub fn results(&self) -> &ResultHistory {
        &self.rows
    }
    /// Uses the dialogs of the system for files.
    pub fn use_native_dialogs(&mut self) {
        self.native_dialogs = true;
    }

    pub(super) fn add_note(&mut self, text: impl Into<String>) {
        self.toasts.add(text.into(), false, None);
    }
    pub(super) fn add_problem(&mut self, text: impl Into<String>) {
        self.toasts.add(text.into(), true, None);
    }
    /// Asks for a path: with the dialog of the system, or by a line to type it.
    pub(super) fn ask(&mut self, mut dialog: PathDialog) {
        if self.native_dialogs {
            dialog.browse_only(false);
        }
        self.path_dialog = Some(dialog);
    }

    pub(super) fn set_session(&mut self, session: Session) {
        // A question about the file of the old session would be answered for the new one.
        self.cancel_save();
        self.changes.is_sensor_kept = false;
        self.path_dialog.take_if(|dialog| dialog.replaces);
        self.session = Some(session);
        self.requested = None;
        self.body = 0;
    }

    /// Returns the area that scrolls a column. It shows its top after other pictures were opened.
    pub(super) fn scroll_area(&mut self, panel: Panel) -> egui::ScrollArea {
        let area = egui::ScrollArea::vertical().auto_shrink([false, false]);
        match self.unscrolled.iter().position(|p| *p == panel) {
            Some(n) => {
                self.unscrolled.swap_remove(n);
                area.vertical_scroll_offset(0.0)
            }
            None => area,
        }
    }

    /// Returns the result for the selected body.
    pub(super) fn answer(&self) -> Option<&Arc<BodyResult>> {
        let outcome = self.frame_view.as_ref()?.answers.first()?;
        outcome.bodies.get(self.body).or(outcome.bodies.first())
    }

    /// Returns the truth for a picture and a body.
    pub(super) fn truth_of(&self, name: &str, body: &str) -> Option<&Truth> {
        self.truth.get(name)?.iter().find(|t| t.body == body)
    }

    /// Stops unfinished writing and stores the settings.
    pub fn close(&self) {
        if let Some(autosave) = self.changes.autosave.as_ref().filter(|_| self.changes.may_close) {
            autosave.remove();
        }
        self.jobs.iter().for_each(Job::abandon);
        self.sweep.iter().for_each(Sweep::abandon);
        if let Some(place) = &self.store {
            // The window is gone, so an error cannot be shown.
            let _ = self.settings.store(place);
        }
    }
}
