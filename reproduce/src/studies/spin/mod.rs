//! Measures what the camera adds while a rocket spins: the roll at despin without it, and with limb and Sun.

mod flight;
mod rendered;

use hzn_fuse::input::Body;
use hzn_fuse::simulated::{Errors, Moment, inputs};
use hzn_nav::frames::{Cam, Covariance, Vector};
use hzn_sim::counter::{Counter, Stream};
use rayon::prelude::*;

use super::setup::Effort;
use crate::section::Section;
use flight::{
    DESPUN_S, Despun, HEAD, LAUNCHER_SIGMA_DEG, LIMB_SIGMA_DEG, PICTURES, SPIN_HZ, YOYO_S, navigate, row, scene,
    settings,
};

/// Number of flights, and the seed of the first.
const FLIGHTS: (usize, u64) = (24, 9300);
/// Error of the drawn directions of the Sun, 1-sigma about each of two axes, degrees. It is assumed, as that of the
/// limb.
const SUN_SIGMA_DEG: f64 = 0.05;
/// Random errors of the time stamps, s: at this rate the vehicle turns by 1.8° in a millisecond.
const JITTERS_S: [f64; 3] = [0.0, 1e-4, 1e-3];

/// Directions with white errors.
struct White {
    seed: u64,
    count: u64,
}

impl Errors for White {
    fn draw(&mut self, at: &Moment, axis: &Vector<Cam>) -> (Vector<Cam>, Covariance<Cam>) {
        let sigma = if at.body == Body::Limb { LIMB_SIGMA_DEG } else { SUN_SIGMA_DEG }.to_radians();
        let draws = Counter::new(self.seed, Stream::Clock);
        let mut normal = || {
            self.count += 1;
            draws.normal(self.count)
        };
        let error = Vector::<Cam>::new(normal(), normal(), normal()) * sigma;
        (error - *axis * error.dot(axis), Covariance::across(axis, sigma.powi(2)))
    }
    fn by_limb_height(&mut self, _: &Moment, _: &Vector<Cam>) -> Vector<Cam> {
        Vector::zeros()
    }
}

/// Flies with drawn directions, or without any.
fn fly(seed: u64, jitter_s: f64, with_camera: bool) -> anyhow::Result<Despun> {
    let scene = scene(seed, jitter_s)?;
    let mut errors = White { seed, count: 0 };
    let mut inputs = inputs(&scene, &mut errors, 0.0)?;
    if !with_camera {
        inputs.recordings.clear();
    }
    navigate(&scene, inputs, &settings(jitter_s))
}

pub(super) fn navigation_through_spin(effort: &Effort) -> anyhow::Result<Section> {
    let flights = effort.frames(FLIGHTS.0);
    let mut s = Section::default();
    let (from_s, to_s, frames) = PICTURES;
    s.text(format!(
        "{flights} flights of the vehicle of `hzn simulate atek` (seeds from {}) that spins up to {SPIN_HZ} turns a \
         second from lift-off to T+44 s and is despun from T+{YOYO_S:.0} s. Gyros to ± 2000°/s with a scale factor of \
         2000 ppm (1σ), 200 samples a second. The launcher gives the attitude at lift-off to {LAUNCHER_SIGMA_DEG}°. \
         Two cameras with mounts of 1° take {frames} pictures each from T+{from_s:.0} s to T+{to_s:.0} s, {:.0}\u{a0}a \
         second. No picture is rendered: where limb or Sun are in view, their directions have white errors of \
         {LIMB_SIGMA_DEG}° and {SUN_SIGMA_DEG}°. The filter estimates the scale factor; everything else is table 3. \
         Errors are those at T+{DESPUN_S:.0} s, RMS over the flights; roll is the rotation about the long axis.",
        FLIGHTS.1,
        f64::from(frames - 1) / (to_s - from_s),
    ));
    let turned_deg = 360.0 * SPIN_HZ * (YOYO_S + 0.5 - 0.5 * PICTURES.0);
    s.text(format!(
        "Until despin the vehicle makes {:.0} turns. With the gyros alone the roll would be lost: 2000 ppm of the \
         turns are {:.0}°. *No camera* is the filter with inertial unit and receiver. It does better than the gyros \
         alone; the likely reason, which was not tested, is the acceleration across the long axis, 3° from the \
         direction of flight, that the receiver sees. Both errors of the directions are assumed; \
         rendered pictures follow below.",
        turned_deg / 360.0,
        2e-3 * turned_deg
    ));
    let mut rows = Vec::new();
    let ways = std::iter::once((false, 0.0)).chain(JITTERS_S.map(|jitter_s| (true, jitter_s)));
    for (with_camera, jitter_s) in ways {
        let all: Vec<Despun> = (0..flights as u64)
            .into_par_iter()
            .map(|k| fly(FLIGHTS.1 + k, jitter_s, with_camera))
            .collect::<anyhow::Result<_>>()?;
        let name = match with_camera {
            true => format!("limb and Sun, time stamps to {} ms", 1e3 * jitter_s),
            false => "no camera".into(),
        };
        rows.push(row(name, &all));
    }
    s.table(HEAD, rows);
    rendered::add(&mut s, effort)?;
    Ok(s)
}
