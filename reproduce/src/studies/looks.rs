//! Measures pictures that can be refused because of the search alone: discs under an image circle, thresholds that
//! follow the clouds, and photographs at many settings.

use std::path::Path;

use anyhow::Context;
use hzn_core::body::{self, Kind};
use hzn_core::frames::{Cam, UnitVec3};
use hzn_core::image::{Channel, Grey, ImageView, Layout};
use hzn_core::threshold::{self, Method};
use hzn_core::{Config, HostHorizon, Prior};
use hzn_host::Compiled;
use hzn_sim::Scenario;
use hzn_sim::painted::LensWithDiscs;
use rayon::prelude::*;

use super::setup::Effort;
use crate::fly::{HEADS, Sensor, cells, evaluate, fly, list_wrong_answers};
use crate::section::Section;

/// Number of brightness thresholds between the sky and the disc.
const LEVELS: u32 = 20;
/// Number of discs under each image circle.
const DISCS: usize = 20;

/// Measures 10 000 combinations of threshold, image circle and pose.
pub(super) fn lost_discs(effort: &Effort) -> anyhow::Result<Section> {
    let circles = effort.frames(25) as u32;
    let outcomes: Vec<Vec<(bool, bool)>> =
        (0..circles).into_par_iter().map(find_discs_under_circle).collect::<anyhow::Result<_>>()?;
    let all: Vec<(bool, bool)> = outcomes.into_iter().flatten().collect();
    let row = |name: &str, whole: bool| {
        let outlines = all.iter().filter(|(w, _)| *w == whole);
        let (count, lost) = (outlines.clone().count(), outlines.filter(|(_, right)| !right).count());
        vec![name.to_owned(), count.to_string(), lost.to_string()]
    };
    let mut s = Section::default();
    s.text(format!(
        "Evenly bright discs without noise through equidistant lenses to 60° to 90°: {circles} image circles, under \
         each {DISCS} discs seen from 1500 to 19 000 km, with half of the outline or more in view, at {LEVELS} fixed \
         thresholds from 5 % to 91 % of the disc's brightness. A disc is lost if there is no answer or the answer is \
         more than 0.2° off."
    ));
    s.table(
        ["outline", "combinations", "lost"],
        [row("whole in view", true), row("cut by the circle or the picture", false)],
    );
    s.text(
        "If a disc touches the image circle over fewer pixels than the strides along the border, only a search line \
         meets its edge and gives a part of it. Without a check for this, 16 of 7880 of these combinations were lost. \
         If an edge from a search line ends at the border, the sensor now searches the border pixel by pixel.",
    );
    Ok(s)
}

/// Returns for each disc at each threshold whether its whole outline is in view, and whether the disc was found.
fn find_discs_under_circle(number: u32) -> anyhow::Result<Vec<(bool, bool)>> {
    let with_discs = LensWithDiscs::new(number, DISCS);
    let mut out = Vec::new();
    for (disc, altitude_km) in &with_discs.discs {
        let data = with_discs.canvas.paint(disc);
        let axis = UnitVec3::<Cam, f64>::try_new(disc.axis).context("the axis has a direction")?;
        let whole = with_discs.canvas.outline_in_view(disc, 4.0) == 1.0;
        for k in 0..LEVELS {
            let part = 0.05 + 0.045 * f64::from(k);
            let mut config = Config::new(with_discs.lens.clone());
            config.body = body::Config {
                kind: Kind::EarthSphere,
                altitude_km: Some(*altitude_km),
                altitude_sigma_km: 1.0,
                limb_height_km: 0.0,
                limb_height_sigma_km: 2.0,
                ..config.body
            };
            let level = disc.dark + (disc.lit - disc.dark) * part;
            config.threshold = threshold::Config { method: Method::Fixed, level, ..config.threshold };
            let mut horizon = HostHorizon::boxed(&config)?;
            let layout = Layout::packed(with_discs.lens.width.into(), with_discs.lens.height.into(), 1, 8);
            let expected = horizon.expect(&Prior::default())?;
            let report = horizon.find(&Grey::try_new(&data, layout)?, &expected);
            let right = report.solution.is_some_and(|found| found.axis.angle_rad(&axis).to_degrees() < 0.2);
            out.push((whole, right));
        }
    }
    Ok(out)
}

