//! The replay of a flight.

mod first;
mod lost;
mod runner;
mod unaided;

use hzn_nav::frames::{Cam, Rotation, Vehicle};
use hzn_nav::layout::MAX_CAMERAS;
use hzn_nav::options::StartSigmas;

use crate::data::Flight;
use crate::error::Error;
use crate::events::{clean, events};
use crate::finding::{Finding, Level, Verdict};
use crate::input::{Body, Inputs, Recording};
use crate::orbit;
use crate::repeats;
use crate::results::{Counts, Fused};
use crate::settings::{ErrorSetting, Limb, Settings, Treatment};
use crate::smooth::{MAX_EPOCHS, smooth};
use crate::solve::{Estimates, Problem, solve};
use crate::verdict::{self, Given};
use runner::{Ran, Runner};

/// Most components of the error without the cameras.
const VEHICLE_STATES: usize = 30;
/// Most components of the error of a camera besides its slow errors: mount and clock. A slow error has three more.
const CAMERA_STATES: usize = 4;
/// Most components of the error of a flight, by the largest number of bodies that each of its cameras sees.
const fn states(bodies: usize) -> usize {
    VEHICLE_STATES + MAX_CAMERAS * (CAMERA_STATES + 3 * bodies)
}

/// Memory for the states of four cameras that see one, two or three bodies each.
const FEW: usize = states(1);
const SOME: usize = states(2);
const MANY: usize = states(3);

/// Smallest angle between two mounts that count as different, rad.
const SAME_MOUNT_RAD: f64 = 1e-4;

/// What a replay makes besides the solution.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Wanted {
    /// The smoothed solution.
    pub smoothed: bool,
    /// The solution of the whole flight at once, instead of the smoothed one.
    pub solved: bool,
    /// Solve with the freely fitted cones of the limbs ([`crate::input::FreeCone`]) instead of their axes.
    pub points: bool,
    /// Most solutions a second; `None` for one at each sample.
    pub rate_hz: Option<f64>,
}

impl Wanted {
    /// Refuses what this program was built without, and what the inputs do not have.
    fn check(self, inputs: &Inputs) -> Result<(), Error> {
        if self.solved && !cfg!(feature = "solve") {
            return Err(Error::without_solver());
        }
        if self.points { check_points(inputs) } else { Ok(()) }
    }
}

/// Fuses everything that a flight recorded.
///
/// # Errors
/// An input is missing or contradicts another one, no two directions give a first attitude, or there are more
/// measurements than a smoother can keep.
pub fn fuse(inputs: &Inputs, settings: &Settings, wanted: Wanted) -> Result<Fused, Error> {
    wanted.check(inputs)?;
    let mounts = mounts(&inputs.recordings)?;
    if inputs.imu.is_empty() {
        return without_unit(inputs, settings, &mounts, wanted);
    }
    let (mut counts, mut notes) = (Counts::default(), Vec::new());
    let without_repeats = repeats::without(inputs, settings, &mut counts, &mut notes);
    let inputs = without_repeats.as_ref().unwrap_or(inputs);
    let samples = clean(&inputs.imu, settings.imu.max_step_s, &mut counts, &mut notes);
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
        return Err(Error::unusable("the inertial unit has no finite sample"));
    };
    if !inputs.has_receiver() {
        without_receiver(inputs, settings)?;
    }
    let span_s = [first.imu.time_s, last.imu.time_s];
    if !inputs.has_receiver() {
        notes.push(
            "without a receiver the position is not known: the attitude against ECEF (qw to qz) holds, but yaw, pitch \
             and roll do not"
                .to_owned(),
        );
    }
    let events = events(inputs, span_s, &mut counts, &mut notes)?;
    let names: Vec<String> = inputs.recordings.iter().map(|r| r.name.clone()).collect();
    let flight = Flight { inputs, names: &names, mounts: &mounts, samples: &samples, events: &events };
    // The time of a step grows with the square of the memory for states, so that few bodies get a small filter.
    let slow_errors = |r: &Recording| CAMERA_STATES + 3 * r.bodies().len();
    let needed = VEHICLE_STATES + inputs.recordings.iter().map(slow_errors).sum::<usize>();
    let replay = if needed <= FEW {
        replay::<FEW>
    } else if needed <= SOME {
        replay::<SOME>
    } else {
        replay::<MANY>
    };
    let (cameras, start) = (flight.cameras(settings), StartSigmas::default());
    let options = flight.options(settings, start);
    let given = Given { inputs, samples: &samples, settings, cameras: &cameras, options: &options };
    let findings = verdict::of_inputs(&given);
    let mut fused = replay(&flight, settings, wanted).map_err(|error| explained(error, &findings))?;
    fused.cameras = names.clone();
    fused.told_mounts = mounts.clone();
    counts.before_start = fused.counts.before_start;
    counts.restarts = fused.counts.restarts;
    counts.restarts_when_wrong = fused.counts.restarts_when_wrong;
    counts.waiting = fused.counts.waiting;
    counts.without_reference = fused.counts.without_reference;
    for ((source, why), count) in std::mem::take(&mut fused.counts.unusable) {
        counts.add_unusable(source, why, count);
    }
    fused.counts = counts;
    notes.append(&mut fused.notes);
    fused.notes = notes;
    fused.receiver_lags = verdict::receiver_lags(inputs);
    fused.verdict = verdict::verdict(findings, &fused, &given);
    Ok(fused)
}

