//! Measures the honesty of a sensor that is not tuned: its user knows the camera and its position, and nothing else.

use anyhow::{Context, anyhow};
use hzn_calib::noise::{self, Calibration, PointRecorder, Sighting};
use hzn_core::body;
use hzn_core::camera::Camera;
use hzn_core::{Config, HostHorizon};
use hzn_evaluate::Case;
use hzn_host::Compiled;
use hzn_sim::scenario::Fit;
use hzn_sim::{Flight, FlightFrame, Picture, Scenario};
use rayon::prelude::*;

use super::setup::Effort;
use crate::fly::{Sensor, deg, evaluate, fly_rendered, list_wrong_answers, two_digits};
use crate::section::Section;

/// Scenes that must meet the goals.
const SCENES: [&str; 6] = ["rocket-clean", "rocket", "horace", "horace-wide", "leo-infrared", "full-disc"];
/// Scene whose rolling shutter breaks the model of a still camera.
const ROLLING_SHUTTER_SCENE: &str = "tumble";
/// Seeds of the flights. No scene has one of them as its own seed, and `hzn simulate` does not measure its noise model
/// on them.
const SEEDS: [u64; 3] = [404, 505, 606];
/// Number of pictures per flight.
const PICTURES: usize = 24;

/// Flight with its pictures, and with the limb height and noise that are measured on them.
pub(super) struct Rendered {
    pub(super) flight: Flight,
    pub(super) pictures: Vec<Picture>,
    /// Limb height and noise measured with the truth, as `hzn simulate` does.
    pub(super) fit: Option<Fit>,
    /// Limb height and noise measured without the truth, as `hzn calibrate noise` does; or the reason why this failed.
    pub(super) calibration: anyhow::Result<Calibration>,
    /// Whether the prior has the rates of rotation.
    rates: bool,
}

impl Rendered {
    fn new(scene: &str, seed: u64, count: usize) -> anyhow::Result<Self> {
        let mut scenario = Scenario::builtin(scene).ok_or_else(|| anyhow!("there is no built-in scene {scene}"))?;
        scenario.seed = seed;
        scenario.capture.frames = u32::try_from(count)?;
        Self::from_scenario(&scenario, scene == ROLLING_SHUTTER_SCENE).with_context(|| format!("{scene}, seed {seed}"))
    }

    /// Renders every picture of a scenario and measures it, with or without the rates of rotation in the prior.
    pub(super) fn from_scenario(scenario: &Scenario, rates: bool) -> anyhow::Result<Self> {
        let flight = scenario.flight()?;
        let pictures: Vec<Picture> = flight.frames.par_iter().map(FlightFrame::render).collect::<Result<_, _>>()?;
        let rendered: Vec<_> = flight.frames.iter().zip(&pictures).collect();
        let fit = Fit::measure_pictures(scenario, &rendered).into_iter().next();
        let mut rendered = Self { flight, pictures, fit, calibration: Err(anyhow!("not measured")), rates };
        rendered.calibration = rendered.calibrate(rates);
        Ok(rendered)
    }

    /// Calibrates as `hzn calibrate noise` does, from the pictures, their positions and, if `rates` is true, their
    /// rates of rotation.
    fn calibrate(&self, rates: bool) -> anyhow::Result<Calibration> {
        let wide = noise::config_for_calibration(&self.default_sensor()).context("no body with a limb height")?;
        let camera = Camera::try_new(&wide.camera)?;
        let each = self.flight.frames.par_iter().zip(&self.pictures).map_init(
            || HostHorizon::boxed(&wide),
            |horizon, (frame, picture)| {
                let horizon = horizon.as_mut().ok()?;
                let known = frame.prior();
                let known = hzn_core::Prior { rate_rad_s: known.rate_rad_s.filter(|_| rates), ..known };
                let expected = horizon.expect(&known).ok()?;
                let points = PointRecorder::default();
                let solution = horizon.find_observed(&picture.view(), &expected, &points).solution?;
                let points = points.candidate_points(solution.candidate);
                Sighting::measure(&frame.file, &camera, &wide.body, &known, &points, &solution)
            },
        );
        let sightings: Vec<Sighting> = each.flatten().collect();
        Ok(Calibration::new(&wide.body, &sightings)?)
    }

