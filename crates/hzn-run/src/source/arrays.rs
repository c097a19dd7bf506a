//! Pictures in the files of scientific programs: one plane of FITS, an array of NumPy, a grey TIFF of 32 or 64 bits.

#[cfg(feature = "recordings")]
use std::io::Cursor;
use std::io::{Read, Seek};

use hzn_core::image::Layout;
use hzn_files::png::Contents;
use hzn_mcap::words_from_floats;

use super::limits::{MAX_BYTES, check_size};
use super::memory::Held;
use super::picture::{Picture, Samples};

/// Number of bytes at the beginning of a file in which its header must end.
const HEADER_BYTES: u64 = 1 << 20;
/// Size of a block of FITS in bytes. The header fills whole blocks.
const FITS_BLOCK: usize = 2880;
/// How a FITS file begins.
pub(crate) const FITS_START: &[u8] = b"SIMPLE  =";
/// Length of a line of a FITS header in bytes.
const FITS_CARD: usize = 80;

/// The arrangement of an array.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Array {
    pub(super) width: u32,
    pub(super) height: u32,
    /// Bytes of a number.
    size: usize,
    is_float: bool,
    is_signed: bool,
    big_endian: bool,
    /// Where the numbers begin.
    offset: usize,
    /// The last row of the picture comes first.
    from_below: bool,
    /// The value of a stored number n is `scale n + zero`.
    scale: f64,
    zero: f64,
}

/// Reads the header of an array. `None` if the contents are of another format.
///
/// # Errors
/// The array is not a picture.
pub(super) fn read_header(contents: &mut (impl Read + Seek)) -> Option<Result<Array, String>> {
    let mut head = Vec::new();
    contents.take(HEADER_BYTES).read_to_end(&mut head).ok()?;
    parse_header(&head)
}

fn parse_header(head: &[u8]) -> Option<Result<Array, String>> {
    if head.starts_with(b"\x93NUMPY") {
        return Some(numpy(head));
    }
    head.starts_with(FITS_START).then(|| fits(head))
}

/// Decodes an array. `None` if the file is of another format.
///
/// # Errors
/// The reason why it is not a picture.
pub(super) fn decode(bytes: &[u8], expected: Option<(u32, u32)>, held: &mut Held) -> Option<Result<Picture, String>> {
    let head = bytes.get(..HEADER_BYTES as usize).unwrap_or(bytes);
    Some(parse_header(head)?.and_then(|array| {
        check_size(array.width, array.height, expected)?;
        array.decode(bytes, held)
    }))
}

impl Array {
    /// Returns whether its samples are words.
    pub(super) fn has_words(&self) -> bool {
        self.size > 1
    }

    fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    fn decode(&self, bytes: &[u8], held: &mut Held) -> Result<Picture, String> {
        let length = self.pixels().saturating_mul(self.size);
        // A number takes up to eight bytes while it is scaled.
        if 8 * self.pixels() as u64 > MAX_BYTES {
            return Err(format!("picture of {}x{} is above the limit of memory", self.width, self.height));
        }
        held.raise(bytes.len() as u64 + 10 * self.pixels() as u64);
        let data = bytes.get(self.offset..).and_then(|data| data.get(..length));
        let data = data.ok_or("the data end before the picture is complete: the file is truncated")?;
        let row = self.width as usize * self.size;
        let rows: Vec<&[u8]> = data.chunks_exact(row).collect();
        let rows: Box<dyn Iterator<Item = &[u8]>> =
            if self.from_below { Box::new(rows.into_iter().rev()) } else { Box::new(rows.into_iter()) };
        if self.size == 1 && !self.is_signed && (self.scale, self.zero) == (1.0, 0.0) {
            let layout = Layout::packed(self.width, self.height, 1, 8);
            return Ok(Picture::new(Samples::Bytes(rows.flatten().copied().collect()), layout));
        }
        let values: Vec<f64> = rows.flat_map(|row| row.chunks_exact(self.size)).map(|b| self.value(b)).collect();
        // Counts of a detector stay as they are; other numbers get a scale of their own.
        let are_counts = !self.is_float && self.size <= 2 && values.iter().all(|v| (0.0..=65535.0).contains(v));
        let words =
            if are_counts { values.iter().map(|v| v.round() as u16).collect() } else { words_from_floats(&values)? };
        Ok(Picture::new(Samples::Words(words), Layout::packed(self.width, self.height, 1, 16)))
    }

