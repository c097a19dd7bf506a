//! Topics, their schemas, and their numbers in recordings of hzn.

use foxglove::Encode;
use foxglove::messages::{
    CameraCalibration, CompressedImage, FrameTransform, ImageAnnotations, Log, PoseInFrame, RawImage,
};
use hzn_core::status::Status;
use serde_json::{Map, Value, json};

use crate::container::Channel;
use crate::ros;
use crate::row::Row;

/// Schema of the fields on `/hzn/report` that are not columns of a row.
const FURTHER: &str = include_str!("../schema/further.json");

/// Returns the JSON Schema of the messages on `/hzn/report`, named `hzn.Report`. Fields that are empty cells in a table
/// are left out of a message.
pub fn report_schema() -> serde_json::Value {
    let mut properties: Map<String, Value> = serde_json::from_str(FURTHER).unwrap_or_default();
    for (name, json_type, _, doc) in Row::CELLS {
        let mut property = json!({"type": json_type, "description": doc.trim()});
        if *name == "status" {
            property["enum"] = Status::ALL.iter().map(|status| status.name()).collect();
        }
        properties.insert((*name).to_owned(), property);
    }
    let required: Vec<_> = Row::CELLS.iter().filter(|(_, _, always, _)| *always).map(|(name, ..)| name).collect();
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "hzn.Report",
        "description": "Result of one picture and body. Cells without a value are left out.",
        "type": "object",
        "required": required,
        "properties": properties,
    })
}

/// The topic of the pictures in recordings of hzn.
pub const IMAGE_TOPIC: &str = "/camera/image";

/// Step from the channels of a head to those of the next one.
const HEAD_STEP: u16 = 16;

/// A topic; its number is the id of its channel and of its schema.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u16)]
pub(crate) enum Topic {
    Report = 1,
    Image = 2,
    Calibration = 3,
    Annotations = 4,
    Axis = 5,
    Transform = 6,
    Log = 7,
    RawImage = 8,
    /// The axis for ROS.
    AxisVector = 9,
    /// The covariance of the axis for ROS.
    AxisCovariance = 10,
}

impl Topic {
    pub(crate) const ALL: [Self; 10] = [
        Self::Report,
        Self::Image,
        Self::Calibration,
        Self::Annotations,
        Self::Axis,
        Self::Transform,
        Self::Log,
        Self::RawImage,
        Self::AxisVector,
        Self::AxisCovariance,
    ];

    /// Returns the topic of a channel that a recording declares; `None` if hzn has no such topic, or if its messages
    /// have another schema there.
    pub(crate) fn of(channel: &Channel) -> Option<Self> {
        Self::with_head(channel).filter(|(_, head)| head.is_empty()).map(|(topic, _)| topic)
    }

    /// Returns the topic of a channel and the name of the head of a rig that it belongs to, see [`Self::of_head`]. The
    /// name is empty for the joint answer of a rig, and for a single camera.
    pub(crate) fn with_head(channel: &Channel) -> Option<(Self, &str)> {
        let head = |topic: Self| match channel.topic.strip_suffix(topic.name())? {
            "" => Some(""),
            before => before.strip_prefix('/').filter(|head| !head.contains('/')),
        };
        let mut known = Self::ALL.into_iter().filter(|topic| topic.schema().0 == channel.schema);
        known.find_map(|topic| Some((topic, head(topic)?)))
    }

    pub(crate) fn id(self) -> u16 {
        self as u16
    }
    /// Returns the id and the name of this topic's channel for a head of a rig. The reports of all heads are on one
    /// topic, so that a reader finds them; the column `head` tells them apart.
    pub(crate) fn of_head(self, number: usize, name: &str) -> (u16, String) {
        match self {
            Self::Report => (self.id(), self.name().to_owned()),
            _ => ((number as u16 + 1) * HEAD_STEP + self.id(), format!("/{name}{}", self.name())),
        }
    }
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Report => "/hzn/report",
            Self::Image | Self::RawImage => IMAGE_TOPIC,
            Self::Calibration => "/camera/calibration",
            Self::Annotations => "/camera/annotations",
            Self::Axis => "/hzn/axis",
            Self::Transform => "/tf",
            Self::AxisVector => "/hzn/axis_vector",
            Self::AxisCovariance => "/hzn/axis_covariance",
            Self::Log => "/log",
        }
    }
    /// Returns name, encoding and bytes of the schema, and the encoding of the messages.
    pub(crate) fn schema(self) -> (String, String, Vec<u8>, &'static str) {
        fn protobuf<M: Encode>() -> (String, String, Vec<u8>, &'static str) {
            M::get_schema().map_or_else(Default::default, |s| (s.name, s.encoding, s.data.into_owned(), "protobuf"))
        }
        let ros = |name: &str, text: &str| (name.to_owned(), "ros2msg".to_owned(), text.as_bytes().to_vec(), "cdr");
        match self {
            Self::Report => ("hzn.Report".into(), "jsonschema".into(), report_schema().to_string().into(), "json"),
            Self::Image => protobuf::<CompressedImage>(),
            Self::Calibration => protobuf::<CameraCalibration>(),
            Self::Annotations => protobuf::<ImageAnnotations>(),
            Self::Axis => protobuf::<PoseInFrame>(),
            Self::Transform => protobuf::<FrameTransform>(),
            Self::Log => protobuf::<Log>(),
            Self::RawImage => protobuf::<RawImage>(),
            Self::AxisVector => ros("geometry_msgs/msg/Vector3Stamped", ros::VECTOR),
            Self::AxisCovariance => ros("std_msgs/msg/Float64MultiArray", ros::MATRIX),
        }
    }
}
