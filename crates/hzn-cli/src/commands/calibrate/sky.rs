//! `hzn calibrate sky`: measures the lens on the limb pictures of a flight.

use std::path::PathBuf;

use hzn_calib::Sensor;
use hzn_calib::sky::{self, Estimate, LimbPrior, Mount, MountRefusal, Parameter, Unknowns, View};
use hzn_run::disk;
use hzn_run::engine::Plan;
use hzn_run::explain::counted;
use hzn_run::source::ending;

use super::flight::{self, check_outputs};
use super::{page, sky_text};
use crate::exit::{Exit, Outcome, Stop, failed, usage};
use crate::progress::Progress;
use crate::setup::{InputArgs, SensorArgs, check_size, find_input};
use crate::tell;

/// Number of times that the pictures are processed at most. The first lens may be several percent wrong, and with it
/// the choice of the edge points.
const PASSES: usize = 3;
/// The pictures are processed again if the focal length changes by more than this, in percent: the edge points at the
/// border of a wide picture then move by about a pixel.
const PROCESS_AGAIN_PERCENT: f64 = 0.2;

/// Measure focal length and principal point on the limb pictures of a flight
///
/// The flight needs an altitude or a position for each picture (frames.csv, --altitude-km, body.altitude_km), but no
/// truth. The lens is estimated together with the limb height, whose value and sigma in [body] are the prior. The
/// range of altitudes and directions separates the two; the report says how well. The sigmas of the calibration in
/// [camera] are the prior of the lens; without them, the focal length is free within 10 %. The report goes to stdout.
/// `-o sensor.toml` writes the determined parameters with their covariance into a copy of the sensor.toml; `-o
/// report.html` writes plots. A parameter is written only if the flight halves its sigma at least. If it halves none,
/// the exit code is 1 and the message has the measured numbers.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A folder, a pattern in quotes, pictures, a video, or an MCAP
    #[arg(required = true, value_name = "FLIGHT")]
    input: Vec<PathBuf>,
    #[command(flatten)]
    sensor: SensorArgs,
    #[command(flatten)]
    source: InputArgs,
    /// Also estimate this parameter; may be given twice
    #[arg(long, value_enum, value_name = "PARAMETER")]
    also: Vec<Also>,
    /// Ignore the sigmas of the calibration in [camera], for example after damage
    #[arg(long)]
    ignore_sigmas: bool,
    /// Ignore the limb height in [body]; the altitude span alone then separates it from the focal length
    #[arg(long)]
    free_limb_height: bool,
    /// Also measure the mounting of the camera; needs a position and an attitude (computed with the nominal mounting)
    /// for each picture
    #[arg(long)]
    mount: bool,
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

/// A parameter that is estimated on request.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Also {
    /// The first coefficient of the lens
    K1,
    /// fx and fy separately
    Aspect,
}

impl From<Also> for Parameter {
    fn from(also: Also) -> Self {
        match also {
            Also::K1 => Self::K1,
            Also::Aspect => Self::Aspect,
        }
    }
}

/// The pictures of a flight for `sky` and `check`, and the number of all pictures.
pub(super) struct Pictures {
    pub(super) views: Vec<View>,
    pub(super) count: u64,
    pub(super) plan: Plan,
}

pub(super) fn run(args: &Args) -> Outcome {
    check_outputs(&args.output, args.force)?;
    let (sensor, notes) = load(&args.input, &args.sensor, &args.source)?;
    if !args.quiet {
        notes.iter().for_each(|note| tell::line(format_args!("note: {note}")));
    }
    let limb = limb_prior(&sensor, args.free_limb_height)?;
    let input = args.input.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(" ");
    let unknowns = unknowns(args, &sensor);
    let Some((pictures, estimate)) = measure(args, &sensor, &unknowns, limb, &input)? else {
        tell::line("interrupted; nothing was measured");
        return Ok(Exit::Interrupted);
    };
    let mount = args.mount.then(|| sky::estimate_mount(&estimate, &pictures.plan.config.body, &pictures.views));
    tell::result(sky_text::report(&estimate, pictures.count, mount.as_ref()))?;
    write(args, &sensor, &estimate, mount, &input)
}

/// Loads the sensor for a flight, with notes for the user.
pub(super) fn load(input: &[PathBuf], sensor: &SensorArgs, source: &InputArgs) -> Result<(Sensor, Vec<String>), Stop> {
    let mut source = source.open(input)?;
    let mut sensor = sensor.load(source.as_ref())?;
    let mut notes = source.notes();
    notes.extend(find_input(source.as_mut(), &mut sensor)?);
    check_size(source.as_ref(), &sensor)?;
    Ok((sensor, notes))
}

/// Returns the limb height of the sensor as a prior. The error of the altitude moves the limb by the same amount.
pub(super) fn limb_prior(sensor: &Sensor, free: bool) -> Result<LimbPrior, Stop> {
    let body = sensor.config.each_body().iter().find(|b| !b.half_angle_is_free());
    let body = body.ok_or_else(|| usage("the sensor looks only for Sun and Moon, which have no limb height"))?;
    let rows = &body.limb_height_by_latitude_km;
    let heights = || rows.iter().map(|[_, km]| *km);
    let (km, spread_km) = if rows.is_empty() {
        (body.limb_height_km, 0.0)
    } else {
        let [low, high] = [heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max)];
        (0.5 * (low + high), 0.5 * (high - low))
    };
    let sigma_km = body.limb_height_sigma_km.hypot(spread_km).hypot(body.altitude_sigma_km);
    Ok(LimbPrior { km, sigma_km: if free { f64::INFINITY } else { sigma_km } })
}

