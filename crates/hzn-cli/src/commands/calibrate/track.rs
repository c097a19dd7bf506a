//! `hzn calibrate sky` for a sensor that looks for the Sun or the Moon: the lens from the track of the disc.

use hzn_calib::sky::{self, Found, FoundMount, Sight, Track};
use hzn_core::body::Kind;
use hzn_core::camera::Camera;
use hzn_core::frames::{Rotation, UnitVec3};
use hzn_files::{FrameData, Sensor};
use hzn_nav::ephemeris;
use hzn_run::explain::counted;
use hzn_run::open::Opened;
use hzn_run::source::ending;

use super::flight::{self, Answered};
use super::sky_args::{Args, unknowns, write_sensors};
use super::{page, sky_text};
use crate::exit::{Exit, Outcome, failed, usage};
use crate::progress::Progress;
use crate::tell;

/// Returns whether the sensor looks for nothing but Sun and Moon.
pub(super) fn is_track(sensor: &Sensor) -> bool {
    sensor.config.each_body().iter().all(|b| matches!(b.kind, Kind::Sun | Kind::Moon))
}

/// Measures the lens on the track.
pub(super) fn run(args: &Args, sensor: &Sensor) -> Outcome {
    if args.free_limb_height {
        return Err(usage("--free-limb-height: the Sun and the Moon have no limb height"));
    }
    let input = args.input.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(" ");
    let unknowns = unknowns(args, sensor);
    let mut used = sensor.clone();
    used.config.camera.covariance = None;
    used.config.camera.focal_sigma_percent = unknowns.focal_sigma_percent();
    let camera = Camera::<f64>::try_new(&used.config.camera).map_err(usage)?;
    let flight = args.sensor.flight;
    let Opened { mut source, sensor: used, frames, .. } = flight::reopen(&args.input, &args.source, flight, used)?;
    let plan = flight::plan(&args.source, flight, args.jobs, frames, used.clone());
    let mut progress = Progress::new(source.total(), 0, args.quiet);
    let kinds: Vec<Kind> = used.config.each_body().iter().map(|b| b.kind).collect();
    let sight = |a: Answered<'_>| {
        let kind = *kinds.get(a.which)?;
        let point = camera.project(&a.solution.axis)?;
        let name = format!("{} ({})", a.name, kind.name());
        Some(Sight { name, point_px: [point.u, point.v], direction: direction(kind, a.data?)? })
    };
    let Some((sights, unread)) = flight::measure_answers(&plan, source.as_mut(), &mut progress, sight)? else {
        tell::line("interrupted; nothing was measured");
        return Ok(Exit::Interrupted);
    };
    let sights = flight::without_copies(sights);
    unread.tell();
    let pictures = counted(progress.frames(), "picture");
    let track =
        sky::estimate_track(&unknowns, &sights).map_err(|why| failed(format!("{input}: of {pictures}: {why}")))?;
    let lines = hzn_calib::sky::track_lines(&track, &pictures);
    tell::report(sky_text::join(&lines))?;
    for path in args.output.iter().filter(|p| ending(p) == "html") {
        let title = format!("Lens from the track of Sun or Moon: {input}");
        hzn_run::disk::write_whole(path, &page::simple(&title, &lines, &[], &sensor.config)?)?;
    }
    Ok(unread.exit(write(args, sensor, &track, &input)?))
}

/// Returns the direction to the body in the nominal camera frame: the column of the Sun, or the ephemeris with the
/// attitude. The Moon is near, so that its direction needs a position too.
pub(super) fn direction(kind: Kind, data: &FrameData) -> Option<[f64; 3]> {
    let given = data.sun_camera.filter(|_| kind == Kind::Sun).and_then(UnitVec3::<hzn_core::frames::Cam, f64>::try_new);
    if let Some(given) = given {
        return Some(given.xyz());
    }
    let unix_s = data.utc_s?;
    let position_m = data.position_km.map(|p| p.map(|km| km * 1e3).into());
    let place = match kind {
        Kind::Moon => ephemeris::moon(unix_s).seen_from(position_m?),
        _ => position_m.map_or_else(|| ephemeris::sun(unix_s), |at| ephemeris::sun(unix_s).seen_from(at)),
    };
    let attitude = Rotation::<hzn_core::frames::Cam, hzn_core::frames::Fixed, f64>::assume_from_quaternion(
        data.q_fixed_from_camera_wxyz?,
    )?;
    Some(attitude.inverse().apply(&place.direction.to_unit()?).xyz())
}

fn write(args: &Args, sensor: &Sensor, track: &Track, input: &str) -> Outcome {
    if let Some(why) = track.undetermined() {
        return Err(failed(format!("{input}: no sensor.toml is written: {why}")));
    }
    let source = &format!("{} of Sun or Moon in {input}", counted(track.pictures as u64, "disc"));
    let found = Found { camera: &track.camera, parameters: &track.parameters, source };
    let mut written = sky::into_sensor_toml(&sensor.text, found).map_err(failed)?;
    if args.mount {
        let q_vehicle_from_nominal_wxyz =
            sensor.config.mount.map_or([1.0, 0.0, 0.0, 0.0], |m| m.q_vehicle_from_camera_wxyz);
        let sigma_deg = track.correction_deg.map(|[_, sigma]| sigma);
        let mount = FoundMount {
            q_vehicle_from_nominal_wxyz,
            q_nominal_from_camera_wxyz: track.q_nominal_from_camera_wxyz,
            sigma_deg,
            source,
        };
        written = written.with_mount(&mount).map_err(failed)?;
    }
    write_sensors(args, &written)
}
