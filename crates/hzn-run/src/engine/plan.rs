//! The settings of a run.

use std::sync::Arc;

use hzn_core::Config;
use hzn_files::Frames;

use super::sensor::LastAnswer;
use super::turns::Turns;
use crate::mask::MaskFolder;
use crate::overlay::OverlayFolder;

/// The settings of a run, for every picture.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The sensor.
    pub config: Config,
    /// Use single precision and at most 2048 points, as `FlightHorizon` has.
    pub flight: bool,
    /// Number of threads.
    pub threads: usize,
    /// The content of frames.csv; it replaces the priors from the source itself.
    pub frames: Option<Frames>,
    /// Frames a second, for pictures without any other time.
    pub fps: f64,
    /// Collect what is to be drawn over the picture.
    pub trace: bool,
    /// Return the traces: everything that the pipeline showed of its work.
    pub keep_traces: bool,
    /// Hand the picture to the sink.
    pub keep_picture: bool,
    /// Draw an overlay of every picture into this folder.
    pub overlay: Option<OverlayFolder>,
    /// Write a mask of every answered picture into this folder.
    pub masks: Option<Arc<MaskFolder>>,
    /// The last answers of the run that this one continues, one for each body.
    pub last: Vec<Option<LastAnswer>>,
    /// The answers and turns of the run that this one continues.
    pub turns: Turns,
}