    fn value(&self, bytes: &[u8]) -> f64 {
        let mut wide = [0; 8];
        for (to, from) in wide.iter_mut().zip(bytes) {
            *to = *from;
        }
        if self.big_endian
            && let Some(used) = wide.get_mut(..self.size)
        {
            used.reverse();
        }
        let whole = u64::from_le_bytes(wide);
        let unused = 64 - 8 * self.size as u32;
        let stored = match (self.is_float, self.size) {
            (true, 4) => f64::from(f32::from_bits(whole as u32)),
            (true, _) => f64::from_bits(whole),
            (false, _) if self.is_signed => ((whole << unused) as i64 >> unused) as f64,
            (false, _) => whole as f64,
        };
        self.scale * stored + self.zero
    }
}

/// Reads the header of NumPy's format, versions 1 to 3.
fn numpy(head: &[u8]) -> Result<Array, String> {
    let short = "the header of the NumPy array is not complete";
    let byte = |i: usize| head.get(i).copied().map(usize::from).ok_or(short);
    let (start, length): (usize, usize) = if byte(6)? == 1 {
        (10, byte(8)? + (byte(9)? << 8))
    } else {
        (12, byte(8)? + (byte(9)? << 8) + (byte(10)? << 16) + (byte(11)? << 24))
    };
    let text = head.get(start..length.saturating_add(start)).and_then(|t| std::str::from_utf8(t).ok()).ok_or(short)?;
    let after = |key: &str| text.split(&format!("'{key}':")).nth(1).map(str::trim_start);
    let kind = after("descr").and_then(|t| t.strip_prefix('\'')?.split('\'').next()).unwrap_or_default();
    let (order, letter) = (kind.get(..1).unwrap_or_default(), kind.get(1..2).unwrap_or_default());
    let size = kind.get(2..).and_then(|n| n.parse::<usize>().ok()).unwrap_or_default();
    let is_known = matches!((letter, size), ("u" | "i", 1 | 2 | 4) | ("f", 4 | 8));
    if !is_known || !["<", ">", "|"].contains(&order) {
        return Err(format!("a NumPy array of {kind:?} is not a picture; save it as float32, uint8 or uint16"));
    }
    if after("fortran_order").is_some_and(|t| t.starts_with("True")) {
        return Err("the NumPy array has its columns first; save numpy.ascontiguousarray(array)".to_owned());
    }
    let shape = after("shape").and_then(|t| t.strip_prefix('(')?.split(')').next()).unwrap_or_default();
    let sides: Vec<u32> = shape.split(',').filter_map(|n| n.trim().parse().ok()).collect();
    let &[height, width] = sides.as_slice() else {
        return Err(format!("a NumPy array of shape ({shape}) is not one grey picture: it needs rows and columns"));
    };
    let (is_float, is_signed) = (letter == "f", letter == "i");
    let (big_endian, offset) = (order == ">", start + length);
    Ok(Array { width, height, size, is_float, is_signed, big_endian, offset, from_below: false, scale: 1.0, zero: 0.0 })
}

/// Where the parts of a FITS file are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FitsHeader {
    /// Number of rows.
    pub(crate) height: u32,
    /// The last row of the picture comes first.
    pub(crate) from_below: bool,
    /// Where the card `END` begins.
    pub(crate) end: usize,
    /// Where the data begin.
    pub(crate) data: usize,
}

/// Returns where the parts of a FITS file are; `None` for another file.
///
/// # Errors
/// The reason why its first part is not a picture.
pub(crate) fn fits_header(bytes: &[u8]) -> Option<Result<FitsHeader, String>> {
    let head = bytes.get(..HEADER_BYTES as usize).unwrap_or(bytes);
    head.starts_with(FITS_START).then(|| {
        let Array { height, from_below, offset: data, .. } = fits(head)?;
        let end = head.chunks_exact(FITS_CARD).take_while(|card| !card.starts_with(b"END ")).count() * FITS_CARD;
        Ok(FitsHeader { height, from_below, end, data })
    })
}

