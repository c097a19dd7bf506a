//! Measures hzn-core in both precisions, as the tables need it.

use std::hint::black_box;
use std::time::Instant;

use hzn_core::image::{Grey, Layout};
use hzn_core::real::Real;
use hzn_core::status::Status;
use hzn_core::{
    Config, Expected, FlightHorizon, Horizon, HostHorizon, Observer, Prior, Report, Step, Tracker, Unobserved,
};

use crate::cases::{Case, Picture};
use crate::observers::{Clock, PixelMap};
use crate::state::{FLUSH_BYTES, State};

/// Value of `keep_points` in the measurement with fewer points.
pub(crate) const FEWER: u16 = 200;
/// Distance of the limb from its predicted place in a sequence, pixels.
pub(crate) const MOVED_PX: f64 = 4.0;
/// Times that the frames are processed one after another to measure the time of a point.
const TURNS: usize = 9;

/// Sensor, with the memory that flushes the caches.
pub(crate) struct Sensor<T, const POINTS: usize, const BLOCKS: usize, const WORDS: usize> {
    horizon: Box<Horizon<T, POINTS, BLOCKS, WORDS>>,
    flush: Vec<u8>,
    /// In a sequence: what the tracker knows before each frame.
    trackers: Vec<Tracker<T>>,
}

/// Result of one run.
pub(crate) struct Timed {
    pub(crate) elapsed_us: f64,
    pub(crate) level: u16,
    pub(crate) points: u32,
    /// The answer, if the status is `ok`.
    pub(crate) axis: Option<[f64; 3]>,
}

/// Measurements of any sensor.
pub(crate) trait Measured {
    /// Measures one frame with the caches in a state.
    fn measure(&mut self, case: &Case, frame: usize, state: State) -> Result<Timed, String>;
    /// Returns the time of each stage in microseconds, with the caches in a state.
    fn measure_stages(&mut self, case: &Case, frame: usize, state: State) -> Result<Vec<(&'static str, f64)>, String>;
}

/// Makes a sensor in f32 with the lists of a flight computer.
pub(crate) fn flight_sensor(config: &Config) -> Result<Sensor<f32, 2048, 256, 512>, String> {
    Ok(Sensor::from_horizon(FlightHorizon::boxed(config).map_err(|e| e.to_string())?))
}

/// Makes the same sensor with fewer points, as for a flight computer that is short of time.
pub(crate) fn sensor_with_fewer_points(config: &Config) -> Result<Sensor<f32, 2048, 256, 512>, String> {
    let mut config = config.clone();
    config.edge_points.keep_points = FEWER;
    flight_sensor(&config)
}

/// Makes the same sensor in a sequence: it has just found the limb of each frame [`MOVED_PX`] away.
pub(crate) fn sensor_in_sequence(case: &Case) -> Result<Sensor<f32, 2048, 256, 512>, String> {
    let mut config = case.sensor.clone();
    // A full search comes before the frames are measured, and none of them is the 25th.
    config.track.full_every = 25;
    let mut sensor = flight_sensor(&config)?;
    for frame in &case.frames {
        let mut tracker = Tracker::default();
        let (picture, expected) = (picture(case, frame)?, sensor.expect(frame)?);
        sensor.horizon.track(&mut tracker, &picture, (&expected, &sensor.step(case, None)));
        sensor.trackers.push(tracker);
    }
    Ok(sensor)
}

/// Makes a sensor in f64 with the lists of a workstation.
pub(crate) fn host_sensor(config: &Config) -> Result<Sensor<f64, 16384, 2048, 65536>, String> {
    Ok(Sensor::from_horizon(HostHorizon::boxed(config).map_err(|e| e.to_string())?))
}

/// Makes a sensor in f32 that keeps every point of an edge.
pub(crate) fn sensor_with_every_point(config: &Config) -> Result<Sensor<f32, 16384, 2048, 16384>, String> {
    let mut config = config.clone();
    config.edge_points.keep_points = 0;
    Ok(Sensor::from_horizon(Horizon::boxed(&config).map_err(|e| e.to_string())?))
}

fn picture<'a>(case: &Case, frame: &'a Picture) -> Result<Grey<'a, u8>, String> {
    let c = &case.sensor.camera;
    Grey::try_new(frame.memory.bytes(), Layout::packed(c.width.into(), c.height.into(), 1, 8))
        .map_err(|e| e.to_string())
}

fn prior<T: Real>(frame: &Picture) -> Prior<T> {
    Prior {
        altitude_m: frame.prior.altitude_m.map(T::from_f64),
        position_m: frame.prior.position_m.map(|p| p.map(T::from_f64)),
        ..Prior::default()
    }
}

impl<T: Real, const POINTS: usize, const BLOCKS: usize, const WORDS: usize> Sensor<T, POINTS, BLOCKS, WORDS> {
    fn from_horizon(horizon: Box<Horizon<T, POINTS, BLOCKS, WORDS>>) -> Self {
        Self { horizon, flush: vec![1; FLUSH_BYTES], trackers: Vec::new() }
    }

