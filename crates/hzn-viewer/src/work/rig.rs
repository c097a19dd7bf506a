//! The run over the heads of a rig, and the pictures of the shown epoch.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crossbeam_channel::{Receiver, Sender, unbounded};
use egui::ColorImage;
use hzn_core::camera::Camera;
use hzn_core::rig::Mount;
use hzn_core::status::Status;
use hzn_core::{Config, Solution};
use hzn_files::FrameData;
use hzn_mcap::Row;
use hzn_run::engine::{AnySensor, Finished, Plan, Turns};
use hzn_run::overlay;
use hzn_run::rig::{self, Epochs, FinishedEpoch, HeadPlan, Opened, Request};
use hzn_run::source::Payload;

use super::Wake;
use crate::model::view::Point;

/// A head of the rig.
#[derive(Debug, Clone)]
pub struct Head {
    /// Its name.
    pub name: String,
    /// Its lens.
    pub camera: Camera<f64>,
    /// Its attitude on the vehicle, scalar first.
    pub q_vehicle_from_camera_wxyz: [f64; 4],
    /// Its sensor.
    config: Arc<Config>,
    /// Where its pictures lie.
    pictures: PathBuf,
}

/// The picture of a head in an epoch.
#[derive(Debug, Clone)]
pub struct HeadAnswer {
    /// Name of the picture.
    pub name: String,
    /// Status of the picture.
    pub status: Status,
    /// The answer of the head about its first body.
    pub solution: Option<Box<Solution<f64>>>,
    /// What was known of the picture.
    data: Option<Box<FrameData>>,
}

/// An epoch: the joint answer, and the pictures of the heads in the order of rig.toml.
#[derive(Debug, Clone)]
pub struct Epoch {
    /// The joint answer.
    pub joint: Row,
    /// The pictures; `None` for a head without one.
    pub heads: Vec<Option<HeadAnswer>>,
}

/// An event of the run.
#[derive(Debug)]
pub enum Event {
    /// The files are open: the heads, and what looks wrong.
    Opened(Vec<Head>, Vec<String>),
    /// An epoch is processed.
    Epoch(Box<Epoch>),
    /// All epochs are processed.
    End,
    /// The rig cannot be opened or processed, for this reason.
    Failed(String),
}

/// A picture for the screen, with the limb of its head's answer.
#[derive(Debug, Clone)]
pub struct Painted {
    /// The pixels, stretched to their range of brightness.
    pub image: Arc<ColorImage>,
    /// The limb as lines in pixels.
    pub limb: Vec<Vec<Point>>,
}

/// The pictures of an epoch, or the reasons why they cannot be shown.
pub type Pictures = (usize, Vec<Option<Result<Painted, String>>>);

/// A run in progress. It stops when the handle is dropped.
pub struct RigRun {
    stop: Arc<AtomicBool>,
    events: Receiver<Event>,
    wanted: Sender<(usize, Vec<Head>, Epoch)>,
    painted: Receiver<Pictures>,
}

impl RigRun {
    /// Begins to process the epochs of a rig.toml.
    pub fn start(path: PathBuf, flight: bool, wake: Wake) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let (send, events) = unbounded();
        let (flag, wake_run) = (Arc::clone(&stop), Arc::clone(&wake));
        std::thread::spawn(move || {
            let last = run(&path, flight, &flag, &send, &wake_run).map_or_else(Event::Failed, |()| Event::End);
            let _ = send.send(last);
            wake_run();
        });
        let (wanted, requests) = unbounded::<(usize, Vec<Head>, Epoch)>();
        let (send, painted) = unbounded();
        std::thread::spawn(move || {
            while let Ok(first) = requests.recv() {
                // Only the newest epoch is on the screen.
                let (index, heads, epoch) = requests.try_iter().last().unwrap_or(first);
                let paint = |(head, answer): (&Head, &Option<HeadAnswer>)| Some(paint(head, answer.as_ref()?));
                let pictures = heads.iter().zip(&epoch.heads).map(paint).collect();
                if send.send((index, pictures)).is_err() {
                    break;
                }
                wake();
            }
        });
        Self { stop, events, wanted, painted }
    }
    /// Asks for the pictures of an epoch.
    pub fn show(&self, index: usize, heads: &[Head], epoch: &Epoch) {
        let _ = self.wanted.send((index, heads.to_vec(), epoch.clone()));
    }
    /// Returns the events since the last call.
    pub fn events(&self) -> Vec<Event> {
        self.events.try_iter().collect()
    }
    /// Returns the newest pictures since the last call.
    pub fn painted(&self) -> Option<Pictures> {
        self.painted.try_iter().last()
    }
}

