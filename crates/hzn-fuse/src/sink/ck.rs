//! SPICE CK (attitude kernel) of type 3, with the clock kernel (SCLK) and the frame kernel (FK) that it needs.
//!
//! Sources: NAIF, *CK Required Reading* (type 3), *DAF Required Reading*, *SCLK Required Reading*. The attitude is
//! relative to ITRF93, SPICE's frame of the Earth with all rotations. A tick of the clock is a microsecond.

use std::path::{Path, PathBuf};

use hzn_nav::time::tt_days_since_j2000;

use super::Utc;
use super::aem::{best, rising};
use crate::error::Error;
use crate::results::{Epoch, Fused};

/// The number of ITRF93 in SPICE.
const ITRF93: i32 = 13_000;
/// Length of a record of a DAF, bytes and words.
const RECORD: usize = 1024;
const WORDS: usize = RECORD / 8;
/// Words before the segment: the records of the file, the summaries and the names.
const BEFORE: usize = 3 * WORDS;
/// Every so many times there is one in the directory.
const DIRECTORY: usize = 100;
/// Test string of SPICE: a transfer that changes line ends destroys it.
const FTP: &[u8; 28] = b"FTPSTR:\r:\n:\r\n:\r\x00:\x81:\x10\xce:ENDFTP";

/// Numbers of a CK.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CkOptions {
    /// UTC of time 0.
    pub utc: Utc,
    /// SPICE's number of the vehicle, negative. Its frame is this number times 1000, with the name `HZN_BODY`.
    pub spacecraft: i32,
}

/// Writes FILE.bc, and next to it FILE.tsc and FILE.tf. Returns their paths.
///
/// # Errors
/// There is no solution, the number of the vehicle is not negative, or a file cannot be written.
pub fn write_ck(fused: &Fused, options: &CkOptions, path: &Path) -> Result<[PathBuf; 3], Error> {
    let epochs = rising(best(fused));
    let (Some(first), Some(last)) = (epochs.first(), epochs.last()) else {
        return Err(Error::unusable("there is no solution to write as a CK"));
    };
    if !(-999_999..0).contains(&options.spacecraft) {
        return Err(Error::unusable(format!("{}: SPICE's number of a vehicle is negative", options.spacecraft)));
    }
    let zero_s = first.state.time_s;
    let ticks = |epoch: &Epoch| ((epoch.state.time_s - zero_s) * 1e6).round();
    let paths = [path.to_owned(), path.with_extension("tsc"), path.with_extension("tf")];
    let bytes = daf(&segment(&epochs, ticks), [0.0, ticks(last)], options.spacecraft);
    let texts = [bytes, clock(options, zero_s).into_bytes(), frame(options.spacecraft).into_bytes()];
    for (path, bytes) in paths.iter().zip(texts) {
        hzn_run::disk::write(path, bytes)?;
    }
    Ok(paths)
}

/// Returns the words of the segment: quaternions, times, directory, the begin of the one interval, two counts.
fn segment(epochs: &[&Epoch], ticks: impl Fn(&Epoch) -> f64) -> Vec<f64> {
    // SPICE's matrix turns vectors from the reference frame into that of the instrument.
    let mut words: Vec<f64> = epochs.iter().flat_map(|epoch| epoch.state.attitude.inverse().wxyz()).collect();
    let times: Vec<f64> = epochs.iter().map(|e| ticks(e)).collect();
    words.extend(&times);
    words.extend(times.iter().skip(DIRECTORY - 1).step_by(DIRECTORY).take((times.len() - 1) / DIRECTORY));
    words.push(times.first().copied().unwrap_or(0.0));
    words.push(1.0);
    words.push(times.len() as f64);
    words
}

/// Returns the bytes of a DAF with one segment.
fn daf(segment: &[f64], span: [f64; 2], spacecraft: i32) -> Vec<u8> {
    let (begin, end) = (BEFORE + 1, BEFORE + segment.len());
    let mut file = Vec::with_capacity((end + WORDS) * 8);
    let int = |x: usize| i32::try_from(x).unwrap_or(i32::MAX).to_le_bytes();
    // The record of the file.
    file.extend(b"DAF/CK  ");
    file.extend(int(2));
    file.extend(int(6));
    file.extend(format!("{:<60}", "hzn fuse").as_bytes());
    file.extend(int(2));
    file.extend(int(2));
    file.extend(int(end + 1));
    file.extend(b"LTL-IEEE");
    file.resize(699, 0);
    file.extend(FTP);
    file.resize(RECORD, 0);
    // The record of the summaries: next, previous, count, and one summary.
    for word in [0.0, 0.0, 1.0, span[0], span[1]] {
        file.extend(f64::to_le_bytes(word));
    }
    file.extend((spacecraft * 1000).to_le_bytes());
    file.extend(ITRF93.to_le_bytes());
    file.extend(int(3));
    file.extend(int(0));
    file.extend(int(begin));
    file.extend(int(end));
    file.resize(2 * RECORD, 0);
    // The record of the names.
    file.extend(format!("{:<40}", "HZN_BODY").as_bytes());
    file.resize(3 * RECORD, b' ');
    segment.iter().for_each(|word| file.extend(word.to_le_bytes()));
    file.resize(file.len().div_ceil(RECORD) * RECORD, 0);
    file
}

/// Returns the clock kernel: ticks of a microsecond from the first attitude on.
fn clock(options: &CkOptions, zero_s: f64) -> String {
    let id = -options.spacecraft;
    let tt_s = tt_days_since_j2000(options.utc.unix_s) * 86_400.0 + zero_s;
    format!(
        "KPL/SCLK\n\n\\begindata\n\nSCLK_KERNEL_ID = ( @2026-01-01T00:00:00 )\nSCLK_DATA_TYPE_{id} = ( 1 )\n\
         SCLK01_TIME_SYSTEM_{id} = ( 2 )\nSCLK01_N_FIELDS_{id} = ( 2 )\nSCLK01_MODULI_{id} = ( 4294967296 1000000 )\n\
         SCLK01_OFFSETS_{id} = ( 0 0 )\nSCLK01_OUTPUT_DELIM_{id} = ( 1 )\nSCLK_PARTITION_START_{id} = ( 0.0 )\n\
         SCLK_PARTITION_END_{id} = ( 4.294967295E+15 )\nSCLK01_COEFFICIENTS_{id} = ( 0.0 {tt_s:.6} 1.0 )\n\n\
         \\begintext\n"
    )
}

/// Returns the frame kernel.
fn frame(spacecraft: i32) -> String {
    let class = spacecraft * 1000;
    format!(
        "KPL/FK\n\n\\begindata\n\nFRAME_HZN_BODY = {class}\nFRAME_{class}_NAME = 'HZN_BODY'\nFRAME_{class}_CLASS = 3\n\
         FRAME_{class}_CLASS_ID = {class}\nFRAME_{class}_CENTER = {spacecraft}\nCK_{class}_SCLK = {spacecraft}\n\
         CK_{class}_SPK = {spacecraft}\nOBJECT_{spacecraft}_FRAME = 'HZN_BODY'\n\n\\begintext\n"
    )
}
