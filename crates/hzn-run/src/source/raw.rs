//! Headerless pictures: `--raw WIDTHxHEIGHT:FORMAT`.

use std::borrow::Cow;
use std::fmt;
use std::str::FromStr;

use hzn_core::image::{Channel, Layout};

use super::picture::{Picture, Samples};
use crate::error::{Error, unusable};

/// Arrangement of the samples in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// One byte a pixel.
    Mono8,
    /// Little-endian words with 10, 12 or 16 significant bits.
    Words(u8),
    /// 4 pixels in 5 bytes, least significant bits first (PFNC Mono10p).
    Mono10p,
    /// 2 pixels in 3 bytes, least significant bits first (PFNC Mono12p).
    Mono12p,
    /// Bayer mosaic, one byte a photosite, any order of colours. Each 2×2 cell becomes one pixel with its mean. The
    /// picture has half the mosaic's width and height, and so must the calibration.
    Bayer8,
}

const FORMATS: &[(&str, Format)] = &[
    ("mono8", Format::Mono8),
    ("mono10", Format::Words(10)),
    ("mono12", Format::Words(12)),
    ("mono16", Format::Words(16)),
    ("mono10p", Format::Mono10p),
    ("mono12p", Format::Mono12p),
    ("bayer8", Format::Bayer8),
];

/// Size and format of headerless pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Raw {
    /// Columns in the file.
    pub width: u32,
    /// Rows in the file.
    pub height: u32,
    /// Arrangement of the samples.
    pub format: Format,
}

impl FromStr for Raw {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let form = "WIDTHxHEIGHT:FORMAT is expected, for example 1920x1080:mono12";
        let (size, name) = text.split_once(':').ok_or(form)?;
        let (width, height) = size.split_once(['x', 'X']).ok_or(form)?;
        let side = |s: &str| s.parse::<u32>().ok().filter(|n| (1..=super::decode::MAX_SIDE_PX).contains(n));
        let (Some(width), Some(height)) = (side(width), side(height)) else {
            return Err(format!("width and height must be 1 to {}", super::decode::MAX_SIDE_PX));
        };
        let names = || FORMATS.iter().map(|(n, _)| *n);
        let Some((_, format)) = FORMATS.iter().find(|(n, _)| n.eq_ignore_ascii_case(name)) else {
            // A number of bits without a format has room in the next larger format.
            let bits = name.strip_prefix("mono").and_then(|n| n.parse::<u8>().ok()).filter(|n| (9..16).contains(n));
            let hint = match bits {
                Some(bits) => format!("; did you mean mono16, with bits = {bits} in [input] of sensor.toml?"),
                None => hzn_files::nearest(name, names()).map(|n| format!("; did you mean {n}?")).unwrap_or_default(),
            };
            return Err(format!(
                "there is no format {name:?}{hint} (the formats are {})",
                names().collect::<Vec<_>>().join(", ")
            ));
        };
        if *format == Format::Bayer8 && (width % 2 != 0 || height % 2 != 0) {
            return Err("a Bayer mosaic has an even width and height".into());
        }
        Ok(Self { width, height, format: *format })
    }
}

impl fmt::Display for Raw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = FORMATS.iter().find(|(_, x)| *x == self.format).map_or("", |(n, _)| n);
        write!(f, "{}x{}:{name}", self.width, self.height)
    }
}

impl Raw {
    /// Returns the number of bytes of one picture.
    pub fn bytes(&self) -> usize {
        let pixels = self.width as usize * self.height as usize;
        match self.format {
            Format::Mono8 | Format::Bayer8 => pixels,
            Format::Words(_) => pixels * 2,
            Format::Mono10p => (pixels * 10).div_ceil(8),
            Format::Mono12p => (pixels * 12).div_ceil(8),
        }
    }

    /// Returns the significant bits of a sample.
    pub fn bits(&self) -> u8 {
        match self.format {
            Format::Mono8 | Format::Bayer8 => 8,
            Format::Words(bits) => bits,
            Format::Mono10p => 10,
            Format::Mono12p => 12,
        }
    }

    /// Returns width and height of the decoded picture in pixels.
    pub fn size(&self) -> (u32, u32) {
        let cell = if self.format == Format::Bayer8 { 2 } else { 1 };
        (self.width / cell, self.height / cell)
    }

    /// Refuses a colour channel of pictures that have none.
    pub(super) fn check_channel(&self, channel: Channel) -> Result<(), Error> {
        if channel == Channel::Mean || self.format != Format::Bayer8 {
            return Ok(());
        }
        Err(unusable(format!(
            "raw pictures, {self}: every cell of a Bayer mosaic becomes one grey pixel; set channel = \"mean\" in \
             [input] of sensor.toml"
        )))
    }

