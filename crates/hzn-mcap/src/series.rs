//! A recording of series over time: JSON with a schema, frames and poses. It has no pictures.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use foxglove::Encode;
use foxglove::messages::{FrameTransform, Pose, PoseInFrame, Quaternion, Vector3};
use prost::Message;
use serde::Serialize;
use serde_json::{Value, json};

use crate::error::Error;
use crate::messages::{stamp, time_ns};
use crate::part::{part_path, publish};

/// A place and an attitude relative to a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed<'a> {
    /// Name of the frame.
    pub frame: &'a str,
    /// Position, m.
    pub position_m: [f64; 3],
    /// Attitude as a quaternion to the frame, scalar first.
    pub q_frame_from_placed_wxyz: [f64; 4],
}

/// A recording that is being written. It gets its name when it is finished.
///
/// ```
/// use hzn_mcap::{SeriesWriter, read_series};
/// use serde_json::json;
///
/// # let folder = tempfile::tempdir()?;
/// let path = folder.path().join("nav.mcap");
/// let mut series = SeriesWriter::create(&path)?;
/// series.json("/nav/state", "hzn.NavState", 0.5, &json!({ "time_s": 0.5 }))?;
/// series.finish()?;
///
/// let mut messages = Vec::new();
/// let is_state = |topic: &str| topic == "/nav/state";
/// read_series(&path, is_state, |_, json| messages.push(String::from_utf8_lossy(json).into_owned()))?;
/// assert_eq!(messages, ["{\"time_s\":0.5}"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct SeriesWriter {
    writer: mcap::Writer<BufWriter<File>>,
    path: PathBuf,
    channels: BTreeMap<String, u16>,
    sequence: u32,
}

impl core::fmt::Debug for SeriesWriter {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("SeriesWriter").field("path", &self.path).finish_non_exhaustive()
    }
}

impl SeriesWriter {
    /// Begins a recording with the final name `path`.
    ///
    /// # Errors
    /// The folder cannot be written to.
    pub fn create(path: &Path) -> Result<Self, Error> {
        let refuse = |source| Error::Write { path: path.to_owned(), source };
        let file = File::create(part_path(path)).map_err(refuse)?;
        let options = mcap::WriteOptions::new().library(concat!("hzn ", env!("CARGO_PKG_VERSION")));
        let writer = options.create(BufWriter::new(file)).map_err(|e| refuse(to_io(e)))?;
        Ok(Self { writer, path: path.to_owned(), channels: BTreeMap::new(), sequence: 0 })
    }

    /// Attaches a text.
    ///
    /// # Errors
    /// The disk is full or broken.
    pub fn attach(&mut self, name: &str, media_type: &str, text: &str) -> Result<(), Error> {
        let attachment = mcap::Attachment {
            log_time: 0,
            create_time: 0,
            name: name.to_owned(),
            media_type: media_type.to_owned(),
            data: text.as_bytes().into(),
        };
        self.writer.attach(&attachment).map_err(to_io).map_err(|e| self.refuse(e))
    }

    /// Appends a value as JSON. The schema of a topic is that of its first value; a value that is missing there counts
    /// as a number.
    ///
    /// # Errors
    /// The disk is full or broken.
    pub fn json(&mut self, topic: &str, schema: &str, time_s: f64, value: &impl Serialize) -> Result<(), Error> {
        let value = serde_json::to_value(value).unwrap_or_default();
        let channel = match self.channels.get(topic) {
            Some(channel) => *channel,
            None => {
                let text = schema_of(schema, &value).to_string();
                self.channel(topic, schema, "jsonschema", text.as_bytes(), "json")?
            }
        };
        self.message(channel, time_s, &serde_json::to_vec(&value).unwrap_or_default())
    }

    /// Appends the place of a frame in another one, for `/tf`.
    ///
    /// # Errors
    /// The disk is full or broken.
    pub fn transform(&mut self, time_s: f64, child: &str, placed: &Placed<'_>) -> Result<(), Error> {
        let ns = time_ns(time_s);
        let (translation, rotation) = parts(placed);
        let message = FrameTransform {
            timestamp: stamp(ns),
            parent_frame_id: placed.frame.into(),
            child_frame_id: child.into(),
            translation: Some(translation),
            rotation: Some(rotation),
        };
        self.protobuf("/tf", time_s, &message)
    }

