//! A calibration on the pictures of the sequence, with the code of `hzn calibrate`.

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crossbeam_channel::{Receiver, bounded};
use hzn_calib::noise::{self, Sighting};
use hzn_calib::sky::{self, LimbPrior, Unknowns, View};
use hzn_core::camera::{self, Camera};
use hzn_core::frames::UnitVec3;
use hzn_core::{Config, Prior};
use hzn_run::engine::{self, Finished, Plan, Turns};
use hzn_run::explain::counted;

use super::Wake;
use super::board;
use super::measured::{HeightOf, Marks, Measured, Steps};
use super::sequence_source::SequenceSource;
use super::sky as sky_places;
use crate::model::Sequence;

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Limb height and edge noise.
    Noise,
    /// Focal length and principal point.
    Lens,
}

impl Kind {
    /// Returns the name on the screen.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Noise => "Limb height and noise from the flight",
            Self::Lens => "Lens from the flight",
        }
    }
}

/// The calibration to be done.
#[derive(Debug)]
pub struct Task {
    /// What is measured.
    pub kind: Kind,
    /// All pictures.
    pub sequence: Sequence,
    /// The configuration.
    pub config: Arc<Config>,
    /// The text of the sensor.toml.
    pub sensor_toml: String,
    /// Single precision and at most 2048 points, as `FlightHorizon` has.
    pub flight: bool,
}

/// A calibration in progress. It stops when the handle is dropped.
#[derive(Debug)]
pub struct Calibration {
    stop: Arc<AtomicBool>,
    done: Arc<AtomicU64>,
    end: Receiver<Result<Measured, String>>,
    /// Number of pictures of the sequence.
    pub total: u64,
}

impl Calibration {
    /// Starts a calibration.
    pub fn start(task: Task, wake: Wake) -> Self {
        let total = task.sequence.len() as u64;
        Self::begin(total, wake, move |steps| Run { task, steps, copies: RefCell::default() }.run())
    }
    /// Starts a calibration from pictures of a board.
    pub fn start_board(task: board::Task, wake: Wake) -> Self {
        let total = std::fs::read_dir(&task.folder).map_or(0, |files| files.count() as u64);
        Self::begin(total, wake, move |steps| task.run(&steps))
    }
    fn begin(
        total: u64,
        wake: Wake,
        run: impl FnOnce(Steps) -> Result<Option<Measured>, String> + Send + 'static,
    ) -> Self {
        let (send, end) = bounded(1);
        let (stop, done) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU64::new(0)));
        let steps = Steps { stop: Arc::clone(&stop), done: Arc::clone(&done), wake: Arc::clone(&wake) };
        std::thread::spawn(move || {
            if let Some(measured) = run(steps).transpose() {
                let _ = send.send(measured);
            }
            wake();
        });
        Self { stop, done, end, total }
    }
    /// Returns the number of pictures that are processed. The lens may need several passes, and each begins again.
    pub fn done(&self) -> u64 {
        self.done.load(Ordering::Relaxed)
    }
    /// Returns the result once the calibration has ended, and only once.
    pub fn end(&self) -> Option<Result<Measured, String>> {
        self.end.try_recv().ok()
    }
}

impl Drop for Calibration {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

struct Run {
    task: Task,
    steps: Steps,
    /// Which pictures were left out as copies of others, in words.
    copies: RefCell<Option<String>>,
}

impl Run {
    /// Returns the lines of a report, with the pictures that were left out.
    fn lines<N: Into<String>>(&self, lines: Vec<(N, String)>) -> Vec<(String, String)> {
        let copies = self.copies.take().map(|words| ("copies".to_owned(), words));
        lines.into_iter().map(|(name, value)| (name.into(), value)).chain(copies).collect()
    }

    /// Measures. `None` if it was stopped.
    fn run(&self) -> Result<Option<Measured>, String> {
        let wide = noise::config_for_calibration(&self.task.config)
            .ok_or("The sensor looks only for Sun and Moon, which have no limb height.")?;
        match self.task.kind {
            Kind::Noise => self.noise(&wide),
            Kind::Lens => self.lens(&wide),
        }
    }

    fn pictures(&self) -> String {
        counted(self.task.sequence.len() as u64, "picture")
    }

    fn refused(&self, why: &impl std::fmt::Display) -> String {
        format!("{}: {why}", self.pictures())
    }