    /// Makes a sensor that gets the rates of rotation if this flight has them.
    fn sensor(&self, name: &str, config: Config) -> Sensor {
        let sensor = Sensor::new(name, config);
        if self.rates { sensor } else { sensor.without_rates() }
    }

    /// Returns the configuration of a user who knows the camera and its mask: every other key is the default. The
    /// program finds the tone from the files.
    pub(super) fn default_sensor(&self) -> Config {
        let camera = self.flight.sensor.camera.clone();
        let mut sensor = Config { mask: self.flight.sensor.mask.clone(), ..Config::new(camera) };
        sensor.input.tone = self.flight.sensor.input.tone;
        sensor
    }

    /// Returns the sensor that `hzn simulate` would write after it has measured this flight with its truth.
    fn sensor_from_truth(&self) -> Config {
        let mut sensor = self.flight.sensor.clone();
        self.fit.iter().for_each(|fit| fit.apply(&mut sensor));
        sensor
    }

    /// Returns the sensor of [`Self::default_sensor`] after `hzn calibrate noise`; `None` if the calibration refused or
    /// raised the alarm.
    fn calibrated_sensor(&self) -> Option<Config> {
        let calibration = self.calibration.as_ref().ok().filter(|c| c.alarm().is_none())?;
        let mut sensor = self.default_sensor();
        calibration.apply(&mut sensor);
        Some(sensor)
    }
}

/// Results for one entry of [`KNOWLEDGE`], over all flights of a scene.
pub(super) struct Outcome {
    pub(super) knowledge: &'static str,
    pub(super) cases: Vec<Case>,
}

impl Outcome {
    /// Returns the NEES of the answers with a limb in view.
    fn nees(&self) -> Vec<f64> {
        self.cases.iter().filter(|c| c.limb).filter_map(|c| c.miss?.nees).collect()
    }

    fn share_beyond(&self, sigmas: f64) -> f64 {
        let nees = self.nees();
        nees.iter().filter(|n| **n > sigmas * sigmas).count() as f64 / nees.len().max(1) as f64
    }

    pub(super) fn mean_nees(&self) -> f64 {
        let nees = self.nees();
        nees.iter().sum::<f64>() / nees.len() as f64
    }

    pub(super) fn rms_deg(&self) -> f64 {
        evaluate(&self.cases).errors.map_or(f64::NAN, |e| e.rms_deg)
    }

    /// Returns the goals that are missed. The goals are at most the share `beyond` of answers beyond 3 sigma, none
    /// beyond 5 sigma, a mean NEES within the limits `nees`, and no false answer.
    fn missed_goals(&self, nees: [f64; 2], beyond: f64) -> Vec<String> {
        let mut missed = Vec::new();
        let mut check = |is_missed: bool, what: String| missed.extend(is_missed.then_some(what));
        check(self.nees().is_empty(), "no answer".into());
        check(self.share_beyond(3.0) > beyond, "beyond 3 sigma".into());
        check(self.share_beyond(5.0) > 0.0, "beyond 5 sigma".into());
        check(!(nees[0]..=nees[1]).contains(&self.mean_nees()), "NEES".into());
        check(evaluate(&self.cases).false_answers > 0, "false answers".into());
        missed
    }

    fn cells(&self, scene: &str, missed: &[String]) -> Vec<String> {
        let e = evaluate(&self.cases);
        let without = e.frames - e.with_limb;
        vec![
            format!("`{scene}`"),
            self.knowledge.to_owned(),
            format!("{}/{}", e.answered, e.with_limb),
            if without > 0 { format!("{}/{without}", e.false_answers) } else { "–".into() },
            deg(self.rms_deg()),
            e.errors.as_ref().map_or_else(|| "–".into(), |x| deg(x.worst_deg)),
            two_digits(self.mean_nees()),
            format!("{:.1} %", 100.0 * self.share_beyond(3.0)),
            format!("{:.1} %", 100.0 * self.share_beyond(5.0)),
            if missed.is_empty() { "yes".into() } else { format!("no: {}", missed.join(", ")) },
        ]
    }
}

