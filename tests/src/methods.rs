//! The presets beside each other on the same rendered scenes, as text.

use core::fmt::Write;
use std::time::Instant;

use hzn_core::body::{self, Kind};
use hzn_core::camera::{self, Model};
use hzn_core::image::{Channel, ImageView, Layout};
use hzn_core::{Config, Frame, HostHorizon, Preset, covariance};
use hzn_sim::pose::position_m;
use hzn_sim::{Detector, Look, Pose, Profile, Scene, Sky, flight};

use crate::disc::{Disc, direction};
use crate::sensors::look;
use crate::table::{self, two_digits};
use crate::{Tally, known};

/// Pictures of one kind, in memory, with what is known and what is true of each.
struct Kindred {
    name: &'static str,
    /// Camera, body and edge errors; the rest is the preset's.
    sensor: Config,
    presets: Vec<Preset>,
    frames: Vec<Shot>,
}

/// One picture.
struct Shot {
    /// Samples, of two bytes above 8 bits, the low one first.
    bytes: Vec<u8>,
    bits: u8,
    known: Frame<f64>,
    truth: [f64; 3],
}

/// The presets of bodies that fill the picture.
fn limb_presets() -> Vec<Preset> {
    Preset::ALL.iter().copied().filter(|p| !matches!(p, Preset::Sun | Preset::Moon)).collect()
}

fn rendered(name: &'static str, sensor: Config, scenes: impl Iterator<Item = Scene>) -> Kindred {
    let frames = scenes
        .map(|scene| {
            let truth = scene.truth("", 0.0).expect("the scene is valid");
            let picture = scene.render().expect("the scene is valid");
            let bits = picture.bits();
            let bytes = match picture.samples() {
                hzn_sim::Samples::Bytes(b) => b.clone(),
                hzn_sim::Samples::Words(w) => w.iter().flat_map(|v| v.to_le_bytes()).collect(),
            };
            Shot { bytes, bits, known: known(&scene), truth: [truth.axis_x, truth.axis_y, truth.axis_z] }
        })
        .collect();
    Kindred { name, sensor, presets: limb_presets(), frames }
}

fn scenes(count: usize) -> Vec<Kindred> {
    let rocket = flight::rocket(1920, 1080, count, 1);
    let infrared = flight::leo_infrared(3 * count, 1);
    let third = |k: usize| infrared.frames[k * count..(k + 1) * count].iter().map(|f| f.scene.clone());
    let narrow = camera::Config::ideal(Model::Pinhole, 640, 480, 554.0);
    let (horace, looks) = table::cell(&narrow, 70.0, 0.02, 1.0);
    let (far, views) = full_disc(count);
    vec![
        rendered("rocket, 70 to 240 km", rocket.sensor, rocket.frames.into_iter().map(|f| f.scene)),
        rendered("infrared, 0 to 40° off nadir", infrared.sensor.clone(), third(0)),
        rendered("infrared, 40 to 80°", infrared.sensor.clone(), third(1)),
        rendered("infrared, 80 to 120°", infrared.sensor.clone(), third(2)),
        rendered("HORACE, 70 km, 60° lens", horace, looks.into_iter()),
        rendered("full disc, 36000 km", far, views.into_iter()),
        suns(count),
    ]
}

/// The whole Earth, blurred and noisy, in the middle half of the picture.
fn full_disc(count: usize) -> (Config, Vec<Scene>) {
    let camera = camera::Config::ideal(Model::Pinhole, 640, 480, 900.0);
    let mut sensor = Config::new(camera.clone());
    sensor.body = body::Config { limb_height_sigma_km: 2.0, ..sensor.body };
    sensor.covariance = covariance::Config { sigma_px: 0.07, correlation_px: 5.0, ..Default::default() };
    let scenes = (0..count).map(|i| {
        let x = i as f64 / count as f64;
        let position = position_m(40.0 * (6.3 * x).sin(), 300.0 * x, 35_786.0);
        Scene {
            body: sensor.body.clone(),
            profile: Profile::Exponential { scale_km: 5.0 },
            sky: Sky { brightness: 0.03, ..Sky::default() },
            detector: Detector { psf_sigma_px: 0.9, read_noise: 0.02, ..Detector::default() },
            seed: i as u64,
            ..Scene::new(camera.clone(), Pose::looking(position, Look::off_nadir(0.08 * x, 6.0 * x, 5.0 * x)))
        }
    });
    (sensor.clone(), scenes.collect())
}

