//! Runs flights through sensors: every picture is rendered once and processed by each sensor.

use std::time::Instant;

use anyhow::Context;
use hzn_core::body::Kind;
use hzn_core::{Config, HostHorizon, Report};
use hzn_evaluate::{Answer, Case, Evaluation, pair};
use hzn_files::truth::Truth;
use hzn_host::Compiled;
use hzn_sim::{Flight, FlightFrame, Picture};
use rayon::prelude::*;

/// Sensor, with the parts of the prior that it gets.
#[derive(Debug, Clone)]
pub(crate) struct Sensor {
    /// Name in tables.
    pub(crate) name: String,
    /// Configuration of the sensor.
    pub(crate) config: Config,
    /// Error of the prior attitude (1-sigma about each axis) in degrees; `None` means a prior without an attitude.
    pub(crate) attitude_sigma_deg: Option<f64>,
    /// Whether the prior has the altitude but no position.
    pub(crate) altitude_only: bool,
    /// Whether the prior has no rates of rotation.
    pub(crate) without_rates: bool,
}

impl Sensor {
    /// Makes a sensor whose prior has the position and the rates of rotation, but no attitude.
    pub(crate) fn new(name: &str, config: Config) -> Self {
        Self { name: name.into(), config, attitude_sigma_deg: None, altitude_only: false, without_rates: false }
    }
    /// Adds an attitude to the prior.
    pub(crate) fn with_attitude(self, sigma_deg: f64) -> Self {
        Self { attitude_sigma_deg: Some(sigma_deg), ..self }
    }
    /// Gives the prior the altitude, but neither position nor attitude.
    pub(crate) fn with_altitude_only(self) -> Self {
        Self { attitude_sigma_deg: None, altitude_only: true, ..self }
    }
    /// Removes the rates of rotation from the prior.
    pub(crate) fn without_rates(self) -> Self {
        Self { without_rates: true, ..self }
    }
    /// Returns the prior of a picture for this sensor.
    pub(crate) fn prior(&self, frame: &FlightFrame) -> hzn_core::Prior<f64> {
        let known = match self.attitude_sigma_deg {
            Some(sigma_deg) => frame.prior_with_attitude(sigma_deg.to_radians()),
            None => frame.prior(),
        };
        hzn_core::Prior {
            position_m: known.position_m.filter(|_| !self.altitude_only),
            rate_rad_s: known.rate_rad_s.filter(|_| !self.without_rates),
            ..known
        }
    }
}

/// Results of a flight through one sensor.
pub(crate) struct Flown {
    /// One case per picture and body.
    pub(crate) cases: Vec<Case>,
    /// Processing time of every picture in µs, while all cores are busy.
    pub(crate) elapsed_us: Vec<f64>,
}

/// Results of one picture: the truth of each body, and for each sensor one answer per body with the time in µs.
type PictureResults = (Vec<Truth>, Vec<(Vec<Answer>, f64)>);

/// Runs the pictures of a flight through sensors. Returns one list of cases per sensor.
pub(crate) fn fly(flight: &Flight, sensors: &[Sensor]) -> anyhow::Result<Vec<Vec<Case>>> {
    Ok(fly_timed(flight, sensors)?.into_iter().map(|flown| flown.cases).collect())
}

/// Does the same as [`fly`] and returns the processing times too.
pub(crate) fn fly_timed(flight: &Flight, sensors: &[Sensor]) -> anyhow::Result<Vec<Flown>> {
    process_all(flight, sensors, &|frame| Ok(std::borrow::Cow::Owned(frame.render()?)))
}

/// Does the same as [`fly`] with pictures that are rendered already, in the order of the flight's frames.
pub(crate) fn fly_rendered(
    flight: &Flight,
    pictures: &[Picture],
    sensors: &[Sensor],
) -> anyhow::Result<Vec<Vec<Case>>> {
    let rendered = |frame: &FlightFrame| {
        let place = flight.frames.iter().position(|f| f.file == frame.file);
        let picture = place.and_then(|i| pictures.get(i)).with_context(|| format!("{} is not rendered", frame.file))?;
        Ok(std::borrow::Cow::Borrowed(picture))
    };
    Ok(process_all(flight, sensors, &rendered)?.into_iter().map(|flown| flown.cases).collect())
}

/// Runs every picture through every sensor; `picture` renders or finds a picture.
fn process_all<'a>(
    flight: &Flight,
    sensors: &[Sensor],
    picture: &(dyn Fn(&FlightFrame) -> anyhow::Result<std::borrow::Cow<'a, Picture>> + Sync),
) -> anyhow::Result<Vec<Flown>> {
    let make = || sensors.iter().map(|s| HostHorizon::boxed(&s.config)).collect::<Result<Vec<_>, _>>();
    // An invalid configuration is refused here, not in a thread.
    make()?;
    let kinds: Vec<Kind> = flight.sensor.each_body().iter().map(|b| b.kind).collect();
    let results: Vec<PictureResults> = flight
        .frames
        .par_iter()
        .map_init(make, |horizons, frame| {
            let body_truth = |&kind: &Kind| frame.scene.body_truth(kind, &frame.file, frame.time_s);
            let truths: Vec<Truth> = kinds.iter().map(body_truth).collect::<Result<_, _>>()?;
            let picture = picture(frame)?;
            let horizons = horizons.as_mut().map_err(|e| *e)?;
            let answers = horizons.iter_mut().zip(sensors);
            let answers = answers.map(|(horizon, sensor)| process_picture(horizon, sensor, frame, &picture, &truths));
            let answers = answers.collect::<anyhow::Result<_>>()?;
            anyhow::Ok((truths, answers))
        })
        .collect::<anyhow::Result<_>>()?;
    let truth: Vec<Truth> = results.iter().flat_map(|(t, _)| t.clone()).collect();
    let flown_by = |i: usize| {
        let (answers, elapsed_us): (Vec<Vec<Answer>>, Vec<f64>) =
            results.iter().filter_map(|(_, a)| a.get(i).cloned()).unzip();
        let camera = hzn_core::camera::Camera::try_new(&flight.sensor.camera)?;
        Ok(Flown { cases: pair(&answers.concat(), &truth, Some(&camera))?, elapsed_us })
    };
    (0..sensors.len()).map(flown_by).collect()
}

