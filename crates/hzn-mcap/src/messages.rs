//! Conversion of frames to Foxglove's messages and back; `drawing` converts the annotations. No other module depends on
//! Foxglove's conventions.

use foxglove::messages::{
    CameraCalibration, CompressedImage, FrameTransform, Log, Pose, PoseInFrame, Quaternion, RawImage, Timestamp,
    Vector3, log::Level,
};
use hzn_core::camera;
use hzn_files::FrameData;
use prost::Message;
use serde_json::{Map, Value};

use crate::frame::{Attitude, CandidateEdge, EncodedImage, FrameRecord, ImageFormat, LogLevel, LogLine};
use crate::header::{Decoded, Header};
use crate::raw_images::raw_format;
use crate::row::Row;
use crate::topics::Topic;

/// Name of the camera frame of a recording with one camera; with several, the frames have the names of the heads.
pub(crate) const CAMERA: &str = "camera";
/// Name of the vehicle's frame, for the joint axis of several heads.
pub(crate) const VEHICLE: &str = "vehicle";
/// Name of the frame that is fixed in the body, for the camera's attitude.
const FIXED: &str = "fixed";

/// Converts a time in seconds to a log time in nanoseconds. Foxglove's messages cannot represent times before 0 and
/// after the year 2106. These times are clamped to the limit, and NaN becomes 0; the row keeps the exact time.
pub(crate) fn time_ns(time_s: f64) -> u64 {
    const MAX_S: f64 = u32::MAX as f64;
    // The cast converts NaN to 0.
    (time_s.clamp(0.0, MAX_S) * 1e9).round() as u64
}

pub(crate) fn stamp(ns: u64) -> Option<Timestamp> {
    Timestamp::new_checked(u32::try_from(ns / 1_000_000_000).ok()?, (ns % 1_000_000_000) as u32)
}

/// Appends a message to a buffer. This cannot fail, because the buffer grows.
pub(crate) fn append<M: Message>(message: &M, buffer: &mut Vec<u8>) {
    message.encode_raw(buffer);
}

/// Writes the JSON of `/hzn/report`: the row without its empty cells, the candidates, and the prior of the picture.
pub(crate) fn report(frame: &FrameRecord) -> Vec<u8> {
    let mut map = match serde_json::to_value(&frame.row) {
        Ok(Value::Object(map)) => map,
        _ => Map::new(),
    };
    map.retain(|_, v| !v.is_null());
    map.insert("candidate_edges".into(), serde_json::to_value(&frame.candidates).unwrap_or_default());
    if let Ok(Value::Object(prior)) = serde_json::to_value(&frame.prior)
        && !prior.is_empty()
    {
        map.insert("prior".into(), prior.into());
    }
    serde_json::to_vec(&map).unwrap_or_default()
}

/// Reads a report: the row, the candidates, and the prior of the picture.
pub(crate) fn parse_report(data: &[u8]) -> Result<(Row, Vec<CandidateEdge>, FrameData), serde_json::Error> {
    let mut value: Value = serde_json::from_slice(data)?;
    let mut part = |key: &str| value.as_object_mut().and_then(|map| map.remove(key));
    let edges = part("candidate_edges").unwrap_or(Value::Array(Vec::new()));
    let prior = part("prior").map_or(Ok(FrameData::default()), serde_json::from_value)?;
    Ok((serde_json::from_value(value)?, serde_json::from_value(edges)?, prior))
}

