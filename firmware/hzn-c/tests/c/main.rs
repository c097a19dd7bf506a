//! Tests of the C interface.

#[path = "../any_calls/mod.rs"]
mod any_calls;
mod corpus;
mod flips;
mod header;
mod known;
mod rig;
