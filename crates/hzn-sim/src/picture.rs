//! A rendered picture in memory and as a file.

use std::borrow::Cow;
use std::path::Path;

use image::ExtendedColorType;

use hzn_core::image::{Channel, ImageView, Layout};

/// Samples of a picture, row by row without padding.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Samples {
    /// One byte per sample.
    Bytes(Vec<u8>),
    /// One 16-bit word per sample. The value is not shifted up, so 12 bits reach 4095.
    Words(Vec<u16>),
}

/// A picture, grey or in three colours.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    pub(crate) width: u16,
    pub(crate) height: u16,
    /// Samples per pixel: 1, or 3 for red, green, blue.
    pub(crate) channels: u8,
    pub(crate) bits: u8,
    pub(crate) samples: Samples,
}

impl Picture {
    /// Returns the number of columns.
    pub fn width(&self) -> u16 {
        self.width
    }
    /// Returns the number of rows.
    pub fn height(&self) -> u16 {
        self.height
    }
    /// Returns the samples per pixel: 1 is grey, 3 is red, green, blue.
    pub fn channels(&self) -> u8 {
        self.channels
    }
    /// Returns the significant bits of a sample, 8 to 16.
    pub fn bits(&self) -> u8 {
        self.bits
    }
    /// Returns the samples.
    pub fn samples(&self) -> &Samples {
        &self.samples
    }
    /// Returns the value at column `x`, row `y`; in a colour picture the mean of the colours. Outside the picture it is
    /// 0.
    pub fn at(&self, x: u16, y: u16) -> u16 {
        if x >= self.width || y >= self.height {
            return 0;
        }
        let n = usize::from(self.channels);
        let i = (usize::from(y) * usize::from(self.width) + usize::from(x)) * n;
        let sum: u32 = match &self.samples {
            Samples::Bytes(data) => data[i..i + n].iter().map(|&v| u32::from(v)).sum(),
            Samples::Words(data) => data[i..i + n].iter().map(|&v| u32::from(v)).sum(),
        };
        (sum / u32::from(self.channels)) as u16
    }

