//! Three clocks: those of the receiver, of the cameras and of the inertial unit.
//!
//! Positions compare the receiver with each camera, thrust compares it with the inertial unit, and the directions
//! compare the cameras with the inertial unit. Two comparisons say which clock is wrong.

use super::place::{Place, lag, place};
use super::receiver::median;
use crate::finding::{Cause, Finding, Level, Source};
use crate::input::Inputs;
use crate::results::{CameraState, Fused, ReceiverLag};
use crate::settings::Settings;

/// Smallest lag of the inertial unit that counts, s: two steps of its search.
const LAG_S: f64 = 0.5;
/// Lags that are alike, s: the receiver has a fix a second.
const ALIKE_S: f64 = 1.0;

/// Tests positions and clocks. `force_lag_s` is the time by which the inertial unit is late against the receiver, if
/// thrust shows it; `of_cameras` says that the directions already contradict the clock of a camera.
pub(super) fn test(inputs: &Inputs, settings: &Settings, force_lag_s: Option<f64>, of_cameras: bool) -> Vec<Finding> {
    let places: Vec<Place> = inputs.recordings.iter().map(|r| place(r, &inputs.gnss, settings)).collect();
    let lags: Vec<f64> = places.iter().filter_map(|p| if let Place::Lag(s) = p { Some(*s) } else { None }).collect();
    let apart: Vec<f64> = places.iter().filter_map(|p| if let Place::Apart(m) = p { Some(*m) } else { None }).collect();
    let is_all = |list: &[f64]| list.len() == places.len() && !list.is_empty();
    let mean = |list: &[f64]| list.iter().sum::<f64>() / list.len().max(1) as f64;
    let mut findings = Vec::new();
    if is_all(&lags) {
        let lag_s = mean(&lags);
        let by_thrust = force_lag_s.is_some_and(|of_imu_s| (of_imu_s + lag_s).abs() > ALIKE_S);
        findings.push(if of_cameras || by_thrust { all_cameras(lag_s) } else { receiver(lag_s) });
        return findings;
    }
    if let Some(lag_s) = force_lag_s.filter(|lag_s| lag_s.abs() > LAG_S) {
        let what = format!(
            "the inertial unit is {} against the receiver: the thrust begins and ends at other times",
            late(lag_s)
        );
        findings.push(finding(Cause::ImuClock, Source::Imu, what));
    }
    if is_all(&apart) {
        let what = format!(
            "the receiver's positions are {:.0} km from those in all recordings: are they ECEF coordinates, with the \
             right axes?",
            mean(&apart) / 1e3
        );
        findings.push(finding(Cause::ReceiverFrame, Source::Receiver, what));
        return findings;
    }
    let each = inputs.recordings.iter().zip(&places);
    findings.extend(each.filter_map(|(recording, place)| of_one(&recording.name, place)));
    findings
}

/// Returns the lag of the receiver against the positions of each recording that determines it.
pub(super) fn receiver_lags(inputs: &Inputs) -> Vec<ReceiverLag> {
    let each = inputs.recordings.iter().enumerate();
    each.filter_map(|(camera, recording)| lag(camera, recording, &inputs.gnss)).collect()
}

/// Tests lags that the clocks of the cameras would allow. These do not help: the position is the receiver's, and
/// nothing estimates its clock. A lag is only without harm if it is the camera's own, and the filter found it.
pub(super) fn test_small(fused: &Fused) -> Option<Finding> {
    let position_m = median(fused.epochs.iter().map(|epoch| epoch.along_sigma_m()))?;
    let last = fused.smoothed.last().filter(|_| fused.solved.is_some()).or(fused.epochs.last())?;
    let is_harmful = |lag: &&ReceiverLag| {
        lag.matters(position_m) && !last.cameras.get(lag.camera).is_some_and(|camera| is_of_camera(lag, camera))
    };
    let harmful: Vec<&ReceiverLag> = fused.receiver_lags.iter().filter(is_harmful).collect();
    let surest = harmful.iter().min_by(|a, b| a.sigma_s.total_cmp(&b.sigma_s))?;
    let ReceiverLag { lag_s, sigma_s, speed_m_s, camera } = **surest;
    let is_one = fused.receiver_lags.len() > harmful.len();
    let name = fused.cameras.get(camera).filter(|_| is_one);
    let (whose, cause, source) = match name {
        Some(name) => (name.as_str(), Cause::CameraClock, Source::Camera(name.clone())),
        None => ("all recordings", Cause::ReceiverClock, Source::Receiver),
    };
    let word = if lag_s > 0.0 { "late" } else { "early" };
    let what = format!(
        "the receiver is {:.3} s {word} (sigma {sigma_s:.3} s) against the positions in {whose}: {:.2} km along the \
         path, while the sigma of the solution's position is {:.3} km there. This position is the receiver's, so \
         that it is wrong if its clock is not that of the inertial unit ({:+.3} s more in --clock gnss would agree). \
         Otherwise the recordings were made with the positions of other times",
        lag_s.abs(),
        lag_s.abs() * speed_m_s * 1e-3,
        position_m * 1e-3,
        -lag_s
    );
    Some(Finding { level: Level::Doubtful, ..finding(cause, source, what) })
}

/// Returns whether the filter has found the lag as the error of a camera's clock, whose recording has the positions of
/// the true times.
fn is_of_camera(lag: &ReceiverLag, camera: &CameraState) -> bool {
    let (own_s, sigma_s) = (camera.clock_s, camera.clock_sigma_s);
    sigma_s > 0.0 && own_s.abs() > 3.0 * sigma_s && (own_s - lag.lag_s).abs() < 3.0 * sigma_s.hypot(lag.sigma_s)
}

fn finding(cause: Cause, source: Source, what: String) -> Finding {
    Finding { level: Level::Contradicts, cause, source, what }
}

/// Returns a lag in words.
fn late(lag_s: f64) -> String {
    format!("{:.1} s {}", lag_s.abs(), if lag_s > 0.0 { "late" } else { "early" })
}

/// The receiver is late if its positions of a later time are those of the recordings.
fn receiver(lag_s: f64) -> Finding {
    let what = format!(
        "the receiver is {} against the positions in all recordings: is its clock that of the inertial unit? GPS time \
         is ahead of UTC by whole leap seconds",
        late(lag_s)
    );
    finding(Cause::ReceiverClock, Source::Receiver, what)
}

fn all_cameras(lag_s: f64) -> Finding {
    let what = format!(
        "the times of all cameras are {}: the positions in their recordings are the receiver's of that time; check the \
         times, or give --clock",
        late(-lag_s)
    );
    finding(Cause::CameraClock, Source::Cameras, what)
}

/// Returns what the place of one camera means, while others agree with the receiver.
fn of_one(name: &str, place: &Place) -> Option<Finding> {
    let source = Source::Camera(name.to_owned());
    match place {
        Place::Lag(lag_s) => {
            let what = format!(
                "the times of {name} are {}: its positions are the receiver's of that time; check the times, or give \
                 --clock",
                late(-lag_s)
            );
            Some(finding(Cause::CameraClock, source, what))
        }
        Place::Apart(m) => {
            let what = format!("the positions in {name} are {:.1} km from the receiver's", m / 1e3);
            Some(finding(Cause::Receiver, source, what))
        }
        Place::Near(m) => {
            let what = format!(
                "the positions that the pictures of {name} were processed with are {:.1} km from the receiver's: are \
                 both ECEF coordinates at the same times?",
                m / 1e3
            );
            Some(Finding { level: Level::Doubtful, ..finding(Cause::ReceiverFrame, Source::Receiver, what) })
        }
        Place::Agrees => None,
    }
}
