//! The thread that looks: it takes the newest wish, forgets older ones, and answers with a [`FrameView`]. While nothing
//! is wished for it decodes the frames that will come next.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Instant;

use crossbeam_channel::{Receiver, Sender, unbounded};
use hzn_core::Config;
use hzn_core::camera::Camera;
use hzn_core::config::{Input, Orient};
use hzn_run::engine::AnySensor;
use hzn_run::source::Picture;
use hzn_run::source::picture::Samples;

use super::Wake;
use super::frame_view::{self, FrameInput, FrameView, Outcome, Shown};
use super::paint::{self, Recipe, Warp};
use super::store::Store;
use crate::model::{Entry, Look, Plane, plane::Pinhole};

/// A configuration, with a number that tells versions apart.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The configuration.
    pub config: Arc<Config>,
    /// Its version.
    pub changes: u64,
}

/// What is to be seen.
#[derive(Debug, Clone)]
pub struct Ask {
    /// The frame's place in the sequence.
    pub index: usize,
    /// The frame.
    pub entry: Entry,
    /// The session, and what it is compared with.
    pub setups: Vec<Setup>,
    /// Single precision and 2048 points, as on the flight computer.
    pub flight: bool,
    /// How the picture is shown.
    pub look: Look,
    /// Without the lens's distortion.
    pub undistorted: bool,
    /// Pixels that were read are wanted.
    pub touched: bool,
    /// Frames that will be asked for next.
    pub ahead: Vec<(usize, Entry)>,
    /// When it was wished for.
    pub since: Instant,
}

enum Message {
    Open(Vec<std::path::PathBuf>),
    Recording(hzn_mcap::Pictures),
    Look(Box<Ask>),
}

/// The thread, from outside. It ends when this is dropped.
pub struct Engine {
    send: Sender<Message>,
    receive: Receiver<FrameView>,
}

impl Engine {
    /// Starts the thread.
    pub fn start(wake: Wake) -> Self {
        let (send, messages) = unbounded();
        let (sights, receive) = unbounded();
        std::thread::spawn(move || Looker::default().run(&messages, &sights, &wake));
        Self { send, receive }
    }
    /// Another sequence.
    pub fn open(&self, inputs: Vec<std::path::PathBuf>) {
        let _ = self.send.send(Message::Open(inputs));
    }
    /// How pictures of the recording are read.
    pub fn recording(&self, pictures: hzn_mcap::Pictures) {
        let _ = self.send.send(Message::Recording(pictures));
    }
    /// Wishes to see a frame; wishes of before that have not been met are forgotten.
    pub fn ask(&self, ask: Ask) {
        let _ = self.send.send(Message::Look(Box::new(ask)));
    }
    /// The newest answer that has come since the last call, with those before it.
    pub fn answers(&self) -> impl Iterator<Item = FrameView> {
        self.receive.try_iter()
    }
    /// Waits for an answer; `None` when the time is up.
    pub fn wait(&self, limit: std::time::Duration) -> Option<FrameView> {
        self.receive.recv_timeout(limit).ok()
    }
}

#[derive(Default)]
struct Looker {
    store: Store,
    sensors: Vec<(Arc<Config>, bool, AnySensor)>,
    warp: Warp,
    shown: Option<Arc<Shown>>,
    ahead: VecDeque<(usize, Entry)>,
}

/// The picture with as many bits as the sensor says, and turned as it says.
fn told(picture: Arc<Picture>, input: &Input) -> Result<Arc<Picture>, String> {
    match (&picture.samples, input.bits) {
        (Samples::Words(_), Some(bits)) if bits != picture.layout.bits => {
            Picture::clone(&picture).with_input(input).map(Arc::new)
        }
        _ if picture.is_turned(input) => Picture::clone(&picture).with_input(input).map(Arc::new),
        _ => Ok(picture),
    }
}

impl Looker {
    fn run(&mut self, messages: &Receiver<Message>, sights: &Sender<FrameView>, wake: &Wake) {
        loop {
            let mut newest = None;
            // Wait only when there is nothing to decode beforehand.
            let first = if self.ahead.is_empty() { messages.recv().map_err(drop) } else { Err(()) };
            if first.is_err() && self.ahead.is_empty() {
                return;
            }
            for message in first.into_iter().chain(messages.try_iter()) {
                match message {
                    Message::Open(inputs) => {
                        self.store.open(inputs);
                        (self.shown, newest) = (None, None);
                        self.ahead.clear();
                    }
                    Message::Recording(pictures) => self.store.recording(pictures),
                    Message::Look(ask) => newest = Some(ask),
                }
            }
            match newest {
                Some(ask) => {
                    let sight = self.look(&ask);
                    self.ahead = ask.ahead.into();
                    if sights.send(sight).is_err() {
                        return;
                    }
                    wake();
                }
                None => {
                    if let Some((index, entry)) = self.ahead.pop_front()
                        && !self.store.has(index)
                    {
                        let _ = self.store.get(index, &entry.place);
                    }
                }
            }
        }
    }