/// Calls a function with the whole flight as a sum of squares and with its first estimates, which are the filter's:
/// what [`Wanted::solved`] solves, with `points` for [`Wanted::points`].
///
/// # Errors
/// See [`fuse`].
pub fn with_problem<R>(
    inputs: &Inputs,
    settings: &Settings,
    points: bool,
    call: impl FnOnce(&Problem<'_>, &Estimates) -> R,
) -> Result<R, Error> {
    let mounts = mounts(&inputs.recordings)?;
    let mut counts = Counts::default();
    let samples = clean(&inputs.imu, settings.imu.max_step_s, &mut counts, &mut Vec::new());
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
        return Err(Error::unusable("the inertial unit has no finite sample"));
    };
    let events = events(inputs, [first.imu.time_s, last.imu.time_s], &mut counts, &mut Vec::new())?;
    let names: Vec<String> = inputs.recordings.iter().map(|r| r.name.clone()).collect();
    let flight = Flight { inputs, names: &names, mounts: &mounts, samples: &samples, events: &events };
    let all = estimate_all(settings);
    let ran = Runner::<MANY>::new(&flight, settings, false)?.run(Some(1.0))?;
    let (problem, first) = Problem::new(&flight, &all, &ran.track, points)?;
    Ok(call(&problem, &first))
}

/// Fuses a flight without an inertial unit: gravity joins the states of a satellite.
fn without_unit(
    inputs: &Inputs,
    settings: &Settings,
    mounts: &[Rotation<Cam, Vehicle>],
    wanted: Wanted,
) -> Result<Fused, Error> {
    if wanted.solved {
        let (mut counts, mut notes) = (Counts::default(), Vec::new());
        let without_repeats = repeats::without(inputs, settings, &mut counts, &mut notes);
        let mut fused = orbit::fuse(without_repeats.as_ref().unwrap_or(inputs), settings, mounts)?;
        notes.append(&mut fused.notes);
        fused.notes = notes;
        for ((source, why), count) in counts.unusable {
            fused.counts.add_unusable(source, why, count);
        }
        return Ok(fused);
    }
    Err(Error::unusable(
        "there is no sample of an inertial unit; give --imu FILE, or --solve for the orbit of a satellite from limbs \
         and attitudes",
    ))
}

/// Refuses limbs without free cones, and flights in which nothing says how high the vehicle is.
fn check_points(inputs: &Inputs) -> Result<(), Error> {
    if inputs.imu.is_empty() || !inputs.has_receiver() {
        return Err(Error::unusable(
            "--points compares the size of the limb with the altitude, which needs an inertial unit and a receiver; \
             give --imu FILE and --gnss FILE, or leave --points out",
        ));
    }
    let limbs = |r: &'_ Recording| r.seen.iter().filter(|s| s.body == Body::Limb).count();
    let cones = |r: &'_ Recording| r.seen.iter().filter(|s| s.cone.is_some()).count();
    match inputs.recordings.iter().find(|r| limbs(r) > 0 && cones(r) == 0) {
        Some(one) => Err(Error::unusable(format!(
            "{}: --points needs the freely fitted cone of each limb (column var_free_cos) and the sensor.toml; run \
             `hzn run -o {0}.mcap` again without --flight, which stores both, or leave --points out",
            one.name
        ))),
        None => Ok(()),
    }
}

/// Refuses settings that need a receiver.
fn without_receiver(inputs: &Inputs, settings: &Settings) -> Result<(), Error> {
    match inputs.recordings.iter().find(|r| settings.camera(&r.name).limb == Limb::Position) {
        Some(one) => {
            let what = "limb = \"position\" in fuse.toml corrects the position of a receiver, and there is none";
            Err(Error::unusable(format!("{}: {what}; give --gnss FILE, or leave the key out", one.name)))
        }
        None => Ok(()),
    }
}