/// Appends a picture as a message. The bytes are copied only once, directly into the buffer, because pictures are
/// almost all of a recording.
pub(crate) fn image(image: &EncodedImage, frame_id: &str, ns: u64, buffer: &mut Vec<u8>) {
    /// Field numbers of `data` in `foxglove.CompressedImage` and `foxglove.RawImage`.
    const COMPRESSED_DATA: u32 = 2;
    const RAW_DATA: u32 = 6;
    buffer.reserve(image.bytes.len() + 128);
    let raw = |buffer: &mut Vec<u8>, width: u32, height: u32, encoding: &str, bytes_per_pixel: u32| {
        let message = RawImage {
            timestamp: stamp(ns),
            frame_id: frame_id.into(),
            width,
            height,
            encoding: encoding.into(),
            step: width.saturating_mul(bytes_per_pixel),
            ..RawImage::default()
        };
        append(&message, buffer);
        RAW_DATA
    };
    let compressed = |buffer: &mut Vec<u8>, format: &str| {
        let message = CompressedImage {
            timestamp: stamp(ns),
            frame_id: frame_id.into(),
            format: format.into(),
            ..CompressedImage::default()
        };
        append(&message, buffer);
        COMPRESSED_DATA
    };
    let field = match &image.format {
        ImageFormat::Png => compressed(buffer, "png"),
        ImageFormat::Jpeg => compressed(buffer, "jpeg"),
        ImageFormat::Other(name) => compressed(buffer, name),
        ImageFormat::Mono8 { width, height } => raw(buffer, *width, *height, "mono8", 1),
        ImageFormat::Mono16 { width, height } => raw(buffer, *width, *height, "mono16", 2),
        ImageFormat::Rgb8 { width, height } => raw(buffer, *width, *height, "rgb8", 3),
        ImageFormat::Rgb16 { width, height } => raw(buffer, *width, *height, "rgb16", 6),
    };
    prost::encoding::encode_key(field, prost::encoding::WireType::LengthDelimited, buffer);
    prost::encoding::encode_varint(image.bytes.len() as u64, buffer);
    buffer.extend_from_slice(&image.bytes);
}

/// Returns the topic for pictures of this format.
pub(crate) fn image_topic(format: &ImageFormat) -> Topic {
    match format {
        ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Other(_) => Topic::Image,
        ImageFormat::Mono8 { .. }
        | ImageFormat::Mono16 { .. }
        | ImageFormat::Rgb8 { .. }
        | ImageFormat::Rgb16 { .. } => Topic::RawImage,
    }
}

/// Returns the format for the format name of a compressed picture. ROS writes names like `rgb8; jpeg compressed bgr8`.
pub(crate) fn compressed_format(name: &str) -> ImageFormat {
    let name = name.to_ascii_lowercase();
    if name.contains("png") {
        ImageFormat::Png
    } else if name.contains("jpeg") || name.contains("jpg") {
        ImageFormat::Jpeg
    } else {
        ImageFormat::Other(name)
    }
}

/// Reads a picture from a protobuf message with this schema.
pub(crate) fn parse_image(schema: &str, data: &[u8]) -> Decoded {
    // The log time counts for these messages.
    let header = |frame_id: String| Some(Header { time: None, frame_id });
    match schema {
        "foxglove.CompressedImage" => match CompressedImage::decode(data) {
            Ok(m) => {
                let image = EncodedImage { format: compressed_format(&m.format), bytes: m.data.into() };
                Decoded { image: Ok(image), header: header(m.frame_id) }
            }
            Err(e) => Decoded { image: Err(e.to_string()), header: header(String::new()) },
        },
        "foxglove.RawImage" => match RawImage::decode(data) {
            Ok(m) => {
                let image = raw_format(m.width, m.height, m.step, &m.encoding, false, &m.data);
                Decoded { image, header: header(m.frame_id) }
            }
            Err(e) => Decoded { image: Err(e.to_string()), header: header(String::new()) },
        },
        other => Decoded::without_header(format!("{other} is not a picture")),
    }
}

/// Returns the axis in a frame as a pose at the origin of the frame whose x axis points along it.
pub(crate) fn axis([x, y, z]: [f64; 3], frame_id: &str, ns: u64) -> PoseInFrame {
    // The shortest rotation from +x to the axis is (1 + x, +x × axis), normalised; half a turn about z if they are
    // opposite.
    let n = ((1.0 + x).powi(2) + y * y + z * z).sqrt();
    let orientation = if n > 1e-9 {
        Quaternion { w: (1.0 + x) / n, x: 0.0, y: -z / n, z: y / n }
    } else {
        Quaternion { w: 0.0, x: 0.0, y: 0.0, z: 1.0 }
    };
    let pose = Pose { position: Some(Vector3 { x: 0.0, y: 0.0, z: 0.0 }), orientation: Some(orientation) };
    PoseInFrame { timestamp: stamp(ns), frame_id: frame_id.into(), pose: Some(pose) }
}

