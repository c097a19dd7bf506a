//! Positions from rendered pictures of whole bodies and parts of them, at every size and phase.

use hzn_core::camera::{Config as CameraConfig, Model};
use hzn_core::{Config, HostHorizon, Prior, body};
use hzn_evaluate::{Answer, Case, Evaluation, MeasuredPosition, pair};
use hzn_host::Compiled;
use hzn_sim::{Detector, Ellipsoid, Reflection, Scene, Surface, Trials};

use super::setup::{Effort, halton};
use crate::section::Section;

/// Bodies, the first seed of each, and the focal length of the camera in pixels.
const BODIES: [(&str, u64, f64); 4] = [
    ("callisto", 51_000, 3000.0),
    ("jupiter", 52_000, 6000.0),
    ("enceladus", 53_000, 2500.0),
    ("phobos", 54_000, 900.0),
];
const PICTURES: usize = 500;
/// 1-sigma of the attitude that the sensor is told, degrees.
const ATTITUDE_SIGMA_DEG: f64 = 0.05;

/// Pictures of one body, evaluated: all together and by the size of the disc.
struct Flown {
    cases: Vec<Case>,
    diameters_px: Vec<f64>,
}

fn trials(name: &str, focal_px: f64) -> Trials {
    Trials {
        body: Ellipsoid { surface: surface(name), ..Ellipsoid::named(name) },
        camera: CameraConfig::ideal(Model::Pinhole, 640, 640, focal_px),
        detector: Detector { read_noise: 0.01, ..Detector::default() },
        diameter_px: [9.0, 1600.0],
        phase_deg: [0.0, 150.0],
    }
}

/// Returns the light of the surface: bands of cloud for Jupiter, dark regolith with patches for the others.
fn surface(name: &str) -> Surface {
    match name {
        "jupiter" => Surface { reflection: Reflection::Minnaert, band_contrast: 0.1, ..Surface::default() },
        _ => Surface { reflection: Reflection::LommelSeeliger, patch_contrast: 0.15, ..Surface::default() },
    }
}

/// Makes the sensor: only the body and the camera are told. The limb of the scenes has the height that is told, with an
/// error of its own in every picture.
fn sensor(name: &str, trials: &Trials) -> anyhow::Result<Config> {
    let kind = body::Kind::ALL.iter().find(|kind| kind.name() == name);
    let kind = *kind.ok_or_else(|| anyhow::anyhow!("there is no body {name}"))?;
    Ok(Config { body: body::Config::of_kind(kind, None), ..Config::new(trials.camera.clone()) })
}

/// Returns four normal numbers of unit variance for a picture. They fill the distribution evenly, and are the same in
/// every run.
fn normal(index: usize) -> [f64; 4] {
    let pair = |a: u32, b: u32| {
        let [u, v] = [a, b].map(|base| halton(index + 1, base as usize));
        let (sin, cos) = (core::f64::consts::TAU * v).sin_cos();
        let r = (-2.0 * u.ln()).sqrt();
        [r * cos, r * sin]
    };
    let ([a, b], [c, d]) = (pair(2, 3), pair(5, 7));
    [a, b, c, d]
}

/// Returns what the sensor is told: an attitude with an error, and the Sun.
fn prior(scene: &Scene, error: [f64; 3]) -> Prior<f64> {
    let sigma_rad = ATTITUDE_SIGMA_DEG.to_radians();
    let told = scene.pose.disturbed(error.map(|e| sigma_rad * e));
    Prior { fixed_from_camera: told.fixed_from_camera(), attitude_sigma_rad: Some(sigma_rad), ..scene.told_prior() }
}

