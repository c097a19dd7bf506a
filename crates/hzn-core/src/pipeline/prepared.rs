//! A sensor as bytes, prepared on another computer.
//!
//! The bytes are a header of 20 bytes and a body. All numbers are little-endian.
//!
//! | place | bytes | content |
//! |---|---|---|
//! | 0 | 4 | `hzns` |
//! | 4 | 2 | 0xFEFF: the order of the bytes, for programs that copy them word by word |
//! | 6 | 1 | the version of this layout |
//! | 7 | 1 | bytes of a number: 4 for `f32`, 8 for `f64` |
//! | 8 | 4 | the keys that the program knows, as a number of their names, types and words |
//! | 12 | 4 | the bytes of the body |
//! | 16 | 4 | CRC-32 (ISO-HDLC, as in zip) of the bytes before, and of the body |
//! | 20 | | camera with the series of its lens, region, rotation of the mount, configuration, its polygons and bodies |

use core::fmt;

use super::sensor::Sensor;
use crate::base::packed::{self, Packed, Packer, Unpacker};
use crate::base::parts::packed;
use crate::base::real::Real;
use crate::config::{Config, SECTIONS};
use crate::geometry::camera::Camera;
use crate::geometry::frames::{Cam, Rotation, Vehicle};
use crate::image::region::{MAX_POLYGONS, Polygon, Region};
use crate::model::body;
use crate::model::report::MAX_BODIES;

const MAGIC: [u8; 4] = *b"hzns";
const ORDER: u16 = 0xFEFF;
/// The version of everything that the number of the keys does not contain: the header, the camera and the region.
const VERSION: u8 = 1;
const HEADER: usize = 20;
const CRC: crc::Crc<u32, crc::NoTable> = crc::Crc::<u32, crc::NoTable>::new(&crc::CRC_32_ISO_HDLC);

/// The bytes of a prepared sensor are never more: `f64`, eight polygons of sixteen corners, every further body.
pub const MAX_BYTES: usize = 8 * 1024;

/// The reason why bytes are not a prepared sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum PreparedError {
    /// The buffer has fewer bytes than the sensor needs.
    TooLong {
        /// The bytes that it needs.
        needed: usize,
    },
    /// The bytes do not begin as those of a prepared sensor do, or they end before it.
    NoSensor,
    /// The bytes of each word are reversed.
    Order,
    /// Another version of hzn prepared the sensor: prepare it again with the version of this program.
    Version,
    /// The sensor was prepared for the other precision: `f32` is that of a flight computer.
    Precision,
    /// The checksum is wrong: the bytes changed after they were prepared.
    Checksum,
    /// A value is out of its limits, or needs a feature that is not in this build.
    Value,
}

impl fmt::Display for PreparedError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TooLong { needed } => return write!(f, "the sensor needs {needed} bytes"),
            Self::NoSensor => "the bytes are not a prepared sensor, or not a whole one",
            Self::Order => "the bytes of each word are reversed",
            Self::Version => "another version prepared the sensor; prepare it again with the version of this program",
            Self::Precision => "the sensor was prepared for the other precision",
            Self::Checksum => "the checksum is wrong: the bytes changed after they were prepared",
            Self::Value => "a value is out of its limits, or needs a feature that is not in this build",
        })
    }
}

impl core::error::Error for PreparedError {}

impl<T: Real> Sensor<T> {
    /// Writes the sensor as bytes, for [`Self::from_prepared`], and returns how many they are. [`MAX_BYTES`] are always
    /// enough.
    ///
    /// # Errors
    /// The buffer is too short.
    ///
    /// # Example
    ///
    /// ```
    /// use hzn_core::camera::{self, Model};
    /// use hzn_core::{Config, Sensor, prepared};
    ///
    /// // On the ground: every check, and the series of the lens.
    /// let sensor = Sensor::<f32>::new(&Config::new(camera::Config::ideal(Model::Equidistant, 640, 480, 300.0)))?;
    /// let mut bytes = [0; prepared::MAX_BYTES];
    /// let length = sensor.prepare(&mut bytes)?;
    /// // On the flight computer: the same sensor.
    /// assert_eq!(Sensor::from_prepared(&bytes[..length])?, sensor);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn prepare(&self, bytes: &mut [u8]) -> Result<usize, PreparedError> {
        let (header, body) = bytes.split_at_mut_checked(HEADER).unwrap_or_default();
        let mut packer = Packer::new(body);
        self.pack(&mut packer);
        self.config.mask.polygons_px.pack(&mut packer);
        self.config.bodies.pack(&mut packer);
        let length = packer.length();
        let needed = HEADER.saturating_add(length);
        let body = body.get(..length).filter(|_| !header.is_empty()).ok_or(PreparedError::TooLong { needed })?;
        let mut packer = Packer::new(header);
        packer.put(&MAGIC);
        ORDER.pack(&mut packer);
        VERSION.pack(&mut packer);
        (size_of::<T>() as u8).pack(&mut packer);
        KEYS.pack(&mut packer);
        (length as u32).pack(&mut packer);
        let start = packer.length();
        let sum = checksum(header.get(..start).unwrap_or_default(), body);
        for (place, byte) in header.iter_mut().skip(start).zip(sum.to_le_bytes()) {
            *place = byte;
        }
        Ok(needed)
    }

    /// Reads a sensor that [`Self::prepare`] wrote with the same version of hzn, with the same answers to the last bit.
    /// Bytes behind it are not read, so that it can stand in a larger page of flash.
    ///
    /// Neither the lens nor the agreement of the values with each other is checked again: the checksum says that they
    /// were. A program that calls this function and not [`Self::new`] has neither the checks nor the functions that
    /// make the series of a lens. No bytes panic.
    ///
    /// # Errors
    /// The bytes are not those of a sensor for this program, or they were changed.
    pub fn from_prepared(bytes: &[u8]) -> Result<Self, PreparedError> {
        check::<T>(bytes)?;
        let mut from = values(bytes);
        let mut sensor = Self::unpack(&mut from);
        sensor.read_lists(&mut from);
        Ok(sensor)
    }

    /// Reads the lists of the configuration, which come last.
    // They take most of the memory. They are read when the sensor is in its place, so that they are never on the stack.
    #[inline(never)]
    pub(super) fn read_lists(&mut self, from: &mut Unpacker<'_>) {
        packed::unpack_list(&mut self.config.mask.polygons_px, from);
        packed::unpack_list(&mut self.config.bodies, from);
    }
}

