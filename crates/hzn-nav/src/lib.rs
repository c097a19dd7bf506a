//! This crate has the functions that navigation needs in addition to the horizon sensor. It needs neither the standard
//! library nor a heap.
//!
//! | module | what it holds |
//! |---|---|
//! | [`ephemeris`] | where Sun and Moon stand |
//! | [`time`] | leap seconds, and days of the time scales that an ephemeris counts in |

#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod ephemeris;
pub mod time;
