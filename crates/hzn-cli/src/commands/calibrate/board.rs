//! `hzn calibrate board`: calibrates a camera from pictures of a chessboard.

use std::path::PathBuf;

use hzn_calib::board::{self, Board};
use hzn_core::camera::Model;
use hzn_run::source::{self, Raw};

use super::board_search;
use super::board_size::BoardSize;
use super::lens_output::{check_endings, write_all};
use crate::commands::lens_model;
use crate::exit::{Exit, Outcome, failed, usage};
use crate::files;
use crate::setup::stop_flag;
use crate::tell;

/// Calibrate a camera from pictures of a chessboard
///
/// Print a chessboard, fix it to something flat, and take 10 to 20 pictures. Tilt the board by 30 to 45 degrees in
/// different directions, and hold it near each corner of the picture in some of them. No first guess is needed. A board
/// that the border of the picture cuts counts as well.
///
/// The report goes to stdout. `-o camera.toml` writes the section [camera] with the covariance of its parameters, ready
/// for a sensor.toml; `-o report.html` writes plots; `-o residuals.csv` writes the residual of every corner.
/// `hzn camera convert` turns the camera into the form of another tool.
///
///   hzn calibrate board boards/*.png --board 9x6 --square-mm 30 -o camera.toml
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Pictures, a folder, a pattern in quotes, a video, or an MCAP
    #[arg(required = true, value_name = "PICTURES")]
    input: Vec<PathBuf>,
    /// Inner corners of the board, along its rows and its columns: one less than its squares
    #[arg(long, value_name = "COLUMNSxROWS")]
    board: BoardSize,
    /// Side of a square of the board; it sets the scale of the board's bow and has no effect on the lens
    #[arg(long, value_name = "MM", default_value_t = 1.0)]
    square_mm: f64,
    /// Model of the lens: kannala-brandt, brown-conrady, equidistant, pinhole, double-sphere, eucm
    #[arg(long, value_name = "MODEL", default_value = "kannala-brandt", value_parser = lens_model::parse)]
    model: Model,
    /// Size and format of headerless pictures, as in `hzn run`
    #[arg(long, value_name = "WIDTHxHEIGHT:FORMAT")]
    raw: Option<Raw>,
    /// Topic of the pictures in an MCAP; without it, the first topic with pictures
    #[arg(long, value_name = "TOPIC")]
    topic: Option<String>,
    /// Also write the camera (.toml), a report with plots (.html) or the residuals (.csv); may be given several times
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// Number of threads; without it, all cores
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Print no notes on stderr
    #[arg(short, long)]
    quiet: bool,
}

pub(super) fn run(args: &Args) -> Outcome {
    check_endings(&args.output)?;
    if !(args.square_mm > 0.0 && args.square_mm.is_finite()) {
        return Err(usage("--square-mm: must be above 0"));
    }
    let board = Board { columns: args.board.0[0], rows: args.board.0[1], square_mm: args.square_mm };
    let mut source = source::open(&args.input, args.raw, args.topic.as_deref())?;
    files::check_outputs(&source.files(), &args.output, args.force)?;
    if !args.quiet {
        source.notes().iter().for_each(|note| tell::line(format_args!("note: {note}")));
    }
    let Some(pictures) = board_search::search(source.as_mut(), &board, args.jobs, &stop_flag(), args.quiet)? else {
        tell::line("interrupted; nothing was calibrated");
        return Ok(Exit::Interrupted);
    };
    pictures.reasons.iter().for_each(|(name, why)| tell::warning(format_args!("{name}: {why}")));
    board_search::note_of_parts(&pictures, &board).iter().for_each(tell::warning);
    let name = args.input.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(" ");
    let calibrated = board::calibrate(args.model, pictures.size_px, &board, &pictures.views)
        .map_err(|why| failed(format!("no camera is written: {why}")))?;
    write_all(&calibrated, &pictures.reasons, &args.output, &name, args.quiet)?;
    Ok(if pictures.unreadable > 0 { Exit::SomeUnreadable } else { Exit::Done })
}
