//! The run over a sequence of pictures: it turns files into directions with covariances, in files that other programs
//! can read.
//!
//! [`open`] opens a sequence with its sensor, by the same rules for every program. A [`source`] hands out pictures in
//! order. The [`engine`] processes them with the sensor on all cores. A [`sink`] takes the results in order.
//! [`rig`] does the same for several cameras that are one sensor.
//! [`instruments`] makes tables of the inertial unit and the receiver in a recording.
//! [`results`] reads the files that a sink wrote; [`checked_row`] has the checksums of their rows. [`overlay`] draws
//! the result over a picture, and [`explained`] describes what happened to it, in the words of [`explain`], with the
//! [`advice`] for a picture without an answer.
//! [`diagnosis`] says what would make a refused limb the expected one. [`disk`] has the errors of files that cannot be
//! written, and [`unread`] the words for pictures that are not read. [`terminal`] makes text from files safe for a
//! terminal. [`start`] says what pictures tell about a camera without a calibration, [`bars`] finds black bars in them,
//! and [`nadir`] turns the limb axis into the direction to the centre. [`mask`] draws what hides the stars, and [`wcs`]
//! writes centre and scale into the header of a FITS file.
//!
//! [`record`] turns an answer into the row of the results; the feature `recordings` adds the files. Without it, a
//! picture in memory goes through the same code without files, threads and clocks, as a browser has it.
//!
//! The command line, the Python package and the viewer are built on this crate. It prints nothing, and its [`Error`]
//! contains no exit code and no name of an option.

#![deny(clippy::print_stdout, clippy::print_stderr, reason = "a library prints nothing; the caller does")]

pub mod advice;
pub mod bars;
#[cfg(feature = "recordings")]
pub mod checked_row;
pub mod diagnosis;
pub mod disk;
pub mod engine;
mod error;
pub mod explain;
pub mod explained;
mod image_circle;
#[cfg(feature = "recordings")]
pub mod instruments;
mod limb_words;
pub mod mask;
pub mod nadir;
pub mod open;
pub mod overlay;
#[cfg(feature = "recordings")]
mod possible;
pub mod provenance;
pub mod record;
#[cfg(feature = "recordings")]
pub mod results;
#[cfg(feature = "recordings")]
pub mod rig;
#[cfg(feature = "recordings")]
pub mod sink;
pub mod source;
pub mod start;
mod tangent;
pub mod terminal;
pub mod unread;
pub mod wcs;

pub use error::{Error, Kind, Remedy};