    /// Processes all pictures and measures each answer.
    fn measure<T>(
        &self,
        config: Config,
        measure: impl FnMut(engine::Answered<'_>) -> Option<T>,
    ) -> Result<Option<Vec<T>>, String> {
        let threads = if config.tracks() { 1 } else { std::thread::available_parallelism().map_or(1, usize::from) };
        let plan = Plan {
            config,
            flight: self.task.flight,
            threads,
            frames: None,
            fps: 1.0,
            trace: false,
            keep_traces: true,
            keep_picture: false,
            overlay: None,
            masks: None,
            last: Vec::new(),
            turns: Turns::default(),
        };
        let mut source = SequenceSource::new(self.task.sequence.clone())?;
        self.steps.done.store(0, Ordering::Relaxed);
        let seen = |_: &Finished| {
            self.steps.done.fetch_add(1, Ordering::Relaxed);
            (self.steps.wake)();
        };
        let measured = engine::measure_answers(&plan, &mut source, &self.steps.stop, seen, measure);
        let Some(measured) = measured.map_err(|e| format!("{e:#}"))? else { return Ok(None) };
        *self.copies.borrow_mut() = measured.copies_in_words();
        Ok(Some(measured.answers))
    }

    fn noise(&self, wide: &Config) -> Result<Option<Measured>, String> {
        let camera = Camera::try_new(&wide.camera).map_err(|e| e.to_string())?;
        let sighting = |a: engine::Answered<'_>| {
            let sighting = Sighting::measure(a.name, &camera, &wide.body, &a.prior, &a.points, a.solution)?;
            Some(sighting.with_clipped(a.clipped))
        };
        let Some(sightings) = self.measure(wide.clone(), sighting)? else { return Ok(None) };
        let mut found = noise::Calibration::new(&wide.body, &sightings).map_err(|why| self.refused(&why))?;
        found.compare_with(&self.task.config);
        let written = noise::into_sensor_toml(&self.task.sensor_toml, &found, &self.task.sequence.title)?;
        let lines = noise::lines(&found, &self.pictures(), &wide.camera);
        let height = |p: &noise::Picture| HeightOf { km: p.km, sigma_km: p.sigma_km, counts: p.counts };
        Ok(Some(Measured {
            lines: self.lines(lines),
            keys: written.keys,
            text: found.alarm().map_or(Ok(written.text), |why| Err(why.to_string())),
            heights: found.pictures.iter().map(height).collect(),
            height_km: found.height.km,
            marks: None,
        }))
    }

    fn lens(&self, wide: &Config) -> Result<Option<Measured>, String> {
        let limb = LimbPrior::of_sensor(&self.task.config, false)
            .ok_or("The sensor looks only for Sun and Moon; `hzn calibrate sky` measures a lens on their track.")?;
        let unknowns = Unknowns::new(&self.task.config.camera, &[]);
        let process = |camera: &camera::Config| {
            let used = Config { camera: camera.clone(), ..wide.clone() };
            // The side of the Sun follows from the attitude, where frames.csv does not have its direction.
            self.measure(used, |a| {
                let sun = a.data.and_then(sky_places::sun).and_then(UnitVec3::try_new);
                Some(View::new(a.name, a.points, Prior { sun: sun.or(a.prior.sun), ..a.prior }, a.solution))
            })
        };
        let found = sky::estimate_in_passes(&self.task.config, &wide.body, &unknowns, limb, process, |_| ())?;
        let Some(found) = found else { return Ok(None) };
        let (estimate, _) = found.map_err(|why| self.refused(&why))?;
        let count = estimate.pictures.iter().filter(|p| p.counts).count() as u64;
        let source = format!("{} of {}", counted(count, "limb picture"), self.task.sequence.title);
        let lens = sky::Found { camera: &estimate.camera, parameters: &estimate.parameters, source: &source };
        let written = sky::into_sensor_toml(&self.task.sensor_toml, lens)?;
        let doubt = estimate.alarm().or_else(|| estimate.undetermined());
        let rms = (1..).zip(&estimate.pictures).map(|(n, p)| ([f64::from(n), p.rms_px], p.counts)).collect();
        let height = |p: &sky::Picture| HeightOf { km: p.km, sigma_km: p.sigma_km, counts: p.counts };
        Ok(Some(Measured {
            lines: self.lines(sky::lines(&estimate, &self.pictures(), None)),
            keys: written.keys,
            text: doubt.map_or(Ok(written.text), |why| Err(why.to_string())),
            heights: estimate.pictures.iter().map(height).collect(),
            height_km: estimate.height_km[0],
            marks: Some(Marks { title: "RMS of each picture with the new lens, px", points: rms }),
        }))
    }
}
