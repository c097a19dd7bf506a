//! `hzn calibrate noise`: measures limb height and edge noise on the pictures of a flight.

use hzn_run::explain;
use std::path::PathBuf;

use hzn_calib::Sensor;
use hzn_calib::noise::{self, Calibration, Sighting};
use hzn_core::Prior;
use hzn_core::body;
use hzn_core::camera::Camera;

use super::{page, text};
use crate::commands::run::cores;
use crate::exit::{Exit, Outcome, failed, usage};
use crate::progress::Progress;
use crate::setup::{InputArgs, SensorArgs, check_size, need_altitude, settle_input, stop_flag};
use crate::tell;
use hzn_run::engine::{self, End, Finished, Plan, Sink};
use hzn_run::sink;
use hzn_run::source::ending;

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
struct Nowhere;

impl Sink for Nowhere {
    fn write(&mut self, _: &mut Finished) -> anyhow::Result<()> {
        Ok(())
    }
    fn flush(&mut self) -> anyhow::Result<()> {
        Ok(())
    }
}

pub(super) fn run(args: &Args) -> Outcome {
    for path in &args.output {
        match ending(path).as_str() {
            "toml" | "html" => {}
            _ => return Err(usage(format!("{}: a sensor ends in .toml, a report in .html", path.display()))),
        }
        sink::refuse_existing(path, args.force)?;
    }
    let mut source = args.source.open(&args.input)?;
    let mut sensor = args.sensor.load(source.as_ref())?;
    let mut notes = source.notes();
    notes.extend(settle_input(source.as_mut(), &mut sensor)?);
    check_size(source.as_ref(), &sensor)?;
    let Some(config) = noise::looks_with(&sensor.config) else {
        return Err(usage("the sensor looks only for Sun and Moon, which have no limb height to measure"));
    };
    let wide = Sensor { config, ..sensor.clone() };
    let frames = args.source.frames(source.as_ref(), &wide, args.sensor.flight)?;
    need_altitude(&wide, source.as_ref(), frames.as_ref())?;
    let camera = Camera::try_new(&wide.config.camera).map_err(usage)?;
    let body = wide.config.body.clone();
    let threads = if wide.config.tracks() { 1 } else { args.jobs.map_or_else(cores, usize::from) };
    let plan = Plan {
        config: wide.config,
        flight: args.sensor.flight,
        threads,
        frames,
        fps: args.source.fps,
        trace: false,
        keep_traces: true,
        keep_picture: false,
        overlay: None,
        last: Vec::new(),
    };
    if !args.quiet {
        notes.iter().for_each(|note| tell::line(format_args!("note: {note}")));
    }
    let mut progress = Progress::new(source.total(), 0, args.quiet);
    let mut sightings = Vec::new();
    let mut seen = |frame: &Finished| {
        progress.count(frame.found.iter().map(engine::BodyOutcome::status));
        sightings.extend(sighting(frame, &camera, &body));
    };
    let stop = stop_flag();
    let end = engine::run(&plan, source.as_mut(), 0, &stop, &mut Nowhere, &mut seen)?;
    progress.finish();
    if end == End::Interrupted {
        tell::line("interrupted; nothing was measured");
        return Ok(Exit::Interrupted);
    }
    let shown = args.input.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(" ");
    let pictures = progress.frames();
    let calibration = Calibration::new(&body, &sightings)
        .map_err(|why| failed(format!("{shown}: of {} {why}", explain::counted(pictures, "picture"))))?;
    let written = noise::into_sensor_toml(&sensor.text, &calibration, &shown).map_err(failed)?;
    tell::result(text::of(&calibration, pictures))?;
    for path in args.output.iter().filter(|p| ending(p) == "html") {
        let html = page::html(&calibration, pictures, &shown)?;
        std::fs::write(path, html).map_err(|e| sink::cannot(path, &e))?;
    }
    if let Some(alarm) = calibration.alarm() {
        return Err(failed(format!("{shown}: no sensor.toml is written: {alarm}")));
    }
    tell::result(format_args!("\n{}\n", written.keys.join("\n")))?;
    let sensors: Vec<_> = args.output.iter().filter(|p| ending(p) == "toml").collect();
    for path in &sensors {
        std::fs::write(path, &written.text).map_err(|e| sink::cannot(path, &e))?;
    }
    if sensors.is_empty() && !args.quiet {
        tell::line("note: -o sensor.toml writes these keys into a copy of the sensor.toml");
    }
    Ok(Exit::Done)
}

/// Measures the limb height of one picture, if it was answered.
fn sighting(frame: &Finished, camera: &Camera<f64>, body: &body::Config) -> Option<Sighting> {
    let report = frame.found.first()?.report.as_ref().ok()?;
    let solution = report.solution.as_ref()?;
    let edges = frame.traces.as_ref()?.each.first()?.edges();
    let edge = edges.iter().find(|e| e.candidate == solution.candidate)?;
    let points: noise::Weighted = edge.points.iter().copied().zip(edge.weights.iter().copied()).collect();
    let known = frame.data.as_ref().map_or_else(Prior::default, |d| d.to_frame(None));
    Sighting::measure(&frame.name, camera, body, &known, &points, solution)
}