    fn wrong_length(&self, length: usize) -> String {
        let one = self.bytes();
        let left = match (length / one, length % one) {
            (0, _) => format!("{} less", one - length),
            (n, 0) => format!("these are {n} pictures; write each into its own file"),
            (1, more) => format!("{more} bytes more"),
            (n, more) => format!("these are {n} pictures and {more} bytes more"),
        };
        let other = FORMATS.iter().map(|(name, format)| (name, Self { format: *format, ..*self }));
        let other: Vec<&str> = other.filter(|(_, raw)| raw.bytes() == length).map(|(name, _)| *name).collect();
        let hint = if other.is_empty() { String::new() } else { format!("; it fits {}", other.join(", ")) };
        format!("{length} bytes, but a picture of {self} has {one}: {left}{hint}")
    }

    /// Decodes a picture from exactly as many bytes as it has. A vector of single bytes becomes the picture without a
    /// copy.
    ///
    /// # Errors
    /// The number of bytes is different.
    pub fn decode<'a>(&self, data: impl Into<Cow<'a, [u8]>>) -> Result<Picture, String> {
        let data = data.into();
        if data.len() != self.bytes() {
            return Err(self.wrong_length(data.len()));
        }
        let pixels = self.width as usize * self.height as usize;
        let samples = match self.format {
            Format::Mono8 => Samples::Bytes(data.into_owned()),
            Format::Words(bits) => {
                // The bits above the significant ones are noise of the transport.
                let mask = u16::MAX >> (16 - bits);
                Samples::Words(data.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]]) & mask).collect())
            }
            Format::Mono10p => Samples::Words(unpack(&data, 10, pixels)),
            Format::Mono12p => Samples::Words(unpack(&data, 12, pixels)),
            Format::Bayer8 => return Ok(self.bayer(&data)),
        };
        Ok(Picture::new(samples, Layout::packed(self.width, self.height, 1, self.bits())))
    }

    fn bayer(&self, data: &[u8]) -> Picture {
        let row = self.width as usize;
        let mut out = Vec::with_capacity(data.len() / 4);
        for pair in data.chunks_exact(2 * row) {
            let (top, bottom) = pair.split_at(row);
            for (a, b) in top.chunks_exact(2).zip(bottom.chunks_exact(2)) {
                let sum: u16 = a.iter().chain(b).map(|&v| u16::from(v)).sum();
                out.push((sum / 4) as u8);
            }
        }
        let (width, height) = self.size();
        let layout = Layout::packed(width, height, 1, 8);
        Picture::new(Samples::Bytes(out), layout)
    }
}

/// Unpacks samples of `bits` bits that lie without gaps, least significant bit first.
fn unpack(data: &[u8], bits: u32, count: usize) -> Vec<u16> {
    let mut out = Vec::with_capacity(count);
    let (mut buffer, mut buffered) = (0u32, 0u32);
    for &byte in data {
        buffer |= u32::from(byte) << buffered;
        buffered += 8;
        while buffered >= bits && out.len() < count {
            out.push((buffer & ((1 << bits) - 1)) as u16);
            buffer >>= bits;
            buffered -= bits;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str, data: &[u8]) -> Vec<u16> {
        match text.parse::<Raw>().unwrap().decode(data).unwrap().samples {
            Samples::Words(w) => w,
            Samples::Bytes(b) => b.into_iter().map(u16::from).collect(),
        }
    }

    #[test]
    fn formats_by_hand() {
        assert_eq!(words("2x1:mono8", &[1, 2]), [1, 2]);
        assert_eq!(words("2x1:mono12", &[0x34, 0xf2, 0xff, 0x0f]), [0x234, 0xfff]);
        assert_eq!(words("2x1:mono16", &[0x34, 0x12, 0xff, 0xff]), [0x1234, 0xffff]);
        // 0x321 and 0xcba in three bytes are 21 a3 cb.
        assert_eq!(words("2x1:mono12p", &[0x21, 0xa3, 0xcb]), [0x321, 0xcba]);
        // 1, 2, 3, 1023 in five bytes are 01 08 30 c0 ff.
        assert_eq!(words("4x1:mono10p", &[0x01, 0x08, 0x30, 0xc0, 0xff]), [1, 2, 3, 1023]);
        assert_eq!(words("4x2:bayer8", &[10, 20, 1, 1, 30, 40, 1, 2]), [25, 1]);
    }

    #[test]
    fn wrong_forms_say_what_is_right() {
        let error = |t: &str| t.parse::<Raw>().unwrap_err();
        assert!(error("1920").contains("1920x1080:mono12"));
        assert!(error("2x2:mono21").contains("did you mean mono12?"));
        assert!(error("2x2:mono13").contains("did you mean mono16, with bits = 13 in [input]"));
        assert!(error("0x2:mono8").contains("1 to 20000"));
        assert!(error("3x2:bayer8").contains("even"));
        assert!(
            "2x2:mono16"
                .parse::<Raw>()
                .unwrap()
                .decode(&[0; 7])
                .unwrap_err()
                .contains("7 bytes, but a picture of 2x2:mono16 has 8: 1 less")
        );
    }
}
