//! Tests of the replay of whole flights.

mod clocks;
mod common;
mod common_part;
mod directions;
mod flight;
mod infrared;
mod lens;
mod oem;
mod orbit;
mod orbit_lens;
mod points;
mod recordings;
mod repeats;
mod solve;
mod standing;
mod tables;
mod tracker;
mod two_bodies;
mod verdict;
