//! A camera of the computer: its pictures, its parameters, its counts.

use std::collections::VecDeque;

use crossbeam_channel::{Receiver, TryRecvError};
use hzn_core::Solution;
use hzn_core::camera::Camera;
use hzn_core::image::Layout;
use hzn_core::status::Status;
use hzn_flight::board::Picture;
use hzn_mcap::RowMeta;
use hzn_run::engine::{REMEMBERED, Tiles, widen_solution};

use crate::camera::{Capture, Ended, FromCamera, Recording, Shot};
use crate::flash::Flash;
use crate::keeper::Keeper;
use crate::tell::{Rarely, Tell};

/// Pictures of a head that may wait for the end of their epoch.
const RECENT: usize = 4;

/// Counts of a flight.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Pictures that were processed.
    pub pictures: u64,
    /// Pictures with an answer.
    pub answers: u64,
    /// Pictures that were lost.
    pub lost: u64,
    /// Pictures that the flight software refused, such as those of a wrong size. An event says why.
    pub refused: u64,
}

impl Counts {
    /// Returns the sum of two counts.
    pub(crate) fn plus(self, other: Self) -> Self {
        Self {
            pictures: self.pictures + other.pictures,
            answers: self.answers + other.answers,
            lost: self.lost + other.lost,
            refused: self.refused + other.refused,
        }
    }
}

/// Where the pictures of a head come from.
pub(crate) enum Feed {
    /// A thread that waits for a camera or a pipe.
    Camera(Capture),
    /// Pictures with times, which were taken before.
    Recording(Box<Recording>),
}

/// A camera with its parameters.
pub(crate) struct Head {
    /// Its name; `None` for the only camera, which has none.
    pub(crate) name: Option<String>,
    feed: Feed,
    pub(crate) flash: Flash,
    /// Keeps pictures, if that is wanted.
    pub(crate) keeper: Option<Keeper>,
    pub(crate) next: Option<Shot>,
    pub(crate) current: Option<Shot>,
    pub(crate) ended: Option<Ended>,
    /// The checksums of the last pictures that were shown, the newest last; those of the tiles if the lens is known.
    shown: VecDeque<(u32, Option<Tiles>)>,
    /// The lens, once the parameters are known.
    pub(crate) camera: Option<Camera<f64>>,
    /// Multiple of sigma that is the protection level.
    pub(crate) protection_factor: Option<f64>,
    counts: Counts,
    /// Number of pictures that were handed out to be processed.
    handed_out: u64,
    /// The last pictures that were processed, with their numbers in the loop.
    recent: VecDeque<(u32, RowMeta)>,
    not_stored: Rarely,
}

impl Head {
    pub(crate) fn new(name: Option<String>, feed: Feed, flash: Flash, keeper: Option<Keeper>, tell: Tell) -> Self {
        Self {
            name,
            feed,
            flash,
            keeper,
            next: None,
            current: None,
            ended: None,
            shown: VecDeque::new(),
            camera: None,
            protection_factor: None,
            counts: Counts::default(),
            handed_out: 0,
            recent: VecDeque::new(),
            not_stored: Rarely::new(tell),
        }
    }

    /// Returns the channel of the pictures, which is ready when one comes; `None` after the end, and for a recording.
    pub(crate) fn pictures(&self) -> Option<&Receiver<FromCamera>> {
        match &self.feed {
            Feed::Camera(capture) if self.ended.is_none() => Some(&capture.pictures),
            Feed::Camera(_) | Feed::Recording(_) => None,
        }
    }

    /// Returns the time of the next picture of a recording, µs since the start.
    pub(crate) fn upcoming_us(&self) -> Option<u64> {
        match &self.feed {
            Feed::Recording(recording) => recording.upcoming_us(),
            Feed::Camera(_) => None,
        }
    }

    /// Returns the time of the next picture of a recording in seconds.
    pub(crate) fn upcoming_s(&self) -> Option<f64> {
        match &self.feed {
            Feed::Recording(recording) => recording.upcoming_s(),
            Feed::Camera(_) => None,
        }
    }

    /// Sets the time of the first picture of all recordings. Returns the time at which the clock of the flight begins;
    /// `None` if this is no recording.
    pub(crate) fn begin_at(&mut self, first_s: f64) -> Option<f64> {
        match &mut self.feed {
            Feed::Recording(recording) => Some(recording.begin_at(first_s)),
            Feed::Camera(_) => None,
        }
    }

    /// Takes what the camera has sent, and the pictures of a recording until now.
    pub(crate) fn poll(&mut self, now_us: u64) {
        if self.ended.is_some() {
            return;
        }
        match &mut self.feed {
            Feed::Camera(capture) => match capture.pictures.try_recv() {
                Ok(from) => self.take(Some(from)),
                Err(TryRecvError::Disconnected) => self.take(None),
                Err(TryRecvError::Empty) => {}
            },
            Feed::Recording(recording) => {
                if let Some(from) = recording.take_until(now_us) {
                    self.take(Some(from));
                }
            }
        }
    }

