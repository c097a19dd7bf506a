//! The rotation about the line to a flattened body, over orbits about the poles.

use anyhow::Context;
use hzn_core::camera::{Config as CameraConfig, Model};
use hzn_core::frames::{Rotation, UnitVec3};
use hzn_core::pipeline::edges::Edges;
use hzn_core::{Config, Prior, Sensor, body, covariance};
use hzn_sim::sensitivity::ThirdAxis;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::setup::{Effort, halton};
use crate::section::Section;

/// Radius of the disc in the pictures, pixels.
const DISC_PX: f64 = 400.0;
const SIGMA_PX: f64 = 0.1;
const CORRELATION_PX: f64 = 100.0;
/// 1-sigma of the rotation that the sensor is told wrongly, degrees.
const TOLD_SIGMA_DEG: f64 = 1.0;
/// Places on the orbit, and runs at each of them.
const PLACES: usize = 24;
const RUNS: usize = 25;
/// The seeds of this study; no other study uses them.
const FIRST_SEED: u64 = 4_210_000;

/// Body, altitude above the mean radius in km, and the 1-sigma of the second harmonic in km; `None` for the default.
const ORBITS: [(body::Kind, f64, Option<f64>); 8] = [
    (body::Kind::Earth, 600.0, Some(0.1)),
    (body::Kind::Earth, 600.0, None),
    (body::Kind::Earth, 8000.0, Some(0.1)),
    (body::Kind::Earth, 35_786.0, Some(0.1)),
    (body::Kind::Earth, 35_786.0, None),
    (body::Kind::Jupiter, 5.87e6, Some(1.0)),
    (body::Kind::Jupiter, 5.87e6, None),
    (body::Kind::Enceladus, 2750.0, None),
];

/// Measures the rotations over all orbits.
pub(super) fn orbits(effort: &Effort) -> anyhow::Result<Section> {
    let runs = effort.frames(RUNS);
    let mut s = Section::default();
    s.text(format!(
        "Orbits over the poles, {PLACES} places with {runs} runs at each. The camera looks at the centre of the body; \
         the disc has a radius of {DISC_PX} px, one point per pixel, with errors of {SIGMA_PX} px and a correlation \
         length of {CORRELATION_PX} px. The sensor is told an attitude that is turned about the line to the body by \
         {TOLD_SIGMA_DEG}° (1σ); it has no position. The second harmonic of the limb height is drawn in every run with \
         the sigma that the sensor is told; `default` is the sigma of the limb height itself. σ at latitudes 0°, 30° \
         and 60° is that of `hzn sensitivity yaw`. NEES has one degree of freedom (1 is ideal). It counts the runs \
         whose reported σ is below 20°, because a rotation is periodic; `below 1°` is the share of runs that \
         `fit.yaw_limit_deg` lets through by default. The rules were chosen on other seeds.",
    ));
    let mut rows = Vec::new();
    for (number, (kind, altitude_km, harmonic_km)) in ORBITS.into_iter().enumerate() {
        let orbit = Orbit::new(kind, altitude_km, harmonic_km);
        let mut found = Found::default();
        for place in 0..PLACES {
            for run in 0..runs {
                let number = (number * PLACES + place) * RUNS + run;
                found.add(orbit.run(place, number)?);
            }
        }
        let bounds = [0.0, 30.0, 60.0].map(|latitude| -> anyhow::Result<String> {
            let sigmas = orbit.at(latitude).sigmas()?;
            Ok(sigmas.map_or_else(|| "–".to_owned(), |sigmas| format!("{:.2}", sigmas.total_deg())))
        });
        let [a, b, c] = bounds;
        rows.push(found.cells(kind, altitude_km, harmonic_km, format!("{}/{}/{}°", a?, b?, c?)));
    }
    s.table(
        [
            "body, altitude",
            "second harmonic",
            "σ at 0°/30°/60°",
            "reported",
            "below 1°",
            "σ: median",
            "error: RMS, mean",
            "NEES",
            "beyond 3σ",
        ],
        rows,
    );
    Ok(s)
}

struct Orbit {
    config: Config,
    /// The camera above the equator.
    equator: ThirdAxis,
}

impl Orbit {
    fn new(kind: body::Kind, altitude_km: f64, harmonic_km: Option<f64>) -> Self {
        let mut body = body::Config::of_kind(kind, None);
        body.limb_height_harmonic_sigma_km = harmonic_km;
        let radius_km = body.mean_radius_km();
        let alpha = ((radius_km + body.limb_height_km) / (radius_km + altitude_km)).asin();
        let camera = CameraConfig {
            theta_max_deg: Some(100.0),
            ..CameraConfig::ideal(Model::Equidistant, 1000, 1000, DISC_PX / alpha)
        };
        let equator = ThirdAxis {
            camera: camera.clone(),
            radii_km: body.figure_km().unwrap_or([radius_km; 3]),
            limb_height_km: body.limb_height_km,
            second_harmonic_km: harmonic_km.unwrap_or(body.limb_height_sigma_km),
            altitude_km,
            latitude_deg: 0.0,
            azimuth_deg: 0.0,
            depression_deg: 90.0,
            roll_deg: 0.0,
            sigma_px: SIGMA_PX,
            correlation_px: CORRELATION_PX,
        };
        let mut config =
            Config { body, covariance: covariance::Config::given(SIGMA_PX, CORRELATION_PX), ..Config::new(camera) };
        config.fit.position = Some(true);
        config.fit.yaw_limit_deg = 180.0;
        Self { config, equator }
    }

    fn at(&self, latitude_deg: f64) -> ThirdAxis {
        ThirdAxis { latitude_deg, ..self.equator.clone() }
    }

