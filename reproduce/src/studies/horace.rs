//! Barf 2014 and Barf et al. 2015: HORACE's own criteria.

use hzn_core::camera::{self, Model};
use hzn_core::pipeline::Preset;
use hzn_core::{Config, body};
use hzn_sim::evaluate::Evaluation;
use hzn_sim::flight::rocket;
use hzn_sim::pose::position_m;
use hzn_sim::{Flight, Look, Pose};

use super::{Effort, halton, preset};
use crate::document::Section;
use crate::fly::{Sensor, deg, evaluate, fly, wrong};

/// `count` pictures of a spinning rocket without rate control: azimuth and roll anywhere, the optical axis from 40° above
/// the horizontal to 70° below, so that a part of them shows no limb.
fn pictures(count: usize) -> Flight {
    let mut flight = rocket(640, 480, 1, 31);
    let camera = camera::Config::ideal(Model::Pinhole, 640, 480, 560.0);
    let own = body::Config { altitude_sigma_km: 0.1, limb_height_sigma_km: 1.0, ..flight.sensor.body.clone() };
    flight.sensor = Config { camera: camera.clone(), body: own, ..flight.sensor };
    let Some(pattern) = flight.frames.first().cloned() else { return flight };
    let frame = |i: usize| {
        let n = i + 1;
        let turn = core::f64::consts::TAU;
        let look = Look {
            azimuth_rad: turn * halton(n, 2),
            depression_rad: (110.0 * halton(n, 3) - 40.0).to_radians(),
            roll_rad: turn * halton(n, 5),
        };
        let mut frame = pattern.clone();
        (frame.file, frame.time_s) = (format!("horace-{i:04}.png"), i as f64);
        frame.scene.camera = camera.clone();
        frame.scene.pose = Pose::looking(position_m(67.9, 21.1, 60.0 + 30.0 * halton(n, 7)), look);
        frame.scene.seed = 5000 + i as u64;
        frame
    };
    flight.frames = (0..count).map(frame).collect();
    flight
}

pub(super) fn criteria(effort: &Effort) -> anyhow::Result<Section> {
    let count = effort.frames(200);
    let mut s = Section::default();
    s.text(format!(
        "{count} pictures of 640×480 pixels through a pinhole of 59°, 60 to 90 km above clouds and dark sea as in the rocket \
         scene, azimuth and roll anywhere, the optical axis from 40° above the horizontal to 70° below. An answer succeeds \
         when its half-angle is within 10 % and its direction within 10 % of the half-angle; every other picture with a \
         limb in view is a false negative, an answer without one a false positive."
    ));
    let flight = pictures(count);
    let horace = preset(Preset::Horace2015, &flight, flight.sensor.body.clone());
    let sensors = [Sensor::new("hzn", flight.sensor.clone()), Sensor::new("horace-2015", horace)];
    let flown = fly(&flight, &sensors)?;
    let percent = |x: f64| format!("{:.1} %", 100.0 * x);
    let row = |name: String, e: &Evaluation| {
        let error = |of: fn(&hzn_sim::evaluate::Errors) -> f64| e.errors.as_ref().map_or("–".into(), |x| deg(of(x)));
        vec![
            name,
            format!("{}/{}", e.answered, e.with_limb),
            percent(e.horace.false_negatives),
            e.horace.false_positives.map_or("–".into(), percent),
            error(|x| x.median_deg),
            error(|x| x.rms_deg),
            error(|x| x.worst_deg),
        ]
    };
    let published = ["[B14], [H15]", "", "10.29 %", "0 %", "0.6° (accuracy)", "", ""].map(str::to_owned).to_vec();
    let wrong = wrong(&flown[0]);
    let ours = sensors.into_iter().zip(&flown).map(|(sensor, cases)| row(sensor.name, &evaluate(cases)));
    s.table(
        ["sensor", "answered", "false negatives", "false positives", "median", "RMS", "worst"],
        std::iter::once(published).chain(ours),
    );
    if !wrong.is_empty() {
        s.text(format!(
            "Wrong answers of `hzn`: {wrong}. An error of twice the half-angle (some 81° here) has the Earth on the other side \
             of the edge. This scene shows a weakness that the flights below do not; it is not solved."
        ));
    }
    s.text(
        "[B14] and [H15] count on their own set of test pictures and their flight video, which are not public: pictures of a \
         limb that is curved enough for a circle, seen by a camera that looks at the Earth. `horace-2015` rebuilds their \
         method; the centre of its circle is not the direction to the Earth in a tilted picture (docs/methods.md), which is \
         what its errors here are.",
    );
    Ok(s)
}
