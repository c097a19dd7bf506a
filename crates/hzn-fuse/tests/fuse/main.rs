//! Tests of the replay of whole flights.

mod common;
mod flight;
mod solve;
mod tracker;
mod two_bodies;
mod verdict;
