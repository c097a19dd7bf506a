//! All errors of a flight.

use std::collections::HashMap;

use hzn_core::ellipsoid::EARTH_MEAN_RADIUS_M;
use hzn_nav::filter::{DirectionMeasurement, chi2_limit};
use hzn_nav::frames::{Cam, Rotation};
use hzn_nav::layout::Layout;
use hzn_nav::options::{CameraOptions, Mode};
use hzn_nav::strapdown::Nominal;
use nalgebra::{DVector, Matrix3};

use super::begin::{first_estimates, shared};
use super::carried::Carrier;
use super::cones::{Cone, Told};
use super::directions::{At, CentreSeen, Direction};
use super::estimates::{Estimates, column};
use super::knots::Knot;
use super::known::{Known, without_fixed};
use super::lens::{Lens, lenses, without_lens};
use super::loss::Loss;
use super::others;
use super::places::Places;
use super::slow::Link;
use super::turning::Turning;
use crate::data::Flight;
use crate::error::Error;
use crate::events::{Event, Source};
use crate::input::{Body, Seen};
use crate::reference::limb_axis;
use crate::results::Kind;
use crate::settings::{Limb, Settings};
use crate::sparse::Linear;
use crate::track::Track;

/// 1-sigma of the first knot: attitude (rad), velocity (m/s), position (m). The measurements say where the vehicle is;
/// these keep the equations regular where they do not.
const FIRST: [f64; 3] = [core::f64::consts::PI, 1e4, EARTH_MEAN_RADIUS_M];

/// What an error is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Role {
    /// What was known before, the inertial samples between two knots, or the change of a slow error.
    Model,
    /// A measurement: its time, its camera, its kind.
    Measured(f64, Option<usize>, Kind),
}

/// An error at the estimates with the weight of its loss.
#[derive(Debug, Clone)]
pub struct Weighed {
    /// What it is.
    pub role: Role,
    /// The error with its derivatives, without the weight.
    pub linear: Linear,
    /// The weight: 1 for an error that a right measurement has.
    pub weight: f64,
    /// Its part of the cost.
    pub cost: f64,
}

/// A measurement with its place in the problem.
#[derive(Debug, Clone)]
enum Measured {
    Direction(Direction),
    Cone(Box<Cone>),
    Centre(CentreSeen),
    Fix { knot: usize, index: usize },
    Attitude { knot: usize, index: usize },
}

/// The flight as a sum of squares.
#[derive(Clone)]
pub struct Problem<'a> {
    flight: Flight<'a>,
    settings: &'a Settings,
    /// Whether limbs count with their freely fitted cones instead of their axes.
    points: bool,
    cameras: Vec<CameraOptions>,
    lenses: Vec<Option<Lens>>,
    places: Places,
    known: Known,
    begin: Nominal,
    carrier: Carrier,
    turning: Turning,
    measured: Vec<(Role, Measured)>,
    links: Vec<Link>,
}

impl<'a> Problem<'a> {
    /// Makes the problem, and its first estimates from the filter's.
    /// With `points`, limbs count with their freely fitted cones.
    pub(crate) fn new(
        flight: &Flight<'a>,
        settings: &'a Settings,
        track: &Track,
        points: bool,
    ) -> Result<(Self, Estimates), Error> {
        let mut cameras = flight.cameras(settings);
        let mut options = flight.options(settings, hzn_nav::options::StartSigmas::default());
        let slow: Vec<Option<f64>> =
            cameras.iter().map(|c| (c.slow_error != Mode::Off).then_some(c.slow_error_time_s)).collect();
        let known = without_fixed(&mut options, &mut cameras);
        let lenses = lenses(&flight.inputs.recordings, settings)?;
        let is_unknown: Vec<[bool; 2]> =
            lenses.iter().map(|lens| lens.as_ref().map_or([false; 2], Lens::is_unknown)).collect();
        let places = Places::new(&options, &cameras, &is_unknown);
        let has_receiver = flight.inputs.has_receiver();
        let carrier = Carrier::new(&options, flight.samples, has_receiver);
        let turning = Turning::new(flight.samples);
        let (knots, states) = first_estimates(flight.events, track, &carrier, &turning, settings.imu.max_step_s);
        let Some(begin) = states.first().copied() else {
            return Err(Error::unusable("--solve: there is no measurement after the start"));
        };
        let estimates = Estimates { knots: states, slow: Vec::new(), shared: shared(track) };
        let known = Known::new(&known, &lenses, &places);
        let mut problem = Self {
            flight: *flight,
            settings,
            points,
            cameras,
            lenses,
            places,
            known,
            begin,
            carrier,
            turning,
            measured: Vec::new(),
            links: Vec::new(),
        };
        let count = problem.measure(&knots, &estimates, &slow);
        Ok((problem, Estimates { slow: vec![nalgebra::Vector3::zeros(); count], ..estimates }))
    }

