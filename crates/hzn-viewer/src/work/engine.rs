//! The thread that processes the shown picture. It takes the newest request, drops older ones, and answers with a
//! [`FrameView`]. Without a request it decodes the pictures that come next.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use crossbeam_channel::{Receiver, Sender, unbounded};
use hzn_core::Config;
use hzn_core::camera::Camera;
use hzn_core::config::{Input, Orient};
use hzn_core::image::Channel;
use hzn_run::engine::AnySensor;
use hzn_run::source::Picture;
use hzn_run::source::picture::Samples;

use super::Wake;
use super::frame_view::{FrameInput, FrameView, Outcome, Shown, process_frame};
use super::paint::{self, Recipe, Tone, Warp};
use super::store::Store;
use super::trials::Trials;
use crate::model::{Contrast, Entry, Histogram, Look, Plane, plane::Pinhole};

/// A configuration with its version number.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The configuration.
    pub config: Arc<Config>,
    /// Version number of the configuration.
    pub version: u64,
}

/// Request to process and show a picture.
#[derive(Debug, Clone)]
pub struct FrameRequest {
    /// Index of the picture in the sequence.
    pub index: usize,
    /// The picture.
    pub entry: Entry,
    /// Configuration of the session, and the one that it is compared with.
    pub setups: Vec<Setup>,
    /// Single precision and at most 2048 points, as `FlightHorizon` has.
    pub flight: bool,
    /// Display of the picture.
    pub look: Look,
    /// Range of brightness that is shown, and the exponent of the display.
    pub contrast: (Contrast, f32),
    /// The picture is shown without the distortion of the lens.
    pub undistorted: bool,
    /// The answer has to list the pixels that were read.
    pub touched: bool,
    /// Pictures that are likely to be requested next.
    pub ahead: Vec<(usize, Entry)>,
    /// Time of the request.
    pub since: Instant,
}

enum Message {
    Open(Vec<std::path::PathBuf>),
    Recording(hzn_mcap::Pictures),
    Request(Box<FrameRequest>),
    Renumbered,
}

/// Handle of the thread. The thread ends when the handle is dropped.
pub struct Engine {
    send: Sender<Message>,
    receive: Receiver<FrameView>,
    is_awaited: Awaited,
}

/// True while the window waits for an answer, so that it need not be woken. The lock is held while an answer is sent,
/// so the window cannot have the answer before the thread knows whether to wake it.
#[derive(Clone, Default)]
struct Awaited(Arc<Mutex<bool>>);

impl Awaited {
    fn set(&self, is_awaited: bool) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = is_awaited;
    }
    /// Calls `send` and returns true if the window waited for it.
    fn during<T>(&self, send: impl FnOnce() -> T) -> (bool, T) {
        let is_awaited = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        (*is_awaited, send())
    }
}

impl Engine {
    /// Starts the thread.
    pub fn start(wake: Wake) -> Self {
        let (send, messages) = unbounded();
        let (frame_views, receive) = unbounded();
        let is_awaited = Awaited::default();
        let awaited = is_awaited.clone();
        std::thread::spawn(move || {
            Worker::default().run(&messages, |frame_view| {
                let (is_awaited, sent) = awaited.during(|| frame_views.send(frame_view).is_ok());
                // An answer to a window that waits does not make it draw once more.
                if !is_awaited {
                    wake();
                }
                sent
            });
        });
        Self { send, receive, is_awaited }
    }
    /// Starts another sequence.
    pub fn open(&self, inputs: Vec<std::path::PathBuf>) {
        let _ = self.send.send(Message::Open(inputs));
    }
    /// Sets the reader for the pictures of the recording.
    pub fn set_recording(&self, pictures: hzn_mcap::Pictures) {
        let _ = self.send.send(Message::Recording(pictures));
    }
    /// Tells that the pictures have other numbers now, so that nothing that is kept belongs to its number.
    pub fn renumber(&self) {
        let _ = self.send.send(Message::Renumbered);
    }
    /// Requests a picture. Earlier requests that have not been answered are dropped.
    pub fn request(&self, request: FrameRequest) {
        let _ = self.send.send(Message::Request(Box::new(request)));
    }
    /// Returns the answers that have come since the last call, the newest last.
    pub fn answers(&self) -> impl Iterator<Item = FrameView> {
        self.receive.try_iter()
    }
    /// Waits for an answer; returns `None` when the time is up.
    pub fn wait(&self, limit: std::time::Duration) -> Option<FrameView> {
        self.is_awaited.set(true);
        let answer = self.receive.recv_timeout(limit).ok();
        self.is_awaited.set(false);
        // An answer that came between the two lines above has not woken the window.
        answer.or_else(|| self.receive.try_recv().ok())
    }
}

