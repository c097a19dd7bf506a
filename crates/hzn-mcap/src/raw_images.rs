//! The pixels of pictures that other programs recorded without compression, in the encodings of ROS and Foxglove.

use crate::floats::words_from_floats;
use crate::frame::{EncodedImage, ImageFormat};

/// The arrangement of the samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Whole numbers of one or two bytes: the number of channels in the message, and whether blue comes first.
    Whole { channels: usize, blue_first: bool },
    /// A mosaic of colours, two rows and columns wide.
    Bayer,
    /// Two bytes a pixel; the brightness is at this byte of the two.
    Luma { at: usize },
    /// The brightness of all pixels first, then their colours.
    Planes,
    /// Numbers with a fraction.
    Float,
}

/// The encodings: names, bytes of a sample, kind.
const ENCODINGS: &[(&[&str], usize, Kind)] = &[
    (&["mono8", "8UC1"], 1, Kind::Whole { channels: 1, blue_first: false }),
    (&["mono16", "16UC1"], 2, Kind::Whole { channels: 1, blue_first: false }),
    (&["rgb8"], 1, Kind::Whole { channels: 3, blue_first: false }),
    (&["bgr8", "8UC3"], 1, Kind::Whole { channels: 3, blue_first: true }),
    (&["rgba8"], 1, Kind::Whole { channels: 4, blue_first: false }),
    (&["bgra8", "8UC4"], 1, Kind::Whole { channels: 4, blue_first: true }),
    (&["rgb16"], 2, Kind::Whole { channels: 3, blue_first: false }),
    (&["bgr16", "16UC3"], 2, Kind::Whole { channels: 3, blue_first: true }),
    (&["rgba16"], 2, Kind::Whole { channels: 4, blue_first: false }),
    (&["bgra16", "16UC4"], 2, Kind::Whole { channels: 4, blue_first: true }),
    (&["bayer_rggb8", "bayer_bggr8", "bayer_gbrg8", "bayer_grbg8"], 1, Kind::Bayer),
    (&["bayer_rggb16", "bayer_bggr16", "bayer_gbrg16", "bayer_grbg16"], 2, Kind::Bayer),
    (&["yuv422", "uyvy"], 1, Kind::Luma { at: 1 }),
    (&["yuv422_yuy2", "yuyv"], 1, Kind::Luma { at: 0 }),
    (&["nv12", "nv21", "nv24"], 1, Kind::Planes),
    (&["32FC1"], 4, Kind::Float),
    (&["64FC1"], 8, Kind::Float),
];

/// Converts a picture with rows of `step` bytes (0: without padding) to one of the formats of hzn. An error names what
/// is not supported.
///
/// Transparency is left out. Of YUV the brightness is taken, which is linear in the colours. A Bayer mosaic becomes
/// grey, see [`grey_of_mosaic`]. Numbers with a fraction become 16 bits, see [`words_from_floats`].
pub(crate) fn raw_format(
    width: u32,
    height: u32,
    step: u32,
    encoding: &str,
    big_endian: bool,
    data: &[u8],
) -> Result<EncodedImage, String> {
    let Some((_, size, kind)) = ENCODINGS.iter().find(|(names, ..)| names.contains(&encoding)) else {
        let known: Vec<&str> = ENCODINGS.iter().filter_map(|(names, ..)| names.first().copied()).collect();
        return Err(format!("raw pictures of encoding \"{encoding}\" are not supported ({} are)", known.join(", ")));
    };
    let samples = match kind {
        Kind::Whole { channels, .. } => *channels,
        Kind::Luma { .. } => 2,
        Kind::Bayer | Kind::Planes | Kind::Float => 1,
    };
    let mut bytes = rows(data, width, height, step, samples * size)?;
    if big_endian && *size > 1 {
        bytes.chunks_exact_mut(*size).for_each(<[u8]>::reverse);
    }
    let grey = if *size == 1 { ImageFormat::Mono8 { width, height } } else { ImageFormat::Mono16 { width, height } };
    let (format, bytes) = match kind {
        Kind::Whole { channels: 1, .. } | Kind::Planes => (grey, bytes),
        Kind::Whole { channels, blue_first } => {
            let colour =
                if *size == 1 { ImageFormat::Rgb8 { width, height } } else { ImageFormat::Rgb16 { width, height } };
            let order = if *blue_first { [2, 1, 0] } else { [0, 1, 2] };
            (colour, reorder(&bytes, channels * size, *size, order))
        }
        Kind::Luma { at } => (grey, bytes.chunks_exact(2).filter_map(|pair| pair.get(*at).copied()).collect()),
        Kind::Bayer => (grey, grey_of_mosaic(&bytes, width as usize, *size)),
        Kind::Float => {
            let value = |b: &[u8]| match b.first_chunk::<8>() {
                Some(b) => f64::from_le_bytes(*b),
                None => b.first_chunk::<4>().map_or(f64::NAN, |b| f64::from(f32::from_le_bytes(*b))),
            };
            let values: Vec<f64> = bytes.chunks_exact(*size).map(value).collect();
            let words = words_from_floats(&values)?;
            (ImageFormat::Mono16 { width, height }, words.into_iter().flat_map(u16::to_le_bytes).collect())
        }
    };
    Ok(EncodedImage { format, bytes })
}

