//! The arrangement of the samples of a picture, and their conversion to one byte for each pixel.

use hzn_run::source::picture;
use hzn_run::source::raw::{Format, Raw};

/// The arrangement of the samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Samples {
    /// As `hzn run --raw` has them. Words are reduced to their eight upper bits.
    Raw(Raw),
    /// Two bytes for each pixel, of which the first is the brightness (YUYV).
    Yuyv {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
}

impl Samples {
    /// Returns the number of bytes of a picture.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Raw(raw) => raw.bytes(),
            Self::Yuyv { width, height } => 2 * *width as usize * *height as usize,
        }
    }
    /// Returns the number of bytes of a row.
    pub fn row_bytes(&self) -> usize {
        self.bytes() / self.height().max(1) as usize
    }
    fn height(&self) -> u32 {
        match self {
            Self::Raw(raw) => raw.height,
            Self::Yuyv { height, .. } => *height,
        }
    }
    /// Returns whether the bytes are the pixels already.
    pub fn is_plain(&self) -> bool {
        matches!(self, Self::Raw(raw) if raw.format == Format::Mono8)
    }

    /// Converts a picture to one byte for each pixel.
    ///
    /// # Errors
    /// The number of bytes is not that of a picture.
    pub fn convert(&self, from: &[u8], into: &mut Vec<u8>) -> Result<(), String> {
        into.clear();
        match self {
            Self::Raw(raw) => {
                let shift = u32::from(raw.bits()) - 8;
                match raw.decode(from)?.samples {
                    picture::Samples::Bytes(bytes) => into.extend(bytes),
                    picture::Samples::Words(words) => into.extend(words.iter().map(|w| (w >> shift) as u8)),
                }
            }
            Self::Yuyv { .. } => {
                if from.len() != self.bytes() {
                    return Err(format!("{} bytes, but a picture has {}", from.len(), self.bytes()));
                }
                into.extend(from.iter().step_by(2));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn converted(text: &str, from: &[u8]) -> Vec<u8> {
        let mut out = vec![9; 3];
        Samples::Raw(text.parse().unwrap()).convert(from, &mut out).unwrap();
        out
    }

    #[test]
    fn every_format_becomes_one_byte_a_pixel() {
        assert_eq!(converted("2x1:mono8", &[1, 2]), [1, 2]);
        assert_eq!(converted("2x1:mono12", &[0x34, 0x02, 0xff, 0x0f]), [0x23, 0xff]);
        assert_eq!(converted("2x1:mono16", &[0x34, 0x12, 0xff, 0xff]), [0x12, 0xff]);
        assert_eq!(converted("2x1:mono12p", &[0x21, 0xa3, 0xcb]), [0x32, 0xcb]);
        assert_eq!(converted("4x2:bayer8", &[10, 20, 1, 1, 30, 40, 1, 2]), [25, 1]);
        let yuyv = Samples::Yuyv { width: 2, height: 1 };
        let mut out = Vec::new();
        yuyv.convert(&[7, 100, 8, 200], &mut out).unwrap();
        assert_eq!((out, yuyv.row_bytes()), (vec![7, 8], 4));
        assert!(yuyv.convert(&[7; 3], &mut Vec::new()).unwrap_err().contains("3 bytes, but a picture has 4"));
    }
}