    /// Collects the measurements, and returns the number of slow errors. The filter counts those that are not usable.
    fn measure(&mut self, knots: &[Knot], estimates: &Estimates, slow: &[Option<f64>]) -> usize {
        let mut last: HashMap<(usize, Body), (usize, f64)> = HashMap::new();
        let mut count = 0;
        for (knot, (one, state)) in knots.iter().zip(&estimates.knots).enumerate() {
            for event in &one.events {
                match event.source {
                    Source::Gnss(index) => self.fix(event, knot, index),
                    Source::Attitude(index) => {
                        let role = Role::Measured(event.time_s, None, Kind::Attitude);
                        self.measured.push((role, Measured::Attitude { knot, index }));
                    }
                    Source::Camera(camera, index) => {
                        let at = At { knot, time_s: event.time_s, camera };
                        let correlation_s = slow.get(camera).copied().flatten();
                        let Some(body) = self.camera(at, index, state, correlation_s.map(|_| count)) else { continue };
                        let Some(correlation_s) = correlation_s else { continue };
                        let before = last.insert((camera, body), (count, event.time_s));
                        let before = before.map(|(i, time_s)| (i, (event.time_s - time_s) / correlation_s));
                        self.links.push(Link { before, index: count });
                        count += 1;
                    }
                }
            }
        }
        count
    }

    fn fix(&mut self, event: &Event, knot: usize, index: usize) {
        let Some(fix) = self.flight.inputs.gnss.get(index) else { return };
        if fix.position_m.is_finite() {
            let role = Role::Measured(event.time_s, None, Kind::Position);
            self.measured.push((role, Measured::Fix { knot, index }));
        }
        if fix.position_m.is_finite() && fix.velocity_m_s.is_finite() {
            let role = Role::Measured(event.time_s, None, Kind::Velocity);
            self.measured.push((role, Measured::Fix { knot, index }));
        }
    }

    /// Adds what a camera measured; returns the body of a direction that was added.
    fn camera(&mut self, at: At, index: usize, state: &Nominal, slow: Option<usize>) -> Option<Body> {
        let recording = self.flight.inputs.recordings.get(at.camera)?;
        let seen: &Seen = recording.seen.get(index)?;
        let white_rad = self.cameras.get(at.camera)?.white_rad;
        if let (Some(centre), Limb::Position) = (seen.centre, self.settings.camera(&recording.name).limb) {
            let centre = CentreSeen::new(at, &centre, state, white_rad).ok()?;
            let role = Role::Measured(at.time_s, Some(at.camera), Kind::Centre);
            self.measured.push((role, Measured::Centre(centre)));
            return None;
        }
        let by_position = || limb_axis(seen.body, &state.position_m).filter(|_| self.flight.inputs.has_receiver());
        let reference = seen.reference.or_else(by_position)?;
        let role = Role::Measured(at.time_s, Some(at.camera), Kind::Direction(seen.body));
        if let Some((cone, altitude_km)) = seen.cone.zip(seen.altitude_km).filter(|_| self.points) {
            let told = Told { reference, altitude_km, slow_share: seen.slow_share() };
            let lens = self.lenses.get(at.camera).and_then(Option::as_ref);
            let cone = Cone::new(at, &cone, told, state, white_rad, slow, lens)?;
            self.measured.push((role, Measured::Cone(Box::new(cone))));
            return Some(seen.body);
        }
        let mut measurement = DirectionMeasurement {
            camera: at.camera,
            body: 0,
            measured: seen.axis,
            reference,
            covariance_rad2: seen.covariance_rad2,
            common_rad2: seen.common_rad2,
            by_limb_height: seen.by_limb_height,
            is_limb: seen.body == Body::Limb,
        };
        let lens = self.lenses.get(at.camera).and_then(Option::as_ref);
        let by_lens = lens.and_then(|lens| without_lens(&mut measurement, lens, seen));
        let mut direction = Direction::new(at, &measurement, &state.position_m, white_rad, slow).ok()?;
        direction.by_lens = by_lens;
        self.measured.push((role, Measured::Direction(direction)));
        Some(seen.body)
    }

    /// Returns the places of the shared errors, after those of a state.
    pub fn places(&self) -> &Places {
        &self.places
    }

    /// Returns what was known of the shared errors before: 1-sigma of each.
    pub fn known(&self) -> &DVector<f64> {
        &self.known.sigmas
    }

