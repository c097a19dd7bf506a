//! The state of the window, and what happens to it.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::Receiver;
use hzn_core::Preset;
use hzn_sim::truth::Truth;

use super::dialogs::{Asking, Purpose};
use super::{Command, command, compare, dialogs, help, picture, plots, side, stages, theme, timeline, top};
use crate::model::settings::Layer;
use crate::model::{Entry, Look, Playback, Rows, Sequence, Session, Settings, View};
use crate::work::export::Export;
use crate::work::open::{self, Request};
use crate::work::sight::Answer;
use crate::work::sweep::{self, Sweep};
use crate::work::{Ask, Engine, Setup, Sight, Wake};

/// Frames that are decoded beforehand.
const AHEAD: usize = 4;
/// The window waits so long at most for an answer, so that it comes with the frame of the change.
const AT_ONCE: Duration = Duration::from_millis(4);

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
    pub(super) rows: Rows,
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
    pub(super) sight: Option<Sight>,
    pub(super) messages: Vec<Message>,
    pub(super) asking: Option<Asking>,
    pub(super) mask: Option<picture::MaskTool>,
    pub(super) showing_help: bool,
    pub(super) showing_diff: bool,
    pub(super) layers_hidden: bool,
    /// Place in the list of worst frames.
    worst: usize,
    request: Request,
    opening: Option<Receiver<open::Event>>,
    pub(super) sweep: Option<Sweep>,
    pub(super) export: Option<Export>,
    pub(super) textures: picture::Textures,
    pictures: Option<PathBuf>,
    engine: Engine,
    wake: Wake,
    asked: Option<Asked>,
    last: Instant,
    styled: bool,
}

/// What was asked for last: nothing is asked for twice.
#[derive(Debug, Clone, PartialEq)]
struct Asked {
    index: usize,
    changes: Vec<u64>,
    look: Look,
    undistorted: bool,
    touched: bool,
    flight: bool,
    title: String,
    entries: bool,
}

impl Viewer {
    /// An empty window. `wake` is called by threads that have something to show.
    pub fn new(settings: Settings, store: Option<PathBuf>, wake: Wake) -> Self {
        Self {
            settings,
            store,
            sequence: Sequence::default(),
            rows: Rows::default(),
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
            sweep: None,
            export: None,
            textures: picture::Textures::default(),
            pictures: None,
            engine: Engine::start(Arc::clone(&wake)),
            wake,
            asked: None,
            last: Instant::now(),
            styled: false,
        }
    }

