//! A satellite that tumbles through twenty orbits: no limb and no Sun in the Earth's shadow.

use hzn_core::ellipsoid::WGS84_A_M;
use hzn_fuse::flight::Wanted;
use hzn_fuse::input::Body;
use hzn_fuse::simulated::{Errors, Moment, inputs};
use hzn_fuse::truth::{Miss, compare};
use hzn_fuse::{Fused, Settings, fuse};
use hzn_nav::ephemeris;
use hzn_nav::frames::{Cam, Covariance, Fixed, Vector};
use hzn_sim::Scenario;
use rayon::prelude::*;

use super::super::recordings::{self, untold};
use super::super::residuals::{self, Donors, Drawn, Residuals};
use super::super::setup::Effort;
use super::vehicle;
use crate::section::Section;

/// Period of the orbit, s.
const ORBIT_S: f64 = 5740.0;
const ORBITS: usize = 20;
/// Time between two pictures, s.
const STEP_S: f64 = 10.0;
/// Number of flights, and the seed of the first.
const FLIGHTS: (usize, u64) = (6, 8100);
/// Seed of the pictures whose errors the flights draw from.
const PICTURES: (usize, u64) = (200, 8001);

/// Returns the direction to the Sun.
fn to_sun(unix_s: f64, from_m: &Vector<Fixed>) -> Vector<Fixed> {
    ephemeris::sun(unix_s).seen_from(*from_m).direction
}

/// Returns whether a position is in the Earth's shadow, a cylinder.
fn is_eclipsed(unix_s: f64, position_m: &Vector<Fixed>) -> bool {
    let sun = to_sun(unix_s, position_m);
    let along = position_m.dot(&sun);
    along < 0.0 && (*position_m - sun * along).norm() < WGS84_A_M
}

/// Returns the direction from the Earth's centre to the limb's point in a direction; `None` if the position
/// lies within the Earth, or if the direction is vertical.
fn limb_point(position_m: &Vector<Fixed>, outward: &Vector<Fixed>) -> Option<Vector<Fixed>> {
    // The line of sight touches the sphere where its angle at the Earth's centre from the position is 90° − α, with the
    // half-angle α of the limb. The flattening moves the latitude by less than 0.2°.
    let distance_m = position_m.norm();
    let up = position_m.try_normalize(WGS84_A_M)?;
    let along = (*outward - up * outward.dot(&up)).try_normalize(1e-12)?;
    let sine = WGS84_A_M / distance_m;
    Some(up * sine + along * (1.0 - sine * sine).sqrt())
}

/// Errors of pictures, without answers where there is no light.
struct Lit<'a> {
    drawn: Drawn<'a>,
    start_unix_s: f64,
}

impl Errors for Lit<'_> {
    fn draw(&mut self, at: &Moment, axis: &Vector<Cam>) -> (Vector<Cam>, Covariance<Cam>) {
        self.drawn.draw(at, axis)
    }
    fn common(&mut self, at: &Moment, axis: &Vector<Cam>) -> Option<Covariance<Cam>> {
        self.drawn.common(at, axis)
    }
    fn by_limb_height(&mut self, at: &Moment, axis: &Vector<Cam>) -> Vector<Cam> {
        self.drawn.by_limb_height(at, axis)
    }
    fn has_light(&mut self, at: &Moment) -> bool {
        let unix_s = self.start_unix_s + at.time_s;
        if at.body != Body::Limb {
            return !is_eclipsed(unix_s, &at.position_m);
        }
        // The limb that the camera sees lies towards its boresight.
        let boresight = at.fixed_from_camera * Vector::new(0.0, 0.0, 1.0);
        limb_point(&at.position_m, &boresight).is_some_and(|point| point.dot(&to_sun(unix_s, &at.position_m)) > 0.0)
    }
}

/// Returns the scene over its orbits.
fn scene(seed: u64, orbits: usize) -> anyhow::Result<Scenario> {
    let mut scene = Scenario::builtin("tumble").ok_or_else(|| anyhow::anyhow!("there is no scene tumble"))?;
    scene.seed = seed;
    scene.bodies = vec![hzn_core::body::Kind::Earth, hzn_core::body::Kind::Sun];
    scene.capture.to_s = ORBIT_S * orbits as f64;
    scene.capture.frames = (scene.capture.to_s / STEP_S) as u32 + 1;
    scene.exposure = Default::default();
    scene.imu = Some(vehicle::imu());
    scene.gnss = Some(vehicle::gnss());
    Ok(scene)
}

/// Returns the errors of pictures that the sensor answers with default settings.
fn donors(effort: &Effort) -> anyhow::Result<Donors> {
    let mut scene = scene(PICTURES.1, 1)?;
    let own = Scenario::builtin("tumble").ok_or_else(|| anyhow::anyhow!("there is no scene tumble"))?;
    scene.exposure = own.exposure;
    scene.capture.to_s = own.capture.to_s;
    scene.capture.frames = u32::try_from(effort.frames(PICTURES.0))?;
    let inputs = recordings::inputs(&scene, untold, effort.recordings.as_deref())?;
    Ok(Donors::new(vec![Residuals::new(&scene, &inputs)?]))
}

/// The figures of a flight.
#[derive(Default)]
struct Figures {
    /// Sums of squares of the error of one axis (rad²), counts, and components beyond 3σ: in light and in eclipse.
    square: [f64; 2],
    count: [f64; 2],
    beyond: [f64; 2],
    nees: [f64; 2],
    /// Largest error, rad, and longest time above 5°, s.
    largest_rad: f64,
    above_s: f64,
    restarts: usize,
}

