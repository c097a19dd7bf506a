//! Pictures that are kept with their answers, so that `hzn run` can process them again.

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use hzn_core::Config;
use hzn_core::status::Status;
use hzn_files::FrameData;
use hzn_mcap::{EncodedImage, FrameRecord, ImageFormat};

use crate::error::Error;
use crate::flash::Flash;
use crate::log::{Limits, Log, Sensors, Spare};
use crate::tell::{Rarely, Tell};

/// Which pictures are kept: every n-th, those without an answer, or both.
///
/// ```
/// let which: hzn_fly::Which = "25,refused".parse()?;
/// assert_eq!((which.every, which.refused), (Some(25), true));
/// assert!("0".parse::<hzn_fly::Which>().is_err());
/// # Ok::<(), String>(())
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Which {
    /// The first picture and every n-th one after it.
    pub every: Option<u32>,
    /// Pictures without an answer.
    pub refused: bool,
}

impl Which {
    fn has(self, picture: u32, status: Status) -> bool {
        self.refused && status != Status::Ok
            || self.every.is_some_and(|every| picture.wrapping_sub(1).is_multiple_of(every))
    }
}

impl FromStr for Which {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut which = Self::default();
        for word in text.split(',') {
            match (word, word.parse::<u32>()) {
                ("refused", _) => which.refused = true,
                (_, Ok(every @ 1..)) => which.every = Some(every),
                _ => return Err(format!("{word:?}: give a number from 1 on, refused, or both, as in 25,refused")),
            }
        }
        Ok(which)
    }
}

impl fmt::Display for Which {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let every = self.every.map(|every| every.to_string());
        let refused = self.refused.then(|| "refused".to_owned());
        f.write_str(&every.into_iter().chain(refused).collect::<Vec<_>>().join(","))
    }
}

/// The pictures that are kept, in a folder with a limit of its own.
pub(crate) struct Keeper {
    which: Which,
    size: (u32, u32),
    log: Log,
    /// Its folder is one of these.
    spare: Spare,
    lost: Rarely,
    tell: Tell,
}

impl Keeper {
    /// Opens the folder `pictures` next to the parameters of a head.
    pub(crate) fn open(
        (which, bytes): (Which, u64),
        flash: &Flash,
        config: &Config,
        spare: &Spare,
        tell: &Tell,
    ) -> Result<Self, Error> {
        let size = (u32::from(config.camera.width), u32::from(config.camera.height));
        let picture_bytes = u64::from(size.0) * u64::from(size.1);
        let least_bytes = Limits::least_bytes(picture_bytes);
        if bytes < least_bytes {
            let least_mb = least_bytes.div_ceil(1_000_000);
            let what = format!("pictures of {}x{} need at least --pictures-mb {least_mb}", size.0, size.1);
            return Err(Error::usage(what));
        }
        let folder = flash.folder().join("pictures");
        let sensors = Sensors { configs: vec![config.clone()], rig: None };
        let limits = Limits { bytes, picture_bytes };
        let (name, tell_all) = (folder.display().to_string(), tell.clone());
        let tell_of_folder: Tell = Arc::new(move |line: &str| tell_all(&format!("{name}: {line}")));
        let log = Log::open(&folder, limits, sensors, Spare::default(), tell_of_folder)
            .map_err(|e| Error::failed(format!("{}: {e}", folder.display())))?;
        spare.add(&folder);
        Ok(Self { which, size, log, spare: spare.clone(), lost: Rarely::new(tell.clone()), tell: tell.clone() })
    }

    /// Takes note of another sensor, which a telecommand has set.
    pub(crate) fn set_config(&mut self, config: &Config) {
        self.size = (u32::from(config.camera.width), u32::from(config.camera.height));
        self.log.set_config(0, config);
    }

    /// Keeps a picture, if it is one of those that are kept.
    pub(crate) fn see(&mut self, picture: u32, status: Status, record: &FrameRecord, pixels: &[u8]) {
        let (width, height) = self.size;
        if !self.which.has(picture, status) || pixels.len() as u64 != u64::from(width) * u64::from(height) {
            return;
        }
        if self.spare.is_needed() {
            if self.log.close() {
                (self.tell)("pictures are no longer kept, because the disk is full and the log needs it");
            }
            return;
        }
        let mut record = record.clone();
        // Alone it is no part of a rig.
        record.row.head = None;
        record.image = Some(EncodedImage { format: ImageFormat::Mono8 { width, height }, bytes: pixels.to_vec() });
        record.prior = FrameData { altitude_km: record.row.altitude_km, ..FrameData::default() };
        if !self.log.add(record) {
            self.lost.line("pictures are not kept, because the disk is too slow or cannot be written");
        }
    }

    /// Writes what waits. Returns how many pictures were kept, and how many were lost.
    pub(crate) fn finish(&mut self) -> (u64, u64) {
        self.log.finish()
    }
}