    /// Opens something else.
    pub fn open(&mut self, request: Request) {
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
    pub fn sight(&self) -> Option<&Sight> {
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
    pub(super) fn answer(&self) -> Option<&Answer> {
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
        let elapsed = std::mem::replace(&mut self.last, Instant::now()).elapsed();
        let elapsed = elapsed.min(Duration::from_millis(250));
        // The picture on the screen comes first: no frame is passed over because it is slow.
        let shown = self.sight.as_ref().is_none_or(|s| s.index == self.playback.frame());
        if shown {
            let sequence = &self.sequence;
            self.playback.advance(elapsed, sequence.len(), |i| sequence.duration_s(i));
        }
        if self.playback.is_playing() {
            ctx.request_repaint_after(Duration::from_millis(4));
        }
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
        picture::show(self, ui);
        compare::show(self, &ctx);
        dialogs::show(self, &ctx);
        help::show(self, &ctx);
        self.ask();
    }

    /// Takes what the threads have.
    fn poll(&mut self, ctx: &egui::Context) {
        let opening: Vec<open::Event> = self.opening.iter().flat_map(|r| r.try_iter()).collect();
        for event in opening {
            self.opened(event);
        }
        let sights: Vec<Sight> = self.engine.answers().collect();
        for sight in sights {
            self.see(sight);
        }
        self.textures.take(self.sight.as_ref(), ctx);
        let swept = self.sweep.as_mut().map(Sweep::events).unwrap_or_default();
        for event in swept {
            self.swept(event);
        }
        if let Some(end) = self.export.as_mut().and_then(Export::end) {
            self.export = None;
            match end {
                Ok(done) => self.say(done),
                Err(why) => self.say_bad(why),
            }
        }
        dialogs::poll(self);
    }

    /// Waits a moment for the answer to what was asked last; a slow one comes with a later frame.
    fn wait(&mut self, ctx: &egui::Context) {
        let until = Instant::now() + AT_ONCE;
        let mut new = false;
        while !self.is_settled() && self.asked.is_some() {
            let Some(sight) = self.engine.wait(until.saturating_duration_since(Instant::now())) else { break };
            self.see(sight);
            new = true;
        }
        if new {
            self.textures.take(self.sight.as_ref(), ctx);
            // The columns were drawn before the answer came.
            ctx.request_repaint();
        }
    }

    /// A frame was looked at.
    fn see(&mut self, sight: Sight) {
        if let Some(outcome) = sight.answers.first()
            && self.session.as_ref().is_some_and(|s| s.changes() == sight.changes)
            && !outcome.bodies.is_empty()
        {
            self.rows.refresh(sight.index, outcome.bodies.iter().map(|b| b.row.clone()).collect());
        }
        self.sight = Some(sight);
    }

    fn opened(&mut self, event: open::Event) {
        match event {
            open::Event::Opened(opened) => {
                let opened = *opened;
                self.sequence = Sequence {
                    title: opened.title,
                    inputs: self.request.inputs.clone(),
                    folder: opened.folder,
                    ..Sequence::default()
                };
                (self.rows, self.truth) = (Rows::default(), opened.truth);
                (self.sight, self.asked, self.sweep, self.mask) = (None, None, None, None);
                (self.worst, self.body) = (0, 0);
                self.view = View::FIT;
                self.pictures = None;
                self.messages.clear();
                self.playback.go(self.request.frame, usize::MAX);
                self.engine.open(self.request.inputs.clone());
                // A sensor that was opened by hand stays when only the pictures are others.
                match opened.sensor {
                    Some(s) => self.session = Some(Session::new(&s.text, &s.home, s.is_file)),
                    None if self.session.is_none() => self.say(
                        "There is no sensor.toml here, so pictures are only shown. Open one (or drop it on the window); `hzn init` writes one to start from.",
                    ),
                    None => {}
                }
                for note in opened.notes {
                    self.say(note);
                }
            }
            open::Event::Pictures(pictures) => {
                self.engine.recording(pictures);
                self.pictures = self.request.inputs.first().cloned();
            }
            open::Event::Frames(frames) => {
                for (entry, rows) in frames {
                    let index = self.sequence.len();
                    self.sequence.entries.push(entry);
                    for row in rows {
                        self.rows.record(index, row);
                    }
                }
            }
            open::Event::End { cut_off, note } => {
                self.opening = None;
                self.sequence.complete = true;
                self.playback.go(self.playback.frame(), self.sequence.len());
                if cut_off {
                    let path = self.request.inputs.first().cloned();
                    self.message(Message {
                        text: "This recording was not closed: its run broke off, or the file was cut. What is whole is shown.".into(),
                        bad: true,
                        recover: path,
                    });
                }
                if self.sequence.is_empty() {
                    self.say_bad("There is no frame in it.");
                } else if self.sequence.entries.iter().all(|e| e.place == crate::model::Place::Nowhere) {
                    self.say("This recording was made without pictures (--no-images): results are shown, but nothing can be processed again.");
                }
                if let Some(note) = note {
                    self.say_bad(note);
                }
            }
            open::Event::Failed(why) => {
                self.opening = None;
                self.say_bad(why);
            }
        }
    }

    fn swept(&mut self, event: sweep::Event) {
        match event {
            sweep::Event::Frame { index, changes, rows } => {
                if self.session.as_ref().is_some_and(|s| s.changes() == changes) {
                    self.rows.refresh(index, rows);
                }
            }
            sweep::Event::End { file, stopped } => {
                self.sweep = None;
                if let Some(file) = file {
                    let what = if stopped { "Stopped; the frames so far are in" } else { "Written:" };
                    self.say(format!("{what} {}", file.display()));
                }
            }
            sweep::Event::Failed(why) => {
                self.sweep = None;
                self.say_bad(why);
            }
        }
    }

    /// Wishes for what is to be seen, when it is not what was wished for last.
    fn ask(&mut self) {
        let index = self.playback.frame();
        let Some(entry) = self.sequence.entries.get(index) else { return };
        let sessions = self.session.iter().chain(self.other.iter().map(|(_, s)| s));
        let setup = |s: &Session| Some(Setup { config: Arc::clone(s.config()?), changes: s.changes() });
        let setups: Vec<Setup> = sessions.filter_map(setup).collect();
        let asked = Asked {
            index,
            changes: setups.iter().map(|s| s.changes).collect(),
            look: self.settings.look,
            undistorted: self.settings.undistorted,
            touched: self.settings.shows(Layer::Touched),
            flight: self.flight,
            title: self.sequence.title.clone(),
            entries: true,
        };
        if self.asked.as_ref() == Some(&asked) {
            return;
        }
        if self.asked.as_ref().is_some_and(|a| a.changes != asked.changes) {
            self.rows.forget();
        }
        let ahead = |i: usize| Some((i, self.sequence.entries.get(i)?.clone()));
        let ask = Ask {
            index,
            entry: entry.clone(),
            setups,
            flight: asked.flight,
            look: asked.look,
            undistorted: asked.undistorted,
            touched: asked.touched,
            ahead: (index + 1..=index + AHEAD).filter_map(ahead).collect(),
            since: Instant::now(),
        };
        self.engine.ask(ask);
        self.asked = Some(asked);
    }

    /// Does what a key or a menu asks for.
    pub fn run(&mut self, command: Command, ctx: &egui::Context) {
        let count = self.sequence.len();
        match command {
            Command::Open => self.asking = Some(Asking::new(Purpose::Open, &self.sequence.folder)),
            Command::Save => self.save(),
            Command::SaveAs => {
                if let Some(session) = &self.session {
                    self.asking = Some(Asking::new(Purpose::SaveSensor, session.home()));
                }
            }
            Command::Undo => self.session.iter_mut().for_each(Session::undo),
            Command::Redo => self.session.iter_mut().for_each(Session::redo),
            Command::Reset => self.session.iter_mut().for_each(Session::reset),
            Command::Diff => self.showing_diff = !self.showing_diff,
            Command::Play => self.playback.toggle(count),
            Command::Next => self.playback.step(1, count),
            Command::Back => self.playback.step(-1, count),
            Command::Next10 => self.playback.step(10, count),
            Command::Back10 => self.playback.step(-10, count),
            Command::First => self.playback.go(0, count),
            Command::Last => self.playback.go(usize::MAX, count),
            Command::NextRefused | Command::BackRefused => self.go_refused(command == Command::BackRefused),
            Command::Worst => self.go_worst(),
            Command::Faster => self.playback.change_speed(true),
            Command::Slower => self.playback.change_speed(false),
            Command::Fit | Command::Actual | Command::ZoomIn | Command::ZoomOut => picture::zoom(self, command, ctx),
            Command::Colour => self.settings.look = Look::Colour,
            Command::Grey => self.settings.look = Look::Grey,
            Command::Level => self.settings.look = Look::Level,
            Command::Undistorted => self.settings.undistorted = !self.settings.undistorted,
            Command::Mask => picture::toggle_mask(self),
            Command::Layers => self.layers_hidden = !self.layers_hidden,
            Command::Compare => match self.other.take() {
                Some(_) => {}
                None => self.compare_with_preset(Preset::default()),
            },
            Command::ProcessAll => self.process_all(None),
            Command::Rerun => {
                if self.session.is_some() && count > 0 {
                    let name = format!("{}-again.mcap", self.sequence.title.trim_end_matches(".mcap"));
                    self.asking = Some(Asking::new(Purpose::Rerun, &self.sequence.folder.join(name)));
                }
            }
            Command::ExportPicture => {
                let name = hzn_cli::overlay::file_name(self.sight.as_ref().map_or("frame", |s| &s.name));
                let name = format!("overlay-{name}");
                self.asking = Some(Asking::new(Purpose::Picture, &self.sequence.folder.join(name)));
            }
            Command::Stages => self.settings.stages = !self.settings.stages,
            Command::Plots => self.settings.plots = !self.settings.plots,
            Command::Theme => self.settings.dark = !self.settings.dark,
            Command::Help => self.showing_help = !self.showing_help,
        }
    }

    fn save(&mut self) {
        let Some(session) = &mut self.session else { return };
        let Some(path) = session.path().map(std::path::Path::to_owned) else {
            // Out of a recording: nothing is written where nobody said.
            self.asking = Some(Asking::new(Purpose::SaveSensor, session.home()));
            return;
        };
        match session.save(&path) {
            Ok(()) => self.say(format!("Saved: {}", path.display())),
            Err(why) => self.say_bad(why),
        }
    }

    fn go_refused(&mut self, back: bool) {
        match self.rows.next_refused(self.playback.frame(), back, self.body) {
            Some(frame) => self.playback.go(frame, self.sequence.len()),
            None => self.say("No frame is without an answer, among those that were processed."),
        }
    }

    /// By error where the truth is known, else by sigma.
    fn go_worst(&mut self) {
        let known = !self.truth.is_empty();
        let badness = |_: usize, row: &hzn_mcap::Row| {
            if known {
                crate::model::rows::error_deg(row, self.truth_of(&row.file, &row.body))
            } else {
                row.sigma_max_deg
            }
        };
        let worst = self.rows.worst(self.body, badness);
        if worst.is_empty() {
            return;
        }
        // Once more goes to the next worst, as long as the one shown is that of before.
        let at = worst.iter().position(|&i| i == self.playback.frame());
        self.worst = if at == Some(self.worst) { (self.worst + 1) % worst.len() } else { 0 };
        if let Some(&frame) = worst.get(self.worst) {
            self.playback.go(frame, self.sequence.len());
        }
    }

    pub(super) fn compare_with_preset(&mut self, preset: Preset) {
        if let Some(session) = &self.session {
            self.other = Some((preset.name().to_owned(), session.under_preset(preset)));
        }
    }

    pub(super) fn compare_with_file(&mut self, path: &std::path::Path) {
        match Session::open(path) {
            Ok(session) => {
                if let Some(problem) = session.problem() {
                    self.say_bad(problem.to_string());
                    return;
                }
                let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
                self.other = Some((name, session));
            }
            Err(problem) => self.say_bad(problem.to_string()),
        }
    }

    /// All frames, for the plots or into a file.
    pub(super) fn process_all(&mut self, output: Option<PathBuf>) {
        let Some(session) = &self.session else {
            self.say("Open a sensor.toml first.");
            return;
        };
        let Some(config) = session.config().map(Arc::clone) else { return };
        match self.recording_reader() {
            Ok(pictures) => {
                let task = sweep::Task {
                    entries: self.sequence.entries.clone(),
                    inputs: self.sequence.inputs.clone(),
                    pictures,
                    config,
                    changes: session.changes(),
                    sensor_toml: session.sheet().text().to_owned(),
                    flight: self.flight,
                    output,
                };
                self.sweep = Some(Sweep::start(task, Arc::clone(&self.wake)));
            }
            Err(why) => self.say_bad(why),
        }
    }

    /// A reader of one's own for the pictures of the recording that is open.
    fn recording_reader(&self) -> Result<Option<hzn_mcap::Pictures>, String> {
        let Some(path) = &self.pictures else { return Ok(None) };
        let mut index = hzn_mcap::Index::open(path).map_err(|e| e.to_string())?;
        // Its channels are declared before the first picture.
        while index.channels() == 0 && index.next_part().map_err(|e| e.to_string())?.is_some() {}
        index.pictures().map(Some).map_err(|e| e.to_string())
    }

    /// Every frame with everything drawn over it, as a video.
    pub(super) fn export_video(&mut self, path: PathBuf) {
        let Some(config) = self.session.as_ref().and_then(|s| s.config().map(Arc::clone)) else { return };
        match self.recording_reader() {
            Ok(pictures) => {
                let entries: Vec<Entry> = self.sequence.entries.clone();
                let inputs = self.sequence.inputs.clone();
                let layers = self.settings.layers.clone();
                let fps = self.sequence.duration_s(0).filter(|d| *d > 0.0).map_or(25.0, |d| (1.0 / d).clamp(1.0, 60.0));
                self.export =
                    Some(Export::video(entries, inputs, pictures, config, self.flight, layers, fps, path, &self.wake));
            }
            Err(why) => self.say_bad(why),
        }
    }

    /// Recovers a recording that was cut off, and opens what came of it.
    pub(super) fn recover(&mut self, path: &std::path::Path) {
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let stem = name.trim_end_matches(".part").trim_end_matches(".mcap");
        let out = path.with_file_name(format!("{stem}-recovered.mcap"));
        match hzn_mcap::recover(path, &out) {
            Ok(found) => {
                self.open_paths(vec![out.clone()]);
                self.say(format!("{} frames recovered into {}", found.frames, out.display()));
            }
            Err(e) => self.say_bad(e.to_string()),
        }
    }

    /// Keeps the settings.
    pub fn close(&self) {
        if let Some(place) = &self.store {
            // Nobody is there any more to hear of it.
            let _ = self.settings.store(place);
        }
    }
}
