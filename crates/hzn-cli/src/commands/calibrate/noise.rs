//! `hzn calibrate noise`: measures limb height and edge noise on the pictures of a flight.

use std::path::PathBuf;

use hzn_calib::Sensor;
use hzn_calib::noise::{self, Calibration, Sighting};
use hzn_core::Prior;
use hzn_core::body;
use hzn_core::camera::Camera;
use hzn_run::engine::{self, End, Finished, Plan, Sink};
use hzn_run::source::{Source, ending};
use hzn_run::{disk, explain};

use super::{page, text};
use crate::commands::run::cores;
use crate::exit::{Exit, Outcome, Stop, failed, usage};
use crate::progress::Progress;
use crate::setup::{InputArgs, SensorArgs, check_altitude, check_size, find_input, stop_flag};
use crate::tell;

/// Measure limb height and edge noise on the pictures of a flight
///
/// The flight needs an altitude or a position for each picture (frames.csv, --altitude-km, body.altitude_km), but no
/// truth. The altitude gives the expected size of the limb, so the measured size gives the limb height. The residuals
/// along the limb give the edge noise. The report goes to stdout. `-o sensor.toml` writes the keys, with comments, into
/// a copy of the sensor.toml; `-o report.html` writes plots of both. No sensor.toml is written if the flight is not
/// sufficient (fewer than 12 answered pictures, too small a field of view), or if its pictures contradict each other.
/// Then the exit code is 1 and the message has the measured number.
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

/// A sink that stores nothing; only the sightings of the pictures are kept.
struct NoSink;

impl Sink for NoSink {
    fn write(&mut self, _: &mut Finished) -> anyhow::Result<()> {
        Ok(())
    }
    fn flush(&mut self) -> anyhow::Result<()> {
        Ok(())
    }
}

pub(super) fn run(args: &Args) -> Outcome {
    check_outputs(args)?;
    let mut source = args.source.open(&args.input)?;
    let mut sensor = args.sensor.load(source.as_ref())?;
    let mut notes = source.notes();
    notes.extend(find_input(source.as_mut(), &mut sensor)?);
    check_size(source.as_ref(), &sensor)?;
    let plan = plan(args, source.as_ref(), &sensor)?;
    if !args.quiet {
        notes.iter().for_each(|note| tell::line(format_args!("note: {note}")));
    }
    let mut progress = Progress::new(source.total(), 0, args.quiet);
    let Some(sightings) = collect_sightings(&plan, source.as_mut(), &mut progress)? else {
        tell::line("interrupted; nothing was measured");
        return Ok(Exit::Interrupted);
    };
    let input = args.input.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(" ");
    let pictures = progress.frames();
    let calibration = Calibration::new(&plan.config.body, &sightings)
        .map_err(|why| failed(format!("{input}: of {} {why}", explain::counted(pictures, "picture"))))?;
    let written = noise::into_sensor_toml(&sensor.text, &calibration, &input).map_err(failed)?;
    tell::result(text::report(&calibration, pictures))?;
    for path in args.output.iter().filter(|p| ending(p) == "html") {
        let html = page::html(&calibration, pictures, &input)?;
        std::fs::write(path, html).map_err(|e| disk::cannot_write(path, &e))?;
    }
    if let Some(alarm) = calibration.alarm() {
        return Err(failed(format!("{input}: no sensor.toml is written: {alarm}")));
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

/// Refuses outputs of another kind, and files that exist.
fn check_outputs(args: &Args) -> Result<(), Stop> {
    for path in &args.output {
        match ending(path).as_str() {
            "toml" | "html" => {}
            _ => return Err(usage(format!("{}: a sensor ends in .toml, a report in .html", path.display()))),
        }
        disk::refuse_existing(path, args.force)?;
    }
    Ok(())
}

/// Returns the plan of the run. Its sensor has a very wide prior of the limb height.
fn plan(args: &Args, source: &dyn Source, sensor: &Sensor) -> Result<Plan, Stop> {
    let Some(config) = noise::config_for_calibration(&sensor.config) else {
        return Err(usage("the sensor looks only for Sun and Moon, which have no limb height to measure"));
    };
    let sensor = Sensor { config, ..sensor.clone() };
    let frames = args.source.frames(source, &sensor, args.sensor.flight)?;
    check_altitude(&sensor, source, frames.as_ref())?;
    let threads = if sensor.config.tracks() { 1 } else { args.jobs.map_or_else(cores, usize::from) };
    Ok(Plan {
        config: sensor.config,
        flight: args.sensor.flight,
        threads,
        frames,
        fps: args.source.fps,
        trace: false,
        keep_traces: true,
        keep_picture: false,
        overlay: None,
        last: Vec::new(),
    })
}

/// Processes the flight and measures each picture that is answered. Returns `None` if the run was interrupted.
fn collect_sightings(
    plan: &Plan,
    source: &mut dyn Source,
    progress: &mut Progress,
) -> Result<Option<Vec<Sighting>>, Stop> {
    let camera = Camera::try_new(&plan.config.camera).map_err(usage)?;
    let mut sightings = Vec::new();
    let mut seen = |frame: &Finished| {
        progress.count(frame.outcomes.iter().map(engine::BodyOutcome::status));
        sightings.extend(measure(frame, &camera, &plan.config.body));
    };
    let end = engine::run(plan, source, 0, &stop_flag(), &mut NoSink, &mut seen)?;
    progress.finish();
    Ok((end == End::Complete).then_some(sightings))
}

/// Measures the limb height of one picture, if it was answered.
fn measure(frame: &Finished, camera: &Camera<f64>, body: &body::Config) -> Option<Sighting> {
    let report = frame.outcomes.first()?.report.as_ref().ok()?;
    let solution = report.solution.as_ref()?;
    let edges = frame.traces.as_ref()?.each.first()?.edges();
    let edge = edges.iter().find(|e| e.candidate == solution.candidate)?;
    let points: noise::WeightedPoints = edge.points.iter().copied().zip(edge.weights.iter().copied()).collect();
    let known = frame.data.as_ref().map_or_else(Prior::default, |d| d.to_prior(None));
    Sighting::measure(&frame.name, camera, body, &known, &points, solution)
}
