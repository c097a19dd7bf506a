//! Reads picture files without colour profiles and texts.

use std::io::{self, BufReader, Read, Seek};

use hzn_files::png::WithoutProfiles;
use image::ImageReader;

/// Returns a reader of a picture file that knows its format.
pub(super) fn picture_reader<'a>(
    contents: impl Read + Seek + 'a,
) -> io::Result<ImageReader<BufReader<WithoutProfiles<'a>>>> {
    ImageReader::new(BufReader::new(WithoutProfiles::new(Box::new(contents))?)).with_guessed_format()
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use image::codecs::png::PngEncoder;
    use image::{ExtendedColorType, ImageDecoder, ImageEncoder};

    use super::*;

    /// Returns a PNG of 3x2 pixels with a colour profile and EXIF.
    fn png() -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = PngEncoder::new(&mut bytes);
        encoder.set_icc_profile(vec![7; 100_000]).unwrap();
        encoder.set_exif_metadata(b"MM\0*\0\0\0\x08\0\0\0\0\0\0".to_vec()).unwrap();
        encoder.write_image(&[1, 2, 3, 4, 5, 6], 3, 2, ExtendedColorType::L8).unwrap();
        bytes
    }

    #[test]
    fn a_png_is_read_without_its_profile() {
        let bytes = png();
        let with_profile = ImageReader::new(Cursor::new(&bytes)).with_guessed_format().unwrap().into_decoder();
        assert_eq!(with_profile.unwrap().icc_profile().unwrap().unwrap().len(), 100_000);
        let mut decoder = picture_reader(Cursor::new(&bytes)).unwrap().into_decoder().unwrap();
        assert_eq!(decoder.icc_profile().unwrap(), None);
        assert_eq!(decoder.exif_metadata().unwrap().unwrap().len(), 14);
        let mut pixels = [0; 6];
        decoder.read_image(&mut pixels).unwrap();
        assert_eq!(pixels, [1, 2, 3, 4, 5, 6]);
    }
}
