//! Pictures with times, which were taken before: a folder, a video or a recording.

use std::time::Instant;

use hzn_core::Config;
use hzn_core::image::{ImageView, Pixels};
use hzn_files::Frames;
use hzn_run::source::{Item, Payload, Source, TimeSource, exif_time_s};

use super::Ended;
use super::capture::{FromCamera, Recorded, Shot};
use crate::tell::Tell;

/// Time between the start of the flight and its first picture, µs. The heads then start in the mode flight.
const LEAD_US: u64 = 1_000_000;

/// Pictures with times. The clock of the flight follows them.
pub struct Recording {
    name: String,
    source: Box<dyn Source>,
    frames: Option<Frames>,
    config: Config,
    /// The next picture, and its time in seconds.
    ahead: Option<(Item, f64)>,
    /// Time of the first picture of all heads, s.
    origin_s: f64,
    /// Number of pictures that were read.
    read: u64,
    /// Pictures that were lost since the last one.
    lost: u32,
    /// Why there is no further picture.
    end: Option<Ended>,
    tell: Tell,
}

impl Recording {
    /// Opens the pictures of a sensor, and reads the first one's time.
    ///
    /// # Errors
    /// The pictures have no times.
    pub fn open(
        name: String,
        source: Box<dyn Source>,
        frames: Option<Frames>,
        config: Config,
        tell: Tell,
    ) -> Result<Self, String> {
        let mut recording =
            Self { name, source, frames, config, ahead: None, origin_s: 0.0, read: 0, lost: 0, end: None, tell };
        recording.advance(None);
        match &recording.end {
            Some(Ended::Failed(why)) => Err(format!("{}: {why}", recording.name)),
            _ => Ok(recording),
        }
    }

    /// Returns the time of the next picture in seconds; `None` at the end.
    pub fn upcoming_s(&self) -> Option<f64> {
        self.ahead.as_ref().map(|(_, time_s)| *time_s)
    }

    /// Sets the time of the first picture of all heads. Returns the time in seconds at which the clock of the flight
    /// begins.
    pub fn begin_at(&mut self, origin_s: f64) -> f64 {
        self.origin_s = origin_s;
        origin_s - LEAD_US as f64 * 1e-6
    }

    /// Returns the time of the next picture on the clock of the flight, µs.
    pub(crate) fn upcoming_us(&self) -> Option<u64> {
        Some(LEAD_US + ((self.upcoming_s()? - self.origin_s).max(0.0) * 1e6).round() as u64)
    }

    /// Takes the next picture if it was taken until then, or the end.
    pub(crate) fn take_until(&mut self, now_us: u64) -> Option<FromCamera> {
        loop {
            let Some(exposure_us) = self.upcoming_us() else { return self.end.take().map(FromCamera::End) };
            if exposure_us > now_us {
                return None;
            }
            let (Item { name, payload, .. }, time_s) = self.ahead.take()?;
            let number = self.read - 1;
            self.advance(Some(time_s));
            match pixels(payload, &self.config) {
                Ok(pixels) => {
                    let recorded = Some(Recorded { exposure_us, name });
                    let lost = std::mem::take(&mut self.lost);
                    return Some(FromCamera::Shot(Shot { pixels, number, lost, ready: Instant::now(), recorded }));
                }
                Err(why) => self.lose(&name, &why),
            }
        }
    }

    fn lose(&mut self, name: &str, why: &str) {
        self.lost = self.lost.saturating_add(1);
        (self.tell)(&format!("{}{name}: lost: {why}", self.prefix()));
    }

    fn prefix(&self) -> String {
        if self.name.is_empty() { String::new() } else { format!("{}: ", self.name) }
    }

    /// Finds the next picture with a time that is later than the last one.
    fn advance(&mut self, last_s: Option<f64>) {
        loop {
            let item = match self.source.next() {
                Some(Ok(item)) => item,
                Some(Err(e)) => return self.end = Some(Ended::Failed(e.to_string())),
                None => return self.end = Some(Ended::Whole),
            };
            self.read += 1;
            match self.time_s(&item) {
                Err(why) => return self.end = Some(Ended::Failed(why)),
                Ok(Some(time_s)) if last_s.is_none_or(|last_s| time_s > last_s) => {
                    return self.ahead = Some((item, time_s));
                }
                Ok(Some(_)) => self.lose(&item.name, "its time is not later than that of the picture before"),
                Ok(None) => self.lose(&item.name, "it has no time"),
            }
        }
    }

    fn time_s(&self, item: &Item) -> Result<Option<f64>, String> {
        let data = self.frames.as_ref().map_or(item.data.as_ref(), |frames| frames.get(&item.name));
        let exif = || match &item.payload {
            Payload::File(path) => exif_time_s(path),
            _ => None,
        };
        let time = item.time_source(self.frames.as_ref());
        if time == TimeSource::Count {
            return Err(
                "the pictures have no times, which a flight on recorded pictures needs; give a frames.csv with \
                        time_s or utc next to them, pictures with EXIF times, or a recording or video with times"
                    .into(),
            );
        }
        Ok(time.time_s(data, exif, 0, 1.0))
    }
}

/// Returns one byte for each pixel, row by row.
fn pixels(payload: Payload, config: &Config) -> Result<Vec<u8>, String> {
    let (picture, _) = payload.decode(Some(config))?;
    let view = picture.view(config.input.channel).map_err(|e| format!("{e} (input.channel in sensor.toml)"))?;
    Ok(match view {
        ImageView::Grey8(grey) => bytes(&grey),
        ImageView::Grey16(grey) => bytes(&grey),
        ImageView::Colour8(colour) => bytes(&colour),
        ImageView::Colour16(colour) => bytes(&colour),
    })
}

/// Reduces each sample to its eight upper bits.
fn bytes(picture: &impl Pixels) -> Vec<u8> {
    let shift = (u16::BITS - picture.full_scale().leading_zeros()).saturating_sub(8);
    let row = |y| (0..picture.width()).map(move |x| (picture.at(x, y) >> shift) as u8);
    (0..picture.height()).flat_map(row).collect()
}
