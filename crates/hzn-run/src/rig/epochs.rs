//! Pairs the pictures of the heads by time.

use std::collections::VecDeque;

use hzn_core::rig::MOST_HEADS;
use hzn_files::Frames;

use super::open::{OpenHead, Vehicle};
use super::sync::is_in_sync;
use crate::error::{Error, unusable};
use crate::explain;
use crate::source::{Item, Payload, Source, TimeSource, exif_time_s};

/// The pictures of one epoch, one for each head; `None` for a head without one.
#[derive(Debug, Default)]
pub struct Epoch {
    /// The pictures, in the order of the heads, each with its place in the sequence of its head.
    pub(super) pictures: [Option<(u64, Item)>; MOST_HEADS],
}

impl Epoch {
    /// Returns the pictures, in the order of the heads.
    pub fn into_pictures(self) -> impl Iterator<Item = Option<Item>> {
        self.pictures.into_iter().map(|picture| picture.map(|(_, item)| item))
    }
}

/// The pictures of the heads, epoch after epoch.
///
/// The earliest picture that is not yet taken opens an epoch. Each other head adds its next picture if that is at most
/// `sync_s` later and if no later picture of the opening head is nearer. A picture without a time, or out of the order
/// of time, is an epoch of its own, because nothing can be paired with it.
pub struct Epochs {
    heads: Vec<Queue>,
    sync_s: f64,
    /// Number of epochs with several pictures that a head has a part in.
    paired: [u64; MOST_HEADS],
}

/// The next pictures of a head.
struct Queue {
    name: String,
    source: Box<dyn Source>,
    /// The table next to the pictures, which has their times.
    frames: Option<Frames>,
    vehicle: Option<Vehicle>,
    ahead: VecDeque<Timed>,
    /// Number of pictures that were read.
    read: u64,
    /// Time of the last picture that can be paired.
    last_s: Option<f64>,
    unordered: Unordered,
    unmatched: Unmatched,
}

struct Timed {
    number: u64,
    item: Item,
    time_s: Option<f64>,
    /// Whether the time is in the order of the pictures; `None` before it is judged.
    is_ordered: Option<bool>,
}

/// The pictures of a head whose times do not rise.
#[derive(Default)]
struct Unordered {
    pictures: u64,
    first: Option<String>,
}

/// The pictures without a row in the table of the vehicle.
#[derive(Clone, Copy)]
struct Unmatched {
    pictures: u64,
    /// Time to the nearest row.
    nearest_s: f64,
}

impl Epochs {
    /// Begins with the first picture of each head.
    ///
    /// # Errors
    /// The pictures of a head have no times, or its source breaks off.
    pub fn new(heads: Vec<OpenHead>, sync_s: f64) -> Result<Self, Error> {
        let queue = |head: OpenHead| Queue {
            name: head.name,
            source: head.source,
            frames: head.frames,
            vehicle: head.vehicle,
            ahead: VecDeque::new(),
            read: 0,
            last_s: None,
            unordered: Unordered::default(),
            unmatched: Unmatched { pictures: 0, nearest_s: f64::INFINITY },
        };
        let mut epochs = Self { heads: heads.into_iter().map(queue).collect(), sync_s, paired: [0; MOST_HEADS] };
        for head in &mut epochs.heads {
            head.time_s(0)?;
        }
        Ok(epochs)
    }

