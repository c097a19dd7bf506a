//! The arguments of `hzn run`.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use hzn_files::{Frames, Sensor};
use hzn_run::engine::{Plan, Turns};
use hzn_run::mask::MaskFolder;
use hzn_run::overlay::OverlayFolder;
use hzn_run::provenance;
use hzn_run::sink::{Existing, Outputs};

use crate::exit::{Stop, usage};
use crate::setup::{InputArgs, SensorArgs, TableFormat};

/// Process a sequence of pictures
///
/// Pictures are PNG, JPEG, TIFF, PNM, BMP, WebP, FITS or .npy, in a folder, as a pattern, or one by one; or headerless
/// (--raw); or a video (through ffmpeg on PATH); or an MCAP with an image topic. The pictures of a folder or pattern
/// are sorted by name, and numbers in names are compared by value (img2 before img10). An MCAP of an earlier run is
/// processed again with its own sensor, names, times and positions. A picture that cannot be read becomes a row with
/// status `unreadable`; the run goes on.
///
/// A rig.toml names several cameras that are one sensor: each picture has the row of its camera, and each epoch a row
/// with the joint answer.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// A folder, a pattern in quotes, pictures, a video, an MCAP, or a rig.toml; - reads the names of pictures from
    /// standard input, one a line, or with --raw the pictures themselves
    #[arg(required = true, value_name = "INPUT")]
    pub(super) input: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) sensor: SensorArgs,
    #[command(flatten)]
    pub(super) source: InputArgs,
    /// Results: .mcap, .csv, .jsonl, or - for stdout; may be given several times; without it, a table on stdout
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Vec<PathBuf>,
    /// Format of the results on stdout; without it, csv
    #[arg(long, value_name = "FORMAT")]
    pub(super) format: Option<TableFormat>,
    /// Replace an output that exists
    #[arg(long)]
    pub(super) force: bool,
    /// Continue an output after its last finished picture
    #[arg(long, conflicts_with = "force", requires = "output")]
    pub(super) resume: bool,
    /// Wait for the disk at each flush (every 0.2 s), so that even a power cut loses no finished picture
    #[arg(long, requires = "output")]
    pub(super) durable: bool,
    /// Leave the pictures out of an MCAP
    #[arg(long)]
    pub(super) no_images: bool,
    /// In an MCAP, write the answers also as messages of ROS 2: the axis as geometry_msgs/Vector3Stamped on
    /// /hzn/axis_vector, its covariance as std_msgs/Float64MultiArray on /hzn/axis_covariance
    #[arg(long)]
    pub(super) ros: bool,
    /// Draw the result over every picture, as PNG into this folder
    #[arg(long, value_name = "DIR")]
    pub(super) overlay: Option<PathBuf>,
    /// Write a mask of every answered picture, as PNG into this folder: 255 where the body hides the stars, its limb
    /// moved outwards by three sigmas, with Sun and Moon where their direction is known
    #[arg(long, value_name = "DIR")]
    pub(super) mask_pictures: Option<PathBuf>,
    /// Move the outlines in the masks farther outwards by this angle
    #[arg(long, value_name = "DEG", default_value = "0", requires = "mask_pictures", value_parser = margin_deg)]
    pub(super) mask_margin_deg: f64,
    /// Write a copy of every answered FITS file into this folder, with the centre of the body and the plate scale in
    /// its header (WCS); the rotation is that of the attitude in frames.csv, and else unknown
    #[arg(long, value_name = "DIR")]
    pub(super) wcs: Option<PathBuf>,
    /// After the pictures of the folder, wait for those that arrive in it, until Ctrl-C. A PNG or JPEG is complete with
    /// its end, or when it has not changed for ten seconds, and any other picture when it has not changed for half a
    /// second; a file that gets its name when it is complete is always safe
    #[arg(long)]
    pub(super) watch: bool,
    /// Number of threads; without it, all cores
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) jobs: Option<u16>,
    /// Print no progress and no summary
    #[arg(short, long)]
    pub(super) quiet: bool,
}

impl Args {
    /// Returns the arguments to process a folder with its own sensor.toml into `output`. An existing output is
    /// replaced, and no progress is printed.
    pub(crate) fn quiet_run(folder: &Path, output: &Path) -> Self {
        Self {
            input: vec![folder.to_owned()],
            sensor: SensorArgs { sensor: None, altitude_km: None, flight: false },
            source: InputArgs { frames: None, fps: 1.0, raw: None, topic: None },
            output: vec![output.to_owned()],
            format: None,
            force: true,
            resume: false,
            durable: false,
            no_images: false,
            ros: false,
            overlay: None,
            mask_pictures: None,
            mask_margin_deg: 0.0,
            wcs: None,
            watch: false,
            jobs: None,
            quiet: true,
        }
    }

    /// Returns the treatment of an output that exists.
    pub(super) fn existing(&self) -> Existing {
        match (self.force, self.resume) {
            (true, _) => Existing::Replace,
            (_, true) => Existing::Resume,
            _ => Existing::Refuse,
        }
    }

    /// Returns whether the run writes a picture for each of its own.
    pub(super) fn writes_pictures(&self) -> bool {
        self.overlay.is_some() || self.mask_pictures.is_some() || self.wcs.is_some()
    }

    /// Returns whether pictures are left. Ctrl-C is the only end of a run that waits for them.
    pub(super) fn has_more(&self, done: u64, total: Option<u64>) -> bool {
        !self.watch && total.is_none_or(|n| done < n)
    }

    /// Returns the settings of the pictures of one camera.
    ///
    /// # Errors
    /// The sensor is refused.
    pub(super) fn plan(&self, sensor: Sensor, frames: Option<Frames>) -> Result<Plan, Stop> {
        let trace = Outputs::want_trace(&self.output);
        // If the threshold or a gate comes from the previous picture, pictures are processed one after another.
        let threads = if sensor.config.tracks() { 1 } else { self.jobs.map_or_else(cores, usize::from) };
        let masks = self.mask_pictures.as_deref();
        let masks = masks.map(|folder| MaskFolder::new(folder, &sensor.config, self.mask_margin_deg)).transpose();
        let overlay = self.overlay.clone().map(|path| {
            let hash = provenance::hash(&sensor.config);
            OverlayFolder { path, provenance: provenance::line(hash.as_deref(), &provenance::command("hzn")) }
        });
        Ok(Plan {
            masks: masks.map_err(usage)?.map(Arc::new),
            config: sensor.config,
            flight: self.sensor.flight,
            threads,
            frames,
            fps: self.source.fps,
            trace,
            keep_traces: false,
            keep_picture: trace && !self.no_images,
            overlay,
            last: Vec::new(),
            turns: Turns::default(),
        })
    }

    /// Returns the settings of the pictures of a head of a rig.
    ///
    /// # Errors
    /// The sensor is refused.
    pub(crate) fn rig_plan(&self, sensor: Sensor) -> Result<Plan, Stop> {
        // A picture that repeats the one before it is found by its bytes.
        Ok(Plan { keep_picture: true, ..self.plan(sensor, None)? })
    }
}

/// Reads the margin of the masks.
fn margin_deg(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(deg) if (0.0..=90.0).contains(&deg) => Ok(deg),
        _ => Err("must be a number from 0 to 90".to_owned()),
    }
}

/// Returns the number of threads without `--jobs`.
pub(crate) fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, Into::into)
}
