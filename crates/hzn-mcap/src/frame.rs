//! Everything that a recording keeps about one frame.

use hzn_core::Report;
use hzn_core::real::Real;
use serde::{Deserialize, Serialize};

use crate::row::Row;

/// One frame (of one body) in a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameRecord {
    /// The result.
    pub row: Row,
    /// The edges that were looked at.
    pub candidates: Vec<CandidateEdge>,
    /// The picture; `None` leaves it out.
    pub image: Option<EncodedImage>,
    /// What is drawn over the picture.
    pub annotations: Annotations,
    /// Attitude of the camera, when it is known.
    pub attitude: Option<Attitude>,
    /// What was known about the picture beforehand; with it the same answer can be worked out again.
    pub given: Given,
    /// Messages about this frame.
    pub log: Vec<LogLine>,
}

impl FrameRecord {
    /// A frame with its result alone.
    pub fn new(row: Row) -> Self {
        Self {
            row,
            candidates: Vec::new(),
            image: None,
            annotations: Annotations::default(),
            attitude: None,
            given: Given::default(),
            log: Vec::new(),
        }
    }
}

/// One candidate edge of a report, in the form files hold it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CandidateEdge {
    /// Border pixels of the edge.
    pub length_px: u32,
    /// Sub-pixel points taken from it.
    pub points: u32,
    /// Points that fit the limb.
    pub inliers: u32,
    /// Weighted RMS distance of the inliers from the fitted limb, pixels; `None` without a fit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rms_px: Option<f64>,
    /// What became of it, by its name such as `short-arc`.
    pub verdict: String,
}

impl CandidateEdge {
    /// The candidates of a report, in order.
    pub fn from_report<T: Real>(report: &Report<T>) -> Vec<Self> {
        let edge = |c: &hzn_core::report::Candidate<T>| Self {
            length_px: c.length_px,
            points: c.points,
            inliers: c.inliers,
            rms_px: Some(c.rms_px.to_f64()).filter(|x| x.is_finite()),
            verdict: c.verdict.name().to_owned(),
        };
        report.candidates.iter().map(edge).collect()
    }
}

/// A picture in the bytes it came in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EncodedImage {
    /// How the bytes are to be read.
    pub format: ImageFormat,
    /// The bytes: a whole file for PNG and JPEG, rows without padding for raw pictures.
    pub bytes: Vec<u8>,
}

/// How the bytes of a picture are to be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ImageFormat {
    /// A PNG file.
    Png,
    /// A JPEG file.
    Jpeg,
    /// Another compressed format by its lower-case name, such as `webp`; read from foreign recordings.
    Other(String),
    /// One byte a pixel.
    Mono8 {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// Two bytes a pixel, the low one first.
    Mono16 {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// Three bytes a pixel: red, green, blue.
    Rgb8 {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
}

/// What is drawn over a picture. Points are `[x, y]` in pixels with **pixel centres at integers**, as everywhere in
/// hzn; the writer moves them by the half pixel that Foxglove counts from the corner, the reader moves them back.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Annotations {
    /// Candidate edges, one line each.
    pub edges: Vec<Vec<[f64; 2]>>,
    /// Edge points that carry the answer.
    pub inliers: Vec<[f64; 2]>,
    /// Edge points that were rejected.
    pub rejected: Vec<[f64; 2]>,
    /// The fitted limb: one line for each part of it that the picture shows.
    pub limb: Vec<Vec<[f64; 2]>>,
    /// Where the axis of each body meets the picture; drawn as crosses.
    pub axes: Vec<[f64; 2]>,
}

impl Annotations {
    /// Draws what `other` draws, too.
    pub fn add(&mut self, other: Self) {
        self.edges.extend(other.edges);
        self.inliers.extend(other.inliers);
        self.rejected.extend(other.rejected);
        self.limb.extend(other.limb);
        self.axes.extend(other.axes);
    }
    /// Is there nothing to draw?
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// Attitude and place of the camera in ECEF.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attitude {
    /// Quaternion, scalar first, that takes camera coordinates to ECEF.
    pub q_ecef_from_camera_wxyz: [f64; 4],
    /// Position of the camera in ECEF, metres; zeros when it is unknown.
    pub position_m: [f64; 3],
}

/// What was known about a picture before it was looked at: the columns of frames.csv, in numbers.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Given {
    /// UTC in seconds since 1970.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub utc_s: Option<f64>,
    /// Altitude, kilometres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub altitude_km: Option<f64>,
    /// Position in ECEF, kilometres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_km: Option<[f64; 3]>,
    /// Prior attitude, camera to ECEF, scalar first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub q_ecef_from_camera_wxyz: Option<[f64; 4]>,
    /// 1-sigma of that attitude, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attitude_sigma_deg: Option<f64>,
    /// Direction to the Sun in the camera frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sun_camera: Option<[f64; 3]>,
    /// Rate of rotation of the camera in its own axes, rad/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_rad_s: Option<[f64; 3]>,
}

/// How much a message matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum LogLevel {
    /// For the record.
    Info,
    /// Something the user should look at.
    Warning,
    /// Something was lost.
    Error,
}

/// A message about a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogLine {
    /// How much it matters.
    pub level: LogLevel,
    /// The message.
    pub message: String,
}
