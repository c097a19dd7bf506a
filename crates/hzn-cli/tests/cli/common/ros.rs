//! Messages of ROS 2 in CDR, lower byte first, and recordings of them.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use mcap::records::MessageHeader;

/// Seconds and nanoseconds.
pub type Stamp = (u32, u32);

/// A message in a recording: log time in nanoseconds, topic, type, bytes.
pub type Logged<'a> = (u64, &'a str, &'a str, Vec<u8>);

/// Writes a recording of messages of `sensor_msgs`, each in a chunk of its own.
pub fn write(path: &Path, messages: &[Logged<'_>]) {
    let options = mcap::WriteOptions::new().chunk_size(Some(1));
    let mut writer = options.create(fs::File::create(path).unwrap()).unwrap();
    for (log_time, topic, kind, data) in messages {
        let schema = writer.add_schema(&format!("sensor_msgs/msg/{kind}"), "ros2msg", b"").unwrap();
        let channel_id = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap();
        let header = MessageHeader { channel_id, sequence: 0, log_time: *log_time, publish_time: *log_time };
        writer.write_to_known_channel(&header, data).unwrap();
    }
    writer.finish().unwrap();
}

/// Appends a number of 4 bytes, which begins at a multiple of 4 after the encapsulation.
pub fn push_word(message: &mut Vec<u8>, word: u32) {
    message.resize(message.len().next_multiple_of(4), 0);
    message.extend_from_slice(&word.to_le_bytes());
}

/// Appends a text or a list of bytes, which begins with its length.
pub fn push_blob(message: &mut Vec<u8>, bytes: &[u8]) {
    push_word(message, bytes.len() as u32);
    message.extend_from_slice(bytes);
}

/// Appends numbers of 8 bytes, which begin at a multiple of 8 after the encapsulation.
pub fn push_numbers(message: &mut Vec<u8>, numbers: &[f64]) {
    message.resize((message.len() - 4).next_multiple_of(8) + 4, 0);
    message.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
}

/// Returns the beginning of a message: encapsulation and header.
pub fn stamped((s, ns): Stamp, frame: &str) -> Vec<u8> {
    let mut message = vec![0, 1, 0, 0];
    push_word(&mut message, s);
    push_word(&mut message, ns);
    push_blob(&mut message, format!("{frame}\0").as_bytes());
    message
}

/// Returns a `CompressedImage` with these bytes.
pub fn compressed_image(stamp: Stamp, frame: &str, bytes: &[u8]) -> Vec<u8> {
    let mut message = stamped(stamp, frame);
    push_blob(&mut message, b"png\0");
    push_blob(&mut message, bytes);
    message
}

/// Returns a grey picture as an `Image` of this encoding.
pub fn raw_image(stamp: Stamp, encoding: &str, picture: &image::GrayImage) -> Vec<u8> {
    let mut message = stamped(stamp, "front_optical");
    push_word(&mut message, picture.height());
    push_word(&mut message, picture.width());
    push_blob(&mut message, format!("{encoding}\0").as_bytes());
    message.push(0);
    push_word(&mut message, picture.width());
    push_blob(&mut message, picture.as_raw());
    message
}

/// Returns a picture as PNG.
pub fn png(picture: &image::GrayImage) -> Vec<u8> {
    let mut png = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut png, image::ImageFormat::Png).unwrap();
    png.into_inner()
}

/// A `CameraInfo`.
pub struct CameraInfo<'a> {
    /// Columns and rows of the whole picture.
    pub size: [u32; 2],
    pub model: &'a str,
    pub distortion: &'a [f64],
    pub matrix: [f64; 9],
    /// The left part of the projection, whose last column is 0.
    pub projection: [f64; 9],
    pub binning: [u32; 2],
    /// Column and row of the region of interest, its columns and its rows.
    pub roi: [u32; 4],
}

impl CameraInfo<'_> {
    pub fn message(&self) -> Vec<u8> {
        let mut message = stamped((0, 0), "cam");
        push_word(&mut message, self.size[1]);
        push_word(&mut message, self.size[0]);
        push_blob(&mut message, format!("{}\0", self.model).as_bytes());
        push_word(&mut message, self.distortion.len() as u32);
        push_numbers(&mut message, self.distortion);
        push_numbers(&mut message, &self.matrix);
        push_numbers(&mut message, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
        for row in self.projection.chunks(3) {
            push_numbers(&mut message, row);
            push_numbers(&mut message, &[0.0]);
        }
        let [x, y, width, height] = self.roi;
        for word in [self.binning[0], self.binning[1], x, y, height, width] {
            push_word(&mut message, word);
        }
        message.push(0);
        message
    }
}
