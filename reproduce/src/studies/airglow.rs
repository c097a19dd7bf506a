//! Airglow and aurora above the Earth's night side: false answers with and without the gate `glow`.

use std::sync::Arc;

use hzn_core::Config;
use hzn_core::camera::{self, Model};
use hzn_evaluate::Case;
use hzn_sim::flight::leo_infrared;
use hzn_sim::pose::position_m;
use hzn_sim::radiance::Radiance;
use hzn_sim::{Detector, Flight, Infrared, Look, Pose, Tone, World};

use super::setup::{Effort, halton};
use crate::fly::{Sensor, fly};
use crate::section::Section;

const PICTURES: usize = 3;
const ALTITUDE_KM: f64 = 400.0;
const EARTH_KM: f64 = 6371.0;
/// Brightness of the moonlit ground, as multiples of the brightest part of the airglow.
const GROUNDS: [f64; 7] = [0.02, 0.1, 0.25, 0.5, 1.0, 2.0, 5.0];
/// Brightness of the aurora's red layer per kilometre of path, as a part of that of the airglow.
const AURORAS: [f64; 3] = [0.0, 0.05, 0.2];
/// Width, height and focal length of the cameras, px.
const CAMERAS: [(u16, u16, f64); 2] = [(640, 480, 500.0), (1280, 960, 2000.0)];
/// Peak and scale height of the airglow, and of the red layer, km.
const AIRGLOW_KM: [f64; 2] = [95.0, 5.0];
const RED_KM: [f64; 2] = [250.0, 45.0];
/// Brightness of the brightest place, and of the sky, as parts of full scale.
const BRIGHTEST: f64 = 0.8;
const SKY: f64 = 0.005;
/// An answer is false if its error is beyond both limits.
const FALSE_SIGMAS: f64 = 5.0;
const FALSE_DEG: f64 = 0.5;

/// Returns the light that a Chapman layer emits per kilometre at a height.
fn layer(height_km: f64, [peak_km, scale_km]: [f64; 2]) -> f64 {
    let y = (height_km - peak_km) / scale_km;
    (1.0 - y - (-y).exp()).exp()
}

/// Returns the light along the line of sight with this tangent height. The ground hides the light behind it.
fn along_limb(tangent_km: f64, aurora: f64) -> f64 {
    const STEP_KM: f64 = 1.0;
    let one_side: f64 = (0..4500)
        .map(|k| (EARTH_KM + tangent_km).hypot(f64::from(k) * STEP_KM) - EARTH_KM)
        .filter(|&height_km| height_km >= 0.0)
        .map(|height_km| layer(height_km, AIRGLOW_KM) + aurora * layer(height_km, RED_KM))
        .sum();
    if tangent_km < 0.0 { one_side } else { 2.0 * one_side }
}

/// Returns the radiance by tangent height as a table of [`Radiance`]. The ground and the air above it, in moonlight,
/// have half of their brightness at 17 km.
fn table(ground: f64, aurora: f64) -> String {
    let heights_km = || (-100..=250).map(|k| 2.0 * f64::from(k));
    let glow: Vec<f64> = heights_km().map(|h| along_limb(h, aurora)).collect();
    let peak = glow.iter().copied().fold(0.0, f64::max);
    let moonlit = |h: f64| (0.5 * (-(h - 17.0) / 7.5).exp()).min(1.0);
    let light: Vec<f64> = heights_km().zip(&glow).map(|(h, g)| g / peak + ground * moonlit(h)).collect();
    let most = light.iter().copied().fold(0.0, f64::max);
    let mut text = String::from("latitude_deg,tangent_height_km,radiance\n");
    for latitude in [-90, 90] {
        for (h, b) in heights_km().zip(&light) {
            text.push_str(&format!("{latitude},{h},{}\n", SKY + BRIGHTEST * b / most));
        }
    }
    text
}

