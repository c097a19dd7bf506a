//! The state of the window.

mod act;
mod jobs;
mod threads;

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::Receiver;
use hzn_sim::truth::Truth;

use super::dialogs::Asking;
use super::{command, compare, dialogs, help, picture, plots, side, stages, theme, timeline, top};
use crate::model::{MaskEdit, Playback, ResultHistory, Sequence, Session, Settings, View};
use crate::work::frame_view::BodyResult;
use crate::work::open::{self, Request};
use crate::work::sweep::Sweep;
use crate::work::{Engine, FrameView, Job, Wake};
use threads::Asked;

/// Frames that are decoded beforehand.
const AHEAD: usize = 4;
/// The window waits so long at most for an answer, from the wish on, so that it comes with the frame of the change:
/// what is left of a displayed frame's 16 ms is enough to lay the window out and to hand it over.
const AT_ONCE: Duration = Duration::from_millis(10);

/// A window that stood still for longer goes on from where it was.
const LONGEST_PASS: Duration = Duration::from_millis(250);

/// Something to be said, in place, until it is closed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Message {
    pub(super) text: String,
    pub(super) bad: bool,
    /// A recording that can be recovered.
    pub(super) recover: Option<PathBuf>,
}

/// The window's state.
pub struct Viewer {
    pub(super) settings: Settings,
    /// Where they are kept; `None` leaves them.
    store: Option<PathBuf>,
    pub(super) sequence: Sequence,
    pub(super) rows: ResultHistory,
    pub(super) truth: HashMap<String, Vec<Truth>>,
    pub(super) session: Option<Session>,
    /// What the session is compared with, and its name.
    pub(super) other: Option<(String, Session)>,
    pub(super) flight: bool,
    pub(super) playback: Playback,
    pub(super) view: View,
    pub(super) body: usize,
    /// The candidate that is pointed at.
    pub(super) pointed: Option<u32>,
    pub(super) sight: Option<FrameView>,
    pub(super) messages: Vec<Message>,
    pub(super) asking: Option<Asking>,
    pub(super) mask: Option<MaskEdit>,
    pub(super) showing_help: bool,
    pub(super) showing_diff: bool,
    pub(super) layers_hidden: bool,
    /// Place in the list of worst frames.
    worst: usize,
    request: Request,
    opening: Option<Receiver<open::Event>>,
    /// Messages that were there when it began.
    said_before: usize,
    pub(super) sweep: Option<Sweep>,
    /// Work on files.
    pub(super) jobs: Vec<Job>,
    pub(super) textures: picture::Textures,
    engine: Engine,
    wake: Wake,
    asked: Option<Asked>,
    /// When that was.
    asked_at: Instant,
    last: Instant,
    styled: bool,
}

impl Viewer {
    /// An empty window. `wake` is called by threads that have something to show.
    pub fn new(settings: Settings, store: Option<PathBuf>, wake: Wake) -> Self {
        Self {
            settings,
            store,
            sequence: Sequence::default(),
            rows: ResultHistory::default(),
            truth: HashMap::new(),
            session: None,
            other: None,
            flight: false,
            playback: Playback::default(),
            view: View::FIT,
            body: 0,
            pointed: None,
            sight: None,
            messages: Vec::new(),
            asking: None,
            mask: None,
            showing_help: false,
            showing_diff: false,
            layers_hidden: false,
            worst: 0,
            request: Request::default(),
            opening: None,
            said_before: 0,
            sweep: None,
            jobs: Vec::new(),
            textures: picture::Textures::default(),
            engine: Engine::start(Arc::clone(&wake)),
            wake,
            asked: None,
            asked_at: Instant::now(),
            last: Instant::now(),
            styled: false,
        }
    }

    /// Opens something else.
    pub fn open(&mut self, request: Request) {
        self.said_before = self.messages.len();
        self.opening = Some(open::start(request.clone(), Arc::clone(&self.wake)));
        for path in &request.inputs {
            self.settings.opened(path);
        }
        self.request = request;
    }

    /// Opens files or a folder, with what is known about them by the command line.
    pub(super) fn open_paths(&mut self, inputs: Vec<PathBuf>) {
        // A sensor.toml is for the pictures that are open.
        if let [one] = inputs.as_slice()
            && one.extension().is_some_and(|e| e == "toml")
        {
            match Session::open(one) {
                Ok(session) => self.set_session(session),
                Err(problem) => self.say_bad(problem.to_string()),
            }
            return;
        }
        self.open(Request { inputs, fps: self.request.fps, ..Request::default() });
    }

    /// As on the flight computer.
    pub fn set_flight(&mut self, flight: bool) {
        self.flight = flight;
    }

