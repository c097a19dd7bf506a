//! The verdict over a flight: do its inputs agree with each other?
//!
//! A filter weighs measurements; it does not doubt its inputs. A turned mount or a shifted clock becomes an attitude
//! with a small sigma. The tests here compare inputs that must agree before any filter runs, and the filter's solution
//! with what was known before it:
//!
//! | test | compares |
//! |---|---|
//! | `samples` | intervals of the inertial unit |
//! | `receiver` | positions and velocities of the receiver with each other |
//! | `force` | specific forces with the changes of the receiver's velocities |
//! | `clocks`, `place` | the receiver with the positions that the recordings were made with |
//! | `suspects` | all directions, attitudes and rates, adjusted at once for each suspicion |
//! | `solution` | the filter's estimates with what was known before, refusals, innovations |

mod adjust;
mod clocks;
mod faults;
mod force;
mod motion;
mod place;
mod problem;
mod receiver;
mod samples;
mod solution;
mod state;
mod suspects;

use hzn_nav::options::{CameraOptions, Options};
use nalgebra::Matrix3;

use crate::finding::{Cause, Finding, Level, Source, Verdict};
use crate::input::{Inputs, Recording, Sample};
use crate::results::{Fused, ReceiverLag};
use crate::settings::Settings;
use force::Force;
use motion::Reckoning;
use problem::Problem;
pub(crate) use solution::lens;

/// Most samples that are integrated again for each suspicion: an hour at 50 Hz, in three seconds for all.
const MOST_SAMPLES: usize = 200_000;
/// Time before the first direction that belongs to them, s: the thrust of a rocket.
const BEFORE_S: f64 = 600.0;

/// What the tests of the inputs need.
pub(crate) struct Given<'a> {
    pub(crate) inputs: &'a Inputs,
    pub(crate) samples: &'a [Sample],
    pub(crate) settings: &'a Settings,
    pub(crate) cameras: &'a [CameraOptions],
    pub(crate) options: &'a Options,
}

/// Tests the inputs.
pub(crate) fn of_inputs(given: &Given<'_>) -> Vec<Finding> {
    let Given { inputs, samples, settings, .. } = given;
    let max_step_s = settings.imu.max_step_s;
    if let Some(finding) = samples::test(samples, inputs, max_step_s) {
        // Without the right times nothing else can be compared.
        return vec![finding];
    }
    let samples = part(samples, inputs);
    let mut findings: Vec<Finding> = receiver::test(&inputs.gnss, settings).into_iter().collect();
    let reckoning = Reckoning::new(samples, max_step_s, &Matrix3::identity());
    let force = if findings.is_empty() { force::test(&reckoning, &inputs.gnss, settings) } else { Force::default() };
    findings.extend(force.finding);
    let names: Vec<String> = inputs.recordings.iter().map(|r| r.name.clone()).collect();
    let of_directions = Problem::new(inputs, given.cameras, given.options, reckoning)
        .and_then(|problem| suspects::test(&problem, samples, max_step_s, &names));
    if findings.is_empty() {
        let of_cameras = of_directions.as_ref().is_some_and(|d| d.cause == Cause::CameraClock);
        findings.extend(clocks::test(inputs, settings, force.lag_s, of_cameras));
    }
    findings.extend(of_directions);
    findings
}

/// Returns the samples that the tests integrate again for each suspicion: those of a long flight from before the first
/// direction on. A wrong input is wrong there, too, and the filter's solution is tested over the whole flight.
fn part<'a>(samples: &'a [Sample], inputs: &Inputs) -> &'a [Sample] {
    let directions = inputs.recordings.iter().flat_map(|r| r.seen.iter().map(|seen| seen.time_s + r.clock_offset_s));
    let times = directions.chain(inputs.attitudes.iter().map(|a| a.time_s)).filter(|t| t.is_finite());
    let from_s = times.fold(f64::INFINITY, f64::min) - BEFORE_S;
    let latest = samples.len().saturating_sub(MOST_SAMPLES);
    let first = samples.partition_point(|s| s.imu.time_s < from_s).min(latest);
    samples.get(first..samples.len().min(first + MOST_SAMPLES)).unwrap_or(samples)
}

/// Returns the finding about a camera that was given and does not count.
fn without_measurement(recording: &Recording) -> Finding {
    let name = &recording.name;
    let what = format!(
        "{name} has no usable measurement among its {} rows: look at the file of this camera, or leave it out",
        recording.rows.len()
    );
    Finding { level: Level::Doubtful, cause: Cause::Empty, source: Source::Camera(name.clone()), what }
}

/// Returns the receiver's times against the positions of the recordings.
pub(crate) fn receiver_lags(inputs: &Inputs) -> Vec<ReceiverLag> {
    clocks::receiver_lags(inputs)
}

/// Returns the verdict, with what the inputs already showed.
pub(crate) fn verdict(mut of_inputs: Vec<Finding>, fused: &Fused, given: &Given<'_>) -> Verdict {
    of_inputs.extend(given.inputs.recordings.iter().filter(|r| r.seen.is_empty()).map(without_measurement));
    let is_known = |f: &Finding| f.source == Source::Receiver || f.cause == Cause::CameraClock;
    if !of_inputs.iter().any(is_known) {
        of_inputs.extend(clocks::test_small(fused));
    }
    of_inputs.extend(solution::test(fused, given.cameras, given.options));
    Verdict::new(of_inputs)
}