    fn try_next(&mut self) -> Result<Option<Epoch>, Error> {
        let mut epoch = Epoch::default();
        let mut opening: Option<(usize, f64)> = None;
        for (k, head) in self.heads.iter_mut().enumerate() {
            match head.time_s(0)? {
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
        let following_s = self.heads.get_mut(opener).map(|head| head.time_s(1)).transpose()?;
        let following_s = following_s.flatten().flatten();
        for (k, head) in self.heads.iter_mut().enumerate() {
            let time_s = head.time_s(0)?.flatten();
            let is_near = |time_s: f64| {
                let is_nearer = following_s.is_some_and(|next_s| (next_s - time_s).abs() < time_s - first_s);
                is_in_sync(time_s - first_s, self.sync_s) && !is_nearer
            };
            if k == opener || time_s.is_some_and(is_near) {
                epoch = head.take(k, self.sync_s, epoch).unwrap_or_default();
            }
        }
        Ok(Some(epoch))
    }

    /// Returns what looks wrong in the times of the pictures that were handed out.
    pub fn warnings(&self) -> Vec<String> {
        let unordered = |head: &Queue| {
            let Unordered { pictures, first } = &head.unordered;
            let first = first.as_ref()?;
            let pictures = explain::counted(*pictures, "picture");
            Some(format!(
                "head {}: {pictures} out of the order of time, first {first}; such a picture is paired with none: are \
                 the times and the order of the pictures right?",
                head.name
            ))
        };
        self.heads.iter().filter_map(unordered).chain(self.unpaired()).chain(self.unmatched()).collect()
    }

    /// Returns which heads have no picture in an epoch with those of others, if there are others.
    fn unpaired(&self) -> Option<String> {
        let alone = |(head, paired): (&Queue, &u64)| (head.read > 0 && *paired == 0).then(|| head.name.clone());
        let alone: Vec<String> = self.heads.iter().zip(&self.paired).filter_map(alone).collect();
        let (false, true) = (alone.is_empty(), self.heads.len() > 1) else { return None };
        Some(format!(
            "no picture of {} was taken at most {} s ([rig] sync_s) from one of another head, so nothing was joined \
             with it: do the heads have the same clock?",
            alone.join(", "),
            self.sync_s
        ))
    }

    /// Returns how many pictures have no row in the table of the vehicle, if any.
    fn unmatched(&self) -> Option<String> {
        let missing: Vec<_> = self.heads.iter().filter(|head| head.unmatched.pictures > 0).collect();
        let path = &missing.first()?.vehicle.as_ref()?.frames.path;
        let pictures = explain::counted(missing.iter().map(|head| head.unmatched.pictures).sum(), "picture");
        let nearest_s = missing.iter().map(|head| head.unmatched.nearest_s).fold(f64::INFINITY, f64::min);
        let names: Vec<&str> = missing.iter().map(|head| head.name.as_str()).collect();
        Some(format!(
            "{pictures} of the heads {} had no row in {} at most {} s away ([rig] sync_s), so they were processed \
             without the data of the vehicle, such as its altitude; the smallest distance is {nearest_s:.3} s: does \
             the table have the clock of the pictures?",
            names.join(", "),
            path.display(),
            self.sync_s
        ))
    }

    /// Returns what could not be handed out, after the last picture.
    pub fn describe_loss(&self) -> Option<String> {
        self.heads.iter().find_map(|head| Some(format!("{}: {}", head.name, head.source.describe_loss()?)))
    }
}

impl Iterator for Epochs {
    type Item = Result<Epoch, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        let epoch = self.try_next().transpose()?;
        if let Ok(Epoch { pictures }) = &epoch
            && pictures.iter().flatten().count() > 1
        {
            self.paired.iter_mut().zip(pictures).for_each(|(paired, own)| *paired += u64::from(own.is_some()));
        }
        Some(epoch)
    }
}

impl Queue {
    /// Returns the time of the picture that comes `ahead` places after the next one; `None` if there is none, and
    /// `Some(None)` if it has none that is in order.
    fn time_s(&mut self, ahead: usize) -> Result<Option<Option<f64>>, Error> {
        // The two pictures after it tell whether its time is too late.
        while self.ahead.len() <= ahead + 2 {
            let Some(item) = self.source.next() else { break };
            let timed = self.place(item?)?;
            self.ahead.push_back(timed);
        }
        for i in 0..=ahead {
            self.judge(i);
        }
        Ok(self.ahead.get(ahead).map(|timed| timed.time_s.filter(|_| timed.is_ordered == Some(true))))
    }

    /// Judges whether the time of a picture is in order: it is not if it is not later than the last one in order, or if
    /// the next two pictures rise between these two.
    fn judge(&mut self, i: usize) {
        let time_s = |i: usize| self.ahead.get(i).and_then(|timed| timed.time_s);
        let is_after_last = |time_s: f64| self.last_s.is_none_or(|last_s| time_s > last_s);
        let own_s = time_s(i);
        let is_too_late = |own_s: f64| {
            let next = time_s(i + 1).zip(time_s(i + 2));
            next.is_some_and(|(next_s, then_s)| is_after_last(next_s) && next_s < then_s && then_s <= own_s)
        };
        let is_ordered = own_s.is_none_or(|own_s| is_after_last(own_s) && !is_too_late(own_s));
        let Some(timed) = self.ahead.get_mut(i).filter(|timed| timed.is_ordered.is_none()) else { return };
        timed.is_ordered = Some(is_ordered);
        if is_ordered {
            self.last_s = own_s.or(self.last_s);
        } else {
            self.unordered.pictures += 1;
            let own_s = own_s.unwrap_or_default();
            self.unordered.first.get_or_insert_with(|| format!("{} with {own_s} s", timed.item.name));
        }
    }

    fn place(&mut self, item: Item) -> Result<Timed, Error> {
        let number = self.read;
        self.read += 1;
        let data = self.frames.as_ref().map_or(item.data.as_ref(), |frames| frames.get(&item.name));
        let exif = || match &item.payload {
            Payload::File(path) => exif_time_s(path),
            _ => None,
        };
        let time = item.time_source(self.frames.as_ref());
        if time == TimeSource::Count {
            // A count has no gap where a picture is missing.
            return Err(unusable(format!(
                "head {}: the pictures have no times, which a rig needs to pair them; give a frames.csv with time_s or \
                 utc next to them, pictures with EXIF times, or a recording or video with times",
                self.name
            )));
        }
        let time_s = time.time_s(data, exif, number, 1.0);
        Ok(Timed { number, item, time_s, is_ordered: None })
    }

    /// Moves the next picture into the epoch, with the data of its time.
    fn take(&mut self, k: usize, sync_s: f64, mut epoch: Epoch) -> Option<Epoch> {
        let Timed { number, mut item, time_s, .. } = self.ahead.pop_front()?;
        let own = item.take_prior(self.frames.as_ref());
        let data = match self.vehicle.as_ref().zip(time_s) {
            Some((vehicle, time_s)) => match vehicle.nearest(time_s) {
                Some((away_s, data)) if is_in_sync(away_s, sync_s) => Some(data),
                nearest => {
                    let away_s = nearest.map_or(f64::INFINITY, |(away_s, _)| away_s);
                    self.unmatched.pictures += 1;
                    self.unmatched.nearest_s = self.unmatched.nearest_s.min(away_s);
                    None
                }
            },
            None => own.filter(|_| self.vehicle.is_none()),
        };
        // The time is found already. The engine would count the pictures of the rig and not those of the head.
        item.data = data.map(|data| hzn_files::FrameData { file: item.name.clone(), time_s, ..data });
        item.time = TimeSource::Container(time_s);
        if let Some(place) = epoch.pictures.get_mut(k) {
            *place = Some((number, item));
        }
        Some(epoch)
    }
}
