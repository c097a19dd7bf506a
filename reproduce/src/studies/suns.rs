//! The Sun in pictures with clouds, and with its reflections in the lens.

use hzn_core::{Config, body::Kind};
use hzn_mcap::Row;
use hzn_sim::Scenario;

use super::recordings::{process, untold};
use super::setup::Effort;
use crate::section::Section;

/// Scenes and their first seeds: other seeds than those on which the gates were designed.
const SCENES: [(&str, u64); 3] = [("tumble", 9101), ("horace-wide", 9111), ("rocket", 9121)];
const SEEDS: u64 = 3;
const PICTURES: usize = 120;
/// An answer that is farther from the Sun is false, degrees.
const FALSE_DEG: f64 = 1.0;

/// Numbers of pictures.
#[derive(Default)]
struct Tally {
    pictures: usize,
    in_view: usize,
    right: usize,
    wrong: usize,
}

impl Tally {
    fn add(&mut self, scene: &Scenario, rows: &[Row]) -> anyhow::Result<()> {
        let flight = scene.flight()?;
        // Four fifths of the circumference of the disc.
        let whole_px = 0.8 * core::f64::consts::TAU * 0.00465 * scene.camera.fx_px;
        for row in rows.iter().filter(|row| row.body == Kind::Sun.name()) {
            let Some(frame) = flight.frames.get(row.index as usize) else { continue };
            self.pictures += 1;
            self.in_view += usize::from(frame.scene.visible_px(Kind::Sun)? > whole_px);
            let [Some(x), Some(y), Some(z)] = [row.axis_x, row.axis_y, row.axis_z] else { continue };
            let truth = frame.scene.body_truth(Kind::Sun, &frame.file, frame.time_s)?;
            let cos = x * truth.axis_x + y * truth.axis_y + z * truth.axis_z;
            let is_right = cos.min(1.0).acos().to_degrees() < FALSE_DEG;
            *(if is_right { &mut self.right } else { &mut self.wrong }) += 1;
        }
        Ok(())
    }

    fn cells(&self, scene: &str, bodies: &str) -> Vec<String> {
        let numbers = [self.pictures, self.in_view, self.right, self.wrong].map(|n| n.to_string());
        [vec![format!("`{scene}`"), bodies.to_owned()], numbers.into()].concat()
    }
}

/// Returns the default sensor for some bodies of the scene.
fn sensor(scene: &Scenario, bodies: &[Kind]) -> Config {
    let mut config = untold(scene);
    config.bodies.retain(|body| bodies.contains(&body.kind));
    if let [one] = config.bodies.as_slice() {
        config.body = one.clone();
        config.bodies.clear();
    }
    config
}

pub(super) fn false_suns(effort: &Effort) -> anyhow::Result<Section> {
    let mut section = Section::default();
    section.text(format!(
        "Sensors with default settings look for the Sun in visible pictures with clouds, the limb and reflections in \
         the lens; {SEEDS} seeds of each scene, which were not used while the gates were designed. An answer more than \
         {FALSE_DEG}° from the Sun is false. A Sun is in view if the picture has four fifths of its circumference; \
         behind the Earth or a part of the vehicle it counts as out of view."
    ));
    let mut rows = Vec::new();
    for (name, first_seed) in SCENES {
        for (bodies, text) in [(vec![Kind::Earth, Kind::Sun], "Earth and Sun"), (vec![Kind::Sun], "Sun alone")] {
            let mut tally = Tally::default();
            for seed in first_seed..first_seed + SEEDS {
                let mut scene = Scenario::builtin(name).ok_or_else(|| anyhow::anyhow!("there is no scene {name}"))?;
                scene.seed = seed;
                scene.bodies = vec![Kind::Earth, Kind::Sun];
                scene.capture.frames = u32::try_from(effort.frames(PICTURES))?;
                tally.add(&scene, &process(&scene, &sensor(&scene, &bodies), None)?)?;
            }
            rows.push(tally.cells(name, text));
        }
    }
    section.table(["scene", "bodies of the sensor", "pictures", "Suns in view", "right", "false"], rows);
    Ok(section)
}