    /// The frame that is shown, once it is.
    pub fn sight(&self) -> Option<&FrameView> {
        self.sight.as_ref()
    }
    /// The frames.
    pub fn sequence(&self) -> &Sequence {
        &self.sequence
    }
    /// The sensor.
    pub fn session(&self) -> Option<&Session> {
        self.session.as_ref()
    }
    /// The sensor, to be changed.
    pub fn session_mut(&mut self) -> Option<&mut Session> {
        self.session.as_mut()
    }
    /// Goes to a frame.
    pub fn go(&mut self, frame: usize) {
        self.playback.go(frame, self.sequence.len());
    }
    /// Changes the settings.
    pub fn settings_mut(&mut self) -> &mut Settings {
        &mut self.settings
    }
    /// Is the frame on the screen the one that was asked for, as the parameters are now?
    pub fn is_settled(&self) -> bool {
        let changes = self.session.as_ref().map_or(0, Session::changes);
        self.opening.is_none()
            && self.sight.as_ref().is_some_and(|s| s.index == self.playback.frame() && s.changes == changes)
    }
    /// Number of frames that the parameters as they are now were applied to.
    pub fn processed(&self) -> usize {
        self.rows.fresh()
    }
    /// What the file says about a frame and the body that is looked at.
    pub fn recorded(&self, frame: usize) -> Option<&hzn_mcap::Row> {
        self.rows.recorded(frame, self.body)
    }
    /// Where the picture lies on the screen.
    pub fn view(&self) -> View {
        self.view
    }
    /// What is said to the user.
    pub fn messages(&self) -> impl Iterator<Item = &str> {
        self.messages.iter().map(|m| m.text.as_str())
    }

    pub(super) fn say(&mut self, text: impl Into<String>) {
        self.message(Message { text: text.into(), bad: false, recover: None });
    }
    pub(super) fn say_bad(&mut self, text: impl Into<String>) {
        self.message(Message { text: text.into(), bad: true, recover: None });
    }
    fn message(&mut self, message: Message) {
        if !self.messages.contains(&message) {
            self.messages.push(message);
        }
    }

    pub(super) fn set_session(&mut self, session: Session) {
        self.session = Some(session);
        self.rows.forget();
        self.asked = None;
        self.body = 0;
    }

    /// What was made of the body that is looked at.
    pub(super) fn answer(&self) -> Option<&BodyResult> {
        let outcome = self.sight.as_ref()?.answers.first()?;
        outcome.bodies.get(self.body).or(outcome.bodies.first())
    }

    /// The truth about a picture and the body that is looked at.
    pub(super) fn truth_of(&self, name: &str, body: &str) -> Option<&Truth> {
        self.truth.get(name)?.iter().find(|t| t.body == body)
    }

    /// Draws the window.
    pub fn show(&mut self, ui: &mut egui::Ui) {
        let ctx = ui.ctx().clone();
        if !self.styled {
            theme::apply(&ctx);
            self.styled = true;
        }
        ctx.set_theme(if self.settings.dark { egui::Theme::Dark } else { egui::Theme::Light });
        self.poll(&ctx);
        for command in command::pressed(&ctx) {
            self.run(command, &ctx);
        }
        let dropped: Vec<PathBuf> = ctx.input(|i| i.raw.dropped_files.iter().map(|f| f.path().to_owned()).collect());
        if !dropped.is_empty() {
            self.open_paths(dropped);
        }
        // The answer is made while the panels are laid out.
        self.ask();
        top::show(self, ui);
        timeline::show(self, ui);
        if self.settings.plots {
            plots::show(self, ui);
        }
        side::show(self, ui);
        if self.settings.stages {
            stages::show(self, ui);
        }
        // What was turned just now is in the picture of this very frame, when the answer is quick.
        self.ask();
        self.wait(&ctx);
        compare::show(self, ui);
        picture::show(self, ui);
        dialogs::show(self, &ctx);
        help::show(self, &ctx);
        self.advance(&ctx);
        self.ask();
    }

    /// Time goes on. No frame is passed over because it is slow: each has been drawn before the next one is asked for,
    /// which is then made while this one is painted.
    fn advance(&mut self, ctx: &egui::Context) {
        let elapsed = std::mem::replace(&mut self.last, Instant::now()).elapsed();
        let lasts_s = |frame| self.sequence.duration_s(frame);
        if self.sight.as_ref().is_none_or(|s| s.index == self.playback.frame()) {
            self.playback.advance(elapsed.min(LONGEST_PASS), self.sequence.len(), lasts_s);
        }
        if let Some(due) = self.playback.due(lasts_s) {
            ctx.request_repaint_after(due.clamp(Duration::from_millis(4), LONGEST_PASS / 2));
        }
    }

    /// Stops what is being written, and keeps the settings.
    pub fn close(&self) {
        self.jobs.iter().for_each(Job::abandon);
        self.sweep.iter().for_each(Sweep::abandon);
        if let Some(place) = &self.store {
            // Nobody is there any more to hear of it.
            let _ = self.settings.store(place);
        }
    }
}
