//! The step from a scenario to scenes: a [`Flight`].

use hzn_core::Preset;
use hzn_core::body::Kind;
use hzn_core::region;
use hzn_files::utc;

use super::{Format, Scenario, ScenarioError};
use crate::counter::{Counter, Stream};
use crate::ellipsoid::EllipsoidLimb;
use crate::flight::{Flight, FlightFrame};
use crate::foreground::Foreground;
use crate::halves::Halves;
use crate::infrared::Infrared;
use crate::motion::Motion;
use crate::pose::Pose;
use crate::scene::{Light, Scene, World};
use crate::trajectory::Path;
use hzn_nav::ephemeris;

/// Largest number of pictures over which the exposure is followed before a wanted picture.
const MAX_LEADS: f64 = 32.0;
/// Width in pixels by which a mask extends beyond the hidden part, because edges are blurred.
const MASK_MARGIN_PX: f64 = 4.0;

impl Scenario {
    /// Returns the times of the pictures in seconds.
    pub fn times_s(&self) -> Vec<f64> {
        let c = &self.capture;
        let last = f64::from(c.frames.saturating_sub(1).max(1));
        (0..c.frames).map(|i| c.from_s + (c.to_s - c.from_s) * f64::from(i) / last).collect()
    }

    /// Returns the file name of a picture by its number.
    pub fn file(&self, index: usize) -> String {
        format!("{}-{index:05}.{}", self.name, self.capture.format.ending())
    }

    /// Returns the sensor with the default noise model; [`super::Fit`] measures the noise model of the scenario.
    pub fn sensor(&self) -> hzn_core::Config {
        let preset = |kind: Kind| match kind {
            Kind::Sun => Preset::Sun,
            Kind::Moon => Preset::Moon,
            _ => Preset::Hzn,
        };
        // The last of several bodies is the faintest. Its gates also pass the others.
        let gates = self.bodies.last().copied().map_or(Preset::Hzn, preset);
        let mut sensor = hzn_core::Config::preset(gates, self.camera.clone());
        sensor.mount = self.mount;
        sensor.camera.readout_s = self.shutter.readout_s;
        let body = |kind: Kind| hzn_core::body::Config {
            altitude_sigma_km: self.known.position_sigma_km.max(0.05),
            ..self.body_config(kind)
        };
        let body = |kind: Kind| match &self.world {
            // The band tells its height, so that the sensor knows the limb as well as in a flight.
            World::Infrared(Infrared { limb: Some(limb), .. }) if kind == Kind::Earth => {
                let limb_height_by_latitude_km = Default::default();
                let mut body = hzn_core::body::Config { limb: *limb, limb_height_by_latitude_km, ..body(kind) };
                body.follow_band();
                body
            }
            _ => body(kind),
        };
        sensor.input.tone = Some(self.detector.tone.into());
        match self.bodies.as_slice() {
            [one] => sensor.body = body(*one),
            // There are at most three bodies; `check` refuses more.
            several => {
                let with_threshold = |kind: Kind| hzn_core::body::Config {
                    threshold: Some(hzn_core::Config::preset(preset(kind), self.camera.clone()).threshold),
                    ..body(kind)
                };
                sensor.bodies = several.iter().map(|&kind| with_threshold(kind)).collect();
                sensor.body = hzn_core::body::Config::default();
            }
        }
        for part in self.vehicle.iter().filter(|p| p.masked) {
            let polygon: region::Polygon = grow_polygon(&part.polygon_px, MASK_MARGIN_PX).into_iter().collect();
            // `check` refuses more than eight masks.
            let _ = sensor.mask.polygons_px.push(polygon);
        }
        sensor
    }

    /// Returns the scenes of all pictures, in the order of time.
    ///
    /// # Errors
    /// Fails if a value is out of its limits, if the camera is inside the Earth, or if no picture shows the body.
    pub fn flight(&self) -> Result<Flight, ScenarioError> {
        let times_s: Vec<f64> = self.times_s().iter().map(|time_s| time_s + self.fault.late_s).collect();
        let flight = self.flight_with_times(&times_s)?;
        Ok(self.freeze(flight))
    }

    /// Returns the flight of a camera that repeats a picture, see [`Fault`](super::Fault).
    fn freeze(&self, mut flight: Flight) -> Flight {
        let Some(from_s) = self.fault.frozen_from_s else { return flight };
        let first = flight.frames.partition_point(|frame| frame.time_s < from_s);
        let (before, after) = flight.frames.split_at_mut(first);
        if let Some(last) = before.last() {
            after.iter_mut().for_each(|frame| frame.scene = last.scene.clone());
        }
        flight
    }

