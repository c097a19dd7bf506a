#![doc = include_str!("../README.md")]
//!
//! | module | contents |
//! |---|---|
//! | [`strapdown`] | position, velocity and attitude from angular rate and specific force |
//! | [`gravity`] | gravity in ECEF |
//! | [`filter`] | the Schmidt-Kalman filter: directions, position, velocity and attitude aid the strapdown solution |
//! | [`delayed`] | the filter at a fixed lag, for measurements that come late or out of order |
//! | [`start`] | the first attitude from two directions, and integration back to an earlier time |
//! | [`frames`] | vectors, rotations and covariances with their frames as types |
//! | [`options`], [`layout`] | what the filter estimates, and the order of its states |
//! | [`vectors`] | attitude from two or more directions: TRIAD, Wahba's problem |
//! | [`ephemeris`] | positions of Sun and Moon |
//! | [`planets`] | shape and rotation of planets, moons and dwarf planets |
//! | [`time`] | leap seconds, and days in the time scales of an ephemeris |

#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod delayed;
pub mod ephemeris;
pub mod filter;
pub mod frames;
pub mod gravity;
pub mod layout;
pub mod options;
pub mod planets;
pub mod start;
pub mod strapdown;
pub mod time;
pub mod vectors;
