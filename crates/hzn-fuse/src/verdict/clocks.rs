//! Three clocks: those of the receiver, of the cameras and of the inertial unit.
//!
//! Positions compare the receiver with each camera, thrust compares it with the inertial unit, and the directions
//! compare the cameras with the inertial unit. Two comparisons say which clock is wrong.

use super::place::{Place, place};
use crate::finding::{Cause, Finding, Level, Source};
use crate::input::Inputs;
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