#[derive(Default)]
struct Worker {
    store: Store,
    sensors: Vec<(Arc<Config>, bool, AnySensor)>,
    warp: Warp,
    /// Trials with the session's configuration.
    trials: Option<(Arc<Config>, bool, Trials)>,
    /// Histogram of a picture, by index and channel.
    histogram: Option<(usize, Channel, Arc<Histogram>)>,
    shown: Option<Arc<Shown>>,
    ahead: VecDeque<(usize, Entry)>,
}

/// Returns the picture with the number of bits and the orientation that `input` names.
pub(super) fn with_input(picture: Arc<Picture>, input: &Input) -> Result<Arc<Picture>, String> {
    match (&picture.samples, input.bits) {
        (Samples::Words(_), Some(bits)) if bits != picture.layout.bits => {
            Picture::clone(&picture).with_input(input).map(Arc::new)
        }
        _ if picture.is_changed(input) => Picture::clone(&picture).with_input(input).map(Arc::new),
        _ => Ok(picture),
    }
}

impl Worker {
    /// Answers the requests with `answer`, until it returns false or nobody can request any more.
    fn run(&mut self, messages: &Receiver<Message>, answer: impl Fn(FrameView) -> bool) {
        loop {
            let mut newest = None;
            // The thread waits only if there is nothing to decode in advance.
            let first = if self.ahead.is_empty() { messages.recv().map_err(drop) } else { Err(()) };
            if first.is_err() && self.ahead.is_empty() {
                return;
            }
            for message in first.into_iter().chain(messages.try_iter()) {
                match message {
                    Message::Open(inputs) => {
                        self.store.open(inputs);
                        (self.shown, self.histogram, newest) = (None, None, None);
                        self.ahead.clear();
                    }
                    Message::Recording(pictures) => self.store.set_recording(pictures),
                    Message::Renumbered => {
                        self.store.forget();
                        (self.shown, self.histogram, newest) = (None, None, None);
                        self.ahead.clear();
                    }
                    Message::Request(request) => newest = Some(request),
                }
            }
            match newest {
                Some(request) => {
                    let frame_view = self.process(&request);
                    self.ahead = request.ahead.into();
                    if !answer(frame_view) {
                        return;
                    }
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

    fn process(&mut self, request: &FrameRequest) -> FrameView {
        let begin = Instant::now();
        let is_cached = self.store.has(request.index);
        let picture = self.store.get(request.index, &request.entry.place).and_then(|p| match request.setups.first() {
            Some(setup) => with_input(p, &setup.config.input),
            None => Ok(p),
        });
        let decoding = (!is_cached).then(|| begin.elapsed());
        let mut frame_view = FrameView {
            index: request.index,
            name: request.entry.name.clone(),
            time_s: request.entry.time_s,
            data: request.entry.data.clone(),
            picture: picture.clone(),
            image: None,
            camera: None,
            histogram: None,
            answers: Vec::new(),
            version: request.setups.first().map_or(0, |s| s.version),
            decoding,
            grid: Arc::default(),
            latency: request.since.elapsed(),
        };
        let Ok(picture) = picture else { return frame_view };
        let input = FrameInput::of_entry(request.index, &request.entry, &picture);
        self.sensors.truncate(request.setups.len());
        for (index, setup) in request.setups.iter().enumerate() {
            let touched = request.touched && index == 0;
            let mut trials = if index == 0 { self.take_trials(setup, request.flight) } else { None };
            let outcome = match self.sensor(index, setup, request.flight) {
                Ok((camera, sensor)) => {
                    if index == 0 {
                        frame_view.camera = Some(camera);
                    }
                    process_frame(input, &setup.config, sensor, touched, trials.as_mut().map(|(.., t)| t))
                }
                Err(why) => Outcome { refused: Some(why), ..Outcome::new(&setup.config) },
            };
            if index == 0 {
                self.trials = trials;
            }
            frame_view.answers.push(Arc::new(outcome));
        }
        frame_view.histogram = self.histogram(request, &picture);
        frame_view.image = Some(self.show(request, &picture, &frame_view));
        frame_view.latency = request.since.elapsed();
        frame_view
    }

    /// Returns the camera and the sensor number `index` with this configuration.
    fn sensor(
        &mut self,
        index: usize,
        setup: &Setup,
        flight: bool,
    ) -> Result<(Arc<Camera<f64>>, &mut AnySensor), String> {
        match self.sensors.get_mut(index).filter(|(_, is_flight, _)| *is_flight == flight) {
            // A sensor that tracks the threshold remembers the picture before, which may be any picture here. So it
            // starts anew.
            Some((config, _, sensor)) if *config != setup.config || config.tracks() => {
                sensor.reconfigure(&setup.config).map_err(|e| e.to_string())?;
                *config = Arc::clone(&setup.config);
            }
            Some(_) => {}
            None => {
                let sensor = AnySensor::new(&setup.config, flight).map_err(|e| e.to_string())?;
                self.sensors.truncate(index);
                self.sensors.push((Arc::clone(&setup.config), flight, sensor));
            }
        }
        match self.sensors.get_mut(index) {
            Some((.., sensor)) => Ok((Arc::new(sensor.camera().clone()), sensor)),
            None => Err("the sensor of the session could not be made".into()),
        }
    }

    /// Takes the trials out, with the configuration of the session.
    fn take_trials(&mut self, setup: &Setup, flight: bool) -> Option<(Arc<Config>, bool, Trials)> {
        match self.trials.take().filter(|(_, is_flight, _)| *is_flight == flight) {
            Some(trials) if trials.0 == setup.config => Some(trials),
            Some((_, _, mut trials)) => {
                trials.reconfigure(&setup.config, flight).ok()?;
                Some((Arc::clone(&setup.config), flight, trials))
            }
            None => Some((Arc::clone(&setup.config), flight, Trials::new(&setup.config, flight)?)),
        }
    }

    /// Returns the histogram of a picture. It is counted once.
    fn histogram(&mut self, request: &FrameRequest, picture: &Picture) -> Option<Arc<Histogram>> {
        let channel = request.setups.first().map(|s| s.config.input.channel).unwrap_or_default();
        match &self.histogram {
            Some((index, of, histogram)) if (*index, *of) == (request.index, channel) => Some(Arc::clone(histogram)),
            _ => {
                let histogram = Arc::new(Histogram::of_view(&picture.view(channel).ok()?));
                self.histogram = Some((request.index, channel, Arc::clone(&histogram)));
                Some(histogram)
            }
        }
    }

    /// Returns the picture for the screen. It is painted only if something that it depends on has changed.
    fn show(
        &mut self,
        request: &FrameRequest,
        picture: &hzn_run::source::Picture,
        frame_view: &FrameView,
    ) -> Arc<Shown> {
        let config = request.setups.first().map(|s| &s.config);
        let camera = frame_view.camera.as_deref();
        let plane = match camera {
            Some(camera) if request.undistorted => Plane::Pinhole(Pinhole::new(camera)),
            _ => Plane::Camera,
        };
        let reached = || frame_view.answers.first()?.bodies.first()?.row.level;
        // Only painted properties count: in colour, another threshold does not change the picture.
        let level = if request.look == Look::Level { reached().unwrap_or(0) } else { 0 };
        let channel = match config {
            Some(config) if request.look != Look::Colour => config.input.channel,
            _ => hzn_core::image::Channel::Mean,
        };
        let bits = picture.layout.bits;
        let full = ((1u32 << bits.clamp(1, 16)) - 1) as u16;
        let stretch = frame_view.histogram.as_ref().filter(|_| request.contrast.0.stretches(bits));
        let [low, high] = stretch.map_or([0, full], |h| h.stretch);
        let tone = if request.look == Look::Level {
            Tone::plain(full)
        } else {
            Tone { low, high: high.max(low.saturating_add(1)), gamma: request.contrast.1 }
        };
        let orient = config.map_or(Orient::AsStored, |config| config.input.orient);
        let invert = config.is_some_and(|config| config.input.invert);
        let recipe = Recipe { look: request.look, level, tone, channel, orient, invert, plane };
        let key = (request.index, recipe);
        if let Some(shown) = self.shown.as_ref().filter(|s| s.key == key) {
            return Arc::clone(shown);
        }
        let lens = config.zip(camera).map(|(config, camera)| (&config.camera, camera));
        let image = paint::paint(picture, &key.1, lens, &mut self.warp);
        let shown = Arc::new(Shown { key, image: Arc::new(image) });
        self.shown = Some(Arc::clone(&shown));
        shown
    }
}
