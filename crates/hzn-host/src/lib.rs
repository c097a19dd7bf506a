//! The sensor of a workstation, compiled once.
//!
//! [`hzn_core`] is generic: over the precision, the kind of picture and the observer. Each combination is another copy
//! of the pipeline, 100 KB of code and seconds of compiling, in every crate that makes one. This crate owns the copies
//! that a workstation needs, behind functions that have no type parameters: see [`Compiled`].

#![forbid(unsafe_code)]

mod clock;
mod compiled;

pub use clock::{Clock, now};
pub use compiled::{Compiled, Task};