/// Reads the header of FITS (standard 4.0, section 4.4).
fn fits(head: &[u8]) -> Result<Array, String> {
    let cards: Vec<&[u8]> = head.chunks_exact(FITS_CARD).collect();
    let end = cards.iter().position(|card| card.starts_with(b"END ")).ok_or("the FITS header has no end")?;
    let cell = |key: &str| {
        let card = cards.iter().take(end).find(|card| card.starts_with(format!("{key:<8}= ").as_bytes()))?;
        let text = std::str::from_utf8(card.get(10..)?).ok()?;
        Some(text.split('/').next().unwrap_or_default().trim().to_owned())
    };
    let number = |key: &str| cell(key).and_then(|text| text.replace(['D', 'd'], "E").parse::<f64>().ok());
    let axes = number("NAXIS").unwrap_or_default();
    let side = |key: &str| number(key).filter(|n| (1.0..=1e9).contains(n)).map(|n| n as u32);
    let further = (3..=axes as u32).map(|i| side(&format!("NAXIS{i}"))).all(|n| n == Some(1));
    let (Some(width), Some(height), true) = (side("NAXIS1"), side("NAXIS2"), further) else {
        return Err("the FITS file has no picture of one plane in its first part; extract the plane".to_owned());
    };
    let (size, is_float) = match number("BITPIX").unwrap_or_default() as i32 {
        8 => (1, false),
        16 => (2, false),
        32 => (4, false),
        -32 => (4, true),
        -64 => (8, true),
        other => return Err(format!("FITS with BITPIX = {other} is not supported")),
    };
    let offset = ((end + 1) * FITS_CARD).next_multiple_of(FITS_BLOCK);
    let (scale, zero) = (number("BSCALE").unwrap_or(1.0), number("BZERO").unwrap_or(0.0));
    // The standard shows the first row below. Programs of cameras say so when theirs is above.
    let from_below = !cell("ROWORDER").is_some_and(|order| order.to_uppercase().contains("TOP-DOWN"));
    Ok(Array { width, height, size, is_float, is_signed: size > 1, big_endian: true, offset, from_below, scale, zero })
}

/// Returns width and height of a TIFF whose grey samples have 32 or 64 bits. `None` for every other TIFF.
// Each type of reader would compile the decoder again, so all of them come as this one.
#[cfg(feature = "recordings")]
pub(super) fn wide_tiff_size(contents: &mut dyn Contents) -> Option<(u32, u32)> {
    let mut decoder = tiff::decoder::Decoder::new(contents).ok()?;
    matches!(decoder.colortype().ok()?, tiff::ColorType::Gray(32 | 64)).then(|| decoder.dimensions().ok())?
}

/// Decodes a TIFF whose grey samples have 32 or 64 bits. `None` for every other TIFF.
///
/// # Errors
/// The reason why it cannot be decoded.
#[cfg(feature = "recordings")]
pub(super) fn decode_wide_tiff(
    bytes: &[u8],
    expected: Option<(u32, u32)>,
    held: &mut Held,
) -> Option<Result<Picture, String>> {
    use tiff::decoder::DecodingResult;
    let mut contents = Cursor::new(bytes);
    let (width, height) = wide_tiff_size(&mut contents)?;
    let mut read = || {
        check_size(width, height, expected)?;
        let pixels = u64::from(width) * u64::from(height);
        if 8 * pixels > MAX_BYTES {
            return Err(format!("picture of {width}x{height} is above the limit of memory"));
        }
        held.raise(bytes.len() as u64 + 26 * pixels);
        let failed = |e: tiff::TiffError| format!("TIFF cannot be decoded: {e}");
        let mut limits = tiff::decoder::Limits::default();
        limits.decoding_buffer_size = 8 * pixels as usize;
        limits.intermediate_buffer_size = 8 * pixels as usize;
        contents.set_position(0);
        let contents: &mut dyn Contents = &mut contents;
        let mut decoder = tiff::decoder::Decoder::new(contents).map_err(failed)?.with_limits(limits);
        let values: Vec<f64> = match decoder.read_image().map_err(failed)? {
            DecodingResult::F32(values) => values.into_iter().map(f64::from).collect(),
            DecodingResult::F64(values) => values,
            DecodingResult::U32(values) => values.into_iter().map(f64::from).collect(),
            DecodingResult::I32(values) => values.into_iter().map(f64::from).collect(),
            _ => return Err("TIFF with samples of this kind is not supported".to_owned()),
        };
        Ok(Picture::new(Samples::Words(words_from_floats(&values)?), Layout::packed(width, height, 1, 16)))
    };
    Some(read())
}

/// There is no decoder of TIFF, so no TIFF is one of these.
#[cfg(not(feature = "recordings"))]
pub(super) fn wide_tiff_size(_: &mut dyn Contents) -> Option<(u32, u32)> {
    None
}