impl Figures {
    fn new(scene: &Scenario, fused: &Fused, misses: &[Miss]) -> Self {
        let mut figures = Self { restarts: fused.counts.restarts, ..Self::default() };
        let mut since: Option<f64> = None;
        for miss in misses {
            let epoch = fused.epochs.partition_point(|e| e.state.time_s < miss.time_s);
            let Some(epoch) = fused.epochs.get(epoch) else { continue };
            let dark = usize::from(is_eclipsed(scene.start_unix_s() + miss.time_s, &epoch.state.position_m));
            let sigma = epoch.attitude_sigma_rad();
            figures.square[dark] += miss.attitude_rad.norm_squared();
            figures.count[dark] += 3.0;
            figures.nees[dark] += miss.nees;
            let beyond = miss.attitude_rad.xyz().iter().zip(&sigma).filter(|(e, s)| e.abs() > 3.0 * **s).count();
            figures.beyond[dark] += beyond as f64;
            figures.largest_rad = figures.largest_rad.max(miss.attitude_rad.norm());
            since = (miss.attitude_rad.norm() > 5f64.to_radians()).then(|| since.unwrap_or(miss.time_s));
            figures.above_s = figures.above_s.max(since.map_or(0.0, |from_s| miss.time_s - from_s));
        }
        figures
    }
}

fn fly(scene: &Scenario, donors: &Donors, settings: &Settings, with_false: bool) -> anyhow::Result<Figures> {
    let mut errors = Lit { drawn: donors.draw(scene.seed), start_unix_s: scene.start_unix_s() };
    let mut inputs = inputs(scene, &mut errors, 0.0)?;
    if with_false {
        residuals::replace_one_in_fifty(&mut inputs);
    }
    let fused = fuse(&inputs, settings, Wanted { rate_hz: Some(0.1), ..Wanted::default() })?;
    let path = scene.path()?;
    let truth: Vec<_> = path.vehicle_rows([0.0, scene.capture.to_s], 5.0).collect();
    let misses = compare(&fused.epochs, &truth);
    Ok(Figures::new(scene, &fused, &misses))
}

fn cells(name: &str, all: &[Figures]) -> Vec<String> {
    let sum = |of: &dyn Fn(&Figures) -> f64| all.iter().map(of).sum::<f64>();
    let rms = |dark: usize| (sum(&|f| f.square[dark]) / sum(&|f| f.count[dark]).max(1.0)).sqrt().to_degrees();
    let beyond = |dark: usize| 100.0 * sum(&|f| f.beyond[dark]) / sum(&|f| f.count[dark]).max(1.0);
    let nees = |dark: usize| 3.0 * sum(&|f| f.nees[dark]) / sum(&|f| f.count[dark]).max(1.0);
    let largest = all.iter().map(|f| f.largest_rad).fold(0.0, f64::max).to_degrees();
    let above_s = all.iter().map(|f| f.above_s).fold(0.0, f64::max);
    let restarts: usize = all.iter().map(|f| f.restarts).sum();
    vec![
        name.to_owned(),
        all.len().to_string(),
        format!("{:.3}° / {:.3}°", rms(0), rms(1)),
        format!("{:.2} / {:.2}", nees(0), nees(1)),
        format!("{:.2} % / {:.2} %", beyond(0), beyond(1)),
        format!("{largest:.2}°"),
        format!("{above_s:.0} s"),
        restarts.to_string(),
    ]
}

const HEAD: [&str; 8] = [
    "settings",
    "flights",
    "RMS of an axis, light / eclipse",
    "NEES (3), light / eclipse",
    "beyond 3σ, light / eclipse",
    "largest error",
    "longest time above 5°",
    "new starts",
];

pub(super) fn study(effort: &Effort, section: &mut Section) -> anyhow::Result<()> {
    let orbits = if effort.frames.is_some() { 2 } else { ORBITS };
    let donors = donors(effort)?;
    let scenes: Vec<Scenario> =
        (0..FLIGHTS.0 as u64).map(|k| scene(FLIGHTS.1 + k, orbits)).collect::<Result<_, _>>()?;
    section.text(format!(
        "**A satellite that tumbles ({orbits} orbits).** Scene `tumble`: 550 km, 2.9°/s, one camera, a picture every \
         {STEP_S:.0} s, an inertial unit with the errors of table 3 of [BB]. In the Earth's shadow the camera gives \
         neither limb nor Sun, and a limb counts only where its middle is lit. The errors of the directions are drawn \
         from {} pictures of the scene (seed {}) that the sensor answers with default settings; the flights have other \
         seeds. *defaults*: table 3. *estimated*: all errors of the gyros and the limb height are estimated, and the \
         tuning noise of the gyros is 0.05°/√h; chosen by derivation, not on these flights. *false*: one limb in fifty \
         is 52° wrong and claims 0.2°.",
        PICTURES.0, PICTURES.1
    ));
    section.text(donors.describe());
    let mut rows = Vec::new();
    for (name, settings) in [("defaults", Settings::default()), ("estimated", vehicle::estimating())] {
        for with_false in [false, true] {
            let all: Vec<Figures> =
                scenes.par_iter().map(|s| fly(s, &donors, &settings, with_false)).collect::<Result<_, _>>()?;
            rows.push(cells(&if with_false { format!("{name}, false") } else { name.to_owned() }, &all));
        }
    }
    section.table(HEAD, rows);
    Ok(())
}
