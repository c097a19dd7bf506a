//! The code that all images for the MPS2 boards share. Only this crate has addresses of the board.
//!
//! | module | idea |
//! |---|---|
//! | [`board`] | external memory, timer, serial line, watchdog |
//! | [`cases`] | the files of the images that measure the sensor |
//! | [`port`] | the board for the flight software |

#![no_std]

pub mod board;
pub mod cases;
pub mod port;

pub use hzn_firmware::{host, watermark};