/// The Sun through a wide lens, blooming to one to six times its own size.
fn suns(count: usize) -> Kindred {
    let mut sensor = Config::preset(Preset::Sun, camera::Config::ideal(Model::Pinhole, 640, 480, 800.0));
    sensor.covariance = covariance::Config { sigma_px: 0.1, correlation_px: 10.0, ..Default::default() };
    let frames = (0..count)
        .map(|i| {
            let x = i as f64 / count as f64;
            let axis = direction(&sensor, 60.0 + 520.0 * x, 240.0 + 170.0 * (9.0 * x).sin());
            let half_angle_rad = 0.2666f64.to_radians() * (1.0 + 5.0 * x);
            let disc =
                Disc { axis, half_angle_rad, sun: None, brightness: 900.0, halo: 60.0, blur_px: 0.9, noise: 3.0 };
            Shot { bytes: disc.paint(&sensor, i as u32 + 1), bits: 8, known: Frame::default(), truth: axis }
        })
        .collect();
    let mut presets = limb_presets();
    presets.insert(0, Preset::Sun);
    Kindred { name: "Sun, 1 to 6 times its size", sensor, presets, frames }
}

/// The sensor of a preset for scenes of one kind: told the same of camera, body and edge errors.
fn sensor(preset: Preset, told: &Config) -> Config {
    let mut config = Config::preset(preset, told.camera.clone());
    let degree_px = told.camera.fx_px.to_radians();
    config.body = told.body.clone();
    config.covariance.sigma_px = told.covariance.sigma_px;
    config.covariance.correlation_px = told.covariance.correlation_px;
    match preset.name() {
        // A threshold that the system's makers set for their scene: halfway between sky and body here.
        "dlr-2022" => config.binarize.level = 0.35,
        // 1°, whatever the lens.
        "zju-2022" => config.reject.threshold_px = degree_px,
        "horace-2015" => config.binarize.factor = 1.0,
        _ => {}
    }
    if told.body.kind == Kind::Sun {
        config.binarize = told.binarize;
        config.candidates.min_points = 8;
    }
    config
}

/// The table as Markdown, from `count` pictures of each kind.
///
/// # Panics
/// A scene cannot be rendered, or a preset refuses its camera.
pub fn markdown(count: usize) -> String {
    let mut out = String::from(
        "| scenes | preset | answered | RMS error | 95 % below | above 2° | NEES | time |\n\
         |---|---|---:|---:|---:|---:|---:|---:|\n",
    );
    for kindred in scenes(count) {
        for &preset in &kindred.presets {
            let config = sensor(preset, &kindred.sensor);
            let mut horizon = HostHorizon::boxed(&config).unwrap_or_else(|e| panic!("{}: {e}", preset.name()));
            let mut tally = Tally::default();
            let mut times_us = Vec::new();
            for Shot { bytes, bits, known, truth } in &kindred.frames {
                let c = &config.camera;
                let layout = Layout::packed(u32::from(c.width), u32::from(c.height), 1, *bits);
                let words: Vec<u16> = if *bits > 8 {
                    bytes.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect()
                } else {
                    Vec::new()
                };
                let view = if *bits > 8 {
                    ImageView::from_words(&words, layout, Channel::Mean)
                } else {
                    ImageView::from_bytes(bytes, layout, Channel::Mean)
                };
                let begun = Instant::now();
                let answer = match view.expect("a rendered picture is whole") {
                    ImageView::Grey8(p) => look(&mut horizon, &p, known),
                    ImageView::Grey16(p) => look(&mut horizon, &p, known),
                    _ => continue,
                };
                times_us.push(begun.elapsed().as_secs_f64() * 1e6);
                tally.add(answer.ok().as_ref(), *truth);
            }
            let mut errors = tally.errors_deg.clone();
            errors.sort_by(f64::total_cmp);
            times_us.sort_by(f64::total_cmp);
            let worst_but = errors.len().saturating_sub(1) * 95 / 100;
            let gross = errors.iter().filter(|e| **e > 2.0).count();
            let cell = |x: Option<&f64>, unit: &str| x.map_or("–".into(), |x| format!("{}{unit}", two_digits(*x)));
            let rms = Some(tally.rms_deg()).filter(|x| x.is_finite());
            let nees = Some(tally.mean_nees()).filter(|x| x.is_finite());
            let _ = writeln!(
                out,
                "| {} | `{}` | {}/{} | {} | {} | {gross} | {} | {} |",
                kindred.name,
                preset.name(),
                tally.answered(),
                tally.frames,
                cell(rms.as_ref(), "°"),
                cell(errors.get(worst_but), "°"),
                cell(nees.as_ref(), ""),
                cell(times_us.get(times_us.len() / 2), " µs"),
            );
        }
    }
    out
}
