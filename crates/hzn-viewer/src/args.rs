//! The command line.

use std::path::PathBuf;

use clap::Parser;
use hzn_flight::packet::ApidBase;
use hzn_run::source::Raw;

use crate::measure::Kind;
use crate::ui::Situation;
use crate::work::Computer;
use crate::work::open::Request;

/// Shows what the sensor found in each picture, and tunes its parameters live.
///
/// Opens a recording that `hzn run` wrote (.mcap), a folder of pictures, single pictures, or a video. Without an
/// argument, the window is empty and takes files by menu or by drag and drop.
///
/// With --follow, the window shows new pictures of a folder, or of a recording that grows, as they come. It keeps the
/// newest 9000 pictures.
///
/// A rig.toml shows the pictures of all heads side by side and on one sphere, and their check by each other.
///
/// The line of a flight computer shows its telemetry, and sends telecommands: tcp:HOST:PORT, udp:LOCAL,REMOTE,
/// tcp-listen:HOST:PORT or serial:DEVICE:BAUD. A port without a host (udp:5001) is one that only this computer
/// reaches.
#[derive(Debug, Clone, Parser)]
#[command(name = "hzn-viewer", version, max_term_width = 100)]
pub struct Args {
    /// A recording, a folder, pictures, a video, a rig.toml, or the line of a flight computer
    #[arg(value_name = "INPUT")]
    pub input: Vec<PathBuf>,
    /// The sensor.toml; without it, the one in the recording or next to the pictures
    #[arg(short, long, value_name = "FILE")]
    pub sensor: Option<PathBuf>,
    /// Table with time, altitude, position and attitude of the pictures; without it, frames.csv next to the pictures
    #[arg(long, value_name = "FILE")]
    pub frames: Option<PathBuf>,
    /// Table of the true directions; without it, truth.csv next to the pictures
    #[arg(long, value_name = "FILE")]
    pub truth: Option<PathBuf>,
    /// Pictures per second; used where nothing else gives the times of the pictures
    #[arg(long, value_name = "RATE")]
    pub fps: Option<f64>,
    /// Size and format of headerless pictures, as for `hzn run`
    #[arg(long, value_name = "WIDTHxHEIGHT:FORMAT")]
    pub raw: Option<Raw>,
    /// Compute with single precision and at most 2048 points, as `FlightHorizon` has
    #[arg(long)]
    pub flight: bool,
    /// Show new pictures as they come: of one folder, or of a recording that another program writes
    #[arg(long)]
    pub follow: bool,
    /// The key of the flight computer (`hzn key`), for its telecommands; its counter is kept beside it
    #[arg(long, value_name = "FILE")]
    pub key: Option<PathBuf>,
    /// `line.apid_base` of the flight computer, such as 0x100
    #[arg(long, value_name = "APID", default_value = "0x100")]
    pub apid_base: ApidBase,
    /// Index of the first picture to show, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub frame: usize,
    /// Save a screenshot of the window, print status and axis of the shown picture, and exit
    #[arg(long, value_name = "PNG")]
    pub screenshot: Option<PathBuf>,
    /// Bring the window into this situation before the screenshot
    #[arg(long, value_name = "WHAT", hide = true, requires = "screenshot")]
    pub situation: Option<Situation>,
    /// Size of the window in points
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = size)]
    pub size: Option<[f32; 2]>,
    /// Use light colours
    #[arg(long)]
    pub light: bool,
    /// Measure the speed or the memory of the window, print the result, and exit
    #[arg(long, value_name = "WHAT", hide = true, conflicts_with = "screenshot")]
    pub measure: Option<Kind>,
}

fn size(text: &str) -> Result<[f32; 2], String> {
    let parts = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    parts
        .filter(|s: &[f32; 2]| s.iter().all(|x| (200.0..=16384.0).contains(x)))
        .ok_or_else(|| "must be WIDTHxHEIGHT with sides of 200 to 16384, for example 1440x900".into())
}

impl Args {
    /// Returns the request to open the inputs of the command line.
    pub fn request(&self) -> Request {
        Request {
            inputs: self.input.clone(),
            sensor: self.sensor.clone(),
            frames: self.frames.clone(),
            truth: self.truth.clone(),
            fps: self.fps,
            raw: self.raw,
            computer: Computer { base: self.apid_base, key: self.key.clone() },
            frame: self.frame,
            follow: self.follow,
        }
    }
}
