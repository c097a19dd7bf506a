//! Measures hzn-core in both precisions, as the table needs it.

use std::hint::black_box;
use std::time::Instant;

use hzn_core::image::{Grey, Layout};
use hzn_core::real::Real;
use hzn_core::status::Status;
use hzn_core::{Config, FlightHorizon, Horizon, HostHorizon, Prior};

use crate::cases::{Case, Picture};
use crate::observers::{Clock, PixelMap};

/// Number of bytes that are touched to flush the caches; more than the caches hold.
const FLUSH_BYTES: usize = 64 << 20;
/// Repetitions of a warm measurement; their median counts.
const WARM_RUNS: usize = 9;

/// Value of `keep_points` in the measurement with fewer points.
pub(crate) const FEWER: u16 = 200;

/// Sensor, with the memory that flushes the caches.
pub(crate) struct Sensor<T, const POINTS: usize, const BLOCKS: usize, const WORDS: usize> {
    horizon: Box<Horizon<T, POINTS, BLOCKS, WORDS>>,
    flush: Vec<u8>,
}

/// Result of one run.
pub(crate) struct Timed {
    pub(crate) elapsed_us: f64,
    pub(crate) level: u16,
    pub(crate) status: Status,
    pub(crate) points: u32,
    pub(crate) axis: Option<[f64; 3]>,
}

/// Makes a sensor in f32 with the lists of a flight computer.
pub(crate) fn flight_sensor(config: &Config) -> Result<Sensor<f32, 2048, 256, 512>, String> {
    Ok(Sensor::from_horizon(Box::new(FlightHorizon::new(config).map_err(|e| e.to_string())?)))
}

/// Makes the same sensor with fewer points, as for a flight computer that is short of time.
pub(crate) fn sensor_with_fewer_points(config: &Config) -> Result<Sensor<f32, 2048, 256, 512>, String> {
    let mut config = config.clone();
    config.candidates.keep_points = FEWER;
    flight_sensor(&config)
}

/// Makes a sensor in f64 with the lists of a workstation.
pub(crate) fn host_sensor(config: &Config) -> Result<Sensor<f64, 16384, 2048, 65536>, String> {
    Ok(Sensor::from_horizon(Box::new(HostHorizon::new(config).map_err(|e| e.to_string())?)))
}

/// Makes a sensor in f32 that keeps every point of an edge.
pub(crate) fn sensor_with_every_point(config: &Config) -> Result<Sensor<f32, 16384, 2048, 16384>, String> {
    let mut config = config.clone();
    config.candidates.keep_points = 0;
    Ok(Sensor::from_horizon(Box::new(Horizon::new(&config).map_err(|e| e.to_string())?)))
}

fn picture<'a>(case: &Case, frame: &'a Picture) -> Result<Grey<'a, u8>, String> {
    let c = &case.sensor.camera;
    Grey::try_new(&frame.bytes, Layout::packed(c.width.into(), c.height.into(), 1, 8)).map_err(|e| e.to_string())
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
        Self { horizon, flush: vec![1; FLUSH_BYTES] }
    }

    fn flush_caches(&mut self) {
        self.flush.iter_mut().step_by(64).for_each(|x| *x = x.wrapping_add(1));
        black_box(&self.flush);
    }

    fn measure_once(&mut self, case: &Case, frame: &Picture) -> Result<Timed, String> {
        let picture = picture(case, frame)?;
        let prior = prior(frame);
        // The expected limb does not depend on the picture, so its time is not measured.
        let expected = self.horizon.expect(&prior).map_err(|e| e.to_string())?;
        let start = Instant::now();
        let report = black_box(self.horizon.process(black_box(&picture), &expected));
        let elapsed_us = start.elapsed().as_secs_f64() * 1e6;
        Ok(Timed {
            elapsed_us,
            level: report.level,
            status: report.status,
            points: report.counters.edge_points,
            axis: report.solution.map(|s| s.axis.xyz().map(Real::to_f64)),
        })
    }

    /// Measures one run with flushed caches.
    pub(crate) fn measure_cold(&mut self, case: &Case, frame: &Picture) -> Result<Timed, String> {
        self.flush_caches();
        self.measure_once(case, frame)
    }

    /// Returns the time in microseconds when the same frame has just been processed.
    pub(crate) fn measure_warm(&mut self, case: &Case, frame: &Picture) -> Result<f64, String> {
        Ok(self.measure_warm_run(case, frame)?.elapsed_us)
    }

    /// Measures as [`Self::measure_warm`] does, and returns the whole result of the run.
    pub(crate) fn measure_warm_run(&mut self, case: &Case, frame: &Picture) -> Result<Timed, String> {
        let mut runs = (0..WARM_RUNS).map(|_| self.measure_once(case, frame)).collect::<Result<Vec<_>, _>>()?;
        runs.sort_by(|a, b| a.elapsed_us.total_cmp(&b.elapsed_us));
        Ok(runs.swap_remove(WARM_RUNS / 2))
    }

    /// Returns the time of each stage in microseconds, with flushed caches.
    pub(crate) fn measure_stages(&mut self, case: &Case, frame: &Picture) -> Result<Vec<(&'static str, f64)>, String> {
        self.flush_caches();
        let picture = picture(case, frame)?;
        let expected = self.horizon.expect(&prior(frame)).map_err(|e| e.to_string())?;
        let clock = Clock::start();
        black_box(self.horizon.process_observed(black_box(&picture), &expected, &clock));
        Ok(clock.stages())
    }

    /// Returns the number of pixels that are read at least once.
    pub(crate) fn count_distinct_pixels(&mut self, case: &Case, frame: &Picture) -> Result<u64, String> {
        let picture = picture(case, frame)?;
        let expected = self.horizon.expect(&prior(frame)).map_err(|e| e.to_string())?;
        let touched = PixelMap::new(case.sensor.camera.width, case.sensor.camera.height);
        self.horizon.process_observed(&picture, &expected, &touched);
        Ok(touched.count())
    }
}
