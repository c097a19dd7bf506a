//! The files of the images that measure the sensor: cases come from `cases.bin`, results go to `results.bin`.
//!
//! `cases.bin` has for each case eight words (little-endian): "CASE", the length of the parameter table, the length of
//! the picture, altitude and ECEF position as single-precision numbers in metres (NaN if not known), and one spare. The
//! table follows, and then the picture with one byte per pixel.
//!
//! `results.bin` has for each case "DONE" and the ticks of three calls. Then follow the ticks of each of the eight
//! stages (two words each), the high-water mark of the stack, the length of the answer, and the answer.

use hzn_flight::answer::PictureAnswer;
use hzn_flight::bytes::Writer;

use crate::host::File;
use crate::watermark;

/// Number of stages of the sensor.
pub const STAGES: usize = 8;

/// The header of a case in `cases.bin`.
#[derive(Debug, Clone, Copy)]
pub struct CaseHeader {
    /// Bytes of the parameter table.
    pub table_bytes: usize,
    /// Bytes of the picture.
    pub picture_bytes: usize,
    /// Altitude in metres, if it is known.
    pub altitude_m: Option<f32>,
    /// Position in ECEF in metres, if it is known.
    pub position_m: Option<[f32; 3]>,
}

/// The file has something else in place of a case.
#[derive(Debug, Clone, Copy)]
pub struct NotACase;

impl CaseHeader {
    /// Reads the next header; `None` at the end of the file.
    ///
    /// # Errors
    /// The words do not begin with "CASE".
    pub fn read(cases: &mut File) -> Result<Option<Self>, NotACase> {
        let mut header = [0u8; 32];
        if !cases.read(&mut header) {
            return Ok(None);
        }
        let words: [u32; 8] = core::array::from_fn(|i| {
            header.get(4 * i..).and_then(|h| h.first_chunk()).map_or(0, |w| u32::from_le_bytes(*w))
        });
        let [magic, table_bytes, picture_bytes, altitude, x, y, z, _] = words;
        if magic != u32::from_le_bytes(*b"CASE") {
            return Err(NotACase);
        }
        let known = |bits: u32| Some(f32::from_bits(bits)).filter(|v| !v.is_nan());
        let position_m = match (known(x), known(y), known(z)) {
            (Some(x), Some(y), Some(z)) => Some([x, y, z]),
            _ => None,
        };
        Ok(Some(Self {
            table_bytes: table_bytes as usize,
            picture_bytes: picture_bytes as usize,
            altitude_m: known(altitude),
            position_m,
        }))
    }
}

/// Writes the result of a case: the ticks of the calls and of the stages, the use of the stack, and the answer. Returns
/// `None` if the file cannot take it.
pub fn write_result(results: &mut File, calls: [u32; 3], stages: [u64; STAGES], answer: &PictureAnswer) -> Option<()> {
    let mut bytes = [0u8; 640];
    let mut out = Writer::new(&mut bytes);
    answer.write(&mut out);
    let len = out.finish()?;
    let mut head = [0u8; 88];
    let mut out = Writer::new(&mut head);
    out.bytes(b"DONE");
    for ticks in calls {
        out.u32(ticks);
    }
    for ticks in stages {
        out.u64(ticks);
    }
    out.u32(watermark::stack_bytes());
    out.u32(len as u32);
    out.finish()?;
    (results.write(&head) && results.write(bytes.get(..len)?)).then_some(())
}
