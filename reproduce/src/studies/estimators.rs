//! Measures the estimators of figures 7 and 8 of Wang, Wang & Jin 2022 on the same points, and pictures with noisy
//! points (their step 6).

use hzn_core::{Config, Preset, fit};
use hzn_evaluate::Case;
use hzn_sim::Flight;

use super::infrared::{one_height, pictures_off_nadir};
use super::setup::{Effort, preset};
use crate::fly::{GROSS_DEG, Sensor, deg, fly};
use crate::section::Section;

/// Angles off nadir of the columns, degrees.
const ANGLES_DEG: [f64; 6] = [0.0, 30.0, 60.0, 90.0, 105.0, 120.0];
/// Share of hot pixels, each with a value of its own up to full scale. With 1 %, every third of the 7×7 patches has
/// one.
const HOT_PIXELS: [f64; 3] = [0.0, 0.001, 0.01];

/// Returns sensors with the points and the consensus of `zju-2022`, and one estimator each.
fn estimators(flight: &Flight) -> Vec<Sensor> {
    let chain = preset(Preset::Zju2022, flight, one_height(flight));
    let methods = [
        fit::Method::Direct,
        fit::Method::Conic,
        fit::Method::Circle,
        fit::Method::Tls,
        fit::Method::Wtls,
        fit::Method::Sphere,
    ];
    let one = |method: fit::Method| {
        // The weights of WTLS are on at every angle, so that the column is one estimator.
        let fit = fit::Config { method, weigh_above_deg: 0.0, ..chain.fit };
        Sensor::new(&format!("`{}`", method.name()), Config { fit, ..chain.clone() })
    };
    methods.into_iter().map(one).collect()
}

/// Returns the errors in degrees against the limb axis and against the direction to the Earth's centre.
fn errors(flight: &Flight, cases: &[Case]) -> anyhow::Result<Vec<[f64; 2]>> {
    let mut errors = Vec::new();
    for (frame, case) in flight.frames.iter().zip(cases) {
        let truth = frame.truth()?;
        let Some((miss, centre)) = case.miss.zip(truth.position_km()) else { continue };
        let [a, b] = [miss.found.axis, centre].map(nalgebra::Vector3::from);
        errors.push([miss.angle_deg, a.cross(&b).norm().atan2(a.dot(&b)).to_degrees()]);
    }
    Ok(errors)
}

/// Returns a cell: RMS errors against limb axis and centre of the errors up to [`GROSS_DEG`], and how many pictures
/// have none.
fn cell(errors: &[[f64; 2]], pictures: usize) -> String {
    let good: Vec<_> = errors.iter().filter(|e| e[0] <= GROSS_DEG).collect();
    let rms = |which: usize| (good.iter().map(|e| e[which].powi(2)).sum::<f64>() / good.len() as f64).sqrt();
    let rest = pictures - good.len();
    let without = if rest > 0 { format!(", {rest} wrong or none") } else { String::new() };
    format!("{} / {}{without}", deg(rms(0)), deg(rms(1)))
}

pub(super) fn figures_7_and_8(effort: &Effort) -> anyhow::Result<Section> {
    let count = effort.frames(60);
    let mut s = Section::default();
    s.text(format!(
        "{count} pictures of the study `infrared` at each angle off nadir (blur 1 px, noise 2 %). Every estimator gets \
         the points of `zju-2022`: Zernike moments with the blur known, RANSAC with pre-verification at 1.6 px. None \
         of them but `sphere` knows the altitude. The first number of a cell is the RMS error against the limb axis, \
         the second against the direction to the centre of the Earth, which is the truth of [W]; errors above \
         {GROSS_DEG}° are only counted.",
    ));
    s.text("**In-sample**: limb height, its sigma and the blur are those of the scene.");
    let mut rows: Vec<Vec<String>> = Vec::new();
    for angle_deg in ANGLES_DEG {
        let flight = pictures_off_nadir(angle_deg, count);
        let sensors = estimators(&flight);
        rows.resize(sensors.len(), Vec::new());
        for ((row, sensor), cases) in rows.iter_mut().zip(&sensors).zip(fly(&flight, &sensors)?) {
            if row.is_empty() {
                row.push(sensor.name.clone());
            }
            row.push(cell(&errors(&flight, &cases)?, flight.frames.len()));
        }
    }
    let angles = ANGLES_DEG.map(|angle| format!("{angle}°"));
    s.table(std::iter::once("estimator".to_owned()).chain(angles), rows);
    s.text(
        "[W] prints 0.27° for TLS and 0.16° for WTLS at 120° in figure 8. Against the centre every estimator has the \
         same error of about the distance between limb axis and centre; the rest is what the estimator adds.",
    );
    add_noisy_points(&mut s, count)?;
    Ok(s)
}

fn add_noisy_points(s: &mut Section, count: usize) -> anyhow::Result<()> {
    s.text(
        "**Noisy points** ([W], step 6): the same pictures at 60° and at 120° off nadir with hot pixels at random \
         places, up to full scale.",
    );
    let mut rows = Vec::new();
    for angle_deg in [60.0, 120.0] {
        for share in HOT_PIXELS {
            let mut flight = pictures_off_nadir(angle_deg, count);
            flight.frames.iter_mut().for_each(|frame| frame.scene.detector.hot_pixels = share);
            let zju = preset(Preset::Zju2022, &flight, one_height(&flight));
            let sensors = [
                Sensor::new("zju-2022", zju),
                Sensor::new("hzn", Config { body: one_height(&flight), ..flight.sensor.clone() }),
            ];
            let mut row = vec![format!("{angle_deg}°"), format!("{} %", 100.0 * share)];
            for cases in fly(&flight, &sensors)? {
                row.push(cell(&errors(&flight, &cases)?, flight.frames.len()));
            }
            rows.push(row);
        }
    }
    s.table(["off nadir", "hot pixels", "`zju-2022`", "`hzn`"], rows);
    Ok(())
}