    /// Returns [`Scenario::flight`] with pictures at these times instead of the times of the capture. Trajectory and
    /// attitude are those of the whole capture. The exposure follows the pictures that the capture would take before
    /// each of these.
    pub(super) fn flight_with_times(&self, times_s: &[f64]) -> Result<Flight, ScenarioError> {
        self.check()?;
        self.check_single()?;
        let sensor = self.sensor();
        sensor.check().map_err(|e| ScenarioError::new("[[vehicle]]", e.to_string()))?;
        let path = self.path()?;
        let (mut scenes, mut wanted) = (Vec::with_capacity(times_s.len()), Vec::with_capacity(times_s.len()));
        for (index, &time_s) in times_s.iter().enumerate() {
            let before = scenes.last().map_or(f64::NEG_INFINITY, |(last_s, _)| *last_s);
            for lead_s in self.lead_times_s(before, time_s) {
                scenes.push((lead_s, self.scene(&path, index, lead_s)?));
                wanted.push(false);
            }
            scenes.push((time_s, self.scene(&path, index, time_s)?));
            wanted.push(true);
        }
        self.check_visible(&scenes)?;
        self.exposure.set(&mut scenes).map_err(|e| ScenarioError::new("[exposure]", e.to_string()))?;
        let frames = scenes
            .into_iter()
            .zip(wanted)
            .filter_map(|(scene, wanted)| wanted.then_some(scene))
            .enumerate()
            .map(|(index, (time_s, scene))| FlightFrame {
                file: self.file(index),
                time_s,
                utc: Some(utc::iso8601(path.unix_s(time_s))),
                stamp: self.stamp(&path, index, time_s),
                scene,
                jpeg_quality: (self.capture.format == Format::Jpeg).then_some(self.capture.jpeg_quality),
            })
            .collect();
        Ok(Flight { name: self.name.clone(), sensor, frames })
    }

    /// Returns the times of the capture's pictures before a wanted picture: later than the picture before it, and
    /// within the memory of the exposure controller.
    fn lead_times_s(&self, before_s: f64, time_s: f64) -> Vec<f64> {
        let [from_s, to_s] = self.span_s();
        let every_s = (to_s - from_s) / f64::from(self.capture.frames.saturating_sub(1).max(1));
        if self.exposure.target_mean.is_none() || !(every_s > 0.0) {
            return Vec::new();
        }
        // After 4.6 lags, 1 % of a step is left.
        let count = (4.6 * self.exposure.lag_s / every_s).ceil().min(MAX_LEADS) as u32;
        let lead_s = |k: u32| time_s - f64::from(k) * every_s;
        // The times are rounded, so half a step is allowed.
        (1..=count).rev().map(lead_s).filter(|&t| t >= from_s && t > before_s + 0.5 * every_s).collect()
    }

    fn scene(&self, path: &Path, index: usize, time_s: f64) -> Result<Scene, ScenarioError> {
        let pose = self.fault.turn(&path.camera(time_s), time_s);
        let sun = self.ellipsoid().map(|body| self.body_sun(body, path, time_s));
        let mut scene = self.world_at(pose, path.unix_s(time_s), sun, time_s)?;
        let shutter = self.shutter;
        scene.motion = (shutter.exposure_s > 0.0 || shutter.readout_s > 0.0).then(|| Motion {
            rate_radps: path.camera_rate_radps(time_s),
            exposure_s: shutter.exposure_s,
            readout_s: shutter.readout_s,
        });
        scene.halves = shutter.halves.map(|order| Halves {
            order,
            apart_s: shutter.halves_s,
            rate_radps: path.camera_rate_radps(time_s),
        });
        scene.foreground = self
            .vehicle
            .iter()
            .map(|part| Foreground { polygon_px: part.polygon_px.clone(), brightness: part.brightness })
            .collect();
        scene.seed = self.picture_seed().wrapping_mul(1_000_003).wrapping_add(index as u64);
        Ok(scene)
    }

