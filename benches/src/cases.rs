//! Renders the frames once and keeps them as bytes without a header, so that both programs read the same data.

use std::fs;
use std::path::Path;

use hzn_core::{Config, Prior, camera};
use hzn_sim::flight::rocket;
use hzn_sim::{Disc, Flight, FlightFrame, Samples, Sky};
use serde::{Deserialize, Serialize};

use crate::memory::FrameBytes;

/// Case whose frames may still have to be rendered.
pub(crate) struct Plan {
    pub(crate) name: String,
    flight: Flight,
    /// Whether the frames show hostile patterns instead of the flight.
    hostile: bool,
}

/// Case in memory.
pub(crate) struct Case {
    /// Name of the folder of the frames.
    pub(crate) name: String,
    /// Name in tables.
    pub(crate) title: String,
    pub(crate) sensor: Config,
    pub(crate) frames: Vec<Picture>,
}

/// Frame with its prior and its truth.
pub(crate) struct Picture {
    pub(crate) memory: FrameBytes,
    pub(crate) prior: Prior<f64>,
    /// True limb axis in the camera frame; `None` if the frame shows no limb.
    pub(crate) truth: Option<[f64; 3]>,
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
/// Sizes for the growth of the time with the size of the picture, from 0.08 to 48 million pixels.
const GROWTH_SIZES: [(u16, u16); 6] = [(320, 240), (640, 480), (1280, 960), (1920, 1080), (4096, 3072), (8000, 6000)];
/// Number of frames of each case of the growth.
const GROWTH_FRAMES: usize = 3;

/// Returns the cases of the tables: clean and cloudy frames in three sizes.
pub(crate) fn plans(frames: usize) -> Vec<Plan> {
    let kinds = |size| ["clean", "cloudy"].map(|kind| Plan::new(kind, size, frames));
    SIZES.into_iter().flat_map(kinds).collect()
}

/// Returns the cases of the growth, each with its number of pixels: clean, cloudy and hostile frames of every size.
pub(crate) fn growth_plans() -> Vec<Plan> {
    let kinds = |size| ["clean", "cloudy", "hostile"].map(|kind| Plan::new(kind, size, GROWTH_FRAMES));
    GROWTH_SIZES.into_iter().flat_map(kinds).collect()
}

impl Plan {
    fn new(kind: &str, (width, height): (u16, u16), frames: usize) -> Self {
        // More frames than necessary are made, because a tumbling rocket sometimes shows little limb.
        let mut flight = rocket(width, height, frames.max(8) * 2, 7);
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
        Self { name: format!("{kind}-{width}x{height}"), flight, hostile: kind == "hostile" }
    }
}

/// Paints a hostile frame: soft dots of 48 pixels over the whole picture. Every dot is an edge, and none is a limb. It
/// is the pattern that cost a flight computer most among those of the firmware's table.
fn paint_hostile(width: u16, height: u16, number: usize) -> Vec<u8> {
    let turn = (0.2 + 0.3 * number as f64).sin_cos();
    let wave = |phase: f64| 0.5 + 0.5 * (phase / 48.0 * std::f64::consts::TAU).cos();
    let shade = |x: u16, y: u16| {
        let (x, y) = (f64::from(x), f64::from(y));
        (255.0 * wave(x * turn.1 + y * turn.0) * wave(y * turn.1 - x * turn.0)) as u8
    };
    (0..height).flat_map(|y| (0..width).map(move |x| shade(x, y))).collect()
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
        // Cases of the same kind and size have different numbers of frames.
        let name = format!("{}-{}", self.name, self.flight.frames.len());
        let folder = folder.join(&name);
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
            for (number, (frame, entry)) in self.flight.frames.iter().zip(&manifest.frames).enumerate() {
                let bytes = if self.hostile {
                    let camera = &frame.scene.camera;
                    paint_hostile(camera.width, camera.height, number)
                } else {
                    match frame.render().map_err(|e| e.to_string())?.samples() {
                        Samples::Bytes(bytes) => bytes.clone(),
                        _ => return Err("the rendered frame must have 8 bits".into()),
                    }
                };
                fs::write(folder.join(&entry.file), bytes).map_err(text)?;
            }
            // The description is written last, so that an incomplete case is rendered again.
            fs::write(&path, serde_json::to_string(&manifest).map_err(|e| e.to_string())?).map_err(text)?;
        }
        let mut frames = Vec::new();
        for (frame, entry) in self.flight.frames.iter().zip(&manifest.frames) {
            let truth = frame.truth().map_err(|e| e.to_string())?;
            let bytes = fs::read(folder.join(&entry.file)).map_err(text)?;
            frames.push(Picture {
                memory: FrameBytes::copy(&bytes).map_err(text)?,
                prior: frame.prior(),
                truth: (!self.hostile).then_some([truth.axis_x, truth.axis_y, truth.axis_z]),
            });
        }
        Ok(Case { name, title: self.name, sensor: self.flight.sensor, frames })
    }
}

impl Case {
    /// Returns a frame by its number.
    pub(crate) fn frame(&self, number: usize) -> Result<&Picture, String> {
        self.frames.get(number).ok_or_else(|| format!("{} has no frame {number}", self.name))
    }

    /// Returns the number of pixels of a frame.
    pub(crate) fn pixels(&self) -> u64 {
        u64::from(self.sensor.camera.width) * u64::from(self.sensor.camera.height)
    }
}
