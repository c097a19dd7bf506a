//! `hzn calibrate check`: tests whether a calibration still holds in flight.

use std::path::PathBuf;

use hzn_calib::sky::{self, Verdict};
use hzn_run::explain::counted;

use super::{sky as pictures, sky_text};
use crate::exit::{Exit, Outcome, failed, usage};
use crate::setup::{InputArgs, SensorArgs};
use crate::tell;

/// Test whether the calibration of the camera still holds in flight
///
/// The flight measures the focal length and the principal point without the calibration, and compares them with it. The
/// first line of the report has the verdict: `holds`, `does not hold`, or `cannot tell`. A difference is significant
/// beyond 3 sigmas of the flight and of the calibration together, which happens to 0.3 % of right calibrations. The
/// calibration holds if no difference is significant and an error of the focal length of --detect-percent would have
/// been found with a probability of 95 %; otherwise the flight cannot tell. Exit code 0 for `holds` and `cannot tell`,
/// 1 for `does not hold`.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A folder, a pattern in quotes, pictures, a video, or an MCAP
    #[arg(required = true, value_name = "FLIGHT")]
    input: Vec<PathBuf>,
    #[command(flatten)]
    sensor: SensorArgs,
    #[command(flatten)]
    source: InputArgs,
    /// Error of the focal length that must be found, in percent
    #[arg(long, value_name = "PERCENT", default_value_t = sky::DEFAULT_DETECT_PERCENT)]
    detect_percent: f64,
    /// Ignore the limb height in [body]; the altitude span alone then separates it from the focal length
    #[arg(long)]
    free_limb_height: bool,
    /// Number of threads; without it, all cores
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Print no progress on stderr
    #[arg(short, long)]
    quiet: bool,
}

pub(super) fn run(args: &Args) -> Outcome {
    if !(args.detect_percent > 0.0 && args.detect_percent.is_finite()) {
        return Err(usage("--detect-percent: must be above 0"));
    }
    let (sensor, notes) = pictures::load(&args.input, &args.sensor, &args.source)?;
    if !args.quiet {
        notes.iter().for_each(|note| tell::line(format_args!("note: {note}")));
    }
    let limb = pictures::limb_prior(&sensor, args.free_limb_height)?;
    // Answers must not be refused because of an error of the lens that is to be found.
    let mut used = sensor.clone();
    used.config.camera.covariance = None;
    used.config.camera.focal_sigma_percent = sensor.config.camera.focal_sigma_percent.max(10.0 * args.detect_percent);
    let found = pictures::views(&args.input, &args.source, args.sensor.flight, args.jobs, args.quiet, &used)?;
    let Some(found) = found else {
        tell::line("interrupted; nothing was measured");
        return Ok(Exit::Interrupted);
    };
    found.tell_left_out();
    let input = args.input.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(" ");
    let camera = &sensor.config.camera;
    let check = sky::check(camera, &found.plan.config.body, &found.views, limb, args.detect_percent)
        .map_err(|why| failed(format!("{input}: of {}: {why}", counted(found.count, "picture"))))?;
    tell::report(sky_text::check_report(&check, found.count))?;
    Ok(found.unread.exit(if check.verdict == Verdict::DoesNotHold { Exit::Failed } else { Exit::Done }))
}
