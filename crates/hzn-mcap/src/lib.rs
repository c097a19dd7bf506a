//! Recordings of the hzn horizon sensor.
//!
//! ```text
//!   hzn_core::Report ──► Row ──► FrameRecord ──► Writer ──► out.mcap.part ──► out.mcap
//!                        │  ▲        ▲                           │
//!               CSV, JSON Lines      └── Reader ◄── resume ◄─────┴── recover
//! ```
//!
//! - [`Row`] is the flat result of one picture and body, the same in CSV, JSON Lines and MCAP.
//! - [`FrameRecord`] adds what only an MCAP holds: the picture, drawn edges, attitude, messages.
//! - [`Writer`] writes a `.part` file that survives the end of the program at any moment and gets its name at the end.
//! - [`Reader`] gives the frames back, from broken files too; [`recover`] closes one, [`resume`] goes on with one.
//! - [`ImageReader`] takes pictures out of anybody's MCAP, as an input.
//! - [`Index`] tells where everything stands without reading pictures, [`Pictures`] then reads any one of them.
//!
//! # The file
//!
//! First the attachment `sensor.toml` and the metadata `hzn`, then chunks. Pictures stand uncompressed in chunks of
//! their own, because they are compressed already; everything else is compressed with zstd. A batch is written
//! pictures first, so a frame whose report is there is there as a whole: a frame counts as finished when the chunk with
//! its report is whole in the file. A batch is what came within [`FLUSH_INTERVAL`], or 8 MiB of pictures: that much a
//! crash can cost. A chunk for each frame would cost nothing beside pictures, but ten times the room without them, and
//! a longer summary. Every chunk, the data and the summary carry CRCs. Message `sequence` is the frame's index.
//!
//! | topic | schema | encoding |
//! |---|---|---|
//! | `/hzn/report` | `hzn.Report`, the row plus `candidate_edges` and `given` | JSON |
//! | `/camera/image` | `foxglove.CompressedImage`, or `foxglove.RawImage` for raw frames | protobuf |
//! | `/camera/calibration` | `foxglove.CameraCalibration`, at the start and at most once a second | protobuf |
//! | `/camera/annotations` | `foxglove.ImageAnnotations`, pixel corner at integers (+0.5) | protobuf |
//! | `/hzn/axis` | `foxglove.PoseInFrame` in frame `camera`, x along the axis | protobuf |
//! | `/tf` | `foxglove.FrameTransform`, `camera` in `ecef` | protobuf |
//! | `/log` | `foxglove.Log` | protobuf |
#![forbid(unsafe_code)]

mod cdr;
mod container;
mod drawing;
mod error;
mod frame;
mod images;
mod index;
mod messages;
pub mod palette;
mod part;
mod reader;
mod recover;
mod row;
mod topics;
mod writer;

pub use error::Error;
pub use frame::{
    Annotations, Attitude, CandidateEdge, EncodedImage, FrameRecord, Given, ImageFormat, LogLevel, LogLine,
};
pub use images::{ImageReader, InputImage};
pub use index::{Index, IndexEntry, Pictures, Place};
pub use part::{create_part, open_part, part_path};
pub use reader::{Contents, Reader};
pub use recover::{Recovered, Resumed, recover, recover_while, resume};
pub use row::{Row, RowMeta, roll_pitch_deg};
pub use topics::{IMAGE_TOPIC, report_schema};
pub use writer::{FLUSH_INTERVAL, Options, Writer};

/// A layout of Foxglove's panels for our topics, to be imported there: the picture with what was found, plots over
/// time, status, log, the report and the axis.
pub const LAYOUT: &str = include_str!("../foxglove-layout.json");
