//! The interface of a sequence of pictures.

use std::path::PathBuf;

use hzn_core::image::Channel;

use super::item::Item;
use super::payload::Payload;
use super::tone::FoundTone;
use super::video::measured::Measured;
use crate::error::Error;

/// Largest number of pictures whose headers [`Source::sizes`] reads.
pub(super) const MAX_SIZES_READ: usize = 32;

/// A sequence of pictures in order.
pub trait Source: Send {
    /// Returns the next picture; `None` at the end. An error ends the sequence.
    fn next(&mut self) -> Option<Result<Item, Error>>;
    /// Returns the number of pictures, if it is known before.
    fn total(&self) -> Option<u64>;
    /// Returns the names of all pictures, if they are known before.
    fn names(&self) -> Option<Box<dyn Iterator<Item = String> + '_>> {
        None
    }
    /// Returns names and sizes (width, height in pixels) of some of the pictures, from their headers alone. Pictures
    /// with unreadable headers are left out.
    fn sizes(&self) -> Box<dyn Iterator<Item = (String, (u32, u32))> + '_>;
    /// Returns the file of a picture, if this file can be processed alone with the sensor.toml and frames.csv next to
    /// it.
    fn path(&self, _frame: u64) -> Option<PathBuf> {
        None
    }
    /// Returns the folder in which frames.csv and sensor.toml may lie.
    fn folder(&self) -> PathBuf;
    /// Returns the files that the pictures are read from, so that no output replaces one of them.
    fn files(&self) -> Vec<PathBuf> {
        Vec::new()
    }
    /// Returns the text of the sensor.toml that the pictures were recorded with. A source that has one also knows the
    /// content of frames.csv ([`Item::data`]).
    fn sensor_toml(&self) -> Option<&str> {
        None
    }
    /// Returns the significant bits of a sample, if they are known before.
    fn bits(&self) -> Option<u8> {
        None
    }
    /// Returns the tone, if it is known for all pictures before they are read.
    fn tone(&self) -> Option<FoundTone> {
        None
    }
    /// Returns a few pictures from the whole sequence, for properties that only the samples show
    /// ([`find_bits`](super::find_bits)). The choice depends only on their places, so the same sequence gives the same
    /// pictures.
    fn samples(&self) -> Box<dyn Iterator<Item = Payload> + '_> {
        Box::new(std::iter::empty())
    }
    /// Returns the name of the first picture that is to be shown turned, and the turn in words, as its camera recorded
    /// it.
    fn display_turn(&self) -> Option<(String, &'static str)> {
        None
    }
    /// Returns the width of a pixel over its height, as the container says it. A lens with fx = fy needs 1.
    fn pixel_aspect(&self) -> f64 {
        1.0
    }
    /// Returns what the camera measured while it filmed, which gives the pictures their prior ([`Item::data`]).
    fn measured(&self) -> Option<&Measured> {
        None
    }
    /// Announces that a colour channel is wanted. Some sources must know this before they read.
    ///
    /// # Errors
    /// The source has no colours.
    fn want_channel(&mut self, _channel: Channel) -> Result<(), Error> {
        Ok(())
    }
    /// Returns notes for the user, for example about files that were left out.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }
    /// Returns what could not be handed out, after the last picture.
    fn describe_loss(&self) -> Option<String> {
        None
    }
}