const HEADS: [&str; 10] =
    ["scene", "known", "answered", "false", "RMS", "worst", "NEES", "beyond 3σ", "beyond 5σ", "holds"];

/// Largest allowed share of answers beyond 3 sigma.
const MAX_SHARE_BEYOND_3_SIGMA: f64 = 0.02;
/// Limits of the mean NEES with defaults.
const NEES_DEFAULT: [f64; 2] = [0.4, 3.0];
/// Limits of the mean NEES after a calibration.
const NEES_CALIBRATED: [f64; 2] = [0.3, 3.0];
/// Limits of the mean NEES with a wrong focal length. There is no lower limit: sigma may be as large as the error of
/// the lens makes it.
const NEES_LENS: [f64; 2] = [0.0, 3.0];
/// Largest allowed share of answers beyond 3 sigma with a wrong focal length.
const LENS_MAX_SHARE_BEYOND_3_SIGMA: f64 = 0.01;
/// Largest allowed ratio of the RMS with only an altitude to the RMS with the position.
const MAX_RMS_RATIO_ALTITUDE: f64 = 1.3;

/// Largest allowed ratio of the RMS after a calibration on another flight to the RMS with the truth of that flight.
const MAX_RMS_RATIO_CALIBRATION: f64 = 1.7;

/// Cases of the study: what the sensor knows. A scene has a row for each.
const KNOWLEDGE: [&str; 7] = [
    "camera, position",
    "camera, altitude",
    "truth of another flight",
    "calibrated on another flight",
    "camera, position, no rates",
    "lens 0.3 % long ± 0.3 %",
    "lens 1 % short ± 1 %",
];

/// Focal lengths for the last two entries as parts of the true one, and their sigmas in percent.
const LENSES: [(f64, f64); 2] = [(1.003, 0.3), (0.99, 1.0)];

/// Returns a sensor with another focal length and with its sigma in percent.
fn with_lens(mut config: Config, (part, sigma_percent): (f64, f64)) -> Config {
    config.camera.fx_px *= part;
    config.camera.fy_px *= part;
    config.camera.focal_sigma_percent = sigma_percent;
    config
}

/// Returns the results for every entry of [`KNOWLEDGE`], over the flights of a scene.
fn outcomes(flights: &[Rendered]) -> anyhow::Result<[Outcome; 7]> {
    let mut all = KNOWLEDGE.map(|knowledge| Outcome { knowledge, cases: Vec::new() });
    for (i, flight) in flights.iter().enumerate() {
        let other = flights.get((i + 1) % flights.len()).unwrap_or(flight);
        let default = flight.default_sensor();
        let mut sensors = vec![
            (0, flight.sensor("position", default.clone())),
            (1, flight.sensor("altitude", default.clone()).with_altitude_only()),
            (2, flight.sensor("truth", other.sensor_from_truth())),
        ];
        sensors.extend(other.calibrated_sensor().map(|config| (3, flight.sensor("calibrated", config))));
        for (place, lens) in (5..).zip(LENSES).filter(|_| !flight.rates) {
            sensors.push((place, flight.sensor("lens", with_lens(default.clone(), lens))));
        }
        sensors.extend(flight.rates.then(|| (4, Sensor::new("no rates", default).without_rates())));
        let (places, sensors): (Vec<usize>, Vec<Sensor>) = sensors.into_iter().unzip();
        let flown = fly_rendered(&flight.flight, &flight.pictures, &sensors)?;
        for (outcome, cases) in places.into_iter().zip(flown) {
            all[outcome].cases.extend(cases);
        }
    }
    Ok(all)
}