/// Returns the parameters to estimate.
fn unknowns(args: &Args, sensor: &Sensor) -> Unknowns {
    let also: Vec<Parameter> = args.also.iter().map(|a| (*a).into()).collect();
    if args.ignore_sigmas {
        Unknowns::ignoring_sigmas(&sensor.config.camera, &also)
    } else {
        Unknowns::new(&sensor.config.camera, &also)
    }
}

/// Processes the pictures and estimates the lens, with the estimated lens again if it differs. `None` if interrupted.
fn measure(
    args: &Args,
    sensor: &Sensor,
    unknowns: &Unknowns,
    limb: LimbPrior,
    input: &str,
) -> Result<Option<(Pictures, Estimate)>, Stop> {
    let mut used = sensor.clone();
    used.config.camera.covariance = None;
    used.config.camera.focal_sigma_percent = unknowns.focal_sigma_percent();
    let mut before_percent = 0.0;
    for pass in 1..=PASSES {
        let Some(pictures) = views(&args.input, &args.source, args.sensor.flight, args.jobs, args.quiet, &used)? else {
            return Ok(None);
        };
        let estimate = sky::estimate(unknowns, &pictures.plan.config.body, &pictures.views, limb)
            .map_err(|why| failed(format!("{input}: of {}: {why}", counted(pictures.count, "picture"))))?;
        let [percent, sigma] = estimate.focal_percent;
        if pass == PASSES || (percent - before_percent).abs() <= PROCESS_AGAIN_PERCENT {
            return Ok(Some((pictures, estimate)));
        }
        if !args.quiet {
            let what = "the pictures are processed again with this lens";
            tell::line(format_args!("note: the focal length differs by {percent:+.2} % ± {sigma:.2} %; {what}"));
        }
        before_percent = percent;
        let camera = estimate.camera.clone();
        used.config.camera = hzn_core::camera::Config {
            covariance: None,
            focal_sigma_percent: sigma.max(PROCESS_AGAIN_PERCENT),
            ..camera
        };
    }
    Ok(None)
}

/// Processes the pictures with a sensor. Returns `None` if the run was interrupted.
pub(super) fn views(
    input: &[PathBuf],
    source_args: &InputArgs,
    flight: bool,
    jobs: Option<u16>,
    quiet: bool,
    sensor: &Sensor,
) -> Result<Option<Pictures>, Stop> {
    let mut source = source_args.open(input)?;
    source.want_channel(sensor.config.input.channel)?;
    let plan = flight::plan(source_args, flight, jobs, source.as_ref(), sensor)?;
    let mut progress = Progress::new(source.total(), 0, quiet);
    let view = |a: flight::Answered<'_>| Some(View::new(a.name, a.points, a.prior, a.solution));
    let views = flight::measure_answers(&plan, source.as_mut(), &mut progress, view)?;
    Ok(views.map(|views| Pictures { views, count: progress.frames(), plan }))
}

/// Writes the reports and the sensor.
fn write(
    args: &Args,
    sensor: &Sensor,
    estimate: &Estimate,
    mount: Option<Result<Mount, MountRefusal>>,
    input: &str,
) -> Outcome {
    for path in args.output.iter().filter(|p| ending(p) == "html") {
        let html = page::simple(
            &format!("Lens from the limb: {input}"),
            &sky_text::lines(estimate, estimate.pictures.len() as u64, mount.as_ref()),
            &[sky_text::heights(estimate)],
        )?;
        std::fs::write(path, html).map_err(|e| disk::cannot_write(path, &e))?;
    }
    if let Some(alarm) = estimate.alarm() {
        return Err(failed(format!("{input}: no sensor.toml is written: {alarm}")));
    }
    let mut written = sky::into_sensor_toml(&sensor.text, estimate, input).map_err(failed)?;
    match mount {
        Some(Ok(mount)) => {
            let nominal = sensor.config.mount.map_or([1.0, 0.0, 0.0, 0.0], |m| m.q_body_from_camera_wxyz);
            written = written.with_mount(&mount, nominal, input).map_err(failed)?;
        }
        Some(Err(why)) => return Err(failed(format!("{input}: no sensor.toml is written: --mount: {why}"))),
        None => {}
    }
    tell::result(format_args!("\n{}\n", written.keys.join("\n")))?;
    let sensors: Vec<_> = args.output.iter().filter(|p| ending(p) == "toml").collect();
    for path in &sensors {
        std::fs::write(path, &written.text).map_err(|e| disk::cannot_write(path, &e))?;
    }
    if sensors.is_empty() && !args.quiet {
        tell::line("note: -o sensor.toml writes these keys into a copy of the sensor.toml");
    }
    Ok(Exit::Done)
}
