//! This crate has the functions that navigation needs in addition to the horizon sensor. It needs neither the standard
//! library nor a heap.
//!
//! | module | contents |
//! |---|---|
//! | [`ephemeris`] | positions of Sun and Moon |
//! | [`time`] | leap seconds, and days in the time scales of an ephemeris |

#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod ephemeris;
pub mod time;