pub(crate) fn transform(attitude: &Attitude, frame_id: &str, ns: u64) -> FrameTransform {
    let [w, x, y, z] = attitude.q_fixed_from_camera_wxyz;
    let [px, py, pz] = attitude.position_m;
    FrameTransform {
        timestamp: stamp(ns),
        parent_frame_id: FIXED.into(),
        child_frame_id: frame_id.into(),
        translation: Some(Vector3 { x: px, y: py, z: pz }),
        rotation: Some(Quaternion { x, y, z, w }),
    }
}

pub(crate) fn parse_transform(data: &[u8]) -> Result<Option<Attitude>, prost::DecodeError> {
    let m = FrameTransform::decode(data)?;
    Ok(m.rotation
        .zip(m.translation)
        .map(|(q, t)| Attitude { q_fixed_from_camera_wxyz: [q.w, q.x, q.y, q.z], position_m: [t.x, t.y, t.z] }))
}

/// Returns a log line. The message begins with the picture's name, because the log panel does not show `file`.
pub(crate) fn log(line: &LogLine, file: &str, ns: u64) -> Log {
    let level = match line.level {
        LogLevel::Info => Level::Info,
        LogLevel::Warning => Level::Warning,
        LogLevel::Error => Level::Error,
    };
    Log {
        timestamp: stamp(ns),
        level: level as i32,
        message: format!("{file}: {}", line.message),
        name: "hzn".into(),
        file: file.into(),
        line: 0,
    }
}

pub(crate) fn parse_log(data: &[u8]) -> Result<LogLine, prost::DecodeError> {
    let m = Log::decode(data)?;
    let level = match m.level() {
        Level::Error | Level::Fatal => LogLevel::Error,
        Level::Warning => LogLevel::Warning,
        _ => LogLevel::Info,
    };
    let own = m.message.strip_prefix(&m.file).and_then(|rest| rest.strip_prefix(": "));
    Ok(LogLine { level, message: own.map(str::to_owned).unwrap_or(m.message) })
}

/// Returns the calibration. Its principal point uses hzn's convention, which ROS also has: pixel centres at integers.
pub(crate) fn calibration(c: &camera::Config, frame_id: &str, ns: u64) -> CameraCalibration {
    let (model, coefficients) = match c.model.projection() {
        camera::Projection::Angle => ("kannala_brandt", 4),
        camera::Projection::Plane => ("plumb_bob", 5),
        // Foxglove has no name for these models, so other viewers draw without distortion.
        camera::Projection::Own => ("", 0),
    };
    let (fx, fy, cx, cy) = (c.fx_px, c.fy_px, c.cx_px, c.cy_px);
    CameraCalibration {
        timestamp: stamp(ns),
        frame_id: frame_id.into(),
        width: c.width.into(),
        height: c.height.into(),
        distortion_model: model.into(),
        d: (0..coefficients).map(|i| c.coefficient(i)).collect(),
        k: vec![fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        r: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: vec![fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pose_turns_x_to_the_axis() {
        for axis_xyz in [[0.0, 0.6, 0.8], [0.48, -0.6, 0.64], [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]] {
            let q = axis(axis_xyz, CAMERA, 0).pose.unwrap().orientation.unwrap();
            let (w, x, y, z) = (q.w, q.x, q.y, q.z);
            let turned = [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)];
            for (a, b) in turned.iter().zip(axis_xyz) {
                assert!((a - b).abs() < 1e-12, "{turned:?}");
            }
        }
    }

    #[test]
    fn times_outside_of_foxglove_are_held_at_the_limit() {
        assert_eq!(time_ns(1.5), 1_500_000_000);
        assert_eq!((time_ns(-3.0), time_ns(f64::NAN)), (0, 0));
        assert_eq!(time_ns(1e30), u64::from(u32::MAX) * 1_000_000_000);
        assert!(stamp(time_ns(1e30)).is_some());
    }
}
