//! `hzn calibrate noise`: measures limb height and edge noise on the pictures of a flight.

use std::path::PathBuf;

use hzn_calib::noise::{self, Calibration, Sighting};
use hzn_core::camera::Camera;
use hzn_run::open::Opened;
use hzn_run::source::ending;
use hzn_run::{disk, explain};

use super::flight::{self, Answered, check_endings};
use super::{page, text};
use crate::exit::{Exit, Outcome, failed, usage};
use crate::files;
use crate::progress::Progress;
use crate::setup::{self, InputArgs, SensorArgs};
use crate::tell;

/// Measure limb height and edge noise on the pictures of a flight
///
/// The flight needs an altitude or a position for each picture (frames.csv, --altitude-km, body.altitude_km), but no
/// truth. The altitude gives the expected size of the limb, so the measured size gives the limb height. The residuals
/// along the limb give the edge noise. The report goes to stdout. `-o sensor.toml` writes the keys, with comments, into
/// a copy of the sensor.toml; `-o report.html` writes plots of both. No sensor.toml is written if the flight does not
/// determine the limb height (fewer than 12 answered pictures, too small a field of view), or if its pictures
/// contradict each other. Then the exit code is 1, and the message gives the measured number.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A folder, a pattern in quotes, pictures, a video, or an MCAP
    #[arg(required = true, value_name = "FLIGHT")]
    input: Vec<PathBuf>,
    #[command(flatten)]
    sensor: SensorArgs,
    #[command(flatten)]
    source: InputArgs,
    /// Also write the sensor (.toml) or a report with plots (.html); may be given twice
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// Number of threads; without it, all cores
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Print no progress on stderr
    #[arg(short, long)]
    quiet: bool,
}

pub(super) fn run(args: &Args) -> Outcome {
    check_endings(&args.output)?;
    let opened = setup::open(&args.input, &args.sensor, &args.source)?;
    let read = files::of_sequence(opened.source.as_ref(), &setup::request(&args.input, &args.sensor, &args.source)?);
    files::check_outputs(&read, &args.output, args.force)?;
    opened.check_size()?;
    let wide = flight::with_wide_limb(&opened.sensor)?;
    opened.check_altitude()?;
    let Opened { mut source, sensor, frames, notes, .. } = opened;
    let plan = flight::plan(&args.source, args.sensor.flight, args.jobs, frames, wide);
    let camera = Camera::try_new(&plan.config.camera).map_err(usage)?;
    if !args.quiet {
        notes.iter().for_each(|note| tell::line(format_args!("note: {note}")));
    }
    let mut progress = Progress::new(source.total(), 0, args.quiet);
    let body = &plan.config.body;
    let measure = |a: Answered<'_>| {
        let sighting = Sighting::measure(a.name, &camera, body, &a.prior, &a.points, a.solution)?;
        Some(sighting.with_clipped(a.clipped))
    };
    let Some((sightings, unread)) = flight::measure_answers(&plan, source.as_mut(), &mut progress, measure)? else {
        tell::line("interrupted; nothing was measured");
        return Ok(Exit::Interrupted);
    };
    let sightings = flight::without_copies(sightings);
    unread.tell();
    let input = args.input.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(" ");
    let pictures = progress.frames();
    let mut calibration = Calibration::new(&plan.config.body, &sightings)
        .map_err(|why| failed(format!("{input} ({}): {why}", explain::counted(pictures, "picture"))))?;
    calibration.compare_with(&sensor.config);
    let written = noise::into_sensor_toml(&sensor.text, &calibration, &input).map_err(failed)?;
    tell::report(text::report(&calibration, pictures, &plan.config.camera))?;
    for path in args.output.iter().filter(|p| ending(p) == "html") {
        let html = page::html(&calibration, pictures, &input, &plan.config)?;
        disk::write(path, html)?;
    }
    if let Some(alarm) = calibration.alarm() {
        return Err(failed(format!("{input}: no sensor.toml is written: {alarm}")));
    }
    tell::report(format_args!("\n{}\n", written.keys.join("\n")))?;
    let sensors: Vec<_> = args.output.iter().filter(|p| ending(p) == "toml").collect();
    for path in &sensors {
        disk::write(path, &written.text)?;
    }
    if sensors.is_empty() && !args.quiet {
        tell::line("note: -o sensor.toml writes these keys into a copy of the sensor.toml");
    }
    Ok(unread.exit(Exit::Done))
}
