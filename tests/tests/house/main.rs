//! Tests of the sources and documents. They need no other crate, so they are built in seconds.

mod circles;
mod crates;
mod links;
mod shape;