/// Column heads of the calibrations.
const CALIBRATION_HEADS: [&str; 8] =
    ["scene, seed", "limb height found", "true", "off", "worst row by latitude", "edge noise", "χ²", "focal length"];

/// Returns the row that compares one calibration with the truth of its flight.
fn calibration_cells(name: String, flight: &Rendered, found: &anyhow::Result<Calibration>) -> Vec<String> {
    let none = || "–".to_owned();
    let c = match found {
        Ok(c) => c,
        Err(why) => return [vec![name, format!("refused: {why}")], vec![none(); CALIBRATION_HEADS.len() - 2]].concat(),
    };
    let (h, e) = (&c.height, &c.edge);
    let truth = flight.fit.as_ref();
    let off = truth.map(|fit| (h.km - fit.limb_height_km) / h.sigma_km);
    let truth_sensor = flight.sensor_from_truth();
    let true_km = |deg: f64| limb_height_km(&truth_sensor.body, deg);
    let row = h.by_latitude.iter().map(|[deg, km, _]| (deg, km - true_km(*deg)));
    let worst = row.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let parts = [h.statistical_km, h.scatter_km, h.shift_km, h.bend_km].map(|km| format!("{km:.2}")).join(", ");
    vec![
        name,
        format!("{:.1} ± {:.2} km ({parts})", h.km, h.sigma_km),
        truth.map_or_else(none, |fit| format!("{:.1} km", fit.limb_height_km)),
        off.map_or_else(none, |off| format!("{off:+.1}σ")),
        worst.map_or_else(none, |(deg, off)| format!("{off:+.2} km at {deg:.0}°")),
        format!("{:.2} px, {:.0} px", e.sigma_px, e.correlation_px),
        format!("{:.2}{}", c.chi2, if c.alarm().is_some() { ", alarm" } else { "" }),
        c.focal.map_or_else(none, |f| format!("{:+.2} ± {:.2} %", f.percent, f.sigma_percent)),
    ]
}

/// Returns the limb height in km at a latitude in degrees, from the sensor's configuration.
fn limb_height_km(body: &body::Config, deg: f64) -> f64 {
    let rows = &body.limb_height_by_latitude_km;
    let between = rows.windows(2).find_map(|w| match w {
        [[a, low], [b, high]] if (*a..=*b).contains(&deg) => Some(low + (high - low) * (deg - a) / (b - a)),
        _ => None,
    });
    between.or(rows.first().map(|r| r[1])).unwrap_or(body.limb_height_km)
}

pub(super) fn default_settings(effort: &Effort) -> anyhow::Result<Section> {
    let count = effort.frames(PICTURES);
    let mut s = Section::default();
    s.text(format!(
        "{} flights per scene with seeds of their own, {count} pictures each. *camera, position*: sensor.toml has the \
         camera (and the mask of the vehicle), every other key is the default, and frames.csv has the position. \
         *camera, altitude*: the same with the altitude instead of the position. *truth of another flight*: limb \
         height and noise measured with the truth on another seed, for comparison. The goals with defaults are at most \
         2 % beyond 3σ, none beyond 5σ, a mean NEES of 0.4 to 3, no false answer, and with the altitude alone at most \
         1.3 times the RMS with the position. *calibrated on another flight*: limb height and noise as `hzn calibrate \
         noise` finds them without truth on another seed; the goals are a mean NEES of 0.3 to 3 and at most 1.7 times \
         the RMS with the truth. Only in `{ROLLING_SHUTTER_SCENE}` the prior has rates of rotation, because its \
         rolling shutter needs them; the last row has none. *lens*: as the first row, with a focal length whose error \
         is the sigma in `camera.focal_sigma_percent`; the goal is at most 1 % beyond 3σ. All rows are out of sample: \
         nothing was fitted to the flight that is answered.",
        SEEDS.len()
    ));
    let mut tables = Tables::default();
    for scene in SCENES.into_iter().chain([ROLLING_SHUTTER_SCENE]) {
        let flights =
            SEEDS.iter().map(|&seed| Rendered::new(scene, seed, count)).collect::<anyhow::Result<Vec<_>>>()?;
        tables.add_calibrations(scene, &flights);
        tables.add_outcomes(scene, &outcomes(&flights)?);
    }
    s.table(HEADS, tables.outcomes);
    s.text(
        "The table compares the values that `hzn calibrate noise` finds on each flight, without the truth, with the \
         truth of the same pictures. The parts of sigma in brackets come from edge noise over all pictures, scatter \
         between pictures, a shift of all edges by the slow part of their errors (at least 0.1 px), and a bend that \
         the pictures share (at least half of the shift). Goals: at most 2σ off; a sigma of at most 1.5 km in \
         `rocket-clean` and `horace` and 3 km in `leo-infrared`; \
         latitudes within 1 km; an alarm (χ² above 2) or a refusal in `tumble` without rates, and in no other \
         flight. [BB] (36) has edge errors of 1 px over 300 px; the edge noise of `rocket-clean` is that of the same \
         kind of flight.",
    );
    s.table(CALIBRATION_HEADS, tables.calibrations);
    if !tables.wrong.is_empty() {
        s.text(format!("Wrong answers: {}.", tables.wrong.join("; ")));
    }
    Ok(s)
}