/// Compares one look with several looks on scenes.
pub(super) fn second_look(effort: &Effort) -> anyhow::Result<Section> {
    let count = effort.frames(60);
    let mut s = Section::default();
    s.text(format!(
        "{count} pictures per scene, once with `retry.levels = []` and once by default. The sensor has a limb height \
         of 18 ± 7 km and the default noise. The scenes are the discs of `full-disc`, and `horace` through HORACE's \
         real camera (8 mm, 3.75 µm, 1024×768: 27.0°×20.4°)."
    ));
    let (mut rows, mut bad) = (Vec::new(), Vec::new());
    for name in ["full-disc", "horace"] {
        let mut scenario = Scenario::builtin(name).with_context(|| name.to_owned())?;
        (scenario.capture.frames, scenario.seed) = (u32::try_from(count)?, 4711);
        let flight = scenario.flight()?;
        let mut several = flight.sensor.clone();
        (several.body.limb_height_km, several.body.limb_height_sigma_km) = (18.0, 7.0);
        let mut once = several.clone();
        once.retry.levels.clear();
        let sensors = [Sensor::new("one look", once), Sensor::new("default", several)];
        for (sensor, cases) in sensors.iter().zip(fly(&flight, &sensors)?) {
            rows.push([format!("`{name}`"), sensor.name.clone()].into_iter().chain(cells(&evaluate(&cases))).collect());
            let wrong = list_wrong_answers(&cases);
            if !wrong.is_empty() {
                bad.push(format!("`{name}`, {}: {wrong}", sensor.name));
            }
        }
    }
    s.table(["scene", "sensor"].into_iter().chain(HEADS), rows);
    if !bad.is_empty() {
        s.text(format!("Wrong answers: {}.", bad.join("; ")));
    }
    Ok(s)
}

/// Eight brightness thresholds, as parts of full scale.
const BRIGHTNESS_THRESHOLDS: [f64; 8] = [0.05, 0.08, 0.12, 0.16, 0.2, 0.3, 0.4, 0.5];
/// Five consensus thresholds in pixels.
const CONSENSUS_THRESHOLDS_PX: [f64; 5] = [0.5, 1.0, 2.0, 3.0, 5.0];
/// Possible focal lengths of the lens of the aurora picture in millimetres, on a sensor 36 mm wide.
const LENSES_MM: [f64; 4] = [24.0, 28.0, 35.0, 50.0];
/// Direction to the Earth in iss030e102170-night.jpg (unit vector in the camera frame), from its stars.
const NIGHT_EARTH_DIRECTION: [f64; 3] = [0.022320, 0.942248, 0.334170];

/// Measures photographs at many brightness thresholds and consensus thresholds.
pub(super) fn real_pictures(_: &Effort) -> anyhow::Result<Section> {
    let mut s = Section::default();
    s.text(
        "Photographs of tests/data/real, reduced, at fixed brightness thresholds (levels, as parts of full scale) and \
         consensus thresholds (px). `iss073e0293986-aurora`: night limb, airglow, aurora; its camera is not recorded, \
         so lenses of 24 to 50 mm on a sensor 36 mm wide are assumed. `iss030e102170-night`: airglow and aurora, with \
         the direction to the Earth from the stars. The sensor should not answer the first at any of the 40 settings, \
         and should answer the second only within 3σ of the truth. Its limb height is 17 ± 7 km.",
    );
    let mut rows = Vec::new();
    let mut answers = Vec::new();
    for (name, focal_mm, truth) in LENSES_MM.iter().map(|&mm| ("iss073e0293986-aurora.jpg", Some(mm), None)).chain([(
        "iss030e102170-night.jpg",
        None,
        Some(NIGHT_EARTH_DIRECTION),
    )]) {
        let mut photograph = Photograph::load(name)?;
        if let Some(mm) = focal_mm {
            let camera = &mut photograph.sensor.camera;
            let focal_px = mm / 36.0 * f64::from(camera.width);
            (camera.fx_px, camera.fy_px) = (focal_px, focal_px);
        }
        let settings: Vec<(f64, f64)> =
            BRIGHTNESS_THRESHOLDS.iter().flat_map(|&l| CONSENSUS_THRESHOLDS_PX.iter().map(move |&t| (l, t))).collect();
        let found: Vec<Option<MeasuredAxis>> = settings
            .par_iter()
            .map(|&(level, threshold)| photograph.answer_with_threshold(level, threshold))
            .collect::<anyhow::Result<_>>()?;
        let shown = focal_mm.map_or_else(|| name.to_owned(), |mm| format!("{name}, {mm} mm"));
        let mut beyond = 0;
        for (&(level, threshold), found) in settings.iter().zip(&found) {
            let Some(found) = found else { continue };
            let off = truth.map(|t| found.off_deg(t));
            beyond += usize::from(off.is_none_or(|off| off > 3.0 * found.sigma_deg));
            let off = off.map(|off| format!(", {off:.2}° off")).unwrap_or_default();
            answers.push(format!("{shown}, level {level}, {threshold} px: σ {:.2}°{off}", found.sigma_deg));
        }
        rows.push(vec![
            shown,
            settings.len().to_string(),
            found.iter().flatten().count().to_string(),
            beyond.to_string(),
        ]);
    }
    s.table(["picture", "settings", "answered", "unwanted"], rows);
    if !answers.is_empty() {
        s.text(format!("Answers: {}.", answers.join("; ")));
    }
    add_opssat(&mut s)?;
    Ok(s)
}