#[cfg(not(feature = "recordings"))]
pub(super) fn decode_wide_tiff(_: &[u8], _: Option<(u32, u32)>, _: &mut Held) -> Option<Result<Picture, String>> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(bytes: &[u8]) -> Result<Picture, String> {
        decode(bytes, None, &mut Held::default()).unwrap()
    }

    fn words(picture: Picture) -> Vec<u16> {
        match picture.samples {
            Samples::Words(words) => words,
            Samples::Bytes(bytes) => bytes.into_iter().map(u16::from).collect(),
        }
    }

    /// Returns a file as numpy.save writes it.
    fn npy(kind: &str, shape: &str, data: &[u8]) -> Vec<u8> {
        let text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
        let text = format!("{text:<117}\n");
        [b"\x93NUMPY\x01\0".as_slice(), &(text.len() as u16).to_le_bytes(), text.as_bytes(), data].concat()
    }

    /// Returns a FITS file of two columns and rows.
    fn fits(bitpix: i32, cards: &[&str], data: &[u8]) -> Vec<u8> {
        let mut head = vec![
            "SIMPLE  =                    T".to_owned(),
            format!("BITPIX  = {bitpix:>20} / bits"),
            "NAXIS   =                    2".to_owned(),
            "NAXIS1  =                    2".to_owned(),
            "NAXIS2  =                    2".to_owned(),
        ];
        head.extend(cards.iter().map(|card| (*card).to_owned()));
        head.push("END".to_owned());
        let mut bytes: Vec<u8> = head.iter().flat_map(|card| format!("{card:<80}").into_bytes()).collect();
        bytes.resize(bytes.len().next_multiple_of(2880), b' ');
        [bytes, data.to_vec()].concat()
    }

    #[test]
    fn arrays_of_numpy() {
        let floats: Vec<u8> = [-40.0f32, 20.0, -10.0, 20.0].iter().flat_map(|x| x.to_le_bytes()).collect();
        let picture = decoded(&npy("<f4", "(1, 4)", &floats)).unwrap();
        assert_eq!((picture.layout.width, picture.layout.height), (4, 1));
        assert_eq!(words(picture), [8192, 57344, 32768, 57344]);
        assert_eq!(words(decoded(&npy("|u1", "(2, 1)", &[7, 9])).unwrap()), [7, 9]);
        assert_eq!(words(decoded(&npy(">u2", "(1, 2)", &[1, 2, 0, 3])).unwrap()), [258, 3]);
        // Temperatures in hundredths of a degree can be below zero.
        assert_eq!(words(decoded(&npy("<i2", "(1, 2)", &[0xff, 0xff, 1, 0])).unwrap()), [8192, 57344]);
        for (kind, shape, says) in [
            ("<c8", "(1, 1)", "is not a picture; save it as float32"),
            ("<f4", "(1, 4, 3)", "is not one grey picture"),
            ("<f4", "(2, 4)", "truncated"),
        ] {
            let error = decoded(&npy(kind, shape, &floats)).unwrap_err();
            assert!(error.contains(says), "{error}");
        }
        assert!(decode(b"\x89PNG", None, &mut Held::default()).is_none());
    }

    #[test]
    fn planes_of_fits() {
        // The first row is below unless the file says otherwise.
        let bytes = fits(8, &[], &[1, 2, 3, 4]);
        assert_eq!(words(decoded(&bytes).unwrap()), [3, 4, 1, 2]);
        let down = fits(8, &["ROWORDER= 'TOP-DOWN'"], &[1, 2, 3, 4]);
        assert_eq!(words(decoded(&down).unwrap()), [1, 2, 3, 4]);
        // Words without a sign are stored with a shift by 32768.
        let shifted = fits(16, &["BZERO   =                32768"], &[0x80, 0, 0x80, 1, 0x7f, 0xff, 0, 0]);
        assert_eq!(words(decoded(&shifted).unwrap()), [65535, 32768, 0, 1]);
        let floats: Vec<u8> = [0.0f32, 1.0, 2.0, f32::NAN].iter().flat_map(|x| x.to_be_bytes()).collect();
        assert_eq!(words(decoded(&fits(-32, &[], &floats)).unwrap()), [57344, 8192, 8192, 32768]);
        for (bytes, says) in [
            (fits(8, &[], &[1, 2, 3]), "truncated"),
            (fits(64, &[], &[0; 32]), "BITPIX = 64"),
            (fits(8, &[], &[])[..400].to_vec(), "no end"),
        ] {
            let error = decoded(&bytes).unwrap_err();
            assert!(error.contains(says), "{error}");
        }
    }

    #[test]
    fn a_tiff_of_numbers_with_a_fraction() {
        let mut file = Cursor::new(Vec::new());
        let mut encoder = tiff::encoder::TiffEncoder::new(&mut file).unwrap();
        encoder.write_image::<tiff::encoder::colortype::Gray32Float>(2, 1, &[0.25, 0.75]).unwrap();
        let bytes = file.into_inner();
        assert_eq!(wide_tiff_size(&mut Cursor::new(&bytes)), Some((2, 1)));
        let picture = decode_wide_tiff(&bytes, None, &mut Held::default()).unwrap().unwrap();
        assert_eq!(words(picture), [8192, 57344]);
        let refused = decode_wide_tiff(&bytes, Some((3, 1)), &mut Held::default()).unwrap();
        assert!(refused.unwrap_err().contains("the camera is 3x1"));
    }
}