    /// Returns the picture in the form that hzn-core reads.
    pub fn view(&self) -> ImageView<'_> {
        let layout = Layout::packed(self.width.into(), self.height.into(), self.channels, self.bits);
        match &self.samples {
            Samples::Bytes(data) => ImageView::from_bytes(data, layout, Channel::Mean),
            Samples::Words(data) => ImageView::from_words(data, layout, Channel::Mean),
        }
        .expect("a rendered picture is as large as it says")
    }

    /// Writes the picture; the ending of the name sets the format. A picture with 8 bits is written with 8 bits, others
    /// with 16. Samples of 10 and 12 bits are spread over 16 bits, because readers know no other full scale.
    ///
    /// # Errors
    /// Fails if the file cannot be written, or if the format of the ending does not have this many bits.
    pub fn save(&self, path: &Path) -> Result<(), image::ImageError> {
        Ok(std::fs::write(path, self.encode(path)?)?)
    }

    /// Encodes the picture as [`Self::save`] does; the ending of the name sets the format.
    ///
    /// # Errors
    /// Fails if the format of the ending does not have this many bits.
    pub fn encode(&self, name: &Path) -> Result<Vec<u8>, image::ImageError> {
        let (w, h) = (self.width.into(), self.height.into());
        let grey = self.channels == 1;
        let format = image::ImageFormat::from_path(name)?;
        let mut file = std::io::Cursor::new(Vec::new());
        let mut write = |data: &[u8], colour| image::write_buffer_with_format(&mut file, data, w, h, colour, format);
        match &self.samples {
            Samples::Bytes(data) => {
                let colour = if grey { ExtendedColorType::L8 } else { ExtendedColorType::Rgb8 };
                write(data, colour)
            }
            Samples::Words(data) => {
                // The upper bits are repeated below, so full scale stays full scale.
                let spread =
                    |v: u16| ((u32::from(v) << (16 - self.bits)) | (u32::from(v) >> (2 * self.bits - 16))) as u16;
                let bytes: Vec<u8> = data.iter().flat_map(|&v| spread(v).to_ne_bytes()).collect();
                let colour = if grey { ExtendedColorType::L16 } else { ExtendedColorType::Rgb16 };
                write(&bytes, colour)
            }
        }?;
        Ok(file.into_inner())
    }

    /// Encodes the picture as a JPEG file of this quality, 1 to 100. Samples with more than 8 bits are cut to 8.
    ///
    /// # Errors
    /// Fails if the encoder refuses the picture.
    pub fn encode_jpeg(&self, quality: u8) -> Result<Vec<u8>, image::ImageError> {
        let mut file = Vec::new();
        let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut file, quality.clamp(1, 100));
        let colour = if self.channels == 1 { ExtendedColorType::L8 } else { ExtendedColorType::Rgb8 };
        let bytes: Cow<'_, [u8]> = match &self.samples {
            Samples::Bytes(data) => Cow::Borrowed(data),
            Samples::Words(data) => Cow::Owned(data.iter().map(|v| (v >> (self.bits - 8)) as u8).collect()),
        };
        encoder.encode(&bytes, self.width.into(), self.height.into(), colour)?;
        Ok(file)
    }

    /// Returns the picture as it is read back from a JPEG file of this quality.
    ///
    /// # Errors
    /// Fails like [`Picture::encode_jpeg`].
    pub fn with_jpeg_losses(&self, quality: u8) -> Result<Self, image::ImageError> {
        let read = image::load_from_memory_with_format(&self.encode_jpeg(quality)?, image::ImageFormat::Jpeg)?;
        let data = if self.channels == 1 { read.into_luma8().into_raw() } else { read.into_rgb8().into_raw() };
        Ok(Self { bits: 8, samples: Samples::Bytes(data), ..*self })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_core::image::Pixels;

    #[test]
    fn written_and_read_back() {
        let dir = tempfile::tempdir().unwrap();
        let bytes = Picture {
            width: 3,
            height: 2,
            channels: 1,
            bits: 8,
            samples: Samples::Bytes(vec![0, 1, 2, 253, 254, 255]),
        };
        let words = Picture {
            width: 3,
            height: 2,
            channels: 1,
            bits: 12,
            samples: Samples::Words(vec![0, 1, 2, 4093, 4094, 4095]),
        };
        let path = dir.path().join("a.png");
        // The decoders of memory are compiled in `image`, those of `image::open` would be compiled here.
        let read = |path: &Path| image::load_from_memory(&std::fs::read(path).unwrap()).unwrap();
        bytes.save(&path).unwrap();
        assert_eq!(read(&path).into_luma8().into_raw(), [0, 1, 2, 253, 254, 255]);
        words.save(&path).unwrap();
        assert_eq!(read(&path).into_luma16().into_raw(), [0, 16, 32, 65503, 65519, 65535]);
        assert_eq!((words.view().full_scale(), words.view().at(2, 1), words.at(2, 1)), (4095, 4095, 4095));
        assert_eq!(words.at(3, 0), 0);
    }

    #[test]
    fn jpeg_loses_a_little() {
        let samples = Samples::Bytes((0..3 * 64 * 48).map(|i| 40 + (i / 3 % 64) as u8 * 3).collect());
        let picture = Picture { width: 64, height: 48, channels: 3, bits: 8, samples };
        let worst = |quality| {
            let back = picture.with_jpeg_losses(quality).unwrap();
            assert_eq!((back.width, back.height, back.channels, back.bits), (64, 48, 3, 8));
            let off = |x, y| back.at(x, y).abs_diff(picture.at(x, y));
            (0..48).flat_map(|y| (0..64).map(move |x| (x, y))).map(|(x, y)| off(x, y)).max().unwrap()
        };
        let (fine, coarse) = (worst(95), worst(10));
        assert!(fine <= 4 && coarse > fine, "{fine} {coarse}");
    }
}