/// Runs one picture through one sensor. Returns one answer per body and the processing time in µs.
fn process_picture(
    horizon: &mut HostHorizon,
    sensor: &Sensor,
    frame: &FlightFrame,
    picture: &Picture,
    truths: &[Truth],
) -> anyhow::Result<(Vec<Answer>, f64)> {
    let known = sensor.prior(frame);
    let expected = (0..truths.len()).map(|which| horizon.expect_body(which, &known)).collect::<Result<Vec<_>, _>>();
    let expected = expected.with_context(|| frame.file.clone())?;
    let begun = Instant::now();
    let reports = horizon.find_each(picture.view(), &expected);
    let elapsed_us = begun.elapsed().as_secs_f64() * 1e6;
    let answer = |(report, truth): (&Report<f64>, &Truth)| Answer {
        file: frame.file.clone(),
        body: truth.body.clone(),
        status: report.status,
        found: report.solution.as_ref().map(Into::into),
        position: None,
    };
    Ok((reports.iter().zip(truths).map(answer).collect(), elapsed_us))
}

/// Returns the evaluation of cases of one body.
pub(crate) fn evaluate(cases: &[Case]) -> Evaluation {
    Evaluation::new(&cases.iter().collect::<Vec<_>>())
}

/// Returns the cells of an evaluation: answered, false answers, RMS, 95 %, worst, NEES with its interval.
pub(crate) fn cells(e: &Evaluation) -> Vec<String> {
    let none = || "–".to_owned();
    let error = |value: fn(&hzn_evaluate::Errors) -> f64| e.errors.as_ref().map_or_else(none, |x| deg(value(x)));
    let without = e.frames - e.with_limb;
    vec![
        format!("{}/{}", e.answered, e.with_limb),
        if without > 0 { format!("{}/{without}", e.false_answers) } else { none() },
        error(|x| x.rms_deg),
        error(|x| x.p95_deg),
        error(|x| x.worst_deg),
        e.honesty
            .as_ref()
            .map_or_else(none, |h| format!("{} ({:.2}–{:.2})", two_digits(h.nees), h.interval[0], h.interval[1])),
    ]
}

/// Column heads of [`cells`].
pub(crate) const HEADS: [&str; 6] = ["answered", "false", "RMS", "95 %", "worst", "NEES (95 % if honest)"];

/// Formats an angle in degrees to three digits.
pub(crate) fn deg(x: f64) -> String {
    if !x.is_finite() {
        return "–".into();
    }
    let decimals = if x > 0.0 { (2 - x.log10().floor() as i32).clamp(1, 5) } else { 1 };
    format!("{x:.*}°", decimals as usize)
}

/// Formats a number to two digits, without an exponent.
pub(crate) fn two_digits(x: f64) -> String {
    let decimals = if x > 0.0 { (1 - x.log10().floor() as i32).clamp(0, 6) } else { 1 };
    format!("{x:.*}", decimals as usize)
}

/// Lists the answers that are not of this limb: their error is above [`GROSS_DEG`], or no limb is in view. The text is
/// empty if there are none.
pub(crate) fn list_wrong_answers(cases: &[Case]) -> String {
    let wrong = cases.iter().filter_map(|c| {
        let m = c.miss?;
        let sigma = m.sigma_max_deg;
        match c.limb {
            true if m.angle_deg > GROSS_DEG => {
                let (error, px) = (m.angle_deg, c.limb_in_view_px.unwrap_or(f64::NAN));
                let (place, name) = (c.off_axis_deg, c.off_axis_name());
                Some(format!("{} ({error:.0}° off, sigma {sigma:.2}°; {place:.0}° {name}, limb of {px:.0} px)", c.file))
            }
            true => None,
            false => {
                let (place, name) = (c.off_axis_deg, c.off_axis_name());
                Some(format!("{} (no limb, sigma {sigma:.2}°; {place:.0}° {name})", c.file))
            }
        }
    });
    let mut wrong: Vec<String> = wrong.collect();
    let more = wrong.len().saturating_sub(MAX_LISTED);
    wrong.truncate(MAX_LISTED);
    if more > 0 {
        wrong.push(format!("and {more} more"));
    }
    wrong.join(", ")
}

/// Number of wrong answers that are listed one by one.
const MAX_LISTED: usize = 4;

/// Limit of gross errors in degrees. With a larger error the sensor has fitted another curve than the limb.
pub(crate) const GROSS_DEG: f64 = 2.0;