    /// Returns the share of the limb height's prior sigma in the variance of the limbs' directions; `None` if the limb
    /// height is known, or if there are no limbs.
    pub(super) fn limb_share_of_directions(&self) -> Option<f64> {
        let sigma_km = self.known.sigmas.get(column(self.places.filter.limb_height?))?;
        let seen = self.flight.inputs.recordings.iter().flat_map(|r| &r.seen).filter(|s| s.body == Body::Limb);
        let (by_limb, rest) = seen.fold((0.0, 0.0), |(by_limb, rest), s| {
            let height = s.by_limb_height.norm_squared() * sigma_km * sigma_km;
            (by_limb + height, rest + s.covariance_rad2.as_inner().trace())
        });
        // Recordings without the derivative do not say what the limb height causes.
        (by_limb > 0.0 && rest > 0.0).then(|| by_limb / (by_limb + rest))
    }

    /// Returns the mounts that were told.
    pub(super) fn told(&self) -> Vec<Rotation<Cam, hzn_nav::frames::Vehicle>> {
        self.cameras.iter().map(|c| c.mount).collect()
    }

    pub(super) fn cameras(&self) -> &[String] {
        self.flight.names
    }

    pub(super) fn turning(&self) -> &Turning {
        &self.turning
    }

    /// Returns all errors at the estimates, with a loss for those of measurements.
    ///
    /// # Errors
    /// A state is not finite.
    pub fn errors(&self, estimates: &Estimates, loss: Loss) -> Result<Vec<Weighed>, Error> {
        let shared = self.places.shared();
        let model = |linear: Linear| {
            let cost = linear.error.norm_squared();
            Weighed { role: Role::Model, linear, weight: 1.0, cost }
        };
        let mut all: Vec<Weighed> = Vec::new();
        if let Some(knot) = estimates.knots.first() {
            all.extend(others::first(knot, &self.begin, FIRST).map(model));
        }
        let since = estimates.shared.since(&self.told(), &self.places);
        all.push(model(others::known(&since, &self.known.root, estimates.shared_block())));
        for (i, pair) in estimates.knots.windows(2).enumerate() {
            let [from, to] = pair else { continue };
            let blocks = [i, i + 1, estimates.shared_block()];
            all.push(model(self.carrier.error((from, to), &estimates.shared.corrections, blocks, shared)?));
        }
        all.extend(self.links.iter().map(|link| model(link.error(&estimates.slow, |i| estimates.slow_block(i)))));
        for (role, measured) in &self.measured {
            if let Some(linear) = self.measured_error(estimates, *role, measured) {
                all.push(weighed(*role, linear, loss, self.settings.gate_probability));
            }
        }
        Ok(all)
    }

    fn measured_error(&self, estimates: &Estimates, role: Role, measured: &Measured) -> Option<Linear> {
        match measured {
            Measured::Direction(direction) => direction.error(estimates, &self.places, &self.turning),
            Measured::Cone(cone) => cone.error(estimates, &self.places, &self.turning),
            Measured::Centre(centre) => centre.error(estimates, &self.places, &self.turning),
            Measured::Fix { knot, index } => {
                let (fix, state) = (self.flight.inputs.gnss.get(*index)?, estimates.knots.get(*knot)?);
                let [position, velocity] = self.settings.fix_sigmas(fix);
                let one = Matrix3::identity();
                if matches!(role, Role::Measured(_, _, Kind::Velocity)) {
                    let error = (state.velocity_m_s - fix.velocity_m_s).into_inner();
                    return Some(others::of_state(error, velocity, *knot, &[(Layout::VELOCITY, one)]));
                }
                let dt = fix.time_s - state.time_s;
                let error = (state.position_m + state.velocity_m_s * dt - fix.position_m).into_inner();
                let parts = [(Layout::POSITION, one), (Layout::VELOCITY, one * dt)];
                Some(others::of_state(error, position, *knot, &parts))
            }
            Measured::Attitude { knot, index } => {
                let (seen, state) = (self.flight.inputs.attitudes.get(*index)?, estimates.knots.get(*knot)?);
                let predicted = self.turning.at(state, &estimates.shared.corrections, seen.time_s).0;
                Some(others::attitude(&predicted, &seen.fixed_from_vehicle?, seen.sigma_rad, *knot))
            }
        }
    }
}

/// Gives an error its weight. Its limit is that of the filter's gate.
fn weighed(role: Role, linear: Linear, loss: Loss, gate_probability: f64) -> Weighed {
    let limit = chi2_limit(linear.error.len(), gate_probability);
    let (cost, weight) = loss.of(linear.error.norm_squared(), limit);
    Weighed { role, linear, weight, cost }
}
