//! Measures accuracy and honesty on the scenes of `hzn simulate`, as a user finds them with simulate, run and evaluate.

use hzn_core::Preset;
use hzn_evaluate::Case;
use hzn_sim::Flight;
use hzn_sim::scenario::FIT_PICTURES;

use super::setup::{Effort, OTHER_SEEDS, preset, simulated};
use crate::fly::{HEADS, Sensor, cells, evaluate, fly, list_wrong_answers};
use crate::section::Section;

/// Runs scenes through sensors and adds a table with one row per scene, sensor and body.
fn add_rows(
    s: &mut Section,
    names: &[&str],
    count: usize,
    sensors: impl Fn(&Flight) -> Vec<Sensor>,
) -> anyhow::Result<()> {
    let (mut rows, mut measured, mut bad) = (Vec::new(), Vec::new(), Vec::new());
    for &name in names {
        let (flight, text) = simulated(name, count)?;
        measured.push(text);
        let bodies = flight.sensor.each_body();
        let sensors = sensors(&flight);
        for (sensor, cases) in sensors.iter().zip(fly(&flight, &sensors)?) {
            for body in bodies {
                let kind = body.kind.name();
                let own: Vec<Case> = cases.iter().filter(|c| c.body == kind).cloned().collect();
                let shown = if bodies.len() > 1 { format!("`{name}`, {kind}") } else { format!("`{name}`") };
                rows.push([shown, sensor.name.clone()].into_iter().chain(cells(&evaluate(&own))).collect());
                let wrong = list_wrong_answers(&own);
                if sensor.name.starts_with("hzn") && !wrong.is_empty() {
                    bad.push(format!("{}: {wrong}", sensor.name));
                }
            }
        }
    }
    s.table(["scene", "sensor"].into_iter().chain(HEADS), rows);
    s.text(format!(
        "{OTHER_SEEDS} The values in sensor.toml, measured on {FIT_PICTURES} pictures of other seeds: {}.",
        measured.join("; ")
    ));
    if !bad.is_empty() {
        s.text(format!("Wrong answers: {}.", bad.join("; ")));
    }
    Ok(())
}

const BY_HAND: &str = "By hand: `hzn simulate SCENE -o flight`, `hzn run flight -o flight.csv`, \
                       `hzn evaluate flight.csv --truth flight/truth.csv`.";

pub(super) fn rocket(effort: &Effort) -> anyhow::Result<Section> {
    let count = effort.frames(200);
    let mut s = Section::default();
    s.text(format!(
        "{count} pictures per scene of 1920×1080 pixels through a fisheye of 92°, from T+60 s to T+430 s of a flight \
         to 238 km over clouds, sea and land; the limb falls off exponentially (scale 8 km, a different depth for each \
         colour), PSF 0.9 px, noise 2 %, 8 bits. `rocket-clean`: no Sun in view; goals: all answered, 0.06° RMS, none \
         above 2°, NEES 1 to 4. `rocket`: Sun, lens ghosts and payload in view, colour, sRGB, JPEG; goals: 98 % \
         answered, none above 2°, none without a limb. The prior has the position. {BY_HAND}"
    ));
    let sensors = |flight: &Flight| {
        let hzn = flight.sensor.clone();
        let dlr = preset(Preset::Dlr2022, flight, hzn.body.clone());
        vec![
            Sensor::new("hzn", hzn.clone()),
            Sensor::new("hzn, attitude to 5°", hzn).with_attitude(5.0),
            Sensor::new("dlr-2022", dlr),
        ]
    };
    add_rows(&mut s, &["rocket-clean", "rocket"], count, sensors)?;
    s.text(
        "`dlr-2022` rebuilds [BB]: a fixed threshold, whole pixels, RANSAC on three points and their direct estimate, \
         whose direction uses neither altitude nor limb height. Its covariance is the overbound [BB 37]. As in \
         the paper, the edge with the smallest residual is the limb. Most of its error comes from one threshold for \
         the whole picture under a lens that darkens towards the corners (book/theory/methods.md). The 0.6° of [BB] is \
         the largest angle between a direction and the aided solution of a flight, which is another statistic than \
         these errors. In `rocket` the half level of the limb moves within the flight, because the camera applies a \
         tone curve to a picture with the Sun's veil. This movement is the sigma of the limb height, and it causes \
         most of the error (0.03° per kilometre).",
    );
    Ok(s)
}

pub(super) fn others(effort: &Effort) -> anyhow::Result<Section> {
    let count = effort.frames(200);
    let mut s = Section::default();
    s.text(format!(
        "{count} pictures per scene, as book/theory/simulator.md describes them. `tumble` is coarse (4 km of limb \
         height per pixel) and shows the limb, the Sun or nothing in turn; an answer to a picture without a limb is \
         false. {BY_HAND}"
    ));
    let hzn = |flight: &Flight| vec![Sensor::new("hzn", flight.sensor.clone())];
    add_rows(&mut s, &["horace-wide", "full-disc", "tumble", "sun-moon"], count, hzn)?;
    Ok(s)
}
