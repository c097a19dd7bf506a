//! Headerless pictures one after another on standard input.

use std::io::{self, Read};
use std::path::PathBuf;

use hzn_core::image::Channel;
use hzn_core::tone::Tone;

use super::item::{Item, TimeSource};
use super::payload::Payload;
use super::raw::{Format, Raw};
use super::sequence::Source;
use super::tone::FoundTone;
use crate::error::{Error, failed, unusable};

/// Pictures of a stream. They are named after it: `stdin#000012`.
pub(super) struct Stream<R> {
    input: R,
    raw: Raw,
    /// The first picture. It is read early, so that an empty stream is refused at once.
    first: Option<Vec<u8>>,
    index: u64,
    /// Number of bytes of a last picture that is not complete.
    cut_off_bytes: usize,
}

impl<R: Read + Send> Stream<R> {
    pub(super) fn open(input: R, raw: Raw) -> Result<Self, Error> {
        let mut stream = Self { input, raw, first: None, index: 0, cut_off_bytes: 0 };
        stream.first = stream.read().map_err(cannot_read)?;
        if stream.first.is_none() {
            let (cut_off, one) = (stream.cut_off_bytes, raw.bytes());
            let what = format!("standard input ends after {cut_off} bytes, but a picture of {raw} has {one}");
            return Err(unusable(what));
        }
        Ok(stream)
    }

    /// Reads the bytes of a picture; `None` at the end of the stream.
    fn read(&mut self) -> io::Result<Option<Vec<u8>>> {
        let mut bytes = Vec::new();
        self.input.by_ref().take(self.raw.bytes() as u64).read_to_end(&mut bytes)?;
        if bytes.len() == self.raw.bytes() {
            return Ok(Some(bytes));
        }
        self.cut_off_bytes = bytes.len();
        Ok(None)
    }

    fn payload(&self, bytes: Vec<u8>) -> Payload {
        self.raw.decode(bytes).map_or_else(Payload::Broken, Payload::Decoded)
    }
}

fn cannot_read(error: io::Error) -> Error {
    failed(format!("standard input cannot be read: {error}"))
}

impl<R: Read + Send> Source for Stream<R> {
    fn next(&mut self) -> Option<Result<Item, Error>> {
        let bytes = match self.first.take() {
            Some(bytes) => bytes,
            None => match self.read() {
                Ok(bytes) => bytes?,
                Err(e) => return Some(Err(cannot_read(e))),
            },
        };
        let name = format!("stdin#{:06}", self.index);
        self.index += 1;
        Some(Ok(Item { name, time: TimeSource::Count, stamp: None, data: None, payload: self.payload(bytes) }))
    }
    fn total(&self) -> Option<u64> {
        None
    }
    fn sizes(&self) -> Box<dyn Iterator<Item = (String, (u32, u32))> + '_> {
        Box::new(std::iter::once(("stdin#000000".to_owned(), self.raw.size())))
    }
    fn folder(&self) -> PathBuf {
        PathBuf::new()
    }
    fn bits(&self) -> Option<u8> {
        // Words of mono16 can have any number of significant bits.
        Some(self.raw.bits()).filter(|_| self.raw.format != Format::Words(16))
    }
    fn tone(&self) -> Option<FoundTone> {
        // A picture without a header comes from a detector as it is.
        Some(FoundTone { tone: Tone::Linear, kind: "raw" })
    }
    fn samples(&self) -> Box<dyn Iterator<Item = Payload> + '_> {
        // A stream cannot be read twice, so only its first picture can be a sample.
        Box::new(self.first.iter().map(|bytes| self.payload(bytes.clone())))
    }
    fn want_channel(&mut self, channel: Channel) -> Result<(), Error> {
        self.raw.check_channel(channel)
    }
    fn describe_loss(&self) -> Option<String> {
        let (cut_off, one) = (self.cut_off_bytes, self.raw.bytes());
        (cut_off > 0).then(|| format!("the last picture of standard input is cut off: {cut_off} of {one} bytes"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_is_divided_into_pictures() {
        let raw: Raw = "2x1:mono16".parse().unwrap();
        let mut stream = Stream::open([1, 0, 2, 0, 3, 0, 4, 1, 9].as_slice(), raw).unwrap();
        assert_eq!(stream.sizes().collect::<Vec<_>>(), [("stdin#000000".to_owned(), (2, 1))]);
        assert_eq!(stream.samples().count(), 1);
        let mut largest = Vec::new();
        while let Some(item) = stream.next() {
            let item = item.unwrap();
            let (picture, _) = item.payload.decode(None).unwrap();
            largest.push((item.name, picture.largest_word()));
        }
        assert_eq!(largest, [("stdin#000000".to_owned(), Some(2)), ("stdin#000001".to_owned(), Some(260))]);
        assert_eq!(stream.describe_loss().unwrap(), "the last picture of standard input is cut off: 1 of 4 bytes");
    }

    #[test]
    fn a_stream_without_a_picture_is_refused() {
        let raw: Raw = "2x2:mono8".parse().unwrap();
        let error = Stream::open([1, 2, 3].as_slice(), raw).err().unwrap().to_string();
        assert_eq!(error, "standard input ends after 3 bytes, but a picture of 2x2:mono8 has 4");
    }
}
