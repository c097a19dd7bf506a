//! Renders the frames once and keeps them as bytes without a header, so that both programs read the same data.

use std::fs;
use std::path::Path;

use hzn_core::{Config, Prior, camera};
use hzn_sim::flight::rocket;
use hzn_sim::{Disc, Flight, FlightFrame, Samples, Sky};
use serde::{Deserialize, Serialize};

/// Case whose frames may still have to be rendered.
pub(crate) struct Plan {
    pub(crate) name: String,
    flight: Flight,
}

/// Case in memory.
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) sensor: Config,
    pub(crate) frames: Vec<Picture>,
}

/// Frame with its prior and its truth.
pub(crate) struct Picture {
    pub(crate) bytes: Vec<u8>,
    pub(crate) prior: Prior<f64>,
    /// True limb axis in the camera frame.
    pub(crate) truth: [f64; 3],
}

/// Description next to the frames, for the other program and for the next run.
#[derive(Serialize, Deserialize, PartialEq)]
struct Manifest {
    camera: camera::Config,
    frames: Vec<Entry>,
}
#[derive(Serialize, Deserialize, PartialEq)]
struct Entry {
    file: String,
    /// Scene of the frame, so that frames of other scenes are not used by mistake.
    scene: hzn_sim::Scene,
}

const SIZES: [(u16, u16); 3] = [(640, 480), (1920, 1080), (4096, 3072)];

/// Returns the cases: clean and cloudy frames in three sizes.
pub(crate) fn plans(frames: usize) -> Vec<Plan> {
    let mut plans = Vec::new();
    for (width, height) in SIZES {
        for kind in ["clean", "cloudy"] {
            // Twice the number is made, because a tumbling rocket sometimes shows little limb.
            let mut flight = rocket(width, height, frames * 2, 7);
            let camera = lens_without_image_circle(width, height);
            flight.sensor.camera = camera.clone();
            flight.frames.iter_mut().for_each(|f| f.scene.camera = camera.clone());
            if kind == "clean" {
                for frame in &mut flight.frames {
                    frame.scene.disc = Disc::default();
                    frame.scene.sky = Sky { stars: 0, ..frame.scene.sky };
                }
            }
            let shown = |f: &FlightFrame| f.scene.visible_limb_px().is_ok_and(|px| px > f64::from(width) * 0.5);
            flight.frames.retain(shown);
            flight.frames.truncate(frames);
            plans.push(Plan { name: format!("{kind}-{width}x{height}"), flight });
        }
    }
    plans
}

/// Returns the rocket's lens, scaled by the diagonal of the picture. With this scale the image circle stays outside the
/// picture in every format; the recipe does not know of image circles.
fn lens_without_image_circle(width: u16, height: u16) -> camera::Config {
    let (w, h) = (f64::from(width), f64::from(height));
    let focal_px = 1233.0 * w.hypot(h) / 1920f64.hypot(1080.0);
    let k = [-0.055, 0.011, -0.0035, 0.0002].into_iter().collect();
    camera::Config { k, ..camera::Config::ideal(camera::Model::KannalaBrandt, width, height, focal_px) }
}

impl Plan {
    /// Reads the frames. Renders them first if `render` is set or the stored frames do not match.
    pub(crate) fn prepare(self, folder: &Path, render: bool) -> Result<Case, String> {
        let folder = folder.join(&self.name);
        let text = |e: std::io::Error| format!("{}: {e}", folder.display());
        let entry = |(i, f): (usize, &FlightFrame)| Entry { file: format!("{i:02}.gray"), scene: f.scene.clone() };
        let manifest = Manifest {
            camera: self.flight.sensor.camera.clone(),
            frames: self.flight.frames.iter().enumerate().map(entry).collect(),
        };
        let path = folder.join("case.json");
        let is_current =
            fs::read_to_string(&path).is_ok_and(|s| serde_json::from_str(&s).is_ok_and(|m: Manifest| m == manifest));
        if render || !is_current {
            eprintln!("rendering {}", self.name);
            fs::create_dir_all(&folder).map_err(text)?;
            for (frame, entry) in self.flight.frames.iter().zip(&manifest.frames) {
                let picture = frame.render().map_err(|e| e.to_string())?;
                let Samples::Bytes(bytes) = picture.samples() else {
                    return Err("the rendered frame must have 8 bits".into());
                };
                fs::write(folder.join(&entry.file), bytes).map_err(text)?;
            }
            // The description is written last, so that an incomplete case is rendered again.
            fs::write(&path, serde_json::to_string(&manifest).map_err(|e| e.to_string())?).map_err(text)?;
        }
        let mut frames = Vec::new();
        for (frame, entry) in self.flight.frames.iter().zip(&manifest.frames) {
            let truth = frame.truth().map_err(|e| e.to_string())?;
            frames.push(Picture {
                bytes: fs::read(folder.join(&entry.file)).map_err(text)?,
                prior: frame.prior(),
                truth: [truth.axis_x, truth.axis_y, truth.axis_z],
            });
        }
        Ok(Case { name: self.name, sensor: self.flight.sensor, frames })
    }
}

impl Case {
    /// Returns the number of pixels of a frame.
    pub(crate) fn pixels(&self) -> u64 {
        u64::from(self.sensor.camera.width) * u64::from(self.sensor.camera.height)
    }
}
