//! Measures figures 5 to 8 of Wang, Wang & Jin 2022, and the infrared flight in low orbit.

use hzn_core::Preset;
use hzn_core::{Config, body};
use hzn_evaluate::{Case, Evaluation};
use hzn_plot::{Chart, Series, Style};
use hzn_sim::flight::leo_infrared;
use hzn_sim::pose::position_m;
use hzn_sim::scenario::FIT_PICTURES;
use hzn_sim::{Flight, Look, Pose};

use super::setup::{Effort, OTHER_SEEDS, halton, preset, simulated};
use crate::fly::{GROSS_DEG, HEADS, Sensor, cells, deg, evaluate, fly, two_digits};
use crate::section::Section;

/// Height of the half-level of the radiance, as rows of latitude in degrees and height in km: 25 km ± 4.5 km.
const LIMB_HEIGHTS_KM: [[f64; 2]; 3] = [[-90.0, 20.5], [0.0, 25.0], [90.0, 29.5]];
/// Sigma of the limb height in km for a sensor with one height for all latitudes: the spread of the table over
/// latitudes.
const COMMON_HEIGHT_SIGMA_KM: f64 = 2.6;
/// Sigma of the limb height in km for a sensor that knows the table.
const HEIGHT_SIGMA_BY_LATITUDE_KM: f64 = 0.2;
/// Common shift of all edge points in pixels, caused by blur and by noise that is cut off at black. A pixel is 30 km of
/// limb height. `hzn simulate` measures the shift.
const BIAS_PX: f64 = 0.05;
const ATTITUDE_SIGMA_DEG: f64 = 5.0;

const SCENE: &str = "384×288 pixels, equidistant lens of 92 px/rad to 90° off axis, 600 km above WGS-84, limb \
                     half-level 25 km ± 4.5 km over latitude with a scale of 5 km, blur 1 px, noise 2 %, 16 bits";

/// Returns the body of a sensor with one limb height for all latitudes.
pub(super) fn one_height(flight: &Flight) -> body::Config {
    body::Config {
        limb_height_sigma_km: COMMON_HEIGHT_SIGMA_KM,
        limb_height_by_latitude_km: Default::default(),
        ..flight.sensor.body.clone()
    }
}

/// Returns `hzn` with one limb height for all latitudes, the same with an attitude, the same with an attitude and the
/// height by latitude, and `zju-2022`. `by_latitude_km` has rows of latitude in degrees and height in km;
/// `height_sigma_km` is the remaining sigma of the height.
fn sensors(flight: &Flight, by_latitude_km: &[[f64; 2]], height_sigma_km: f64) -> Vec<Sensor> {
    let one = one_height(flight);
    let each = body::Config {
        limb_height_sigma_km: height_sigma_km,
        limb_height_by_latitude_km: by_latitude_km.iter().copied().collect(),
        ..one.clone()
    };
    let hzn = |body: &body::Config| Config { body: body.clone(), ..flight.sensor.clone() };
    let zju = preset(Preset::Zju2022, flight, one.clone());
    vec![
        Sensor::new("hzn", hzn(&one)),
        Sensor::new("hzn, attitude to 5°", hzn(&one)).with_attitude(ATTITUDE_SIGMA_DEG),
        Sensor::new("hzn, height by latitude, attitude to 5°", hzn(&each)).with_attitude(ATTITUDE_SIGMA_DEG),
        Sensor::new("zju-2022", zju),
    ]
}

/// Returns `count` pictures at this angle off nadir, spread evenly over the globe, azimuth and roll.
pub(super) fn pictures_off_nadir(off_nadir_deg: f64, count: usize) -> Flight {
    let mut flight = leo_infrared(2, 1).with_limb_height_by_latitude_km(&LIMB_HEIGHTS_KM);
    let Some(pattern) = flight.frames.first().cloned() else { return flight };
    let frame = |i: usize| {
        let n = i + 1;
        let turn = core::f64::consts::TAU;
        let latitude_deg = (2.0 * halton(n, 2) - 1.0).asin().to_degrees();
        let look = Look::off_nadir(off_nadir_deg.to_radians(), turn * halton(n, 5), turn * halton(n, 7));
        let mut frame = pattern.clone();
        (frame.file, frame.time_s) = (format!("{off_nadir_deg:03}-{i:04}.png"), i as f64);
        frame.scene.pose = Pose::looking(position_m(latitude_deg, 360.0 * halton(n, 3), 600.0), look);
        frame.scene.seed = 1000 * off_nadir_deg as u64 + i as u64;
        frame
    };
    flight.frames = (0..count).map(frame).collect();
    flight
}