/// Adds what the inputs show to the reason why a flight cannot be fused.
fn explained(error: Error, findings: &[Finding]) -> Error {
    let verdict = Verdict::new(findings.to_vec());
    match (error, verdict.likeliest()) {
        (Error::Unusable(why), Some(first)) if first.level == Level::Contradicts => {
            Error::Contradicts { why, finding: Box::new(first.clone()) }
        }
        (error, _) => error,
    }
}

/// Runs the filter, with memory for N states, and the smoother if it is wanted.
fn replay<const N: usize>(flight: &Flight<'_>, settings: &Settings, wanted: Wanted) -> Result<Fused, Error> {
    let Ran { mut fused, track, .. } = Runner::<N>::new(flight, settings, false)?.run(wanted.rate_hz)?;
    if wanted.solved {
        let all = estimate_all(settings);
        let (problem, first) = Problem::new(flight, &all, &track, wanted.points)?;
        let (epochs, solved) = solve(&problem, first)?;
        if !solved.is_converged {
            fused.notes.push(format!("--solve did not converge in {} steps", solved.steps));
        }
        (fused.smoothed, fused.solved) = (epochs, Some(solved));
    } else if wanted.smoothed {
        if flight.events.len() > MAX_EPOCHS {
            let what = "measurements, more than a smoother can keep";
            return Err(Error::unusable(format!(
                "{} {what} ({MAX_EPOCHS}); leave the smoother out",
                flight.events.len()
            )));
        }
        let all = estimate_all(settings);
        let ran = Runner::<N>::new(flight, &all, true)?.run(wanted.rate_hz)?;
        fused.smoothed = smooth(&ran.recorded);
    }
    Ok(fused)
}

/// Returns the mounts of all recordings.
fn mounts(recordings: &[Recording]) -> Result<Vec<Rotation<Cam, Vehicle>>, Error> {
    if recordings.len() > MAX_CAMERAS {
        let what = "recordings of cameras and tables of directions; the filter has memory for";
        return Err(Error::unusable(format!("{} {what} {MAX_CAMERAS}", recordings.len())));
    }
    let mut mounts: Vec<Rotation<Cam, Vehicle>> = Vec::new();
    for (i, one) in recordings.iter().enumerate() {
        let name = &one.name;
        let Some(mount) = one.mount else {
            let what = "nobody says how the camera is mounted; give --mount";
            return Err(Error::unusable(format!("{name}: {what} {name}=FILE, a TOML file with the table [mount]")));
        };
        for (other, known) in recordings.iter().zip(&mounts) {
            if other.name == *name {
                return Err(Error::unusable(format!("{name}: two recordings have this name; rename one of the files")));
            }
            if other.seen.len() > 1 && other.seen == one.seen {
                let what = "have the same rows: give each recording once, or the other camera's file";
                return Err(Error::unusable(format!("{} and {name} {what}", other.name)));
            }
            // Several sensors of directions have the vehicle's axes.
            let are_cameras = !one.is_table && !other.is_table;
            if are_cameras && known.angle_to(&mount) < SAME_MOUNT_RAD && overlap(other, one) {
                let what =
                    "have the same mount, but took pictures at the same time: two cameras cannot. Correct one with";
                return Err(Error::unusable(format!("{} and {name} {what} --mount {name}=FILE", other.name)));
            }
        }
        debug_assert_eq!(i, mounts.len());
        mounts.push(mount);
    }
    Ok(mounts)
}

/// Returns whether two recordings cover a common time.
fn overlap(a: &Recording, b: &Recording) -> bool {
    let span = |r: &Recording| {
        let times = || r.seen.iter().map(|s| s.time_s + r.clock_offset_s);
        (times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max))
    };
    let ((a0, a1), (b0, b1)) = (span(a), span(b));
    a0 < b1 && b0 < a1
}

/// Returns the settings with every considered error estimated instead.
fn estimate_all(settings: &Settings) -> Settings {
    let mut all = settings.clone();
    let estimate = |error: &mut ErrorSetting| {
        if error.mode == Treatment::Considered {
            error.mode = Treatment::Estimated;
        }
    };
    let imu = &mut all.imu;
    for error in [
        &mut imu.accel_bias_mg,
        &mut imu.accel_scale_ppm,
        &mut imu.accel_misalignment_mrad,
        &mut imu.gyro_bias_deg_h,
        &mut imu.gyro_scale_ppm,
        &mut imu.gyro_misalignment_mrad,
    ] {
        estimate(error);
    }
    for camera in all.cameras.values_mut().chain([&mut all.camera]) {
        estimate(&mut camera.misalignment_deg);
        estimate(&mut camera.clock_s);
        if camera.slow_error == Treatment::Considered {
            camera.slow_error = Treatment::Estimated;
        }
    }
    if all.limb_height.mode == Treatment::Considered {
        all.limb_height.mode = Treatment::Estimated;
    }
    all
}
