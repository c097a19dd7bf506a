//! The part of ROS 2's CDR encoding that pictures, calibrations, inertial units and receivers need.

use crate::camera_info::{CameraInfo, Region};
use crate::frame::EncodedImage;
use crate::header::{Decoded, Header};
use crate::messages::compressed_format;
use crate::raw_images::raw_format;

/// Reads CDR fields in either byte order. Alignment is counted from the end of the four encapsulation bytes.
#[derive(Debug)]
struct Cdr<'a> {
    data: &'a [u8],
    at: usize,
    big_endian: bool,
}

impl<'a> Cdr<'a> {
    fn try_new(message: &'a [u8]) -> Option<Self> {
        let (head, data) = message.split_first_chunk::<4>()?;
        let big_endian = match head[..2] {
            [0, 0] => true,
            [0, 1] => false,
            _ => return None,
        };
        Some(Self { data, at: 0, big_endian })
    }
    fn bytes(&mut self, n: usize) -> Option<&'a [u8]> {
        let bytes = self.data.get(self.at..self.at.checked_add(n)?)?;
        self.at += n;
        Some(bytes)
    }
    fn u8(&mut self) -> Option<u8> {
        self.bytes(1)?.first().copied()
    }
    fn u32(&mut self) -> Option<u32> {
        self.at = self.at.next_multiple_of(4);
        let bytes = *self.bytes(4)?.first_chunk::<4>()?;
        Some(if self.big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    }
    fn f64(&mut self) -> Option<f64> {
        self.at = self.at.next_multiple_of(8);
        let bytes = *self.bytes(8)?.first_chunk::<8>()?;
        Some(if self.big_endian { f64::from_be_bytes(bytes) } else { f64::from_le_bytes(bytes) })
    }
    fn numbers<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.f64()?;
        }
        Some(numbers)
    }
    /// Reads a text: the length, then the bytes. The length includes a final zero byte.
    fn text(&mut self) -> Option<&'a str> {
        let n = self.u32()? as usize;
        let bytes = self.bytes(n)?;
        std::str::from_utf8(bytes.strip_suffix(&[0]).unwrap_or(bytes)).ok()
    }
    fn blob(&mut self) -> Option<&'a [u8]> {
        let n = self.u32()? as usize;
        self.bytes(n)
    }
    /// Reads a std_msgs/Header.
    fn header(&mut self) -> Option<Header> {
        let time = (self.u32()? as i32, self.u32()?);
        // A name that is no UTF-8 is no reason to lose the message.
        let frame_id = self.blob().map(|name| String::from_utf8_lossy(name.strip_suffix(&[0]).unwrap_or(name)));
        Some(Header { time: Some(time), frame_id: frame_id.unwrap_or_default().into_owned() })
    }
}

/// Reason for a message that is shorter than its fields.
const SHORT: &str = "the message ends too early";

/// Reads a picture and its header from `sensor_msgs/msg/Image` or `sensor_msgs/msg/CompressedImage`.
pub(crate) fn parse_image(schema: &str, message: &[u8]) -> Decoded {
    let Some(mut c) = Cdr::try_new(message) else { return Decoded::without_header("unknown CDR encapsulation") };
    let Some(header) = c.header() else { return Decoded::without_header(SHORT) };
    Decoded { image: parse_pixels(schema, &mut c), header: Some(header) }
}

/// Reads the stamp of a message that begins with a header, from its first bytes; `None` if the header cannot be read.
pub(crate) fn parse_stamp(message: &[u8]) -> Option<(i32, u32)> {
    Cdr::try_new(message)?.header()?.time
}

/// Reads what follows the header.
fn parse_pixels(schema: &str, c: &mut Cdr<'_>) -> Result<EncodedImage, String> {
    let short = || SHORT.to_owned();
    if schema == "sensor_msgs/msg/CompressedImage" {
        let (format, data) = c.text().zip(c.blob()).ok_or_else(short)?;
        return Ok(EncodedImage { format: compressed_format(format), bytes: data.to_vec() });
    }
    let fields = (|| Some((c.u32()?, c.u32()?, c.text()?, c.u8()?, c.u32()?, c.blob()?)))();
    let (height, width, encoding, big_endian, step, data) = fields.ok_or_else(short)?;
    raw_format(width, height, step, encoding, big_endian != 0, data)
}

/// Largest number of coefficients of a distortion; the models of ROS have at most 14.
const MAX_COEFFICIENTS: usize = 64;