fn fly(name: &str, first_seed: u64, focal_px: f64, pictures: usize) -> anyhow::Result<Flown> {
    let trials = trials(name, focal_px);
    let config = sensor(name, &trials)?;
    let mut horizon = HostHorizon::boxed(&config)?;
    let (mut answers, mut truths) = (Vec::new(), Vec::new());
    for seed in first_seed..first_seed + pictures as u64 {
        let [height, about @ ..] = normal((seed - first_seed) as usize);
        let mut drawn = trials.clone();
        // The limb of this picture is not where the sensor is told.
        drawn.body.surface_height_km = config.body.limb_height_km + config.body.limb_height_sigma_km * height;
        let scene = drawn.scene(seed)?;
        let file = format!("{name}-{seed}");
        let picture = scene.render()?;
        let expected = horizon.expect(&prior(&scene, about))?;
        let report = horizon.find(picture.view(), &expected);
        let solution = report.solution.as_ref();
        answers.push(Answer {
            file: file.clone(),
            body: name.to_owned(),
            status: report.status,
            found: solution.map(Into::into),
            position: solution.and_then(|s| s.position.as_ref()).map(|p| MeasuredPosition {
                centre_km: p.centre_m.map(|x| x / 1e3),
                covariance_km2: p.covariance_m2.map(|x| x / 1e6),
            }),
        });
        truths.push(scene.truth(&file, 0.0)?);
    }
    let camera = hzn_core::camera::Camera::try_new(&config.camera)?;
    let diameters_px = truths.iter().map(|t| 2.0 * focal_px * t.half_angle_deg.to_radians().tan()).collect();
    Ok(Flown { cases: pair(&answers, &truths, Some(&camera))?, diameters_px })
}

pub(super) fn rendered(effort: &Effort) -> anyhow::Result<Section> {
    let mut section = Section::default();
    let pictures = effort.frames(PICTURES);
    section.text(format!(
        "{pictures} pictures of each body, 640×640 pixels with 1 % noise: discs from 9 px across to wider than the \
         picture, phase angles from 0° to 150°, every direction. The sensor is told the camera, the body by its name, \
         the attitude within {ATTITUDE_SIGMA_DEG}° and the direction to the Sun; it has no distance. The surface of \
         each picture lies higher or lower than the sensor assumes; the default sigma of the limb height is the 1σ of \
         this error. NEES has three degrees of freedom (3 is ideal). The term for light that changes along the limb \
         was added after a look at other seeds of the same bodies; the seeds here were not used before."
    ));
    let mut rows = Vec::new();
    for (name, first_seed, focal_px) in BODIES {
        let flown = fly(name, first_seed, focal_px, pictures)?;
        let sizes = [
            ("all", [0.0, f64::INFINITY]),
            ("9 to 60 px", [0.0, 60.0]),
            ("60 to 400 px", [60.0, 400.0]),
            ("wider", [400.0, f64::INFINITY]),
        ];
        for (what, [low, high]) in sizes {
            let members: Vec<&Case> = flown
                .cases
                .iter()
                .zip(&flown.diameters_px)
                .filter(|(_, d)| (low..high).contains(*d))
                .map(|(c, _)| c)
                .collect();
            rows.push(cells(name, what, &Evaluation::new(&members)));
        }
    }
    section.table(
        [
            "body",
            "disc",
            "answered",
            "false",
            "positions",
            "range error: RMS, mean, RMS in σ",
            "cross-range: median",
            "NEES (95 % if honest)",
        ],
        rows,
    );
    Ok(section)
}

fn cells(name: &str, what: &str, e: &Evaluation) -> Vec<String> {
    let head =
        vec![name.to_owned(), what.to_owned(), format!("{}/{}", e.answered, e.with_limb), e.false_answers.to_string()];
    let Some(p) = &e.position else {
        return [head, vec!["0".into(), "–".into(), "–".into(), "–".into()]].concat();
    };
    let percent = |x: f64| format!("{:.3} %", 100.0 * x);
    let [low, high] = p.nees_interval;
    let rest = vec![
        p.positions.to_string(),
        format!("{}, {}, {:.2}", percent(p.range_share_rms), percent(p.range_share_mean), p.range_sigmas_rms),
        format!("{:.3} km", p.cross_range_median_km),
        format!("{:.2} ({low:.2} to {high:.2})", p.nees),
    ];
    [head, rest].concat()
}
