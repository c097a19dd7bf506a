//! `hzn calibrate sky`: measures the lens on the limb pictures of a flight.

use std::path::PathBuf;

use hzn_calib::sky::{self, Estimate, Found, FoundMount, LimbPrior, Mount, MountRefusal, Unknowns, View};
use hzn_core::frames::UnitVec3;
use hzn_core::{Prior, body};
use hzn_files::Sensor;
use hzn_run::disk;
use hzn_run::engine::Plan;
use hzn_run::explain::counted;
use hzn_run::open::Opened;
use hzn_run::source::{self, ending};

use super::flight::{self, check_endings};
use super::sky_args::{Args, unknowns, write_sensors};
use super::{page, sky_text, track};
use crate::exit::{Exit, Outcome, Stop, failed, usage};
use crate::files;
use crate::progress::Progress;
use crate::setup::{self, InputArgs, SensorArgs};
use crate::tell;

/// The pictures of a flight for `sky` and `check`, and the number of all pictures.
pub(super) struct Pictures {
    pub(super) views: Vec<View>,
    pub(super) count: u64,
    /// Which pictures were left out as copies of others, in words.
    copies: Option<String>,
    pub(super) unread: flight::Unread,
    pub(super) plan: Plan,
}

impl Pictures {
    /// Says which pictures are copies of others, and which could not be read.
    pub(super) fn tell_left_out(&self) {
        self.copies.iter().for_each(tell::warning);
        self.unread.tell();
    }
}

pub(super) fn run(args: &Args) -> Outcome {
    check_endings(&args.output)?;
    let request = setup::request(&args.input, &args.sensor, &args.source)?;
    let source = source::open(&request.inputs, request.raw, request.topic.as_deref())?;
    files::check_outputs(&files::of_sequence(source.as_ref(), &request), &args.output, args.force)?;
    let (sensor, notes) = load(&args.input, &args.sensor, &args.source)?;
    if !args.quiet {
        notes.iter().for_each(|note| tell::line(format_args!("note: {note}")));
    }
    if track::is_track(&sensor) {
        return track::run(args, &sensor);
    }
    let limb = limb_prior(&sensor, args.free_limb_height)?;
    let input = args.input.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(" ");
    let unknowns = unknowns(args, &sensor);
    let Some((pictures, estimate)) = measure(args, &sensor, &unknowns, limb, &input)? else {
        tell::line("interrupted; nothing was measured");
        return Ok(Exit::Interrupted);
    };
    let mount = args.mount.then(|| sky::estimate_mount(&estimate, &pictures.plan.config.body, &pictures.views));
    tell::report(sky_text::report(&estimate, pictures.count, mount.as_ref()))?;
    Ok(pictures.unread.exit(write(args, &sensor, &estimate, mount, &input)?))
}

/// Loads the sensor for a flight, with notes for the user.
pub(super) fn load(input: &[PathBuf], sensor: &SensorArgs, source: &InputArgs) -> Result<(Sensor, Vec<String>), Stop> {
    let opened = setup::open(input, sensor, source)?;
    opened.check_size()?;
    Ok((opened.sensor, opened.notes))
}

/// Returns the limb height of the sensor as a prior.
pub(super) fn limb_prior(sensor: &Sensor, free: bool) -> Result<LimbPrior, Stop> {
    let prior = LimbPrior::of_sensor(&sensor.config, free);
    prior.ok_or_else(|| usage("the sensor looks only for Sun and Moon, which have no limb height"))
}

/// Processes the pictures and estimates the lens, with the estimated lens again if it differs. `None` if interrupted.
fn measure(
    args: &Args,
    sensor: &Sensor,
    unknowns: &Unknowns,
    limb: LimbPrior,
    input: &str,
) -> Result<Option<(Pictures, Estimate)>, Stop> {
    let wide = flight::with_wide_limb(sensor)?;
    let mut last = None;
    let process = |camera: &hzn_core::camera::Config| -> Result<Option<Vec<View>>, Stop> {
        let mut used = sensor.clone();
        used.config.camera = camera.clone();
        last = views(&args.input, &args.source, args.sensor.flight, args.jobs, args.quiet, &used)?;
        Ok(last.as_mut().map(|pictures| std::mem::take(&mut pictures.views)))
    };
    let again = |[percent, sigma]: [f64; 2]| {
        if !args.quiet {
            let what = "the pictures are processed again with this lens";
            tell::line(format_args!("note: the focal length differs by {percent:+.2} % ± {sigma:.2} %; {what}"));
        }
    };
    let found = sky::estimate_in_passes(&sensor.config, &wide.config.body, unknowns, limb, process, again)?;
    let (Some(found), Some(pictures)) = (found, last) else { return Ok(None) };
    pictures.tell_left_out();
    let refused = |why| failed(format!("{input} ({}): {why}", counted(pictures.count, "picture")));
    let (estimate, views) = found.map_err(refused)?;
    Ok(Some((Pictures { views, ..pictures }, estimate)))
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
    let wide = flight::with_wide_limb(sensor)?;
    let Opened { mut source, sensor, frames, .. } = flight::reopen(input, source_args, flight, wide)?;
    let plan = flight::plan(source_args, flight, jobs, frames, sensor);
    let mut progress = Progress::new(source.total(), 0, quiet);
    // The side of the Sun follows from the attitude, where frames.csv does not have its direction.
    let view = |a: flight::Answered<'_>| {
        let sun = a.data.and_then(|data| track::direction(body::Kind::Sun, data)).and_then(UnitVec3::try_new);
        Some(View::new(a.name, a.points, Prior { sun: sun.or(a.prior.sun), ..a.prior }, a.solution))
    };
    let views = flight::measure_answers(&plan, source.as_mut(), &mut progress, view)?;
    Ok(views.map(|(measured, unread)| Pictures {
        copies: measured.copies_in_words(),
        unread,
        views: measured.answers,
        count: progress.frames(),
        plan,
    }))
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
            &sky::lines(estimate, &counted(estimate.pictures.len() as u64, "picture"), mount.as_ref()),
            &[sky_text::heights(estimate)],
            &sensor.config,
        )?;
        disk::write_whole(path, &html)?;
    }
    if let Some(why) = estimate.alarm().or_else(|| estimate.undetermined()) {
        return Err(failed(format!("{input}: no sensor.toml is written: {why}")));
    }
    let count = estimate.pictures.iter().filter(|p| p.counts).count() as u64;
    let source = &format!("{} of {input}", counted(count, "limb picture"));
    let found = Found { camera: &estimate.camera, parameters: &estimate.parameters, source };
    let mut written = sky::into_sensor_toml(&sensor.text, found).map_err(failed)?;
    match mount {
        Some(Ok(mount)) => {
            let q_vehicle_from_nominal_wxyz =
                sensor.config.mount.map_or([1.0, 0.0, 0.0, 0.0], |m| m.q_vehicle_from_camera_wxyz);
            let source = &format!("{} of {input}", counted(mount.pictures as u64, "limb picture"));
            let Mount { q_nominal_from_camera_wxyz, sigma_deg, .. } = mount;
            let mount = FoundMount { q_vehicle_from_nominal_wxyz, q_nominal_from_camera_wxyz, sigma_deg, source };
            written = written.with_mount(&mount).map_err(failed)?;
        }
        Some(Err(why)) => return Err(failed(format!("{input}: no sensor.toml is written: --mount: {why}"))),
        None => {}
    }
    write_sensors(args, &written)
}