/// Measures a photograph with a dark frame of one pixel and with haze: the axis must not depend on the threshold.
fn add_opssat(s: &mut Section) -> anyhow::Result<()> {
    let photograph = Photograph::load("opssat-2020-08-16.png")?;
    let mut found: Vec<MeasuredAxis> = Vec::new();
    let mut rows = Vec::new();
    for level in BRIGHTNESS_THRESHOLDS.into_iter().skip(1) {
        let row = match photograph.answer_with_threshold(level, 3.0)? {
            Some(here) => {
                let largest_deg = found.iter().map(|f| f.off_deg(here.axis)).fold(0.0, f64::max);
                let row =
                    [format!("{:.2} px", here.rms_px), format!("{:.2}°", here.sigma_deg), format!("{largest_deg:.4}°")];
                found.push(here);
                row
            }
            None => ["–".to_owned(), "no answer".to_owned(), "–".to_owned()],
        };
        rows.push([format!("{level}")].into_iter().chain(row).collect());
    }
    s.text(
        "`opssat-2020-08-16`: the Earth's limb through haze. Demosaicing left a frame of one black pixel, which joined \
         the limb to the outline of the picture. The fourth column is the largest distance from the axes in the rows \
         above.",
    );
    s.table(["level", "RMS", "σ", "from the others"], rows);
    Ok(())
}

struct Photograph {
    sensor: Config,
    rgb: image::RgbImage,
}

struct MeasuredAxis {
    axis: [f64; 3],
    sigma_deg: f64,
    rms_px: f64,
}

impl MeasuredAxis {
    fn off_deg(&self, axis: [f64; 3]) -> f64 {
        let unit = |v| UnitVec3::<Cam, f64>::try_new(v);
        unit(self.axis).zip(unit(axis)).map_or(f64::NAN, |(a, b)| a.angle_rad(&b).to_degrees())
    }
}

impl Photograph {
    fn load(name: &str) -> anyhow::Result<Self> {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/real").join(name);
        let mut sensor = hzn_files::sensor::load(&path.with_extension("toml"))?.config;
        (sensor.body.limb_height_km, sensor.body.limb_height_sigma_km) = (17.0, 7.0);
        Ok(Self { sensor, rgb: image::open(&path).with_context(|| path.display().to_string())?.into_rgb8() })
    }

    /// Returns the answer at a fixed brightness threshold (part of full scale) and a consensus threshold in pixels.
    fn answer_with_threshold(&self, level: f64, threshold_px: f64) -> anyhow::Result<Option<MeasuredAxis>> {
        let mut config = self.sensor.clone();
        config.threshold = threshold::Config { method: Method::Fixed, level, ..config.threshold };
        config.consensus.threshold_px = threshold_px;
        let mut horizon = HostHorizon::boxed(&config)?;
        let layout = Layout::packed(self.rgb.width(), self.rgb.height(), 3, 8);
        let view = ImageView::from_bytes(self.rgb.as_raw(), layout, Channel::Mean)?;
        let expected = horizon.expect(&Prior::default())?;
        Ok(horizon.find(view, &expected).solution.map(|s| MeasuredAxis {
            axis: s.axis.xyz(),
            sigma_deg: s.covariance.sigma_max_rad().to_degrees(),
            rms_px: s.rms_px,
        }))
    }
}
