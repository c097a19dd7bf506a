//! Finds the inner corners of a chessboard in a picture.
//!
//! ```text
//! picture ─► smaller copies ─► saddles of the brightness ─► ring test ─► growing grid ─► sub-pixel places
//! ```
//!
//! The grid grows from one corner to the next, with a local prediction of the next place. So it follows the bent rows
//! of a fisheye lens, and it needs no more than a part of the board. A plain chessboard looks the same after half a
//! turn, and a part of it does not tell which part it is. For a calibration both do not matter, because the pose of the
//! board is unknown anyway. A mirrored picture of a chessboard is a picture of a chessboard too, so that a mirrored
//! camera cannot be told from a plain board.
//!
//! The finder is our own, because no maintained crate was as good on rendered boards with known truth (150 pictures of
//! lenses of 60°, 94° and 150°; book/results/calibration.md). `calib-targets` 0.16.1 finds as many boards, but the
//! errors of its corners are two to nine times larger (0.08 to 0.15 px against 0.01 to 0.09 px), and it needs four to
//! eight times longer for whole boards. OpenCV's `findChessboardCorners` finds whole boards alone. ChArUco and
//! AprilGrid are not supported for the same reason: the crate finds them, but with its larger errors. Corners of other
//! targets can be given to [`crate::board::calibrate`].

mod find;
mod grey;
mod grid;
mod refine;
mod ring;
mod saddle;
mod surface;
#[cfg(test)]
mod tests;

pub use find::{Found, NotFound, find_corners};
pub use grey::Grey;
