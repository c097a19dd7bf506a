//! A rendered picture in memory and as a file.

use std::path::Path;

use hzn_core::image::{Channel, ImageView, Layout};

/// Samples of a picture, row by row without padding.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Samples {
    /// One byte a pixel.
    Bytes(Vec<u8>),
    /// One 16-bit word a pixel; the value is not shifted up, so that 12 bits reach 4095.
    Words(Vec<u16>),
}

/// A grey picture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    pub(crate) width: u16,
    pub(crate) height: u16,
    pub(crate) bits: u8,
    pub(crate) samples: Samples,
}

impl Picture {
    /// Columns.
    pub fn width(&self) -> u16 {
        self.width
    }
    /// Rows.
    pub fn height(&self) -> u16 {
        self.height
    }
    /// Significant bits of a sample, 8 to 16.
    pub fn bits(&self) -> u8 {
        self.bits
    }
    /// The samples.
    pub fn samples(&self) -> &Samples {
        &self.samples
    }
    /// Value at column `x`, row `y`; 0 outside the picture.
    pub fn at(&self, x: u16, y: u16) -> u16 {
        if x >= self.width || y >= self.height {
            return 0;
        }
        let i = usize::from(y) * usize::from(self.width) + usize::from(x);
        match &self.samples {
            Samples::Bytes(data) => data[i].into(),
            Samples::Words(data) => data[i],
        }
    }

    /// The picture as hzn-core reads it.
    pub fn view(&self) -> ImageView<'_> {
        let layout = Layout::packed(self.width.into(), self.height.into(), 1, self.bits);
        match &self.samples {
            Samples::Bytes(data) => ImageView::from_bytes(data, layout, Channel::Mean),
            Samples::Words(data) => ImageView::from_words(data, layout, Channel::Mean),
        }
        .expect("a rendered picture is as large as it says")
    }

    /// Writes the picture: 8 bits as 8, more as 16, where samples of 10 and 12 bits keep their values. The format
    /// follows the ending of the name.
    ///
    /// # Errors
    /// The file cannot be written, or its ending is not that of a format with this many bits.
    pub fn save(&self, path: &Path) -> Result<(), image::ImageError> {
        let (w, h) = (self.width.into(), self.height.into());
        let (bytes, colour): (Vec<u8>, _) = match &self.samples {
            Samples::Bytes(data) => return image::save_buffer(path, data, w, h, image::ExtendedColorType::L8),
            Samples::Words(data) => {
                (data.iter().flat_map(|v| v.to_ne_bytes()).collect(), image::ExtendedColorType::L16)
            }
        };
        image::save_buffer(path, &bytes, w, h, colour)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_core::image::Pixels;

    #[test]
    fn written_and_read_back() {
        let dir = tempfile::tempdir().unwrap();
        let bytes = Picture { width: 3, height: 2, bits: 8, samples: Samples::Bytes(vec![0, 1, 2, 253, 254, 255]) };
        let words = Picture { width: 3, height: 2, bits: 12, samples: Samples::Words(vec![0, 1, 2, 4093, 4094, 4095]) };
        let path = dir.path().join("a.png");
        bytes.save(&path).unwrap();
        assert_eq!(image::open(&path).unwrap().into_luma8().into_raw(), [0, 1, 2, 253, 254, 255]);
        words.save(&path).unwrap();
        assert_eq!(image::open(&path).unwrap().into_luma16().into_raw(), [0, 1, 2, 4093, 4094, 4095]);
        assert_eq!((words.view().full_scale(), words.view().at(2, 1), words.at(2, 1)), (4095, 4095, 4095));
        assert_eq!(words.at(3, 0), 0);
    }
}