/// Rows of the tables, and the lists of wrong answers.
#[derive(Default)]
struct Tables {
    outcomes: Vec<Vec<String>>,
    calibrations: Vec<Vec<String>>,
    wrong: Vec<String>,
}

impl Tables {
    /// Adds the calibrations of the flights of a scene.
    fn add_calibrations(&mut self, scene: &str, flights: &[Rendered]) {
        for (flight, seed) in flights.iter().zip(SEEDS) {
            let name = format!("`{scene}`, {seed}");
            if flight.rates {
                let without = flight.calibrate(false);
                self.calibrations.push(calibration_cells(format!("{name}, no rates"), flight, &without));
            }
            self.calibrations.push(calibration_cells(name, flight, &flight.calibration));
        }
    }

    /// Adds the outcomes of a scene, with the goals that they miss.
    fn add_outcomes(&mut self, scene: &str, outcomes: &[Outcome; 7]) {
        let [position_deg, _, truth_deg, ..] = outcomes.each_ref().map(Outcome::rms_deg);
        for (place, outcome) in outcomes.iter().enumerate() {
            let mut missed = match place {
                2 | 3 => outcome.missed_goals(NEES_CALIBRATED, MAX_SHARE_BEYOND_3_SIGMA),
                5.. => outcome.missed_goals(NEES_LENS, LENS_MAX_SHARE_BEYOND_3_SIGMA),
                _ => outcome.missed_goals(NEES_DEFAULT, MAX_SHARE_BEYOND_3_SIGMA),
            };
            let max_rms_deg = match place {
                1 => Some(MAX_RMS_RATIO_ALTITUDE * position_deg),
                3 => Some(MAX_RMS_RATIO_CALIBRATION * truth_deg),
                _ => None,
            };
            if let Some(limit) = max_rms_deg.filter(|limit| outcome.rms_deg() > *limit) {
                missed.push(format!("RMS above {}", deg(limit)));
            }
            if outcome.cases.is_empty() {
                continue;
            }
            self.outcomes.push(outcome.cells(scene, &missed));
            let wrong = list_wrong_answers(&outcome.cases);
            if !wrong.is_empty() {
                self.wrong.push(format!("`{scene}`, {}: {wrong}", outcome.knowledge));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use hzn_core::body::Kind;

    #[test]
    fn the_scenes_are_there_and_look_for_the_earth() {
        for scene in SCENES.into_iter().chain([ROLLING_SHUTTER_SCENE]) {
            let scenario = Scenario::builtin(scene).unwrap();
            assert_eq!(scenario.bodies, [Kind::Earth], "{scene}");
            assert!(!SEEDS.contains(&scenario.seed), "{scene}");
        }
    }
}
