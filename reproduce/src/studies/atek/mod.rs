//! The flight of ATEK through the navigation filter: flights through pictures, and many flights with their errors.

mod score;

use hzn_core::body::Kind;
use hzn_fuse::flight::Wanted;
use hzn_fuse::input::Inputs;
use hzn_fuse::{Fused, Settings, fuse, simulated};
use hzn_sim::Scenario;
use rayon::prelude::*;

use super::recordings::{self, untold};
use super::residuals::{self, Donors, Residuals};
use super::setup::Effort;
use crate::section::Section;
use score::{LATEST_START_S, Score, Table};

/// First seed of the flights through pictures, and their number.
const PICTURE_FLIGHTS: (u64, usize) = (5101, 4);
/// First seed of the flights without pictures.
const FIRST_SEED: u64 = 7000;
/// Number of flights without pictures.
const FLIGHTS: usize = 100;
/// Pictures of a camera in a flight: one each second.
const PICTURES: usize = 371;
/// Pictures of a camera in which the Sun is looked for.
const LOOKS: usize = 38;

/// Returns the scene with a seed.
pub(super) fn scene(seed: u64, count: usize) -> anyhow::Result<Scenario> {
    let mut scene = Scenario::builtin("atek").ok_or_else(|| anyhow::anyhow!("there is no scene atek"))?;
    scene.seed = seed;
    scene.capture.frames = u32::try_from(count)?;
    Ok(scene)
}

/// Returns the flights from a seed on in which a camera sees the Sun before [`LATEST_START_S`].
fn with_sun(first_seed: u64, flights: usize, count: usize) -> anyhow::Result<Vec<Scenario>> {
    let mut found = Vec::new();
    for seed in first_seed.. {
        if found.len() == flights {
            break;
        }
        for one in scene(seed, LOOKS)?.by_camera() {
            let looks = one.flight()?;
            let mut early = looks.frames.iter().filter(|f| f.time_s < LATEST_START_S);
            if early.any(|f| f.scene.visible_px(Kind::Sun).is_ok_and(|px| px > 27.0)) {
                found.push(scene(seed, count)?);
                break;
            }
        }
    }
    Ok(found)
}

/// The defaults, which are those of the paper's table 3, and settings for the inertial unit and the directions of the
/// scene.
fn settings() -> [(&'static str, Settings); 2] {
    let mut own = Settings::default();
    own.imu.gyro_noise_deg_rth[1] = 0.6;
    own.imu.accel_noise_mg_rthz[1] = 0.5;
    own.camera.white_rad = 5e-4;
    [("defaults", Settings::default()), ("scene", own)]
}

pub(super) fn fly(inputs: &Inputs, settings: &Settings) -> Option<Fused> {
    fuse(inputs, settings, Wanted { rate_hz: Some(2.0), ..Wanted::default() }).ok()
}

/// Flies all flights with both settings, with and without false answers.
fn score_all(flights: &[(Scenario, Inputs)]) -> Table {
    let mut table = Table::default();
    for (name, settings) in settings() {
        for with_false in [false, true] {
            let scores: Vec<Option<Score>> = flights
                .par_iter()
                .map(|(scene, inputs)| {
                    let mut inputs = inputs.clone();
                    if with_false {
                        residuals::replace_one_in_fifty(&mut inputs);
                    }
                    fly(&inputs, &settings).and_then(|fused| Score::new(scene, &fused))
                })
                .collect();
            table.add(name, with_false, scores);
        }
    }
    table
}

/// What no filter can do better before the vehicle turns.
const BEFORE_THE_TURN: &str = "Before the vehicle turns, an attitude with a prior of 2° and two cameras with mounts of \
    1° cannot be better than 3/√(1/2² + 2/1²) = 2.0° (3σ). The 1.1° of [BB] needs rotation against the directions, or \
    it is too small because of (48) with (50) as printed (book/theory/navigation.md).";

pub(super) fn navigation(effort: &Effort) -> anyhow::Result<Section> {
    let count = effort.frames(PICTURES);
    let mut section = Section::default();
    section.text(format!(
        "Scene `atek`: two cameras whose stated mounts have errors of 1° and whose clocks are 0.05 s to 0.15 s wrong, \
         an inertial unit of 20 Hz, a receiver. The horizon sensor has its default settings; it knows neither the limb \
         height (true: 25 km) nor the noise. Mounts, clocks and biases are different in every flight. *defaults*: \
         every setting of the filter is the default, that is table 3 of [BB]. *scene*: the shares for unmodelled \
         errors are smaller (gyros 0.6°/√h, accelerometers 0.5 mg/√Hz, directions 0.0005 rad); chosen on seed 1, which \
         is in no table. The filter begins with the first picture of limb and Sun. The Sun is not in view in every \
         flight; the flights are the first seeds from {} and {FIRST_SEED} on whose geometry shows it before \
         T+{LATEST_START_S:.0} s.",
        PICTURE_FLIGHTS.0
    ));
    let mut donors = Vec::new();
    let mut rows = Vec::new();
    for scene in with_sun(PICTURE_FLIGHTS.0, PICTURE_FLIGHTS.1, count)? {
        let inputs = recordings::inputs(&scene, untold, effort.recordings.as_deref())?;
        donors.push(Residuals::new(&scene, &inputs)?);
        for (name, settings) in settings() {
            let head = vec![scene.seed.to_string(), name.to_owned()];
            let cells = match fly(&inputs, &settings) {
                Some(fused) => score::picture_cells(&scene, &fused)?,
                None => vec!["no limb with Sun".to_owned()],
            };
            rows.push([head, cells].concat());
        }
    }
    rows.push(score::paper_row());
    section.text(
        "**Flights through pictures.** 3σ is the largest of three axes. The angles are medians over the flight: \
         between the directions and the solution, with and without aid after the first attitude, and between the \
         attitude of two directions alone (TRIAD) and the filter. The last row is the flight of the paper: its angles \
         are the largest of the flight, and its last column has 3σ, where ours has 1σ.",
    );
    section.table(score::PICTURE_HEAD, rows);
    section.text(BEFORE_THE_TURN);
    let residuals = Donors::new(donors);
    section.text(residuals.describe());
    let flights: Vec<(Scenario, Inputs)> = with_sun(FIRST_SEED, FLIGHTS.min(effort.frames(FLIGHTS)), count)?
        .into_par_iter()
        .map(|scene| {
            let inputs = simulated::inputs(&scene, &mut residuals.draw(scene.seed), 0.0)?;
            Ok((scene, inputs))
        })
        .collect::<anyhow::Result<_>>()?;
    let table = score_all(&flights);
    section.text(format!(
        "**{} flights without pictures**, with the errors of the pictures above: each direction gets the error, the \
         covariance and the derivative by the limb height of a direction at a similar place in the picture and a \
         similar height, from one flight and camera for 20 s. Errors of the attitude are RMS about each axis of the \
         vehicle. *lost*: an error above 5° for more than 10 s, or above 5σ (χ² of three axes above 31.8 for more \
         than 10 s). *false*: one limb in fifty is 52° wrong and claims 0.2°.",
        flights.len()
    ));
    section.table(score::FLIGHT_HEAD, table.rows());
    section.text(table.verdict());
    Ok(section)
}
