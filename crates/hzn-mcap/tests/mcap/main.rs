//! Tests of recordings: written, read, damaged, and written again by other programs.

mod common;
mod recording;
mod rewritten;
