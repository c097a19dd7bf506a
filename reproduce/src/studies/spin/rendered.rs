//! Renders pictures during the spin: the errors of the directions, and the navigation with them.

use hzn_core::body::Kind;
use hzn_evaluate::Case;
use hzn_sim::Scenario;

use super::super::recordings::{self, untold};
use super::super::setup::Effort;
use super::flight::{HEAD, YOYO_S, navigate, row, scene, settings};
use crate::fly::{HEADS, Sensor, cells, evaluate, fly};
use crate::section::Section;

/// First seed and number of the flights whose directions are evaluated, and the pictures of each of the two cameras.
const LOOKS: (u64, u64, u32) = (9401, 4, 12);
/// First seed and number of the flights through the filter.
const FLIGHTS: (u64, usize) = (9301, 4);
/// Random errors of the time stamps in these flights, s.
const JITTER_S: f64 = 1e-4;

/// Width and height of the rendered pictures are those of the scene divided by this: a picture in which everything
/// moves by 74 pixels during the exposure takes a quarter of a minute to render.
const SMALLER: u16 = 3;

/// Returns the flight with smaller pictures through the same lens.
fn smaller(seed: u64, jitter_s: f64) -> anyhow::Result<Scenario> {
    let mut scene = scene(seed, jitter_s)?;
    let (camera, by) = (&mut scene.camera, f64::from(SMALLER));
    (camera.width, camera.height) = (camera.width / SMALLER, camera.height / SMALLER);
    for focal_px in [&mut camera.fx_px, &mut camera.fy_px] {
        *focal_px /= by;
    }
    // The centre of the first pixel is at (0, 0).
    for centre_px in [&mut camera.cx_px, &mut camera.cy_px] {
        *centre_px = (*centre_px + 0.5) / by - 0.5;
    }
    Ok(scene)
}

/// Adds the tables of the rendered pictures.
pub(super) fn add(s: &mut Section, effort: &Effort) -> anyhow::Result<()> {
    directions(s, effort)?;
    navigation(s, effort)
}

/// Evaluates the directions at full spin.
fn directions(s: &mut Section, effort: &Effort) -> anyhow::Result<()> {
    let (first, flights, pictures) = LOOKS;
    let pictures = u32::try_from(effort.frames(pictures as usize))?;
    s.text(format!(
        "**Directions of rendered pictures.** {pictures} pictures of each of the two cameras in {flights} flights \
         (seeds from {first}), T+44 s to T+{YOYO_S:.0} s, before the vehicle is despun. A picture has a third of the \
         scene's width and height. Exposure and readout are those of the \
         scene: 2 ms and 20 ms, in which the vehicle turns by 3.6° and 36°. The sensor has its default settings: it \
         does not know the limb height (true: 25 km) and the noise. *No rates*: it does not know either that the \
         vehicle turns."
    ));
    let mut cases: [Vec<Case>; 2] = Default::default();
    for seed in first..first + flights {
        let mut scene = smaller(seed, 0.0)?;
        (scene.capture.to_s, scene.capture.frames) = (YOYO_S, pictures);
        for one in scene.by_camera() {
            let sensor = untold(&one);
            let sensors = [Sensor::new("rates", sensor.clone()), Sensor::new("no rates", sensor).without_rates()];
            for (all, flown) in cases.iter_mut().zip(fly(&one.flight()?, &sensors)?) {
                all.extend(flown);
            }
        }
    }
    let mut rows = Vec::new();
    for (name, cases) in ["rates told", "no rates"].iter().zip(&cases) {
        for body in [Kind::Earth, Kind::Sun] {
            let own: Vec<Case> = cases.iter().filter(|case| case.body == body.name()).cloned().collect();
            rows.push([vec![format!("{}, {name}", body.name())], cells(&evaluate(&own))].concat());
        }
    }
    let heads: Vec<&str> = std::iter::once("body").chain(HEADS).collect();
    s.table(heads, rows);
    Ok(())
}

/// Navigates with the directions of rendered pictures.
fn navigation(s: &mut Section, effort: &Effort) -> anyhow::Result<()> {
    let (first, count) = FLIGHTS;
    let mut all = Vec::new();
    let mut directions = 0;
    for seed in (first..).take(count) {
        let scene: Scenario = {
            let mut scene = smaller(seed, JITTER_S)?;
            scene.capture.frames = u32::try_from(effort.frames(scene.capture.frames as usize))?;
            scene
        };
        let inputs = recordings::inputs(&scene, untold, None)?;
        directions += inputs.recordings.iter().map(|camera| camera.seen.len()).sum::<usize>();
        all.push(navigate(&scene, inputs, &settings(JITTER_S))?);
    }
    s.text(format!(
        "**The same flights with rendered pictures.** {count} flights (seeds from {first}) as in the first table, time \
         stamps to {} ms, but each picture is rendered, in the smaller size, and the directions \
         ({directions} of limb and Sun) are those of a sensor with default settings.",
        1e3 * JITTER_S
    ));
    s.table(HEAD, vec![row("limb and Sun of pictures".into(), &all)]);
    Ok(())
}