pub(super) fn off_nadir(effort: &Effort) -> anyhow::Result<Section> {
    let count = effort.frames(100);
    let mut s = Section::default();
    s.text(format!(
        "{count} pictures at every angle off nadir, spread evenly over latitude, longitude, azimuth and roll: {SCENE}. \
         [W] do not print their radiance curves; ours are analytic. The prior has the position. The sensor knows a \
         limb height of 25 km ± {COMMON_HEIGHT_SIGMA_KM} km, or the height by latitude ± {HEIGHT_SIGMA_BY_LATITUDE_KM} \
         km, and a possible common shift of all edge points by {BIAS_PX} px. The cells have the RMS error of the axis, \
         the number of errors above 2° (wrong), the number of pictures without an answer by status, and the NEES. [W] \
         is as printed there: RMS errors against the direction to the centre of the Earth. The truth here is the limb \
         axis.",
    ));
    s.text("**In-sample**: limb height, its sigma, the common shift and the edge noise are those of the scene.");
    let mut rows = Vec::new();
    let mut curves: Vec<Vec<(f64, f64)>> = Vec::new();
    let mut names = Vec::new();
    for step in 0..=24 {
        let angle = 5.0 * f64::from(step);
        let mut flight = pictures_off_nadir(angle, count);
        flight.sensor.covariance.bias_px = BIAS_PX;
        let sensors = sensors(&flight, &LIMB_HEIGHTS_KM, HEIGHT_SIGMA_BY_LATITUDE_KM);
        names = sensors.iter().map(|s| s.name.clone()).collect();
        curves.resize(sensors.len(), Vec::new());
        let published = match step {
            0 => "0.04° (full disc)",
            24 => "0.16°",
            _ => "",
        };
        let mut row = vec![format!("{angle}°"), published.to_owned()];
        for (cases, curve) in fly(&flight, &sensors)?.iter().zip(&mut curves) {
            let (cell, rms_deg) = rms_and_gross_cell(cases);
            curve.push((angle, rms_deg));
            row.push(cell);
        }
        rows.push(row);
    }
    let head = ["off nadir".to_owned(), "[W]".to_owned()].into_iter().chain(names.clone());
    s.table(head, rows);
    let chart = Chart::new("RMS error by angle off nadir", "off nadir [deg]", "deg");
    let series = names.into_iter().zip(curves).map(|(name, curve)| Series::new(name, Style::Line, curve));
    let published = Series::new("[W], published", Style::Dots, [(0.0, 0.04), (120.0, 0.16)]);
    s.figure("infrared", &series.fold(chart, Chart::with_series).with_series(published))?;
    s.text(
        "`zju-2022` rebuilds [W]: Zernike points, RANSAC with pre-verification, and an elliptic cone by (weighted) \
         total least squares. Its five free parameters cost little on a whole disc and much on an arc, because it uses \
         neither the altitude nor the limb height. `hzn` uses both, and also the shape of the ellipsoid if an attitude \
         with a sigma of 5° shows where east is. The remaining error is the limb height by latitude: its first \
         harmonic along the limb cannot be separated from a tilt (0.02° per kilometre here). A sensor with one height \
         and a sigma has a NEES above 2, because its sigma describes an error that is common to the whole limb. From \
         25° to 45° off nadir, the free cone of `zju-2022` follows more of the slope. A sensor with the height by \
         latitude and an attitude has only the noise and the common shift of all edge points left. The shift is a \
         twentieth of a pixel of 30 km here; on an arc this is half a hundredth of a degree.",
    );
    Ok(s)
}

/// Returns a cell and the RMS of the errors up to [`GROSS_DEG`]. The cell has this RMS, the pictures without an answer
/// by their status, the number of larger errors, and the NEES of the errors up to the limit.
fn rms_and_gross_cell(cases: &[Case]) -> (String, f64) {
    let gross = |c: &Case| c.miss.is_some_and(|m| m.angle_deg > GROSS_DEG);
    let (bad, good): (Vec<&Case>, Vec<&Case>) = cases.iter().partition(|c| gross(c));
    let e = Evaluation::new(&good);
    let rms_deg = e.errors.as_ref().map_or(f64::NAN, |x| x.rms_deg);
    let mut cell = deg(rms_deg);
    for (status, n) in &e.unanswered {
        cell.push_str(&format!(", {n} {status}"));
    }
    if !bad.is_empty() {
        cell.push_str(&format!(", {} wrong", bad.len()));
    }
    if let Some(h) = &e.honesty {
        cell.push_str(&format!(", NEES {}", two_digits(h.nees)));
    }
    (cell, rms_deg)
}

pub(super) fn flight(effort: &Effort) -> anyhow::Result<Section> {
    let count = effort.frames(200);
    let mut s = Section::default();
    let (flight, measured) = simulated("leo-infrared", count)?;
    let body = &flight.sensor.body;
    let sensors = sensors(&flight, &body.limb_height_by_latitude_km, body.limb_height_sigma_km);
    s.text(format!(
        "{count} pictures of `hzn simulate leo-infrared` over one orbit. The optical axis swings from nadir to 120° \
         off nadir: 384×288 pixels, equidistant lens of 92 px/rad to 90° off axis, 600 km above WGS-84, limb \
         half-level 25 km ± 4.5 km over latitude with a scale of 4 km, cold clouds, blur 1 px, noise 2 %, 16 bits. \
         Goals: 0.04° RMS to 90°, 0.08° beyond; with the height by latitude and an attitude to 5°, 0.015° and 0.03°; \
         NEES 1 to 4. The sensor has values that were measured on {FIT_PICTURES} pictures of other seeds: {measured}; \
         a sensor with one height has ± {COMMON_HEIGHT_SIGMA_KM} km. The sensor.toml of the scene has the height by \
         latitude."
    ));
    s.text(OTHER_SEEDS);
    let flown = fly(&flight, &sensors)?;
    let mut rows = Vec::new();
    for (sensor, cases) in sensors.iter().zip(&flown) {
        for (name, from, to) in [("0–90°", 0.0, 90.0), ("90–120°", 90.0, 180.0)] {
            let part: Vec<_> =
                cases.iter().filter(|c| c.off_axis_deg >= from && c.off_axis_deg < to).cloned().collect();
            let row = vec![sensor.name.clone(), name.to_owned()];
            rows.push(row.into_iter().chain(cells(&evaluate(&part))).collect());
        }
    }
    s.table(["sensor", "off nadir"].into_iter().chain(HEADS), rows);
    Ok(s)
}
