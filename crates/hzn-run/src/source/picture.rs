//! Decoded pictures.

use std::hash::{DefaultHasher, Hash, Hasher};

use hzn_core::image::{Channel, ImageError, ImageView, Layout};
use image::metadata::Orientation;

use super::levels::Levels;

/// Samples of a picture, packed.
#[derive(Debug, Clone)]
pub enum Samples {
    /// 8 bits.
    Bytes(Vec<u8>),
    /// 9 to 16 bits.
    Words(Vec<u16>),
}

/// A picture in memory.
#[derive(Debug, Clone)]
pub struct Picture {
    /// The samples.
    pub samples: Samples,
    /// Their arrangement.
    pub layout: Layout,
    /// Time of exposure from EXIF, in seconds since 1970. EXIF has no time zone: UTC is assumed.
    pub exif_time_s: Option<f64>,
    /// The turn that is needed to show the picture upright, as the camera recorded it.
    pub orientation: Orientation,
    /// Number of pictures in the file; this is the first of them.
    pub pages: u32,
    /// Whether it is a frame of a video, in which a part of an earlier frame may be copied.
    pub is_video_frame: bool,
}

impl Picture {
    /// Makes a picture that does not come from a file.
    pub fn new(samples: Samples, layout: Layout) -> Self {
        Self {
            samples,
            layout,
            exif_time_s: None,
            orientation: Orientation::NoTransforms,
            pages: 1,
            is_video_frame: false,
        }
    }

    /// Returns the largest sample of a picture of words, without the transparency channel.
    pub fn largest_word(&self) -> Option<u16> {
        self.words()?.max()
    }

    /// Returns the levels of a picture of words, without the transparency channel.
    pub fn levels(&self) -> Option<Levels> {
        self.words().map(Levels::from_iter)
    }

    /// Returns the samples of a picture of words, without the transparency channel.
    fn words(&self) -> Option<impl Iterator<Item = u16>> {
        let Samples::Words(words) = &self.samples else { return None };
        let channels = usize::from(self.layout.channels.max(1));
        let bright = if channels.is_multiple_of(2) { channels - 1 } else { channels };
        Some(words.chunks_exact(channels).flat_map(move |pixel| pixel.iter().take(bright)).copied())
    }

    /// Returns the sum of the colours of a pixel, without transparency; 0 outside of the picture.
    pub(crate) fn brightness(&self, x: u32, y: u32) -> f64 {
        let channels = usize::from(self.layout.channels);
        let from = y as usize * self.layout.stride + x as usize * channels;
        // A second or a fourth channel is transparency.
        let colours = from..from + channels.max(1) - usize::from(channels.is_multiple_of(2));
        match &self.samples {
            Samples::Bytes(d) => d.get(colours).unwrap_or_default().iter().map(|&v| f64::from(v)).sum(),
            Samples::Words(d) => d.get(colours).unwrap_or_default().iter().map(|&v| f64::from(v)).sum(),
        }
    }

    /// Returns a digest of the samples and their arrangement. Pictures with the same digest are the same to the last
    /// bit: of a million different ones, two have the same digest with a probability of 10⁻⁷.
    pub fn digest(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        (self.layout.width, self.layout.height, self.layout.channels, self.layout.bits).hash(&mut hasher);
        match &self.samples {
            Samples::Bytes(bytes) => bytes.hash(&mut hasher),
            Samples::Words(words) => words.hash(&mut hasher),
        }
        hasher.finish()
    }

    /// Returns a checksum of the samples. Two pictures of a camera with noise have the same one with a probability of
    /// 2⁻³²; it takes a tenth of the time of [`Self::digest`].
    pub fn checksum(&self) -> u32 {
        match &self.samples {
            Samples::Bytes(bytes) => crc32fast::hash(bytes),
            Samples::Words(words) => {
                let mut hasher = crc32fast::Hasher::new();
                let mut block = [0_u8; 4096];
                for part in words.chunks(block.len() / 2) {
                    let bytes = block.chunks_exact_mut(2).zip(part);
                    bytes.for_each(|(bytes, word)| bytes.copy_from_slice(&word.to_le_bytes()));
                    hasher.update(block.get(..2 * part.len()).unwrap_or_default());
                }
                hasher.finalize()
            }
        }
    }

    /// Returns advice for a picture without an answer: its upper bits are all unused though the number of bits is not
    /// known, its samples have more bits than were told, or few numbers set the scale of the others.
    pub fn doubt_samples(&self) -> Option<String> {
        let Samples::Words(words) = &self.samples else { return None };
        match self.layout.bits {
            16 => hzn_mcap::doubt_scale(words).or_else(|| self.levels()?.advice()),
            bits => self.levels()?.exceed(bits),
        }
    }

    /// Returns a view of the picture for the pipeline.
    ///
    /// # Errors
    /// The picture does not have this channel.
    pub fn view(&self, channel: Channel) -> Result<ImageView<'_>, ImageError> {
        match &self.samples {
            Samples::Bytes(data) => ImageView::from_bytes(data, self.layout, channel),
            Samples::Words(data) => ImageView::from_words(data, self.layout, channel),
        }
    }

    /// Returns the picture as 8-bit RGB, to draw on. Pictures of more than 8 bits are scaled down.
    pub fn to_rgb(&self) -> image::RgbImage {
        let (w, h, n) = (self.layout.width, self.layout.height, usize::from(self.layout.channels));
        let shift = self.layout.bits.saturating_sub(8);
        let byte = |i: usize| match &self.samples {
            Samples::Bytes(d) => d.get(i).copied().unwrap_or(0),
            Samples::Words(d) => d.get(i).map_or(0, |&v| (v >> shift) as u8),
        };
        image::RgbImage::from_fn(w, h, |x, y| {
            let at = (y as usize * w as usize + x as usize) * n;
            image::Rgb(if n >= 3 { [byte(at), byte(at + 1), byte(at + 2)] } else { [byte(at); 3] })
        })
    }

    /// Returns the picture as PNG bytes, grey or colour, 8 or 16 bits. Words of 9 to 15 bits keep their counts.
    ///
    /// # Errors
    /// The message of the encoder.
    pub fn to_png(&self) -> Result<Vec<u8>, String> {
        use image::ExtendedColorType as C;
        use image::codecs::png::{CompressionType, FilterType, PngEncoder};
        let mut out = Vec::new();
        let color = match (self.layout.channels, &self.samples) {
            (1, Samples::Bytes(_)) => C::L8,
            (2, Samples::Bytes(_)) => C::La8,
            (3, Samples::Bytes(_)) => C::Rgb8,
            (_, Samples::Bytes(_)) => C::Rgba8,
            (1, Samples::Words(_)) => C::L16,
            (2, Samples::Words(_)) => C::La16,
            (3, Samples::Words(_)) => C::Rgb16,
            (_, Samples::Words(_)) => C::Rgba16,
        };
        let words;
        let data = match &self.samples {
            Samples::Bytes(d) => d.as_slice(),
            Samples::Words(d) => {
                words = d.iter().flat_map(|w| w.to_ne_bytes()).collect::<Vec<u8>>();
                &words
            }
        };
        let encoder = PngEncoder::new_with_quality(&mut out, CompressionType::Fast, FilterType::Sub);
        image::ImageEncoder::write_image(encoder, data, self.layout.width, self.layout.height, color)
            .map_err(|e| e.to_string())?;
        Ok(out)
    }
}
