//! Compares the presets on the same pictures.

use anyhow::anyhow;
use hzn_core::HostHorizon;
use hzn_core::Preset;
use hzn_core::body::Kind;
use hzn_core::image::Pixels;
use hzn_evaluate::Case;
use hzn_host::Compiled;
use hzn_sim::{Flight, Picture};

use super::setup::{self, Effort, OTHER_SEEDS, simulated};
use crate::fly::{Flown, GROSS_DEG, Sensor, deg, evaluate, fly_timed, two_digits};
use crate::section::Section;

/// Number of pictures from which the fixed threshold is set.
const THRESHOLD_PICTURES: usize = 9;

/// The four presets that are compared.
const PRESETS: [Preset; 4] = [Preset::Hzn, Preset::Dlr2022, Preset::Zju2022, Preset::Horace2015];

pub(super) fn compare_presets(effort: &Effort) -> anyhow::Result<Section> {
    let count = effort.frames(120);
    let mut s = Section::default();
    s.text(format!(
        "{count} pictures of each scene of `hzn simulate` ({} of the infrared one), each through every preset. All \
         presets get the same values: camera, mask, position, and the limb height and edge errors that were measured \
         on other pictures of the scene (`hzn simulate` writes them into its sensor.toml). The makers of `dlr-2022` \
         set its threshold for their scene; here it is the median of the thresholds that `otsu` finds on \
         {THRESHOLD_PICTURES} of the pictures. RMS, 95 % and NEES (2 is ideal) are for answers within {GROSS_DEG}°; \
         gross errors (above it) and false answers (without a limb in view) have their own columns. Times are medians \
         while two pictures are processed at once.",
        3 * count,
    ));
    s.text(format!("{OTHER_SEEDS} The threshold of `dlr-2022` is in-sample: it comes from these pictures."));
    let mut rows = Vec::new();
    for (name, flight) in scenes(count)? {
        let level = median_threshold(&flight)?;
        let sensors: Vec<Sensor> = PRESETS.iter().map(|&p| sensor(p, &flight, level)).collect();
        for (sensor, flown) in sensors.iter().zip(fly_timed(&flight, &sensors)?) {
            rows.push(row(name, &sensor.name, &flown));
        }
    }
    s.table(["scene", "preset", "answered", "gross", "false", "RMS", "95 %", "NEES", "time, µs"], rows);
    Ok(s)
}

/// Returns the scenes, each with the sensor that fits it.
fn scenes(count: usize) -> anyhow::Result<Vec<(&'static str, Flight)>> {
    let [rocket, clean, horace, disc] =
        ["rocket", "rocket-clean", "horace-wide", "full-disc"].map(|name| anyhow::Ok(simulated(name, count)?.0));
    let (infrared, _) = simulated("leo-infrared", 3 * count)?;
    let third = |k: usize| Flight { frames: infrared.frames[k * count..(k + 1) * count].to_vec(), ..infrared.clone() };
    let (mut sun, _) = simulated("sun-moon", count)?;
    sun.sensor.body = sun.sensor.bodies.first().cloned().ok_or_else(|| anyhow!("the scene sun-moon has no bodies"))?;
    sun.sensor.threshold = sun.sensor.body.threshold.unwrap_or(sun.sensor.threshold);
    sun.sensor.covariance = sun.sensor.body.covariance.unwrap_or(sun.sensor.covariance);
    sun.sensor.bodies.clear();
    Ok(vec![
        ("rocket, Sun, ghosts and payload in view", rocket?),
        ("rocket, clean", clean?),
        ("infrared, 0° to 40° off nadir", third(0)),
        ("infrared, 40° to 80°", third(1)),
        ("infrared, 80° to 120°", third(2)),
        ("HORACE's flight, 59° wide", horace?),
        ("full disc", disc?),
        ("Sun, then Moon", sun),
    ])
}

/// Returns a preset that knows as much as the scene's own sensor.
fn sensor(preset: Preset, flight: &Flight, level: f64) -> Sensor {
    let mut config = setup::preset(preset, flight, flight.sensor.body.clone());
    match preset {
        Preset::Hzn => config = flight.sensor.clone(),
        Preset::Dlr2022 => config.threshold.level = level,
        _ => {}
    }
    Sensor::new(&format!("`{}`", preset.name()), config)
}

/// Returns the threshold that `otsu` usually finds (the median), or for the Sun the threshold of the scene's sensor, as
/// a fraction of full scale.
fn median_threshold(flight: &Flight) -> anyhow::Result<f64> {
    if flight.sensor.body.kind == Kind::Sun {
        return Ok(flight.sensor.threshold.level);
    }
    let mut horizon = HostHorizon::boxed(&flight.sensor)?;
    let step = flight.frames.len().div_ceil(THRESHOLD_PICTURES).max(1);
    let mut levels = Vec::new();
    for frame in flight.frames.iter().step_by(step) {
        let picture: Picture = frame.render()?;
        let expected = horizon.expect(&frame.prior())?;
        let report = horizon.find(picture.view(), &expected);
        levels.push(f64::from(report.level) / f64::from(picture.view().full_scale()));
    }
    levels.sort_by(f64::total_cmp);
    levels.get(levels.len() / 2).copied().ok_or_else(|| anyhow!("no pictures"))
}

fn row(scene: &str, preset: &str, flown: &Flown) -> Vec<String> {
    let gross = |c: &Case| c.limb && c.miss.is_some_and(|m| m.angle_deg > GROSS_DEG);
    let all = evaluate(&flown.cases);
    let good: Vec<Case> = flown.cases.iter().filter(|c| !gross(c)).cloned().collect();
    let good = evaluate(&good);
    let error = |value: fn(&hzn_evaluate::Errors) -> f64| good.errors.as_ref().map_or("–".into(), |x| deg(value(x)));
    let without = all.frames - all.with_limb;
    let mut times = flown.elapsed_us.clone();
    times.sort_by(f64::total_cmp);
    vec![
        scene.to_owned(),
        preset.to_owned(),
        format!("{}/{}", all.answered, all.with_limb),
        flown.cases.iter().filter(|c| gross(c)).count().to_string(),
        if without > 0 { format!("{}/{without}", all.false_answers) } else { "–".into() },
        error(|x| x.rms_deg),
        error(|x| x.p95_deg),
        good.honesty.as_ref().map_or("–".into(), |h| two_digits(h.nees)),
        times.get(times.len() / 2).map_or("–".into(), |t| format!("{t:.0}")),
    ]
}