    /// Returns the scene of the world through the camera at a pose. `sun` is the direction to the Sun at an ellipsoid
    /// (body-fixed), and `time_s` is the time in the message for a camera inside the body.
    pub(super) fn world_at(
        &self,
        pose: Pose,
        unix_s: f64,
        sun: Option<[f64; 3]>,
        time_s: f64,
    ) -> Result<Scene, ScenarioError> {
        let mut scene = Scene::new(self.camera.clone(), pose);
        // The camera flies around the Earth for every body that it looks for.
        scene.body = self.body_config(Kind::Earth);
        self.check_outside(&scene, time_s)?;
        scene.world = self.world.clone();
        match &mut scene.world {
            World::Visible(world) => {
                world.clouds.seed = world.clouds.seed.wrapping_add(self.seed);
                world.ground.seed = world.ground.seed.wrapping_add(self.seed);
                scene.light = Light::Sun { direction: ephemeris::sun(unix_s).direction.xyz(), twilight_rad: 0.01 };
                scene.moon_ecef_m = Some(ephemeris::moon(unix_s).position_m().xyz());
            }
            World::Infrared(world) => {
                if let Some(clouds) = &mut world.clouds {
                    clouds.seed = clouds.seed.wrapping_add(self.seed);
                }
                if let Some(weather) = &mut world.weather {
                    weather.seed = weather.seed.wrapping_add(self.seed);
                }
                *world = world.with_season(unix_s);
                scene.limb_height_by_latitude_km = world.half_level_by_latitude_km();
            }
            World::Ellipsoid(body) => {
                scene.light = Light::Sun { direction: sun.unwrap_or_default(), twilight_rad: 0.0 };
                body.surface.seed = body.surface.seed.wrapping_add(self.seed);
            }
            World::Plain => {}
        }
        scene.optics = self.optics;
        scene.detector = self.detector;
        Ok(scene)
    }

    /// Refuses a camera that is not above the limb.
    fn check_outside(&self, scene: &Scene, time_s: f64) -> Result<(), ScenarioError> {
        let limb_km = scene.body.limb_height_km;
        let (altitude_km, is_outside, name) = match self.ellipsoid() {
            Some(body) => {
                let range_km = scene.pose.position_m.iter().map(|x| x * x).sum::<f64>().sqrt() * 1e-3;
                let is_outside = EllipsoidLimb::try_new(body.limb_m(), &scene.pose).is_some();
                (range_km - body.mean_radius_km(), is_outside, "body")
            }
            None => {
                let altitude_km = crate::Globe::new(&scene.body).altitude_m(scene.pose.position_m) * 1e-3;
                (altitude_km, altitude_km > limb_km, "Earth")
            }
        };
        if is_outside {
            return Ok(());
        }
        let what = format!(
            "at {time_s:.1} s the camera is at {altitude_km:.1} km, inside the {name} or below its limb at \
             {limb_km:.1} km"
        );
        Err(ScenarioError::new("[trajectory]", what))
    }

    /// Refuses a scenario in which the sensor's first body is never in view.
    fn check_visible(&self, scenes: &[(f64, Scene)]) -> Result<(), ScenarioError> {
        let kind = self.bodies.first().copied().unwrap_or_default();
        // About 200 pictures represent thousands.
        let step = (scenes.len() / 200).max(1);
        for (_, scene) in scenes.iter().step_by(step).chain(scenes.last()) {
            if scene.visible_px(kind).map_err(|e| ScenarioError::new("[trajectory]", e.to_string()))? > 0.0 {
                return Ok(());
            }
        }
        let name = self.body_names().first().copied().unwrap_or_default();
        let what = format!(
            "no picture shows a lit limb of the {name}: check the off-nadir angle, the field of view, and the time of \
             day (utc)"
        );
        Err(ScenarioError::new("[attitude]", what))
    }

    /// Returns the row of frames.csv for a picture: the position with its error, and the attitude with its error if
    /// `[known]` has one.
    pub fn frame_row(&self, frame: &FlightFrame) -> crate::flight::FrameRow {
        let draws = Counter::new(frame.scene.seed, Stream::Gnss);
        let error_m = [0, 1, 2].map(|i| self.known.position_sigma_km * 1e3 * draws.normal(i));
        let mut measured = frame.clone();
        let position_m = measured.stamp.as_mut().map_or(&mut measured.scene.pose.position_m, |s| &mut s.position_m);
        (0..3).for_each(|i| position_m[i] += error_m[i]);
        let mut row = measured.row();
        if let Some(sigma_deg) = self.known.attitude_sigma_deg {
            let [w, x, y, z] = frame.told_q_fixed_from_camera_wxyz(sigma_deg.to_radians());
            (row.qw, row.qx, row.qy, row.qz) = (Some(w), Some(x), Some(y), Some(z));
            row.attitude_sigma_deg = Some(sigma_deg);
        }
        row
    }
}

/// Returns a polygon with its corners moved outward, away from their middle.
fn grow_polygon(corners: &[[f64; 2]], by_px: f64) -> Vec<[f64; 2]> {
    let n = corners.len().max(1) as f64;
    let middle = [0, 1].map(|i| corners.iter().map(|c| c[i]).sum::<f64>() / n);
    corners
        .iter()
        .map(|c| {
            let d = [c[0] - middle[0], c[1] - middle[1]];
            // Both coordinates move by the same amount, so that upright edges move by `by_px`.
            [0, 1].map(|i| c[i] + by_px * d[i].signum() * f64::from(u8::from(d[i] != 0.0)))
        })
        .collect()
}
