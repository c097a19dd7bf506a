//! The curve between light and counts, as the header of a picture file says it.

use std::io::{Read, Seek, SeekFrom};

use hzn_core::tone::Tone;
use image::{ImageDecoder, ImageFormat};

use super::picture_reader::picture_reader;
use super::{exif, header, webp};

/// First bytes of a PNG.
const SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

/// A tone, and what says so.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoundTone {
    /// The tone.
    pub tone: Tone,
    /// The kind of pictures, for a sentence that begins with "the pictures are".
    pub kind: &'static str,
}

/// Returns what the contents of a picture file say about its tone.
pub(super) fn read(mut contents: impl Read + Seek) -> Option<FoundTone> {
    let found = |tone, kind| Some(FoundTone { tone, kind });
    let format = picture_reader(&mut contents).ok()?.format();
    contents.rewind().ok()?;
    let Some(format) = format else {
        return if header::has_words(contents) { found(Tone::Linear, "of more than 8 bits") } else { None };
    };
    contents.rewind().ok()?;
    if format == ImageFormat::Png
        && let Some(tone) = read_png_chunks(&mut contents)
    {
        return found(tone, "PNG with the tone in their header");
    }
    contents.rewind().ok()?;
    // EXIF calls every space but sRGB "uncalibrated"; the usual one, Adobe RGB, has nearly the same curve.
    if format == ImageFormat::Jpeg {
        return found(Tone::Srgb, "JPEG");
    }
    if format == ImageFormat::WebP && webp::is_lossy(&mut contents) {
        return found(Tone::Srgb, "lossy WebP");
    }
    contents.rewind().ok()?;
    if header::has_words(&mut contents) {
        return found(Tone::Linear, "of more than 8 bits");
    }
    contents.rewind().ok()?;
    let mut decoder = picture_reader(contents).ok()?.into_decoder().ok()?;
    let says_srgb = decoder.exif_metadata().ok().flatten().is_some_and(exif::is_srgb);
    if says_srgb { found(Tone::Srgb, "in sRGB (EXIF)") } else { None }
}

/// Returns the tone that the chunks before the pixels of a PNG say. Of several, cICP counts before sRGB, and sRGB
/// before gAMA (PNG specification, third edition, 4.3). A colour profile (iCCP) is not read.
fn read_png_chunks(contents: &mut (impl Read + Seek)) -> Option<Tone> {
    let mut start = [0; SIGNATURE.len()];
    contents.read_exact(&mut start).ok()?;
    let (mut coded, [mut srgb, mut gamma]) = (None, [None; 2]);
    let mut head = [0; 8];
    while start == SIGNATURE && contents.read_exact(&mut head).is_ok() {
        let [a, b, c, d, kind @ ..] = head;
        let length = u32::from_be_bytes([a, b, c, d]);
        let mut data = [0; 4];
        match &kind {
            b"IDAT" => break,
            b"sRGB" => srgb = Some(Tone::Srgb),
            b"cICP" | b"gAMA" if length == 4 => {
                contents.read_exact(&mut data).ok()?;
                contents.seek(SeekFrom::Current(-4)).ok()?;
                if kind == *b"gAMA" {
                    // The chunk has the exponent from light to counts, times 100 000; gamma is its inverse.
                    let exponent = f64::from(u32::from_be_bytes(data)) * 1e-5;
                    gamma = Some(exponent).filter(|x| (0.2..=5.0).contains(x)).map(|x| Tone::Gamma(1.0 / x));
                } else {
                    coded = Some(transfer(data[1]));
                }
            }
            _ => {}
        }
        // A checksum of four bytes ends each chunk.
        contents.seek(SeekFrom::Current(i64::from(length) + 4)).ok()?;
    }
    // A curve that is none of ours (PQ, HLG) is not that of another chunk.
    coded.unwrap_or_else(|| srgb.or(gamma))
}

/// Returns the curve of a code of ITU-T H.273, table 3.
fn transfer(code: u8) -> Option<Tone> {
    match code {
        1 | 6 | 14 | 15 => Some(Tone::Bt709),
        4 => Some(Tone::Gamma(2.2)),
        5 => Some(Tone::Gamma(2.8)),
        8 => Some(Tone::Linear),
        13 => Some(Tone::Srgb),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use image::{DynamicImage, GrayImage, ImageBuffer, Luma, RgbImage};

    use super::*;

    fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    fn grey(format: ImageFormat) -> Vec<u8> {
        encoded(&DynamicImage::ImageLuma8(GrayImage::new(8, 6)), format)
    }

    /// Returns a grey PNG of 8 bits with these chunks behind its header, which has 33 bytes with the signature. The
    /// checksums are not read.
    fn png_with(chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
        let mut png = grey(ImageFormat::Png);
        let chunk = |(kind, data): &(&[u8; 4], &[u8])| {
            [&(data.len() as u32).to_be_bytes()[..], &kind[..], data, b"sums"].concat()
        };
        let added: Vec<u8> = chunks.iter().flat_map(chunk).collect();
        png.splice(33..33, added);
        png
    }

    fn tone(bytes: &[u8]) -> Option<Tone> {
        read(Cursor::new(bytes)).map(|found| found.tone)
    }

    #[test]
    fn the_file_says_its_tone() {
        let words: ImageBuffer<Luma<u16>, Vec<u16>> = ImageBuffer::new(8, 6);
        let colour = encoded(&DynamicImage::ImageRgb8(RgbImage::new(8, 6)), ImageFormat::Jpeg);
        assert_eq!((tone(&grey(ImageFormat::Jpeg)), tone(&colour)), (Some(Tone::Srgb), Some(Tone::Srgb)));
        // A lossless WebP says as little as a PNG.
        assert_eq!(tone(&encoded(&DynamicImage::ImageRgb8(RgbImage::new(8, 6)), ImageFormat::WebP)), None);
        for format in [ImageFormat::Png, ImageFormat::Tiff, ImageFormat::Pnm] {
            assert_eq!(tone(&encoded(&DynamicImage::ImageLuma16(words.clone()), format)), Some(Tone::Linear));
            assert_eq!(tone(&grey(format)), None);
        }
        assert_eq!(tone(b""), None);
    }

    #[test]
    fn the_chunks_of_a_png_say_it_in_their_order_of_precedence() {
        let gamma = |exponent: u32| exponent.to_be_bytes();
        assert_eq!(tone(&png_with(&[(b"sRGB", &[0])])), Some(Tone::Srgb));
        assert_eq!(tone(&png_with(&[(b"gAMA", &gamma(100_000))])), Some(Tone::Gamma(1.0)));
        let Some(Tone::Gamma(screen)) = tone(&png_with(&[(b"tEXt", b"gAMA of a text"), (b"gAMA", &gamma(45_455))]))
        else {
            panic!()
        };
        assert!((screen - 2.2).abs() < 1e-4, "{screen}");
        assert_eq!(tone(&png_with(&[(b"gAMA", &gamma(45_455)), (b"sRGB", &[0])])), Some(Tone::Srgb));
        assert_eq!(tone(&png_with(&[(b"sRGB", &[0]), (b"cICP", &[1, 8, 0, 1])])), Some(Tone::Linear));
        // A value without a meaning, or a chunk behind the pixels, says nothing.
        assert_eq!(tone(&png_with(&[(b"gAMA", &gamma(0))])), None);
        assert_eq!(tone(&png_with(&[(b"IDAT", &[]), (b"sRGB", &[0])])), None);
    }
}