    fn take(&mut self, from: Option<FromCamera>) {
        match from {
            Some(FromCamera::Shot(shot)) => {
                if let Some(older) = self.next.replace(shot) {
                    self.give_back(older);
                }
            }
            Some(FromCamera::End(why)) => self.ended = Some(why),
            None => self.ended = Some(Ended::Failed("the camera's thread has ended".into())),
        }
    }

    fn give_back(&self, shot: Shot) {
        if let Feed::Camera(capture) = &self.feed {
            // The channel has room for every buffer.
            let _ = capture.spare.try_send(shot.pixels);
        }
    }

    /// Returns why no more pictures will come. If the loop takes every picture, the last one must have been taken.
    pub(crate) fn ended(&self, takes_pictures: bool) -> Option<&Ended> {
        self.ended.as_ref().filter(|_| !takes_pictures || self.next.is_none())
    }

    pub(crate) fn counts(&self) -> Counts {
        Counts { refused: self.handed_out.saturating_sub(self.counts.pictures), ..self.counts }
    }

    /// Hands out the next picture. `at_us` returns the time of a picture that was taken now.
    pub(crate) fn next_picture(&mut self, now_us: u64, at_us: impl Fn(&Shot) -> u64) -> Option<Picture> {
        if self.next.is_none() {
            self.poll(now_us);
        }
        let shot = self.next.take()?;
        self.counts.lost += u64::from(shot.lost);
        self.handed_out += 1;
        let exposure_us = shot.recorded.as_ref().map_or_else(|| at_us(&shot), |recorded| recorded.exposure_us);
        let picture = Picture { bytes: shot.pixels.len(), exposure_us, lost: shot.lost };
        if let Some(before) = self.current.replace(shot) {
            self.give_back(before);
        }
        Some(picture)
    }

    /// Remembers the picture that is shown.
    pub(crate) fn see_shown(&mut self) {
        let Some(shot) = &self.current else { return };
        let tiles = self.camera.as_ref().map(|camera| {
            let layout = Layout::packed(camera.width().into(), camera.height().into(), 1, 8);
            Tiles::of_bytes(&shot.pixels, layout)
        });
        if self.shown.len() > REMEMBERED {
            self.shown.pop_front();
        }
        self.shown.push_back((crc32fast::hash(&shot.pixels), tiles));
    }

    /// Returns whether the picture that was shown last is one of those before it, at least along its limb.
    pub(crate) fn repeats(&self, limb: Option<&Solution<f32>>) -> bool {
        let mut pictures = self.shown.iter().rev();
        let Some((checksum, tiles)) = pictures.next() else { return false };
        let now = tiles.as_ref().zip(self.camera.as_ref()).zip(limb);
        let limb = now.map(|((tiles, camera), limb)| (tiles, tiles.on_limb(&widen_solution(limb), camera)));
        pictures.any(|(other, other_tiles)| {
            let both = limb.as_ref().zip(other_tiles.as_ref());
            other == checksum || both.is_some_and(|((tiles, limb), other)| tiles.repeat(limb, other))
        })
    }

    /// Returns the name of the picture that was handed out last.
    pub(crate) fn picture_name(&self) -> String {
        let Some(shot) = &self.current else { return String::new() };
        shot.recorded.as_ref().map_or_else(|| format!("frame-{:06}", shot.number), |recorded| recorded.name.clone())
    }

    pub(crate) fn note_answer(&mut self, status: Status) {
        self.counts.pictures += 1;
        self.counts.answers += u64::from(status == Status::Ok);
    }

    /// Takes note of a picture that was processed, for the joint answer of its epoch, which may come later.
    pub(crate) fn note_meta(&mut self, picture: u32, meta: RowMeta) {
        if self.name.is_some() {
            self.recent.truncate(RECENT - 1);
            self.recent.push_front((picture, meta));
        }
    }

    /// Returns what is known of a picture; `None` for picture 0, which is none, and for one of long ago.
    pub(crate) fn meta(&self, picture: u32) -> Option<&RowMeta> {
        self.recent.iter().find(|(number, _)| *number == picture).map(|(_, meta)| meta)
    }

    /// Writes copy 1 or 2 of the parameters. Returns false if the disk refuses.
    pub(crate) fn write_copy(&mut self, copy: u8, bytes: &[u8]) -> bool {
        let written = self.flash.write_copy(copy, bytes);
        if let Err(e) = &written {
            let folder = self.flash.folder().display();
            self.not_stored.line(&format!("{folder}: the parameters cannot be stored: {e}"));
        }
        written.is_ok()
    }
}
