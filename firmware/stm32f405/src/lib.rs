//! The flight software on an STM32F405, without memory for a picture.
//!
//! | module | idea |
//! |---|---|
//! | [`board`] | registers: timer, serial line, watchdog |
//! | [`port`] | the board for the flight software |

#![no_std]

pub mod board;
pub mod port;
