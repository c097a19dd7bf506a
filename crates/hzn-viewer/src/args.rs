//! The command line.

use std::path::PathBuf;

use clap::Parser;
use hzn_run::source::Raw;

use crate::measure::Kind;
use crate::work::open::Request;

/// Sees what the sensor saw, and tunes it live.
///
/// Opens what `hzn run` wrote (.mcap), a folder of pictures, pictures, or a video; without an argument, an empty window
/// that takes files by menu or drag and drop.
#[derive(Debug, Clone, Parser)]
#[command(name = "hzn-viewer", version, max_term_width = 100)]
pub struct Args {
    /// A recording, a folder, pictures, or a video
    #[arg(value_name = "INPUT")]
    pub input: Vec<PathBuf>,
    /// The sensor.toml; without it, the one in the recording or beside the pictures
    #[arg(short, long, value_name = "FILE")]
    pub sensor: Option<PathBuf>,
    /// Table with time, altitude, position, attitude of the pictures; without it, frames.csv beside them
    #[arg(long, value_name = "FILE")]
    pub frames: Option<PathBuf>,
    /// The truth; without it, truth.csv beside the pictures
    #[arg(long, value_name = "FILE")]
    pub truth: Option<PathBuf>,
    /// Frames a second, where nothing else gives a time
    #[arg(long, value_name = "RATE", default_value_t = 1.0)]
    pub fps: f64,
    /// Pictures are headerless: their size and format, as for `hzn run`
    #[arg(long, value_name = "WIDTHxHEIGHT:FORMAT")]
    pub raw: Option<Raw>,
    /// Single precision and 2048 points, as on the flight computer
    #[arg(long)]
    pub flight: bool,
    /// The frame to begin with, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub frame: usize,
    /// Save a picture of the window, print the frame's status and axis, and end
    #[arg(long, value_name = "PNG")]
    pub screenshot: Option<PathBuf>,
    /// Size of the window in points
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = size)]
    pub size: Option<[f32; 2]>,
    /// Light colours
    #[arg(long)]
    pub light: bool,
    /// Measure the window, print, and end
    #[arg(long, value_name = "WHAT", hide = true, conflicts_with = "screenshot")]
    pub measure: Option<Kind>,
}

fn size(text: &str) -> Result<[f32; 2], String> {
    let parts = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    parts
        .filter(|s: &[f32; 2]| s.iter().all(|x| (200.0..=16384.0).contains(x)))
        .ok_or_else(|| "such as 1440x900".into())
}

impl Args {
    /// What is to be opened.
    pub fn request(&self) -> Request {
        Request {
            inputs: self.input.clone(),
            sensor: self.sensor.clone(),
            frames: self.frames.clone(),
            truth: self.truth.clone(),
            fps: self.fps,
            raw: self.raw,
            frame: self.frame,
        }
    }
}