    fn expect(&self, frame: &Picture) -> Result<Expected<T>, String> {
        self.horizon.expect(&prior(frame)).map_err(|e| e.to_string())
    }

    /// Returns the step of a frame in a sequence: the given rate puts the predicted limb [`MOVED_PX`] away.
    fn step(&self, case: &Case, after_s: Option<f64>) -> Step<T> {
        let rate = T::from_f64(MOVED_PX / case.sensor.camera.fx_px);
        Step { after_s: after_s.map(T::from_f64), rate_rad_s: Some([rate, T::ZERO, T::ZERO]), attitude: None }
    }

    /// Processes a frame, in a sequence with what the tracker knows before it.
    fn process<O: Observer<T>>(
        &mut self,
        case: &Case,
        frame: usize,
        expected: &Expected<T>,
        observer: &O,
    ) -> Result<(f64, Report<T>), String> {
        let (picture, step) = (picture(case, case.frame(frame)?)?, self.step(case, Some(1.0)));
        let mut tracker = self.trackers.get(frame).cloned();
        let start = Instant::now();
        let report = match &mut tracker {
            Some(tracker) => self.horizon.track_observed(tracker, black_box(&picture), (expected, &step), observer),
            None => self.horizon.process_observed(black_box(&picture), expected, observer),
        };
        let report = black_box(report);
        Ok((start.elapsed().as_secs_f64() * 1e6, report))
    }

    fn flush_caches(&mut self) {
        self.flush.iter_mut().step_by(64).for_each(|x| *x = x.wrapping_add(1));
        black_box(&self.flush);
    }

    fn measure_once(&mut self, case: &Case, frame: usize) -> Result<Timed, String> {
        // The expected limb does not depend on the picture, so its time is not measured.
        let expected = self.expect(case.frame(frame)?)?;
        let (elapsed_us, report) = self.process(case, frame, &expected, &Unobserved)?;
        let solution = report.solution.filter(|_| report.status == Status::Ok);
        Ok(Timed {
            elapsed_us,
            level: report.level,
            points: report.counters.edge_points,
            axis: solution.map(|s| s.axis.xyz().map(Real::to_f64)),
        })
    }

    /// Brings the caches into a state before frame number `frame` is measured, with an observer if `observed`: the
    /// stages with an observer are other code than those without.
    fn prepare(&mut self, case: &Case, frame: usize, state: State, observed: bool) -> Result<(), String> {
        let before = if state == State::Warm { frame } else { (frame + 1) % case.frames.len() };
        if state != State::Warm {
            self.flush_caches();
        }
        if state == State::AllFlushed {
            return Ok(());
        }
        for _ in 0..2 {
            if observed {
                self.observe(case, before)?;
            } else {
                self.measure_once(case, before)?;
            }
        }
        Ok(())
    }

    /// Processes a frame with a clock in its stages, and returns their times in microseconds.
    fn observe(&mut self, case: &Case, frame: usize) -> Result<Vec<(&'static str, f64)>, String> {
        let expected = self.expect(case.frame(frame)?)?;
        let clock = Clock::start();
        self.process(case, frame, &expected, &clock)?;
        Ok(clock.stages())
    }

    /// Returns the times per edge point in nanoseconds, when the frames are processed one after another: a list for
    /// each frame, with its time in each of several turns through the frames. Frames without points are left out.
    pub(crate) fn measure_ns_a_point(&mut self, case: &Case) -> Result<Vec<Vec<f64>>, String> {
        let mut all = vec![Vec::new(); case.frames.len()];
        for _ in 0..TURNS {
            for (frame, list) in all.iter_mut().enumerate() {
                let Timed { elapsed_us, points, .. } = self.measure_once(case, frame)?;
                if points > 0 {
                    list.push(elapsed_us * 1e3 / f64::from(points));
                }
            }
        }
        all.retain(|list| !list.is_empty());
        Ok(all)
    }

    /// Returns the number of pixels that are read at least once.
    pub(crate) fn count_distinct_pixels(&mut self, case: &Case, frame: &Picture) -> Result<u64, String> {
        let picture = picture(case, frame)?;
        let expected = self.expect(frame)?;
        let touched = PixelMap::new(case.sensor.camera.width, case.sensor.camera.height);
        self.horizon.process_observed(&picture, &expected, &touched);
        Ok(touched.count())
    }
}

impl<T: Real, const POINTS: usize, const BLOCKS: usize, const WORDS: usize> Measured
    for Sensor<T, POINTS, BLOCKS, WORDS>
{
    fn measure(&mut self, case: &Case, frame: usize, state: State) -> Result<Timed, String> {
        self.prepare(case, frame, state, false)?;
        self.measure_once(case, frame)
    }

    fn measure_stages(&mut self, case: &Case, frame: usize, state: State) -> Result<Vec<(&'static str, f64)>, String> {
        self.prepare(case, frame, state, true)?;
        self.observe(case, frame)
    }
}