impl Drop for RigRun {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

fn run(path: &Path, flight: bool, stop: &AtomicBool, send: &Sender<Event>, wake: &Wake) -> Result<(), String> {
    let request = Request { rig: path.to_owned(), flight, ..Request::default() };
    let opened = rig::open(&request).map_err(|e| e.to_string())?;
    let heads = heads(&opened, path.parent().unwrap_or(Path::new("")))?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let plans: Vec<HeadPlan> = opened.heads.iter().map(|head| head_plan(head, flight, cores)).collect();
    // One core is left for the window, if there are several.
    let threads = plans.iter().map(|head| head.plan.threads).min().unwrap_or(1);
    let joiner = opened.joiner().map_err(|e| e.to_string())?;
    let plan = rig::Plan { heads: plans, joiner, threads, keep_pictures: false };
    let _ = send.send(Event::Opened(heads, opened.warnings));
    wake();
    let mut epochs = Epochs::new(opened.heads, opened.rig.rig.sync_s).map_err(|e| e.to_string())?;
    let mut seen = |epoch: &FinishedEpoch| {
        let heads = epoch.heads.iter().map(|frame| frame.as_ref().map(head_answer)).collect();
        let _ = send.send(Event::Epoch(Box::new(Epoch { joint: epoch.joint.clone(), heads })));
        wake();
    };
    rig::look(&plan, &mut epochs, stop, &mut seen).map_err(|e| e.to_string()).map(|_| ())
}

fn head_plan(head: &rig::OpenHead, flight: bool, cores: usize) -> HeadPlan {
    let config = head.sensor.config.clone();
    let threads = if config.tracks() { 1 } else { cores.saturating_sub(1).max(1) };
    let plan = Plan {
        config,
        flight,
        threads,
        frames: None,
        fps: 1.0,
        trace: false,
        keep_traces: false,
        // A picture that repeats the one before it is found by its bytes.
        keep_picture: true,
        overlay: None,
        masks: None,
        last: Vec::new(),
        turns: Turns::default(),
    };
    HeadPlan { name: head.name.clone(), plan }
}

fn heads(opened: &Opened, folder: &Path) -> Result<Vec<Head>, String> {
    let each = opened.rig.heads.iter().zip(&opened.heads);
    let head = |(file, open): (&hzn_files::rig::Head, &rig::OpenHead)| {
        let mount = file.mount.as_ref().and_then(|mount| {
            let rig = opened.rig.rig.mount.q_vehicle_from_rig_wxyz;
            Mount::new(rig, mount.q_rig_from_camera_wxyz, &mount.covariance_rad2())
        });
        let mount = mount.ok_or_else(|| format!("{}: [head.mount] is missing", file.name))?;
        Ok(Head {
            name: file.name.clone(),
            camera: Camera::try_new(&open.sensor.config.camera).map_err(|e| format!("{}: {e}", file.name))?,
            q_vehicle_from_camera_wxyz: mount.q_vehicle_from_camera_wxyz(),
            config: Arc::new(open.sensor.config.clone()),
            pictures: folder.join(&file.pictures),
        })
    };
    each.map(head).collect()
}

fn head_answer(frame: &Finished) -> HeadAnswer {
    let outcome = frame.outcomes.first();
    let solution = outcome.and_then(|o| o.report.as_ref().ok()).and_then(|report| report.solution);
    HeadAnswer {
        name: frame.name.clone(),
        status: outcome.map_or(Status::NoLimb, |o| o.status()),
        solution: solution.map(Box::new),
        data: frame.data.clone().map(Box::new),
    }
}

/// Reads the picture of a head for the screen.
fn paint(head: &Head, answer: &HeadAnswer) -> Result<Painted, String> {
    let path = if head.pictures.is_dir() { head.pictures.join(&answer.name) } else { head.pictures.clone() };
    if !path.is_file() || !head.pictures.is_dir() {
        return Err("only pictures in folders are shown here; open this head alone".to_owned());
    }
    let (picture, _) = Payload::File(path).decode(Some(&head.config))?;
    let rgb = picture.to_rgb();
    let (low, high) = rgb.iter().fold((u8::MAX, u8::MIN), |(low, high), x| (low.min(*x), high.max(*x)));
    let span = f32::from(high.saturating_sub(low).max(1));
    let stretched: Vec<u8> = rgb.iter().map(|x| (f32::from(x - low) / span * 255.0) as u8).collect();
    let image = ColorImage::from_rgb([rgb.width() as usize, rgb.height() as usize], &stretched);
    let sensor = AnySensor::new(&head.config, false).map_err(|e| e.to_string())?;
    let camera = sensor.camera_of(answer.data.as_deref());
    let limb = answer.solution.as_ref().map(|s| overlay::draw_limb(s, &camera).limb).unwrap_or_default();
    Ok(Painted { image: Arc::new(image), limb })
}