// The configuration comes last, so that it is made where it stays.
packed!(Sensor<T> { camera, region, vehicle_from_camera, config });

/// Returns the values behind the header.
pub(super) fn values(bytes: &[u8]) -> Unpacker<'_> {
    Unpacker::new(bytes.get(HEADER..).unwrap_or_default())
}

/// Refuses bytes that are not a sensor for this program. The values are read to be checked, and dropped: a running
/// sensor stays until all of them are right.
// The parts are read one after the other, so that never all of them are on the stack.
pub(super) fn check<T: Real>(bytes: &[u8]) -> Result<(), PreparedError> {
    let mut from = Unpacker::new(content::<T>(bytes)?);
    let camera = size_of_part(&mut from, |camera: &Camera<T>| (camera.width(), camera.height()));
    let region = size_of_part(&mut from, |region: &Region<T>| (region.width(), region.height()));
    let _ = Option::<Rotation<Cam, Vehicle, T>>::unpack(&mut from);
    let config = size_of_part(&mut from, |config: &Config| (config.camera.width, config.camera.height));
    packed::check_list::<Polygon, MAX_POLYGONS>(&mut from);
    packed::check_list::<body::Config, MAX_BODIES>(&mut from);
    let is_right = !from.refused() && from.is_at_end() && camera == region && camera == config;
    if is_right { Ok(()) } else { Err(PreparedError::Value) }
}

/// Reads a part, drops it, and returns the size of the pictures that it is for.
#[inline(never)]
fn size_of_part<P: Packed>(from: &mut Unpacker<'_>, size: impl Fn(&P) -> (u16, u16)) -> (u16, u16) {
    size(&P::unpack(from))
}

/// Checks the header of a prepared sensor, and returns its body.
fn content<T>(bytes: &[u8]) -> Result<&[u8], PreparedError> {
    let (header, rest) = bytes.split_first_chunk::<HEADER>().ok_or(PreparedError::NoSensor)?;
    let mut from = Unpacker::new(header);
    let (magic, order): ([u8; 4], u16) = (Packed::unpack(&mut from), Packed::unpack(&mut from));
    let reversed = order == ORDER.swap_bytes() || magic == [MAGIC[3], MAGIC[2], MAGIC[1], MAGIC[0]];
    let (version, width): (u8, u8) = (Packed::unpack(&mut from), Packed::unpack(&mut from));
    let (keys, length, sum) = (u32::unpack(&mut from), u32::unpack(&mut from), u32::unpack(&mut from));
    let is = |holds: bool, or: PreparedError| if holds { Ok(()) } else { Err(or) };
    is(!reversed, PreparedError::Order)?;
    is(magic == MAGIC && order == ORDER, PreparedError::NoSensor)?;
    let body = usize::try_from(length).ok().and_then(|length| rest.get(..length)).ok_or(PreparedError::NoSensor)?;
    is(sum == checksum(header.get(..16).unwrap_or_default(), body), PreparedError::Checksum)?;
    is(version == VERSION && keys == KEYS, PreparedError::Version)?;
    is(usize::from(width) == size_of::<T>(), PreparedError::Precision)?;
    Ok(body)
}

fn checksum(header: &[u8], body: &[u8]) -> u32 {
    let mut digest = CRC.digest();
    digest.update(header);
    digest.update(body);
    digest.finalize()
}

/// A number of the names, types and words of all keys (FNV-1a), in the order in which they are written.
// A new key changes the bytes, and nobody has to remember a new version for it. It is a constant, so that no text of a
// key is linked.
const KEYS: u32 = {
    let mut hash = 0x811c_9dc5;
    let mut section = 0;
    while section < SECTIONS.len() {
        let keys = SECTIONS[section].keys;
        let mut key = 0;
        while key < keys.len() {
            hash = hashed(hash, keys[key].path.as_bytes());
            hash = hashed(hash, &[keys[key].form as u8]);
            let mut choice = 0;
            while choice < keys[key].choices.len() {
                hash = hashed(hash, keys[key].choices[choice].name.as_bytes());
                choice += 1;
            }
            key += 1;
        }
        section += 1;
    }
    hash
};

const fn hashed(mut hash: u32, text: &[u8]) -> u32 {
    let mut i = 0;
    while i < text.len() {
        hash = (hash ^ text[i] as u32).wrapping_mul(0x0100_0193);
        i += 1;
    }
    hash
}