    fn look(&mut self, ask: &Ask) -> FrameView {
        let begin = Instant::now();
        let at_hand = self.store.has(ask.index);
        let picture = self.store.get(ask.index, &ask.entry.place).and_then(|p| match ask.setups.first() {
            Some(setup) => told(p, &setup.config.input),
            None => Ok(p),
        });
        let decoding = (!at_hand).then(|| begin.elapsed());
        let mut sight = FrameView {
            index: ask.index,
            name: ask.entry.name.clone(),
            time_s: ask.entry.time_s,
            data: ask.entry.data.clone(),
            picture: picture.clone(),
            image: None,
            camera: None,
            answers: Vec::new(),
            changes: ask.setups.first().map_or(0, |s| s.changes),
            decoding,
            latency: ask.since.elapsed(),
        };
        let Ok(picture) = picture else { return sight };
        let subject = FrameInput {
            index: ask.index,
            name: &ask.entry.name,
            time_s: ask.entry.time_s,
            data: ask.entry.data.as_ref(),
            picture: &picture,
        };
        self.sensors.truncate(ask.setups.len());
        for (which, setup) in ask.setups.iter().enumerate() {
            let outcome = match self.sensor(which, setup, ask.flight) {
                Ok((camera, sensor)) => {
                    if which == 0 {
                        sight.camera = Some(camera);
                    }
                    frame_view::look(subject, &setup.config, sensor, ask.touched && which == 0)
                }
                Err(why) => Outcome {
                    config: Arc::clone(&setup.config),
                    bodies: Vec::new(),
                    refused: Some(why),
                    touched: None,
                    touched_pixels: None,
                },
            };
            sight.answers.push(Arc::new(outcome));
        }
        sight.image = Some(self.show(ask, &picture, &sight));
        sight.latency = ask.since.elapsed();
        sight
    }

    /// The sensor number `which`, with this configuration.
    fn sensor(
        &mut self,
        which: usize,
        setup: &Setup,
        flight: bool,
    ) -> Result<(Arc<Camera<f64>>, &mut AnySensor), String> {
        match self.sensors.get_mut(which).filter(|(_, own, _)| *own == flight) {
            // A sensor that tracks the level remembers the frame before, which may be any one here: it begins anew.
            Some((config, _, sensor)) if *config != setup.config || config.tracks() => {
                sensor.reconfigure(&setup.config).map_err(|e| e.to_string())?;
                *config = Arc::clone(&setup.config);
            }
            Some(_) => {}
            None => {
                let sensor = AnySensor::new(&setup.config, flight).map_err(|e| e.to_string())?;
                self.sensors.truncate(which);
                self.sensors.push((Arc::clone(&setup.config), flight, sensor));
            }
        }
        match self.sensors.get_mut(which) {
            Some((.., sensor)) => Ok((Arc::new(sensor.camera().clone()), sensor)),
            None => Err("the sensor before it could not be made".into()),
        }
    }

    /// The picture for the screen, painted only when it is another one.
    fn show(&mut self, ask: &Ask, picture: &hzn_run::source::Picture, sight: &FrameView) -> Arc<Shown> {
        let config = ask.setups.first().map(|s| &s.config);
        let camera = sight.camera.as_deref();
        let plane = match camera {
            Some(camera) if ask.undistorted => Plane::Pinhole(Pinhole::new(camera)),
            _ => Plane::Camera,
        };
        let reached = || sight.answers.first()?.bodies.first()?.row.level;
        // Only what is painted counts: another level is no other picture in colour.
        let level = if ask.look == Look::Level { reached().unwrap_or(0) } else { 0 };
        let channel = match config {
            Some(config) if ask.look != Look::Colour => config.input.channel,
            _ => hzn_core::image::Channel::Mean,
        };
        let orient = config.map_or(Orient::AsStored, |config| config.input.orient);
        let recipe = Recipe { look: ask.look, level, channel, orient, plane };
        let of = (ask.index, recipe);
        if let Some(shown) = self.shown.as_ref().filter(|s| s.of == of) {
            return Arc::clone(shown);
        }
        let lens = config.zip(camera).map(|(config, camera)| (&config.camera, camera));
        let image = paint::paint(picture, &of.1, lens, &mut self.warp);
        let shown = Arc::new(Shown { of, image: Arc::new(image) });
        self.shown = Some(Arc::clone(&shown));
        shown
    }
}
