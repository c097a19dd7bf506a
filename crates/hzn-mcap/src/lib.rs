//! Recordings of the hzn horizon sensor.
//!
//! ```text
//!   hzn_core::Report ──► Row ──► FrameRecord ──► Writer ──► out.mcap.part ──► out.mcap
//!                        │  ▲        ▲                           │
//!               CSV, JSON Lines      └── Reader ◄── resume ◄─────┴── recover
//! ```
//!
//! - [`Row`] is the flat result of one picture and body. It is the same in CSV, JSON Lines and MCAP.
//! - [`FrameRecord`] adds the data that only an MCAP has: the picture, drawn edges, attitude, messages.
//! - [`Writer`] writes a `.part` file, which stays readable if the program ends at any moment. It is renamed at the
//!   end.
//! - [`Reader`] reads the frames, also from broken files; [`recover`] closes a broken file, [`resume`] continues it.
//! - [`ImageReader`] reads pictures from MCAP files of any writer, as an input.
//! - [`SeriesWriter`] writes series over time, for example of a navigation filter; [`read_series`] reads them.
//! - [`read_instruments`] reads inertial units and receivers in recordings of ROS 2.
//! - [`Index`] finds pictures and reports without reading the pictures; [`Pictures`] then reads any one of them.
//!
//! Without the feature `recordings`, there are only rows, records and drawings, which need no file and no compression.
//!
//! # The file
//!
//! A file begins with the attachment `sensor.toml` and the metadata `hzn`; then come chunks. Pictures are in separate
//! chunks without compression, because they are already compressed. All other data are compressed with zstd. A batch
//! has the frames of one [`FLUSH_INTERVAL`], or 8 MiB of pictures, or 1 MiB of other data; a crash can lose at most one
//! batch. Each batch is written with its pictures first. A frame is finished when the chunk with its report is complete
//! in the file, so a frame with a report is always complete. One chunk per frame would need a longer summary. It
//! would need little space compared with the pictures, but without pictures ten times the space. Every chunk, the data
//! and the summary have CRCs. The `sequence` of a message is the index of its frame.
//!
//! Recordings that other programs have written again are read too: with any chunks or none, and compressed with zstd,
//! with LZ4 or not at all. Pictures are recognised by their channels, and frames are put together by log time and
//! sequence.
//!
//! | topic | schema | encoding |
//! |---|---|---|
//! | `/hzn/report` | `hzn.Report`, the row plus `candidate_edges` and `prior` | JSON |
//! | `/camera/image` | `foxglove.CompressedImage`, or `foxglove.RawImage` for raw frames | protobuf |
//! | `/camera/calibration` | `foxglove.CameraCalibration`, at the start and at most once a second | protobuf |
//! | `/camera/annotations` | `foxglove.ImageAnnotations`, pixel corner at integers (+0.5) | protobuf |
//! | `/hzn/axis` | `foxglove.PoseInFrame` in frame `camera`, x along the axis | protobuf |
//! | `/tf` | `foxglove.FrameTransform`, `camera` in `fixed` | protobuf |
//! | `/log` | `foxglove.Log` | protobuf |
#![forbid(unsafe_code)]

#[cfg(feature = "recordings")]
mod camera_info;
#[cfg(feature = "recordings")]
mod cdr;
#[cfg(feature = "recordings")]
mod container;
#[cfg(feature = "recordings")]
mod drawing;
#[cfg(feature = "recordings")]
mod early_sync;
#[cfg(feature = "recordings")]
mod error;
mod floats;
mod frame;
#[cfg(feature = "recordings")]
mod header;
#[cfg(feature = "recordings")]
mod images;
#[cfg(feature = "recordings")]
mod index;
#[cfg(feature = "recordings")]
mod instruments;
#[cfg(feature = "recordings")]
mod messages;
#[cfg(feature = "recordings")]
mod origin;
pub mod palette;
mod part;
#[cfg(feature = "recordings")]
mod pictures;
#[cfg(feature = "recordings")]
mod raw_images;
#[cfg(feature = "recordings")]
mod reader;
#[cfg(feature = "recordings")]
mod recover;
#[cfg(feature = "recordings")]
mod ros;
mod row;
#[cfg(feature = "recordings")]
mod series;
#[cfg(feature = "recordings")]
mod series_reader;
mod stamp;
mod status_name;
#[cfg(feature = "recordings")]
mod summary;
#[cfg(feature = "recordings")]
mod topics;
#[cfg(feature = "recordings")]
mod waiting;
#[cfg(feature = "recordings")]
mod writer;

#[cfg(feature = "recordings")]
pub use camera_info::{CameraInfo, Region};
#[cfg(feature = "recordings")]
pub use error::Error;
pub use floats::{doubt_scale, words_from_floats};
pub use frame::{Annotations, Attitude, CandidateEdge, EncodedImage, FrameRecord, ImageFormat, LogLevel, LogLine};
#[cfg(feature = "recordings")]
pub use images::{Clock, ImageReader, InputImage};
#[cfg(feature = "recordings")]
pub use index::{Index, IndexEntry};
#[cfg(feature = "recordings")]
pub use instruments::{InstrumentMessage, Measured, read_instruments};
pub use part::{check_close, create_part, is_being_written, open_part, part_path, publish, rename, sync, sync_name};
#[cfg(feature = "recordings")]
pub use pictures::{Pictures, Place};
#[cfg(feature = "recordings")]
pub use reader::{Contents, Reader};
#[cfg(feature = "recordings")]
pub use recover::{Recovered, Resumed, recover, recover_while, resume};
pub use row::{Row, RowMeta, roll_pitch_deg};
#[cfg(feature = "recordings")]
pub use series::{Placed, SeriesWriter};
#[cfg(feature = "recordings")]
pub use series_reader::{begins_with_attachment, read_series};
pub use stamp::Stamp;
#[cfg(feature = "recordings")]
pub use topics::{IMAGE_TOPIC, report_schema};
#[cfg(feature = "recordings")]
pub use writer::{FLUSH_INTERVAL, Options, Writer};

/// A layout of Foxglove's panels for the topics of hzn, for import in Foxglove: the picture with its annotations, plots
/// over time, status, log, the report and the axis.
pub const LAYOUT: &str = include_str!("../foxglove-layout.json");
