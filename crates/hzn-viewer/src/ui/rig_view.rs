//! The state of the window on a rig.

use std::path::PathBuf;

use egui::{TextureHandle, TextureOptions};
use hzn_core::status::Status;
use hzn_mcap::Row;

use crate::model::view::Point;
use crate::work::rig::{Epoch, Event, Head, HeadAnswer, Painted, RigRun};

/// A picture on the graphics card, with the limb in pixels.
pub(super) struct Shown {
    pub(super) texture: TextureHandle,
    pub(super) limb: Vec<Vec<Point>>,
}

/// What an epoch does with a head.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Use {
    /// The joint answer contains it.
    Used,
    /// The check excluded it.
    Excluded,
    /// It has an answer that is not joined with others.
    Alone,
    /// It has no answer.
    Nothing,
}

impl Use {
    /// Every use, in the order of a legend.
    pub(super) const ALL: [Self; 4] = [Self::Used, Self::Excluded, Self::Alone, Self::Nothing];

    fn of(head: &Head, answer: Option<&HeadAnswer>, joint: &Row) -> Self {
        let has = |names: &Option<String>| names.as_ref().is_some_and(|all| all.split(' ').any(|one| one == head.name));
        match (has(&joint.heads_excluded), has(&joint.heads_used)) {
            (true, _) => Self::Excluded,
            (_, true) => Self::Used,
            _ if answer.is_some_and(|answer| answer.status == Status::Ok) => Self::Alone,
            _ => Self::Nothing,
        }
    }
    /// Returns the words on the screen.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Used => "used",
            Self::Excluded => "excluded",
            Self::Alone => "answer, not joined",
            Self::Nothing => "no answer",
        }
    }
}

/// The window on a rig.
pub(super) struct RigView {
    run: RigRun,
    pub(super) path: PathBuf,
    pub(super) heads: Vec<Head>,
    pub(super) epochs: Vec<Epoch>,
    /// What each epoch does with each head.
    uses: Vec<Vec<Use>>,
    /// The number of the shown epoch.
    pub(super) epoch: usize,
    /// The epoch whose pictures were asked for.
    asked: Option<usize>,
    /// The epoch whose pictures are here.
    pub(super) shown: Option<usize>,
    pub(super) pictures: Vec<Option<Result<Shown, String>>>,
    pub(super) is_complete: bool,
    /// From where the globe is seen: the azimuth and the elevation of the eye in the axes of the vehicle, rad.
    pub(super) eye_rad: [f32; 2],
}

impl RigView {
    pub(super) fn new(run: RigRun, path: PathBuf) -> Self {
        Self {
            run,
            path,
            heads: Vec::new(),
            epochs: Vec::new(),
            uses: Vec::new(),
            epoch: 0,
            asked: None,
            shown: None,
            pictures: Vec::new(),
            is_complete: false,
            eye_rad: [0.6, 0.5],
        }
    }

    /// Goes to an epoch, at most to the last one.
    pub(super) fn go(&mut self, epoch: usize) {
        self.epoch = epoch.min(self.epochs.len().saturating_sub(1));
    }

    /// Returns what an epoch does with a head.
    pub(super) fn used(&self, epoch: usize, head: usize) -> Use {
        self.uses.get(epoch).and_then(|heads| heads.get(head)).copied().unwrap_or(Use::Nothing)
    }

    /// Takes the events of the threads. Returns the messages, each with whether it is a problem.
    pub(super) fn poll(&mut self, ctx: &egui::Context) -> Vec<(String, bool)> {
        let mut messages = Vec::new();
        for event in self.run.events() {
            match event {
                Event::Opened(heads, warnings) => {
                    self.heads = heads;
                    messages.extend(warnings.into_iter().map(|text| (text, false)));
                }
                Event::Epoch(epoch) => {
                    let each = self.heads.iter().zip(&epoch.heads);
                    self.uses.push(each.map(|(head, own)| Use::of(head, own.as_ref(), &epoch.joint)).collect());
                    self.epochs.push(*epoch);
                }
                Event::End => self.is_complete = true,
                Event::Failed(why) => {
                    self.is_complete = true;
                    messages.push((why, true));
                }
            }
        }
        if let Some(epoch) = self.epochs.get(self.epoch).filter(|_| self.asked != Some(self.epoch)) {
            self.run.show(self.epoch, &self.heads, epoch);
            self.asked = Some(self.epoch);
        }
        if let Some((epoch, pictures)) = self.run.painted() {
            let upload = |(n, picture): (usize, Option<Result<Painted, String>>)| {
                Some(picture?.map(|painted| {
                    let texture = ctx.load_texture(format!("head {n}"), painted.image, TextureOptions::LINEAR);
                    Shown { texture, limb: painted.limb }
                }))
            };
            self.pictures = pictures.into_iter().enumerate().map(upload).collect();
            self.shown = Some(epoch);
        }
        messages
    }
}
