//! Calibration of a camera from pictures of a chessboard.

mod layout;

pub use layout::{Board, Corner, View};