fn flight(
    ground: f64,
    aurora: f64,
    (width, height, focal_px): (u16, u16, f64),
    tone: Tone,
    pictures: usize,
) -> anyhow::Result<Flight> {
    let radiance = Arc::new(Radiance::parse(&table(ground, aurora)).map_err(anyhow::Error::msg)?);
    let world = World::Infrared(Infrared { radiance: Some(radiance), ..Infrared::default() });
    let camera = camera::Config::ideal(Model::Pinhole, width, height, focal_px);
    let pattern = leo_infrared(1, 1);
    let frame = |i: usize| {
        let n = i + 1;
        let turn = core::f64::consts::TAU;
        let off_nadir_deg = 60.0 + 15.0 * halton(n, 2);
        let look = Look::off_nadir(off_nadir_deg.to_radians(), turn * halton(n, 5), turn * halton(n, 7));
        let latitude_deg = 50.0 * (2.0 * halton(n, 11) - 1.0);
        let mut frame = pattern.frames.first().cloned()?;
        (frame.file, frame.time_s) = (format!("{i:04}.png"), i as f64);
        frame.scene.camera = camera.clone();
        frame.scene.pose = Pose::looking(position_m(latitude_deg, 360.0 * halton(n, 3), ALTITUDE_KM), look);
        frame.scene.world = world.clone();
        frame.scene.detector = Detector { psf_sigma_px: 1.0, read_noise: 0.01, bits: 8, tone, ..Detector::default() };
        frame.scene.seed = (1e6 * (ground + aurora)) as u64 + i as u64;
        Some(frame)
    };
    let frames = (0..pictures).filter_map(frame).collect();
    Ok(Flight { name: "airglow".into(), sensor: Config::new(camera), frames })
}

/// Pictures, answers, and false answers.
#[derive(Default, Clone, Copy)]
struct Tally {
    pictures: usize,
    answers: usize,
    wrong: usize,
}

impl Tally {
    fn add(&mut self, cases: &[Case]) {
        self.pictures += cases.len();
        for miss in cases.iter().filter_map(|case| case.miss.as_ref()) {
            self.answers += 1;
            self.wrong += usize::from(miss.angle_deg > FALSE_DEG && miss.angle_deg > FALSE_SIGMAS * miss.sigma_max_deg);
        }
    }
}

pub(super) fn night_side(effort: &Effort) -> anyhow::Result<Section> {
    let pictures = effort.frames(PICTURES);
    let mut section = Section::default();
    section.text(format!(
        "The night side from {ALTITUDE_KM} km: airglow (a Chapman layer at 95 km), a red aurora (a layer at 250 km) of \
         three brightnesses, and ground in moonlight; {} cameras of 500 and 2000 px focal length, with linear and with \
         sRGB counts; {pictures} pictures each. The sensor has default settings; it knows the camera and the position. \
         An answer is false if it is more than {FALSE_DEG}° and {FALSE_SIGMAS} sigmas wrong. The ground's brightness \
         is given as a multiple of the brightest airglow. The gate was designed on one photograph and on an early form \
         of this scene with other pictures (**in-sample** for the decision to check only the edge that wins).",
        CAMERAS.len()
    ));
    let names = ["default", "without the gate", "attitude to 5°"];
    let mut rows = Vec::new();
    let mut total = [Tally::default(); 3];
    for ground in GROUNDS {
        let mut tallies = [Tally::default(); 3];
        for aurora in AURORAS {
            for camera in CAMERAS {
                for tone in [Tone::Linear, Tone::Srgb] {
                    let flight = flight(ground, aurora, camera, tone, pictures)?;
                    let mut trusting = flight.sensor.clone();
                    trusting.gates.max_glow = 1e6;
                    let sensors = [
                        Sensor::new(names[0], flight.sensor.clone()),
                        Sensor::new(names[1], trusting),
                        Sensor::new(names[2], flight.sensor.clone()).with_attitude(5.0),
                    ];
                    for (k, cases) in fly(&flight, &sensors)?.iter().enumerate() {
                        tallies[k].add(cases);
                        total[k].add(cases);
                    }
                }
            }
        }
        rows.push(row(&ground.to_string(), &tallies));
    }
    rows.push(row("all", &total));
    let head = ["ground".to_owned(), "pictures".to_owned()];
    let of = |what: &str| names.map(|name| format!("{name}: {what}"));
    let [a, b, c] = of("answered");
    let [x, y, z] = of("false");
    section.table(head.into_iter().chain([a, x, b, y, c, z]), rows);
    Ok(section)
}

fn row(name: &str, tallies: &[Tally; 3]) -> Vec<String> {
    let numbers = tallies.iter().flat_map(|t| [t.answers, t.wrong]).map(|n| n.to_string());
    [name.to_owned(), tallies[0].pictures.to_string()].into_iter().chain(numbers).collect()
}
