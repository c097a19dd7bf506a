//! `hzn calibrate points`: calibrates a camera from points with known directions.

use std::path::PathBuf;
use std::str::FromStr;

use hzn_calib::points;
use hzn_core::camera::Model;

use super::lens_output::{check_endings, write_all};
use super::lens_text::Reasons;
use crate::commands::lens_model;
use crate::exit::{Exit, Outcome, failed};
use crate::files;
use crate::tell;

/// Calibrate a camera from points with known directions: a rotator with a collimator, or stars
///
/// The table has the columns u_px and v_px, and either azimuth_deg and elevation_deg or the unit vector x, y, z. The
/// azimuth grows to the right, the elevation upwards, and both are 0 near the middle of the picture. The frame of the
/// directions may be turned against the camera in any way, because this rotation is estimated. With a column `file`,
/// each picture has a rotation of its own.
///
/// The report goes to stdout. `-o camera.toml` writes the section [camera] with the covariance of its parameters, ready
/// for a sensor.toml; `-o report.html` writes plots; `-o residuals.csv` writes the residual of every point.
///
///   hzn calibrate points rotator.csv --size 384x288 -o camera.toml
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The table of points (.csv)
    #[arg(value_name = "POINTS")]
    table: PathBuf,
    /// Size of the pictures in pixels
    #[arg(long, value_name = "WIDTHxHEIGHT")]
    size: Size,
    /// Model of the lens: kannala-brandt, brown-conrady, equidistant, pinhole, double-sphere, eucm
    #[arg(long, value_name = "MODEL", default_value = "kannala-brandt", value_parser = lens_model::parse)]
    model: Model,
    /// Also write the camera (.toml), a report with plots (.html) or the residuals (.csv); may be given several times
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// Print no notes on stderr
    #[arg(short, long)]
    quiet: bool,
}

/// Width and height in pixels.
#[derive(Debug, Clone, Copy)]
struct Size([u16; 2]);

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let sides = text.split_once('x').and_then(|(a, b)| Some([a.parse().ok()?, b.parse().ok()?]));
        sides
            .filter(|sides: &[u16; 2]| sides.iter().all(|n| *n >= 2))
            .map(Self)
            .ok_or_else(|| "WIDTHxHEIGHT in pixels is expected, for example 384x288".to_owned())
    }
}

pub(super) fn run(args: &Args) -> Outcome {
    check_endings(&args.output)?;
    files::check_outputs(std::slice::from_ref(&args.table), &args.output, args.force)?;
    let table = points::table::load(&args.table, args.size.0)?;
    let name = args.table.display().to_string();
    if !args.quiet {
        table.copies_in_words().iter().for_each(|note| tell::line(format_args!("note: {name}: {note}")));
    }
    let calibrated = points::calibrate(args.model, args.size.0, &table.pictures)
        .map_err(|why| failed(format!("{name}: no camera is written: {why}")))?;
    write_all(&calibrated, &Reasons::new(), &args.output, &name, args.quiet)?;
    Ok(Exit::Done)
}
