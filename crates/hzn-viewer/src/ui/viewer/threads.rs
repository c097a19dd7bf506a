//! Messages between the window and its threads.

use std::sync::Arc;
use std::time::Instant;

use super::{AHEAD, AT_ONCE, Message, Viewer};
use crate::model::settings::Layer;
use crate::model::{Look, Place, ResultHistory, Sequence, Session, View};
use crate::ui::dialogs;
use crate::work::open;
use crate::work::sweep::{self, Sweep};
use crate::work::{Ask, FrameView, Setup};

/// The last request. An equal request is not sent again.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Asked {
    index: usize,
    changes: Vec<u64>,
    look: Look,
    undistorted: bool,
    touched: bool,
    flight: bool,
    title: String,
}

impl Viewer {
    /// Takes all messages of the threads.
    pub(super) fn poll(&mut self, ctx: &egui::Context) {
        let opening: Vec<open::Event> = self.opening.iter().flat_map(|r| r.try_iter()).collect();
        for event in opening {
            self.opened(event);
        }
        let sights: Vec<FrameView> = self.engine.answers().collect();
        for sight in sights {
            self.see(sight);
        }
        self.textures.take(self.sight.as_ref(), ctx);
        let swept = self.sweep.as_mut().map(Sweep::events).unwrap_or_default();
        for event in swept {
            self.swept(event);
        }
        self.ended();
        dialogs::poll(self);
    }

    /// Waits a short time for the answer to the last request. A slow answer comes with a later frame of the window.
    pub(super) fn wait(&mut self, ctx: &egui::Context) {
        let until = self.asked_at + AT_ONCE;
        let mut new = false;
        while !self.is_settled() && self.asked.is_some() {
            let Some(sight) = self.engine.wait(until.saturating_duration_since(Instant::now())) else { break };
            self.see(sight);
            new = true;
        }
        if new {
            self.textures.take(self.sight.as_ref(), ctx);
            // The columns were drawn before the answer came, so they are drawn again.
            ctx.request_repaint();
        }
    }

    /// Takes over a processed picture.
    fn see(&mut self, sight: FrameView) {
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
                (self.rows, self.truth) = (ResultHistory::default(), opened.truth);
                (self.sight, self.asked, self.sweep, self.mask) = (None, None, None, None);
                (self.worst, self.body) = (0, 0);
                self.view = View::FIT;
                // Messages about the previous sequence are removed; newer messages stay.
                self.messages.drain(..self.said_before.min(self.messages.len()));
                self.playback.go(self.request.frame, usize::MAX);
                self.engine.open(self.request.inputs.clone());
                // A sensor that the user opened stays if the new pictures come without one.
                match opened.sensor {
                    Some(s) => self.session = Some(Session::new(&s.text, &s.home, s.is_file)),
                    None if self.session.is_none() => self.say(
                        "There is no sensor.toml, so the pictures are shown but not processed. Open one, or drop it \
                         on the window; `hzn init` writes a first one.",
                    ),
                    None => {}
                }
                for note in opened.notes {
                    self.say(note);
                }
            }
            open::Event::Pictures(pictures) => {
                self.engine.recording(pictures);
                self.sequence.recording = self.request.inputs.first().cloned();
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
                        text: "This recording was not closed: its run was interrupted, or the file was cut off. All \
                               complete frames are shown."
                            .into(),
                        bad: true,
                        recover: path,
                    });
                }
                if self.sequence.is_empty() {
                    self.say_bad(format!("{}: contains no picture", self.sequence.title));
                } else if self.sequence.entries.iter().all(|e| e.place == Place::Nowhere) {
                    self.say(
                        "This recording was made without pictures (--no-images): the window shows its results, but \
                         cannot process the pictures again.",
                    );
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
                match file {
                    Some(_) if stopped => self.say("Processing was stopped; no file was written."),
                    Some(file) => self.say(format!("Written: {}", file.display())),
                    None => {}
                }
            }
            sweep::Event::Failed(why) => {
                self.sweep = None;
                self.say_bad(why);
            }
        }
    }

    /// Requests the picture to show, unless the last request was the same.
    pub(super) fn ask(&mut self) {
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
        (self.asked, self.asked_at) = (Some(asked), ask.since);
        self.engine.ask(ask);
    }
}
