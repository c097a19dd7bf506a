//! Tests of the replay of whole flights.

mod common;
mod flight;
mod two_bodies;
