//! Pairs the pictures of the heads by time.

use std::collections::VecDeque;

use hzn_core::rig::MOST_HEADS;
use hzn_files::{FrameData, Frames};

use super::open::OpenHead;
use crate::error::{Error, unusable};
use crate::source::{Item, Payload, Source, TimeSource, exif_time_s};

/// The pictures of one epoch, one for each head; `None` for a head without one.
#[derive(Debug, Default)]
pub struct Epoch {
    /// The pictures, in the order of the heads, each with its place in the sequence of its head.
    pub(super) pictures: [Option<(u64, Item)>; MOST_HEADS],
}

/// The pictures of the heads, epoch after epoch.
///
/// The earliest picture that is not yet taken opens an epoch. Each other head adds its next picture if that is at most
/// `sync_s` later and if no later picture of the opening head is nearer. A picture without a time is an epoch of its
/// own, because nothing can be paired with it.
pub struct Epochs {
    heads: Vec<Queue>,
    sync_s: f64,
    fps: f64,
}

/// The next pictures of a head.
struct Queue {
    name: String,
    source: Box<dyn Source>,
    /// The table next to the pictures, which has their times.
    frames: Option<Frames>,
    /// The table of the vehicle, as the head sees it.
    vehicle: Option<Frames>,
    ahead: VecDeque<Timed>,
    /// Number of pictures that were read.
    read: u64,
    last_s: Option<f64>,
}

struct Timed {
    number: u64,
    item: Item,
    time_s: Option<f64>,
}

impl Epochs {
    /// Begins with the first picture of each head. `fps` gives the times of pictures that have no other.
    pub fn new(heads: Vec<OpenHead>, sync_s: f64, fps: f64) -> Self {
        let queue = |head: OpenHead| Queue {
            name: head.name,
            source: head.source,
            frames: head.frames,
            vehicle: head.vehicle,
            ahead: VecDeque::new(),
            read: 0,
            last_s: None,
        };
        Self { heads: heads.into_iter().map(queue).collect(), sync_s, fps }
    }

    fn try_next(&mut self) -> Result<Option<Epoch>, Error> {
        let mut epoch = Epoch::default();
        let mut opening: Option<(usize, f64)> = None;
        for (k, head) in self.heads.iter_mut().enumerate() {
            match head.time_s(0, self.fps)? {
                None => {}
                // It comes first, so that it keeps its place among the pictures of its head.
                Some(None) => return Ok(head.take(k, self.sync_s, epoch)),
                Some(Some(time_s)) if opening.is_none_or(|(_, first_s)| time_s < first_s) => {
                    opening = Some((k, time_s))
                }
                Some(Some(_)) => {}
            }
        }
        let Some((opener, first_s)) = opening else { return Ok(None) };
        let following_s = self.heads.get_mut(opener).map(|head| head.time_s(1, self.fps)).transpose()?;
        let following_s = following_s.flatten().flatten();
        for (k, head) in self.heads.iter_mut().enumerate() {
            let time_s = head.time_s(0, self.fps)?.flatten();
            let is_near = |time_s: f64| {
                let is_nearer = following_s.is_some_and(|next_s| (next_s - time_s).abs() < time_s - first_s);
                time_s - first_s <= self.sync_s && !is_nearer
            };
            if k == opener || time_s.is_some_and(is_near) {
                epoch = head.take(k, self.sync_s, epoch).unwrap_or_default();
            }
        }
        Ok(Some(epoch))
    }

    /// Returns what could not be handed out, after the last picture.
    pub fn describe_loss(&self) -> Option<String> {
        self.heads.iter().find_map(|head| Some(format!("{}: {}", head.name, head.source.describe_loss()?)))
    }
}

impl Iterator for Epochs {
    type Item = Result<Epoch, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        self.try_next().transpose()
    }
}

impl Queue {
    /// Returns the time of the picture that comes `ahead` places after the next one; `None` if there is none, and
    /// `Some(None)` if it has no time.
    fn time_s(&mut self, ahead: usize, fps: f64) -> Result<Option<Option<f64>>, Error> {
        while self.ahead.len() <= ahead {
            let Some(item) = self.source.next() else { return Ok(None) };
            let timed = self.place(item?, fps)?;
            self.ahead.push_back(timed);
        }
        Ok(self.ahead.get(ahead).map(|timed| timed.time_s))
    }

    fn place(&mut self, item: Item, fps: f64) -> Result<Timed, Error> {
        let number = self.read;
        self.read += 1;
        let data = self.frames.as_ref().map_or(item.data.as_ref(), |frames| frames.get(&item.name));
        let exif = || match &item.payload {
            Payload::File(path) => exif_time_s(path),
            _ => None,
        };
        let time_s = item.time_source(self.frames.as_ref()).time_s(data, exif, number, fps);
        if let Some((time_s, last_s)) = time_s.zip(self.last_s)
            && time_s <= last_s
        {
            return Err(unusable(format!(
                "head {}: {} was taken at {time_s} s, not later than the picture before it ({last_s} s); the pictures \
                 of a rig must be in the order of time",
                self.name, item.name
            )));
        }
        self.last_s = time_s.or(self.last_s);
        Ok(Timed { number, item, time_s })
    }

    /// Moves the next picture into the epoch, with the data of its time.
    fn take(&mut self, k: usize, sync_s: f64, mut epoch: Epoch) -> Option<Epoch> {
        let Timed { number, mut item, time_s } = self.ahead.pop_front()?;
        let own = item.take_prior(self.frames.as_ref());
        let data = match &self.vehicle {
            Some(vehicle) => {
                let nearest = time_s.and_then(|time_s| vehicle.nearest(time_s, sync_s)).cloned();
                Some(FrameData { file: item.name.clone(), ..nearest.unwrap_or_default() })
            }
            None => own,
        };
        // The time is found already. The engine would count the pictures of the rig and not those of the head.
        item.data = data.map(|data| FrameData { time_s, ..data });
        item.time = TimeSource::Container(time_s);
        if let Some(place) = epoch.pictures.get_mut(k) {
            *place = Some((number, item));
        }
        Some(epoch)
    }
}
