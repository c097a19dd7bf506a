//! Tests of recordings: written, read, damaged, and written again by other programs.

mod bags;
mod common;
mod recording;
mod rewritten;
