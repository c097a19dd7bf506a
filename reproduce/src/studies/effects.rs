//! Finds out which effect of a scene moves the limb: the effects are switched off one at a time.

use anyhow::{Context, anyhow};
use hzn_sim::detector::Tone;
use hzn_sim::scenario::Format;
use hzn_sim::{Optics, Scenario, World};

use hzn_calib::noise;
use hzn_core::HostHorizon;
use hzn_core::camera::Camera;
use hzn_host::Compiled;
use rayon::prelude::*;

use super::defaults::{Outcome, Rendered};
use super::setup::Effort;
use crate::fly::{Sensor, deg, fly_rendered, two_digits};
use crate::section::Section;

/// Number of pictures per variant.
const PICTURES: usize = 24;
/// Seed of the flights; no default and no gate was chosen on it.
const SEED: u64 = 707;

/// Name of a variant, and the change that it makes.
type Variant = (&'static str, fn(&mut Scenario));

const ROCKET: &[Variant] = &[
    ("as it is", |_| ()),
    ("no veil", |s| s.optics.veil = 0.0),
    ("no bloom", |s| s.optics.bloom = 0.0),
    ("no ghosts", |s| s.optics.ghosts = 0.0),
    ("no fall-off", |s| s.optics.vignetting = 0.0),
    ("linear tone", |s| s.detector.tone = Tone::Linear),
    ("grey", |s| s.detector.colour = false),
    ("no JPEG", |s| s.capture.format = Format::Png),
    ("global shutter", |s| s.shutter = Default::default()),
    ("no clouds", no_clouds),
    ("half the exposure, nothing clips", |s| s.exposure.gain = 0.5),
    ("linear tone, half the exposure", |s| {
        s.detector.tone = Tone::Linear;
        s.exposure.gain = 0.5;
    }),
    ("linear tone, no stray light", |s| {
        s.detector.tone = Tone::Linear;
        s.optics = Optics { vignetting: s.optics.vignetting, ..Optics::default() };
    }),
    ("none of these", |s| {
        s.detector.tone = Tone::Linear;
        s.detector.colour = false;
        s.optics = Optics::default();
        s.capture.format = Format::Png;
        s.shutter = Default::default();
        s.exposure.gain = 0.5;
        no_clouds(s);
    }),
];

const TUMBLE: &[Variant] = &[
    ("as it is", |_| ()),
    ("global shutter", |s| s.shutter.readout_s = 0.0),
    ("global shutter, no exposure time", |s| s.shutter = Default::default()),
    ("global shutter, no stray light", |s| {
        s.shutter.readout_s = 0.0;
        s.optics = Optics { vignetting: s.optics.vignetting, ..Optics::default() };
    }),
    ("global shutter, no fall-off", |s| {
        s.shutter.readout_s = 0.0;
        s.optics.vignetting = 0.0;
    }),
    ("global shutter, no clouds", |s| {
        s.shutter.readout_s = 0.0;
        no_clouds(s);
    }),
    ("global shutter, exposure never clips", |s| {
        s.shutter.readout_s = 0.0;
        s.exposure.target_mean = None;
        s.exposure.gain = 0.5;
    }),
    ("global shutter, none of these", |s| {
        s.shutter = Default::default();
        s.optics = Optics::default();
        s.exposure.target_mean = None;
        s.exposure.gain = 0.5;
        no_clouds(s);
    }),
    ("the same, a limb without air", |s| {
        s.shutter = Default::default();
        s.optics = Optics::default();
        s.world = World::Plain;
    }),
];

fn no_clouds(scenario: &mut Scenario) {
    if let World::Visible(world) = &mut scenario.world {
        world.clear = true;
    }
}

pub(super) fn switched_off_effects(effort: &Effort) -> anyhow::Result<Section> {
    let count = effort.frames(PICTURES);
    let mut s = Section::default();
    s.text(format!(
        "{count} pictures of one flight, rendered again with effects switched off. *found* is the limb height of `hzn \
         calibrate noise`, from the curvature of the limb. *points* is the mean true height of the edge points. \
         *curvature* is the mean of the true heights of the points, weighted by their shares in the fitted height; \
         where the height varies along the limb, a fit with a free half-angle mistakes the variation for another \
         curvature. *found* minus *curvature* is geometry: the rolling shutter, whose rates the sensor does not know \
         here. χ² compares the scatter of the pictures' limb heights with their errors. RMS and NEES are for a sensor \
         with the height of *points* ± 1 km and the default noise.",
    ));
    for (scene, variants) in [("rocket", ROCKET), ("tumble", TUMBLE)] {
        let mut rows = Vec::new();
        for (name, change) in variants {
            let mut scenario = Scenario::builtin(scene).ok_or_else(|| anyhow!("there is no built-in scene {scene}"))?;
            scenario.seed = SEED;
            scenario.capture.frames = u32::try_from(count)?;
            change(&mut scenario);
            rows.push(row(
                name,
                &Rendered::from_scenario(&scenario, false).with_context(|| format!("{scene}: {name}"))?,
            )?);
        }
        s.table([&format!("`{scene}`"), "found", "points", "curvature", "χ²", "edge RMS", "RMS", "NEES"], rows);
    }
    s.text(
        "`rocket`: *found* equals *curvature* in every row, so fit and calibration are right; the height of the limb \
         itself varies. The light of the limb changes along the limb with the angle from the Sun, the edge is at half \
         of the local brightness, and a tone curve moves this place up by 5 km and increases its variation. A fit with \
         a free half-angle mistakes the variation for curvature, so the calibrated height follows *curvature* and not \
         *points*. The Sun's stray light is in none of the answered pictures of this flight, so it is not the cause; \
         JPEG and shutter change less than the calibration's sigma. `tumble`: the shutter is the smaller part of the \
         excess. The exposure controller saturates the bright limb; where the band is clipped, half of the clipped \
         value is kilometres farther out, and not equally everywhere. With an exposure that does not clip, the errors \
         are a third as large. A camera for this sensor should be exposed so that the limb is not saturated.",
    );
    Ok(s)
}

fn row(name: &str, flight: &Rendered) -> anyhow::Result<Vec<String>> {
    let none = || "–".to_owned();
    let found = flight.calibration.as_ref();
    let mut sensor = flight.default_sensor();
    let [points_km, curvature_km] = heights_km(flight)?;
    sensor.body.limb_height_km = points_km;
    sensor.body.limb_height_sigma_km = 1.0;
    let cases = fly_rendered(&flight.flight, &flight.pictures, &[Sensor::new("height given", sensor).without_rates()])?;
    let outcome = Outcome { knowledge: "", cases: cases.into_iter().flatten().collect() };
    Ok(vec![
        name.to_owned(),
        match found {
            Ok(c) => format!(
                "{:.2} ± {:.2} km",
                c.height.km,
                c.height.statistical_km.hypot(c.height.scatter_km / (c.pictures.len() as f64).sqrt())
            ),
            Err(why) => why.to_string(),
        },
        format!("{points_km:.2} km"),
        format!("{curvature_km:.2} km"),
        found.map_or_else(|_| none(), |c| format!("{:.2}", c.chi2)),
        found.map_or_else(|_| none(), |c| format!("{:.3} px", c.edge.sigma_px)),
        deg(outcome.rms_deg()),
        two_digits(outcome.mean_nees()),
    ])
}

/// Returns two mean true heights of the edge points in km: their plain mean, and their mean weighted by the share of
/// each point in the fitted height. The mean over the pictures is weighted by the inverse variance of each picture's
/// height.
fn heights_km(flight: &Rendered) -> anyhow::Result<[f64; 2]> {
    let wide = noise::config_for_calibration(&flight.default_sensor()).context("no body with a limb height")?;
    let camera = Camera::try_new(&wide.camera)?;
    let each = flight.flight.frames.par_iter().zip(&flight.pictures).map_init(
        || HostHorizon::boxed(&wide),
        |horizon, (frame, picture)| {
            let horizon = horizon.as_mut().ok()?;
            let known = frame.prior();
            let turning = camera.with_rate(known.rate_rad_s);
            let known = hzn_core::Prior { rate_rad_s: None, ..known };
            let expected = horizon.expect(&known).ok()?;
            let watch = noise::PointRecorder::default();
            let solution = horizon.find_observed(&picture.view(), &expected, &watch).solution?;
            let points = watch.candidate_points(solution.candidate);
            let sighting = noise::Sighting::measure(&frame.file, &camera, &wide.body, &known, &points, &solution)?;
            let (rays, shares): (Vec<_>, Vec<_>) = noise::shares(&turning, &points, &solution)?.into_iter().unzip();
            let heights = frame.scene.tangent_heights_km(rays);
            let mean = heights.iter().sum::<f64>() / heights.len() as f64;
            let weighted = heights.iter().zip(&shares).map(|(h, share)| h * share).sum::<f64>();
            Some([mean, weighted, sighting.sigma_km.powi(-2)])
        },
    );
    let each: Vec<[f64; 3]> = each.flatten().collect();
    let total: f64 = each.iter().map(|e| e[2]).sum();
    Ok([0, 1].map(|i| each.iter().map(|e| e[i] * e[2]).sum::<f64>() / total))
}