/// Returns the rows without their padding.
fn rows(data: &[u8], width: u32, height: u32, step: u32, bytes_per_pixel: usize) -> Result<Vec<u8>, String> {
    let row = (width as usize).saturating_mul(bytes_per_pixel);
    let step = if step == 0 { row } else { step as usize };
    let needed = step.saturating_mul((height as usize).saturating_sub(1)).saturating_add(row);
    if width == 0 || height == 0 || step < row || data.len() < needed {
        return Err(format!("a raw picture of {width}x{height} needs more than its {} bytes", data.len()));
    }
    Ok(data.chunks(step).take(height as usize).flat_map(|r| r.iter().take(row).copied()).collect())
}

/// Returns three samples of each pixel in this order.
fn reorder(bytes: &[u8], pixel: usize, size: usize, order: [usize; 3]) -> Vec<u8> {
    let samples = bytes.chunks_exact(pixel).flat_map(|pixel| order.map(|k| pixel.get(k * size..(k + 1) * size)));
    samples.flatten().flatten().copied().collect()
}

/// Returns a grey picture of the same size from a mosaic. Each pixel is the mean over itself and its neighbours with
/// the weights 1 2 1 in both directions. These give red 1/4, green 1/2 and blue 1/4 wherever the pixel lies in the
/// mosaic, so that the grey has no pattern, and they are symmetric, so that an edge keeps its place.
fn grey_of_mosaic(bytes: &[u8], width: usize, size: usize) -> Vec<u8> {
    let sample = |b: &[u8]| b.iter().rev().fold(0u32, |sum, byte| (sum << 8) | u32::from(*byte));
    let values: Vec<u32> = bytes.chunks_exact(size).map(sample).collect();
    let height = values.len() / width.max(1);
    let at = |x: usize, y: usize| values.get(y * width + x).copied().unwrap_or_default();
    // At the border the neighbour on the other side counts twice: it has the same colour as the missing one.
    let around = |i: usize, n: usize| {
        let inner = |j: usize| if j < n { j } else { n.saturating_sub(2).min(i) };
        [(i.checked_sub(1).unwrap_or(1.min(n - 1)), 1), (i, 2), (inner(i + 1), 1)]
    };
    let mut grey = Vec::with_capacity(bytes.len());
    for y in 0..height {
        for x in 0..width {
            let row = |y: usize| around(x, width).iter().map(|(x, weight)| weight * at(*x, y)).sum::<u32>();
            let sum: u32 = around(y, height).iter().map(|(y, weight)| weight * row(*y)).sum();
            grey.extend_from_slice(((sum + 8) / 16).to_le_bytes().get(..size).unwrap_or_default());
        }
    }
    grey
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(size: (u32, u32), encoding: &str, data: &[u8]) -> EncodedImage {
        raw_format(size.0, size.1, 0, encoding, false, data).unwrap()
    }

    #[test]
    fn rows_colours_and_byte_orders() {
        let image = raw_format(2, 2, 3, "mono8", false, &[1, 2, 9, 3, 4]).unwrap();
        assert_eq!(image.bytes, [1, 2, 3, 4]);
        assert_eq!(read((1, 1), "bgr8", &[1, 2, 3]).bytes, [3, 2, 1]);
        assert_eq!(read((1, 1), "bgra8", &[1, 2, 3, 4]).bytes, [3, 2, 1]);
        assert_eq!(read((2, 1), "rgba8", &[1, 2, 3, 4, 5, 6, 7, 8]).bytes, [1, 2, 3, 5, 6, 7]);
        assert_eq!(raw_format(1, 1, 2, "mono16", true, &[1, 2]).unwrap().bytes, [2, 1]);
        let wide = raw_format(1, 1, 0, "bgr16", true, &[1, 2, 3, 4, 5, 6]).unwrap();
        assert_eq!((wide.format, wide.bytes), (ImageFormat::Rgb16 { width: 1, height: 1 }, vec![6, 5, 4, 3, 2, 1]));
        assert!(raw_format(u32::MAX, u32::MAX, u32::MAX, "mono8", false, &[1]).is_err());
        assert!(raw_format(0, 2, 0, "mono8", false, &[]).is_err());
        assert!(raw_format(2, 2, 2, "32SC1", false, &[0; 16]).unwrap_err().contains("bayer_rggb8"));
    }

    #[test]
    fn brightness_of_yuv() {
        assert_eq!(read((2, 1), "yuv422", &[128, 10, 128, 20]).bytes, [10, 20]);
        assert_eq!(read((2, 1), "yuv422_yuy2", &[10, 128, 20, 128]).bytes, [10, 20]);
        assert_eq!(read((2, 2), "nv21", &[1, 2, 3, 4, 128, 128]).bytes, [1, 2, 3, 4]);
    }

    #[test]
    fn a_mosaic_of_one_colour_is_one_grey_everywhere() {
        // Red 100, green 40, blue 20: the grey is 25 + 20 + 5.
        let rggb = |x: usize, y: usize| [100u8, 40, 40, 20][2 * (y % 2) + x % 2];
        let data: Vec<u8> = (0..4).flat_map(|y| (0..6).map(move |x| rggb(x, y))).collect();
        assert_eq!(read((6, 4), "bayer_rggb8", &data).bytes, [50; 24]);
        let words: Vec<u8> = data.iter().flat_map(|v| (u16::from(*v) * 256).to_le_bytes()).collect();
        assert_eq!(read((6, 4), "bayer_rggb16", &words).bytes, [0, 50].repeat(24));
        // An edge of a grey body stays where it is: the profile across it is symmetric.
        let edge: Vec<u8> = (0..4).flat_map(|_| [0, 0, 0, 160, 160, 160]).collect();
        assert_eq!(read((6, 4), "bayer_grbg8", &edge).bytes[6..12], [0, 0, 40, 120, 160, 160]);
    }

    #[test]
    fn numbers_with_a_fraction_keep_their_places() {
        let floats = [-40.0f32, 20.0, f32::NAN, -10.0].map(f32::to_le_bytes).concat();
        let words = read((4, 1), "32FC1", &floats).bytes;
        let words: Vec<u16> = words.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
        assert_eq!(words, [8192, 57344, 8192, 32768]);
        assert_eq!(read((1, 2), "64FC1", &[1.0, 2.0f64].map(f64::to_le_bytes).concat()).bytes, [0, 0x20, 0, 0xe0]);
        assert!(words_from_floats(&[1.0, 1.0]).is_err() && words_from_floats(&[f64::NAN]).is_err());
        assert!(words_from_floats(&[f64::MIN, f64::MAX]).is_err());
    }
}