/// Reads a `sensor_msgs/msg/CameraInfo`.
pub(crate) fn parse_camera_info(message: &[u8]) -> Result<CameraInfo, String> {
    let mut c = Cdr::try_new(message).ok_or("unknown CDR encapsulation")?;
    let (size_px, model, count) = (|| {
        c.header()?;
        let (height, width) = (c.u32()?, c.u32()?);
        Some(([width, height], c.text()?.to_owned(), c.u32()? as usize))
    })()
    .ok_or(SHORT)?;
    if count > MAX_COEFFICIENTS {
        return Err(format!("d has {count} coefficients; a lens of ROS has at most 14"));
    }
    let rest = (|| {
        let distortion = (0..count).map(|_| c.f64()).collect::<Option<_>>()?;
        let matrix = c.numbers()?;
        // The rotation of the rectification.
        c.numbers::<9>()?;
        let projection = c.numbers()?;
        let binning = [c.u32()?, c.u32()?];
        let offset_px = [c.u32()?, c.u32()?];
        let (height, width) = (c.u32()?, c.u32()?);
        let roi = Region { offset_px, size_px: [width, height] };
        Some(CameraInfo { size_px, model, distortion, matrix, projection, binning, roi })
    })();
    rest.ok_or_else(|| SHORT.to_owned())
}

/// Reads a `sensor_msgs/msg/Imu`: header, rates and specific forces. `None` if it ends too early.
pub(crate) fn parse_imu(message: &[u8]) -> Option<(Header, [[f64; 3]; 2])> {
    let mut c = Cdr::try_new(message)?;
    let head = c.header()?;
    // The orientation and its covariance.
    c.numbers::<13>()?;
    let mut vector = || {
        let values = c.numbers::<3>()?;
        // A covariance that begins with -1 says that the message does not have the values.
        let [first, ..] = c.numbers::<9>()?;
        Some(if first == -1.0 { [f64::NAN; 3] } else { values })
    };
    let both = [vector()?, vector()?];
    Some((head, both))
}

/// What a `sensor_msgs/msg/NavSatFix` says.
pub(crate) struct NavSatFix {
    pub(crate) header: Header,
    pub(crate) has_fix: bool,
    /// Latitude and longitude in degrees, height in metres.
    pub(crate) place: [f64; 3],
    /// Variances to east, north and up in m², if they are known.
    pub(crate) variances_m2: Option<[f64; 3]>,
}

/// Reads a `sensor_msgs/msg/NavSatFix`; `None` if it ends too early.
pub(crate) fn parse_fix(message: &[u8]) -> Option<NavSatFix> {
    let mut c = Cdr::try_new(message)?;
    let header = c.header()?;
    // The status: -1 is no fix. The services, a number of two bytes, follow.
    let status = c.u8()? as i8;
    c.at = c.at.next_multiple_of(2);
    c.bytes(2)?;
    let place = c.numbers()?;
    let [xx, _, _, _, yy, _, _, _, zz] = c.numbers()?;
    let is_known = c.u8()? != 0;
    Some(NavSatFix { header, has_fix: status >= 0, place, variances_m2: is_known.then_some([xx, yy, zz]) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::ImageFormat;

    fn message() -> Vec<u8> {
        let mut m = vec![0, 1, 0, 0];
        let put = |m: &mut Vec<u8>, x: u32| {
            while !m.len().is_multiple_of(4) {
                m.push(0);
            }
            m.extend_from_slice(&x.to_le_bytes());
        };
        put(&mut m, 12);
        put(&mut m, 500_000_000);
        put(&mut m, 4);
        m.extend_from_slice(b"cam\0");
        put(&mut m, 1); // height
        put(&mut m, 2); // width
        put(&mut m, 6);
        m.extend_from_slice(b"mono8\0");
        m.push(0);
        put(&mut m, 2); // step
        put(&mut m, 2);
        m.extend_from_slice(&[7, 9]);
        m
    }

    #[test]
    fn a_ros_image_is_read_and_a_cut_one_is_not() {
        let m = message();
        let read = |m: &[u8]| parse_image("sensor_msgs/msg/Image", m);
        let Decoded { image, header } = read(&m);
        let expected = EncodedImage { format: ImageFormat::Mono8 { width: 2, height: 1 }, bytes: vec![7, 9] };
        assert_eq!(image, Ok(expected.clone()));
        let time = Some((12, 500_000_000));
        assert_eq!(header, Some(Header { time, frame_id: "cam".into() }));
        for n in 0..m.len() {
            let cut = read(&m[..n]);
            assert!(cut.image.is_err(), "{n}");
            // The stamp is the first field: the encapsulation and eight bytes.
            assert_eq!(cut.header.and_then(|header| header.time), time.filter(|_| n >= 12), "{n}");
        }
        // The stamp is there for an encoding that hzn does not know, and for a name that is no UTF-8.
        let at = m.windows(5).position(|w| w == b"mono8").unwrap();
        let mut other = m.clone();
        other[at] = b'?';
        let Decoded { image, header } = read(&other);
        assert!(image.unwrap_err().contains("encoding \"?ono8\""));
        assert_eq!(header.unwrap().time, time);
        let mut other = m.clone();
        other[16] = 0xff;
        let Decoded { image, header } = read(&other);
        assert_eq!((image, header.unwrap().frame_id), (Ok(expected), "\u{fffd}am".to_owned()));
    }
}
