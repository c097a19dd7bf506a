//! All data of one frame in a recording.

use hzn_core::Report;
use hzn_core::real::Real;
use hzn_files::FrameData;
use serde::{Deserialize, Serialize};

use crate::row::Row;
use crate::stamp::Stamp;

/// One frame (of one body) in a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameRecord {
    /// The result.
    pub row: Row,
    /// The time of the row in whole nanoseconds, if it is known. The messages have it, unless it contradicts the row.
    pub stamp: Option<Stamp>,
    /// The edges that were examined.
    pub candidates: Vec<CandidateEdge>,
    /// The picture; `None` if it is not recorded.
    pub image: Option<EncodedImage>,
    /// The drawing over the picture.
    pub annotations: Annotations,
    /// Attitude of the camera, if it is known.
    pub attitude: Option<Attitude>,
    /// The prior of the picture. With it the same answer can be computed again. Name, line and time are not stored, as
    /// the row has them.
    pub prior: FrameData,
    /// Messages about this frame.
    pub log: Vec<LogLine>,
}

impl FrameRecord {
    /// Creates a frame that has only its result.
    pub fn new(row: Row) -> Self {
        Self {
            row,
            stamp: None,
            candidates: Vec::new(),
            image: None,
            annotations: Annotations::default(),
            attitude: None,
            prior: FrameData::default(),
            log: Vec::new(),
        }
    }
}

/// One candidate edge of a report, as files have it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CandidateEdge {
    /// Number of border pixels of the edge.
    pub length_px: u32,
    /// Number of sub-pixel edge points of the edge.
    pub points: u32,
    /// Number of inliers.
    pub inliers: u32,
    /// Weighted RMS distance of the inliers from the fitted limb, pixels; `None` without a fit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rms_px: Option<f64>,
    /// Verdict by its name, for example `short-arc`.
    pub verdict: String,
}

impl CandidateEdge {
    /// Returns the candidates of a report, in order.
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

/// A picture as encoded bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EncodedImage {
    /// Format of the bytes.
    pub format: ImageFormat,
    /// The bytes: a whole file for PNG and JPEG, rows without padding for raw pictures.
    pub bytes: Vec<u8>,
}

/// Format of the bytes of a picture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ImageFormat {
    /// A PNG file.
    Png,
    /// A JPEG file.
    Jpeg,
    /// Another compressed format by its lower-case name, for example `webp`. It comes only from recordings of other
    /// writers.
    Other(String),
    /// One byte per pixel.
    Mono8 {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// Two bytes per pixel, the low byte first.
    Mono16 {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// Three 16-bit words per pixel, with the lower byte first: red, green, blue.
    Rgb16 {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// Three bytes per pixel: red, green, blue.
    Rgb8 {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
}

/// The drawing over a picture. Points are `[x, y]` in pixels with **pixel centres at integers**, as everywhere in hzn.
/// The writer adds the half pixel of Foxglove's convention, which counts from the corner; the reader subtracts it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Annotations {
    /// Candidate edges, one line each.
    pub edges: Vec<Vec<[f64; 2]>>,
    /// Inliers: edge points that the answer is fitted to.
    pub inliers: Vec<[f64; 2]>,
    /// Edge points that were rejected.
    pub rejected: Vec<[f64; 2]>,
    /// The fitted limb: one line for each of its visible parts.
    pub limb: Vec<Vec<[f64; 2]>>,
    /// Points where the axis of each body meets the picture; they are drawn as crosses.
    pub axes: Vec<[f64; 2]>,
}

impl Annotations {
    /// Adds the lines and points of `other`.
    pub fn add(&mut self, other: Self) {
        self.edges.extend(other.edges);
        self.inliers.extend(other.inliers);
        self.rejected.extend(other.rejected);
        self.limb.extend(other.limb);
        self.axes.extend(other.axes);
    }
    /// Returns whether there is nothing to draw.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// Attitude and position of the camera in the fixed frame (ECEF for the Earth).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attitude {
    /// Quaternion from the camera frame to the fixed frame, scalar first.
    pub q_fixed_from_camera_wxyz: [f64; 4],
    /// Position of the camera in the fixed frame, metres; zeros if it is unknown.
    pub position_m: [f64; 3],
}

/// Severity of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum LogLevel {
    /// Information.
    Info,
    /// A problem that the user should examine.
    Warning,
    /// A loss of data.
    Error,
}

/// A message about a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogLine {
    /// Severity.
    pub level: LogLevel,
    /// Text.
    pub message: String,
}
