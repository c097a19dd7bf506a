//! What is odd about the pictures of a run. It is counted while the run goes on, and told once at its end.

mod airglow;
mod altitudes;
mod contradictions;
mod improbable;
mod one_place;
mod other_axes;
mod rates;
mod refused;
mod repeats;
mod shutter;
mod spread;
mod told_sun;

use hzn_core::body::PriorError;
use hzn_core::status::Status;
use hzn_files::{FrameData, Frames};
use hzn_run::engine::{BodyOutcome, Finished};
use hzn_run::explain;

pub(crate) use airglow::Airglow;
pub(crate) use altitudes::Altitudes;
pub(crate) use contradictions::Contradictions;
pub(crate) use improbable::Improbable;
pub(crate) use one_place::OnePlace;
pub(crate) use rates::{Answer, Rates};
pub(crate) use refused::Refused;
pub(crate) use repeats::Repeats;
pub(crate) use shutter::Shutter;
pub(crate) use spread::Spread;
pub(crate) use told_sun::ToldSun;

use crate::tell;

/// Counts files that contain more pictures than the one that was processed.
#[derive(Default)]
pub(crate) struct MultiPageFiles {
    pub(crate) files: u64,
    first: Option<(String, u32)>,
}

impl MultiPageFiles {
    pub(crate) fn count(&mut self, frame: &Finished) {
        if frame.pages > 1 {
            self.files += 1;
            self.first.get_or_insert_with(|| (frame.name.clone(), frame.pages));
        }
    }

    pub(crate) fn tell(&self) {
        let Some((name, pages)) = &self.first else { return };
        let files = explain::counted(self.files, "file");
        tell::warning(format_args!(
            "only the first picture of {files} with several pages or frames was processed (the first file is {name} \
             with {pages} pictures); write each picture into its own file, or give a video"
        ));
    }
}

/// Counts pictures with missing priors, so that each kind is reported once.
#[derive(Default)]
pub(crate) struct MissingPriors {
    frames: u64,
    no_row: u64,
    /// Pictures whose row has an altitude or a position.
    with_altitude: u64,
    no_time: u64,
    no_altitude: u64,
    below_limb: u64,
    /// Pictures with other values that contradict each other, and the first of them with the reason.
    impossible: u64,
    first_impossible: Option<String>,
}

impl MissingPriors {
    pub(crate) fn count(&mut self, frame: &Finished) {
        self.frames += 1;
        self.no_row += u64::from(frame.data.is_none());
        let has_altitude = |data: &FrameData| data.altitude_km.is_some() || data.position_km.is_some();
        self.with_altitude += u64::from(frame.data.as_ref().is_some_and(has_altitude));
        self.no_time += u64::from(frame.time_s.is_none());
        let unprocessed = |f: &&BodyOutcome| f.status() == Status::NoAltitude;
        let Some(why) = frame.outcomes.iter().find(unprocessed) else { return };
        match why.refused_prior() {
            Some(PriorError::BelowLimb { .. }) => self.below_limb += 1,
            Some(PriorError::NoAltitude) | None => self.no_altitude += 1,
            Some(other) => {
                self.impossible += 1;
                self.first_impossible.get_or_insert_with(|| format!("{}: {other}", frame.name));
            }
        }
    }

    /// Tells that an altitude of the command line was used for no picture.
    pub(crate) fn tell_unused_altitude(&self, frames: Option<&Frames>) {
        if let Some(frames) = frames.filter(|_| self.frames > 0 && self.with_altitude == self.frames) {
            let table = frames.path.display();
            tell::line(format_args!("note: --altitude-km is not used: {table} has an altitude for every picture"));
        }
    }

    pub(crate) fn tell(&self, frames: Option<&Frames>) {
        let mut parts = Vec::new();
        if let Some(frames) = frames.filter(|_| self.no_row > 0) {
            parts.push(format!("{} without a row in {}", self.no_row, frames.path.display()));
        }
        if self.no_time > 0 {
            parts.push(format!("{} without a time", self.no_time));
        }
        if self.no_altitude > 0 {
            let what = "without an altitude, not processed (status no-altitude): give it in frames.csv, as \
                        body.altitude_km, or by --altitude-km";
            parts.push(format!("{} {what}", self.no_altitude));
        }
        if self.below_limb > 0 {
            let what = "below the limb height, where no limb can be seen, not processed (status no-altitude)";
            parts.push(format!("{} {what}", self.below_limb));
        }
        if let Some(first) = &self.first_impossible {
            let what = "with values that allow no search, not processed (status no-altitude); the first is";
            parts.push(format!("{} {what} {first}", self.impossible));
        }
        if !parts.is_empty() {
            tell::warning(format_args!("of {}: {}", explain::counted(self.frames, "picture"), parts.join("; ")));
        }
    }
}

/// Looks for times that do not rise from picture to picture.
#[derive(Default)]
pub(crate) struct Times {
    /// Name and time of the last picture with a time.
    last: Option<(String, f64)>,
    /// Number of pictures with an earlier picture that has a time, and of those among them with the same time.
    pairs: u64,
    equal: u64,
    backwards: u64,
    first_backwards: Option<String>,
}

impl Times {
    pub(crate) fn count(&mut self, frame: &Finished) {
        let Some(time_s) = frame.time_s else { return };
        if let Some((name, before_s)) = self.last.replace((frame.name.clone(), time_s)) {
            self.pairs += 1;
            self.equal += u64::from(time_s == before_s);
            if time_s < before_s {
                self.backwards += 1;
                let place = || format!("from {before_s} s of {name} to {time_s} s of {}", frame.name);
                self.first_backwards.get_or_insert_with(place);
            }
        }
    }

    pub(crate) fn tell(&self) {
        if let Some(first) = &self.first_backwards {
            let times = explain::counted(self.backwards, "time");
            tell::warning(format_args!(
                "the time goes back {times} in the order of the pictures, first {first}: are the times and the order \
                 of the pictures right?"
            ));
        }
        if let Some((_, time_s)) = self.last.as_ref().filter(|_| self.pairs > 0 && self.equal == self.pairs) {
            let pictures = explain::counted(self.pairs + 1, "picture");
            tell::warning(format_args!("all {pictures} have the same time, {time_s} s"));
        }
    }
}
