//! The run over a sequence of pictures: from files to directions with covariances, in files that others can read.
//!
//! A [`source`] hands out pictures in order, the [`engine`] takes them through the sensor on all cores, and a [`sink`]
//! takes the results in order. [`results`] reads what a sink wrote. [`overlay`] draws what was found over a picture,
//! and
//! [`explain`] says in words what happened to it. [`scene`] reads the scenes that are simulated. The command line, the
//! Python package and the viewer are built on this crate; it prints nothing, and its [`Error`] knows no exit code and
//! no option.

#![deny(clippy::print_stdout, clippy::print_stderr, reason = "a library prints nothing; the caller does")]

pub mod engine;
mod error;
pub mod explain;
pub mod overlay;
pub mod results;
pub mod scene;
pub mod sink;
pub mod source;

pub use error::{Error, Kind, Remedy};
