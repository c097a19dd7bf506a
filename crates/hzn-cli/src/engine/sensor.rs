//! The sensor of the workstation or of the flight computer, behind one face that speaks f64.

use hzn_calib::{FrameData, Frames, Problem};
use hzn_core::body::{self, FrameError};
use hzn_core::camera::Camera;
use hzn_core::error::ConfigError;
use hzn_core::frames::{Cov3, Ecef, UnitVec3};
use hzn_core::image::ImageView;
use hzn_core::pipeline::Candidate;
use hzn_core::real::Real;
use hzn_core::{Config, FlightHorizon, Frame, Horizon, HostHorizon, Report, Solution};

use hzn_sim::ephemeris;

use super::Trace;

enum Kind {
    Host(Box<HostHorizon>),
    Flight(Box<FlightHorizon>),
}

/// A sensor of either precision.
pub struct AnySensor {
    kind: Kind,
    /// The lens in f64, for drawing.
    camera: Camera<f64>,
    body: body::Kind,
}

impl AnySensor {
    /// Makes the sensor.
    ///
    /// # Errors
    /// The first field out of its limits.
    pub fn new(config: &Config, flight: bool) -> Result<Self, ConfigError> {
        let camera = Camera::try_new(&config.camera)?;
        let kind = if flight {
            Kind::Flight(Box::new(FlightHorizon::new(config)?))
        } else {
            Kind::Host(HostHorizon::boxed(config)?)
        };
        Ok(Self { kind, camera, body: config.body.kind })
    }

    /// The lens.
    pub fn camera(&self) -> &Camera<f64> {
        &self.camera
    }

    /// Half-angle in radians that is expected for a frame.
    ///
    /// # Errors
    /// An altitude or position that cannot be.
    pub fn expected_half_angle_rad(&self, data: Option<&FrameData>) -> Result<f64, FrameError> {
        match &self.kind {
            Kind::Host(h) => Ok(h.expect(&frame(data))?.half_angle_rad()),
            Kind::Flight(h) => Ok(f64::from(h.expect(&frame(data))?.half_angle_rad())),
        }
    }

    /// Processes one picture. Of Sun and Moon the direction in ECEF is known too, from the time and the position.
    ///
    /// # Errors
    /// An altitude or position that cannot be.
    pub fn process(
        &mut self,
        view: &ImageView<'_>,
        data: Option<&FrameData>,
        trace: Option<&Trace>,
    ) -> Result<Report<f64>, FrameError> {
        let mut report = match &mut self.kind {
            Kind::Host(h) => run(h, view, data, trace)?,
            Kind::Flight(h) => widen(&run(h, view, data, trace)?),
        };
        if let (Some(solution), Some(direction)) = (&mut report.solution, data.and_then(|d| in_the_sky(self.body, d))) {
            solution.axis_ecef = Some(direction);
        }
        Ok(report)
    }
}

/// Where Sun or Moon stand in ECEF, seen from the position at the time of the frame.
fn in_the_sky(body: body::Kind, data: &FrameData) -> Option<UnitVec3<Ecef, f64>> {
    let place = match body {
        body::Kind::Sun => ephemeris::sun(data.utc_s?),
        body::Kind::Moon => ephemeris::moon(data.utc_s?),
        _ => return None,
    };
    UnitVec3::try_new(place.seen_from(data.position_km?.map(|km| km * 1e3)).direction)
}

fn frame<T: Real>(data: Option<&FrameData>) -> Frame<T> {
    data.map(|d| d.to_frame(None)).unwrap_or_default()
}

fn run<T: Real + Into<f64>, const POINTS: usize, const BLOCKS: usize, const WORDS: usize>(
    horizon: &mut Horizon<T, POINTS, BLOCKS, WORDS>,
    view: &ImageView<'_>,
    data: Option<&FrameData>,
    trace: Option<&Trace>,
) -> Result<Report<T>, FrameError> {
    let expected = horizon.expect(&frame(data))?;
    // Each kind of picture has its own compiled pipeline; behind the enum every pixel would cost a branch.
    macro_rules! observed {
        ($observer:expr) => {
            match view {
                ImageView::Grey8(p) => horizon.process_observed(p, &expected, $observer),
                ImageView::Grey16(p) => horizon.process_observed(p, &expected, $observer),
                ImageView::Colour8(p) => horizon.process_observed(p, &expected, $observer),
                ImageView::Colour16(p) => horizon.process_observed(p, &expected, $observer),
            }
        };
    }
    Ok(match trace {
        Some(trace) => observed!(trace),
        None => observed!(&hzn_core::pipeline::Unobserved),
    })
}

/// A report in f64.
fn widen<T: Real + Into<f64>>(r: &Report<T>) -> Report<f64> {
    Report {
        status: r.status,
        stage: r.stage,
        level: r.level,
        counters: r.counters,
        candidates: r.candidates.iter().map(widen_candidate).collect(),
        solution: r.solution.as_ref().and_then(widen_solution),
    }
}

pub(super) fn widen_candidate<T: Real + Into<f64>>(c: &Candidate<T>) -> Candidate<f64> {
    Candidate {
        length_px: c.length_px,
        points: c.points,
        inliers: c.inliers,
        rms_px: c.rms_px.into(),
        verdict: c.verdict,
    }
}

pub(super) fn widen_solution<T: Real + Into<f64>>(s: &Solution<T>) -> Option<Solution<f64>> {
    let [xx, xy, xz] = s.covariance.rows()[0].map(Into::into);
    let [_, yy, yz] = s.covariance.rows()[1].map(Into::into);
    let zz = s.covariance.rows()[2][2].into();
    Some(Solution {
        axis: UnitVec3::try_new(s.axis.xyz().map(Into::into))?,
        covariance: Cov3::from_upper([xx, xy, xz, yy, yz, zz]),
        axis_ecef: s.axis_ecef.and_then(|a| UnitVec3::try_new(a.xyz().map(Into::into))),
        axis_body: s.axis_body.and_then(|a| UnitVec3::try_new(a.xyz().map(Into::into))),
        half_angle_rad: s.half_angle_rad.into(),
        fused_half_angle_rad: s.fused_half_angle_rad.into(),
        altitude_m: s.altitude_m.map(|(h, sigma)| (h.into(), sigma.into())),
        rms_px: s.rms_px.into(),
        inliers: s.inliers,
        arc_px: s.arc_px.into(),
        candidate: s.candidate,
    })
}

/// Checks a sensor, and every row of frames.csv against it, before the first frame is processed.
///
/// # Errors
/// The row, the picture and the column that cannot be.
pub fn prepare(config: &Config, flight: bool, frames: Option<&Frames>) -> Result<(), Problem> {
    let Some(frames) = frames else { return Ok(()) };
    let Ok(sensor) = AnySensor::new(config, flight) else { return Ok(()) };
    for row in &frames.rows {
        sensor.expected_half_angle_rad(Some(row)).map_err(|why| frames.problem(row, why))?;
    }
    Ok(())
}
