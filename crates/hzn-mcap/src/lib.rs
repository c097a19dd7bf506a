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
//! - [`Index`] finds pictures and reports without reading the pictures; [`Pictures`] then reads any one of them.
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

mod cdr;
mod container;
mod drawing;
mod early_sync;
mod error;
mod frame;
mod images;
mod index;
mod messages;
mod origin;
pub mod palette;
mod part;
mod pictures;
mod raw_images;
mod reader;
mod recover;
mod ros;
mod row;
mod series;
mod series_reader;
mod status_name;
mod topics;
mod waiting;
mod writer;

pub use error::Error;
pub use frame::{Annotations, Attitude, CandidateEdge, EncodedImage, FrameRecord, ImageFormat, LogLevel, LogLine};
pub use images::{ImageReader, InputImage};
pub use index::{Index, IndexEntry};
pub use part::{check_close, create_part, is_being_written, open_part, part_path, publish, rename, sync, sync_name};
pub use pictures::{Pictures, Place};
pub use raw_images::words_from_floats;
pub use reader::{Contents, Reader};
pub use recover::{Recovered, Resumed, recover, recover_while, resume};
pub use row::{Row, RowMeta, roll_pitch_deg};
pub use series::{Placed, SeriesWriter};
pub use series_reader::{begins_with_attachment, read_series};
pub use topics::{IMAGE_TOPIC, report_schema};
pub use writer::{FLUSH_INTERVAL, Options, Writer};

/// A layout of Foxglove's panels for the topics of hzn, for import in Foxglove: the picture with its annotations, plots
/// over time, status, log, the report and the axis.
pub const LAYOUT: &str = include_str!("../foxglove-layout.json");