    /// Returns the error of the rotation and its reported 1-sigma, degrees; `None` if none is reported.
    fn run(&self, place: usize, number: usize) -> anyhow::Result<Option<[f64; 2]>> {
        // An orbit over the poles meets every latitude twice, going north and going south.
        let along = 360.0 * (place as f64 + 0.5) / PLACES as f64;
        let camera = ThirdAxis {
            azimuth_deg: if along.to_radians().cos() > 0.0 { 0.0 } else { 180.0 },
            ..self.at(along.to_radians().sin().asin().to_degrees())
        };
        let [a, b, told, _] = normal(number);
        let harmonic_km = camera.second_harmonic_km;
        let points = camera.limb_points([a * harmonic_km, b * harmonic_km], FIRST_SEED + number as u64)?;
        let (camera_from_fixed, position_km) = camera.pose();
        let sight = UnitVec3::try_new((camera_from_fixed * -position_km).into()).context("no direction")?;
        let yaw_rad = (TOLD_SIGMA_DEG * told).to_radians();
        let axis = nalgebra::Unit::new_normalize(Vector3::from(sight.xyz()));
        let told = Rotation3::from_axis_angle(&axis, -yaw_rad).into_inner() * camera_from_fixed;
        let sensor = Sensor::<f64>::new(&self.config)?;
        let prior = Prior {
            fixed_from_camera: Rotation::assume_from_quaternion(quaternion(&told.transpose())),
            attitude_sigma_rad: Some(0.0),
            ..Prior::default()
        };
        let expected = sensor.expect(&prior)?;
        let mut edges = Edges::for_body(&sensor, &expected, &points, &sight);
        let found = edges.fit_position(&expected).and_then(|fit| edges.fuse(&sensor, &fit, &expected));
        let yaw = found.and_then(|found| found.position).and_then(|position| position.yaw_rad);
        Ok(yaw.map(|(yaw, sigma)| [(yaw - yaw_rad).to_degrees(), sigma.to_degrees()]))
    }
}

fn quaternion(rotation: &Matrix3<f64>) -> [f64; 4] {
    let q = UnitQuaternion::from_matrix(rotation);
    [q.w, q.i, q.j, q.k]
}

/// Returns four normal numbers of unit variance, the same in every run.
fn normal(number: usize) -> [f64; 4] {
    let pair = |a: usize, b: usize| {
        let [u, v] = [a, b].map(|base| halton(number + 1, base));
        let (sin, cos) = (core::f64::consts::TAU * v).sin_cos();
        let r = (-2.0 * u.ln()).sqrt();
        [r * cos, r * sin]
    };
    let ([a, b], [c, d]) = (pair(2, 3), pair(5, 7));
    [a, b, c, d]
}

/// Errors and sigmas over an orbit, degrees.
#[derive(Default)]
struct Found {
    runs: usize,
    reported: Vec<[f64; 2]>,
}

impl Found {
    fn add(&mut self, run: Option<[f64; 2]>) {
        self.runs += 1;
        self.reported.extend(run);
    }

    fn cells(&self, kind: body::Kind, altitude_km: f64, harmonic_km: Option<f64>, bounds: String) -> Vec<String> {
        let linear: Vec<&[f64; 2]> = self.reported.iter().filter(|[_, sigma]| *sigma < 20.0).collect();
        let share = |count: usize| format!("{:.0} %", 100.0 * count as f64 / self.runs as f64);
        let mut sigmas: Vec<f64> = linear.iter().map(|[_, sigma]| *sigma).collect();
        sigmas.sort_by(f64::total_cmp);
        let mean = |f: &dyn Fn(&[f64; 2]) -> f64| linear.iter().map(|x| f(x)).sum::<f64>() / linear.len().max(1) as f64;
        let beyond = linear.iter().filter(|[error, sigma]| error.abs() > 3.0 * sigma).count();
        let numbers = |text: String| if linear.is_empty() { "–".to_owned() } else { text };
        vec![
            format!("{}, {altitude_km} km", kind.name()),
            harmonic_km.map_or_else(|| "default".to_owned(), |km| format!("{km} km")),
            bounds,
            share(linear.len()),
            share(sigmas.iter().filter(|sigma| **sigma < 1.0).count()),
            numbers(format!("{:.3}°", sigmas.get(sigmas.len() / 2).copied().unwrap_or(f64::NAN))),
            numbers(format!("{:.3}°, {:+.3}°", mean(&|[e, _]| e * e).sqrt(), mean(&|[e, _]| *e))),
            numbers(format!("{:.2}", mean(&|[e, s]| e * e / (s * s)))),
            numbers(format!("{beyond} of {}", linear.len())),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sensor and `hzn sensitivity yaw` compute their sigmas independently of each other. The error is far smaller
    /// than the rotation that the sensor was told wrongly, so the sign is right.
    #[test]
    fn the_sensor_has_the_sigma_of_the_design() {
        for (kind, altitude_km, harmonic_km) in [ORBITS[2], ORBITS[5], ORBITS[6]] {
            let orbit = Orbit::new(kind, altitude_km, harmonic_km);
            for place in [0, 1, 13, 16] {
                let [error, sigma] = orbit.run(place, 7 * place + 3).unwrap().unwrap();
                let along = 360.0 * (place as f64 + 0.5) / PLACES as f64;
                let design = orbit.at(along.to_radians().sin().asin().to_degrees()).sigmas().unwrap().unwrap();
                let ratio = sigma / design.total_deg();
                println!("{} {place}: {error} {sigma} {ratio}", kind.name());
                assert!((ratio - 1.0).abs() < 0.15, "{} {place}: {ratio}", kind.name());
                assert!(error.abs() < 4.0 * sigma);
            }
        }
    }
}
