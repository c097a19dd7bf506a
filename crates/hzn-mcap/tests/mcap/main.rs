//! Tests of recordings: written, read, damaged, and written again by other programs.

mod recording;
mod rewritten;