    /// Appends a pose.
    ///
    /// # Errors
    /// The disk is full or broken.
    pub fn pose(&mut self, topic: &str, time_s: f64, placed: &Placed<'_>) -> Result<(), Error> {
        let (position, orientation) = parts(placed);
        let pose = Pose { position: Some(position), orientation: Some(orientation) };
        let message =
            PoseInFrame { timestamp: stamp(time_ns(time_s)), frame_id: placed.frame.into(), pose: Some(pose) };
        self.protobuf(topic, time_s, &message)
    }

    /// Ends the recording and gives it its name.
    ///
    /// # Errors
    /// The disk is full or broken.
    pub fn finish(mut self) -> Result<(), Error> {
        self.writer.finish().map_err(to_io).map_err(|e| self.refuse(e))?;
        let refuse = |source| Error::Write { path: self.path.clone(), source };
        let file = self.writer.into_inner();
        publish(file.get_ref(), &part_path(&self.path), &self.path).map_err(refuse)
    }

    fn protobuf<M: Message + Encode>(&mut self, topic: &str, time_s: f64, message: &M) -> Result<(), Error> {
        let channel = match (self.channels.get(topic), M::get_schema()) {
            (Some(channel), _) => *channel,
            (None, Some(schema)) => self.channel(topic, &schema.name, &schema.encoding, &schema.data, "protobuf")?,
            (None, None) => self.channel(topic, "", "", &[], "protobuf")?,
        };
        self.message(channel, time_s, &message.encode_to_vec())
    }

    fn channel(
        &mut self,
        topic: &str,
        schema: &str,
        schema_encoding: &str,
        data: &[u8],
        encoding: &str,
    ) -> Result<u16, Error> {
        let id = self.writer.add_schema(schema, schema_encoding, data).map_err(to_io).map_err(|e| self.refuse(e))?;
        let added = self.writer.add_channel(id, topic, encoding, &BTreeMap::new());
        let channel = added.map_err(to_io).map_err(|e| self.refuse(e))?;
        self.channels.insert(topic.to_owned(), channel);
        Ok(channel)
    }

    fn message(&mut self, channel_id: u16, time_s: f64, data: &[u8]) -> Result<(), Error> {
        let ns = time_ns(time_s);
        self.sequence += 1;
        let header =
            mcap::records::MessageHeader { channel_id, sequence: self.sequence, log_time: ns, publish_time: ns };
        self.writer.write_to_known_channel(&header, data).map_err(to_io).map_err(|e| self.refuse(e))
    }

    fn refuse(&self, source: std::io::Error) -> Error {
        Error::Write { path: self.path.clone(), source }
    }
}

fn to_io(error: mcap::McapError) -> std::io::Error {
    match error {
        mcap::McapError::Io(e) => e,
        e => std::io::Error::other(e),
    }
}

fn parts(placed: &Placed<'_>) -> (Vector3, Quaternion) {
    let ([x, y, z], [w, i, j, k]) = (placed.position_m, placed.q_frame_from_placed_wxyz);
    (Vector3 { x, y, z }, Quaternion { x: i, y: j, z: k, w })
}

/// Returns a JSON Schema that describes a value.
fn schema_of(title: &str, value: &Value) -> Value {
    let mut schema = describe(value);
    schema["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    schema["title"] = json!(title);
    schema
}

fn describe(value: &Value) -> Value {
    match value {
        Value::Null | Value::Number(_) => json!({"type": "number"}),
        Value::Bool(_) => json!({"type": "boolean"}),
        Value::String(_) => json!({"type": "string"}),
        Value::Array(all) => {
            json!({"type": "array", "items": all.first().map_or_else(|| json!({"type": "number"}), describe)})
        }
        Value::Object(map) => {
            let properties: serde_json::Map<String, Value> =
                map.iter().map(|(name, value)| (name.clone(), describe(value))).collect();
            json!({"type": "object", "properties": properties})
        }
    }
}
