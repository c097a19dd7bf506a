//! Joint adjustment of a lens and of the poses of its pictures, by the Levenberg-Marquardt method.
//!
//! The unknowns are the free intrinsic parameters, two for the bow of the board, and one pose for each [`Block`]. A
//! block is a picture of a board, with rotation and translation, or a set of directions at infinity (stars, a
//! collimator), with a rotation alone. The residual of an observation is its measured image point minus the projected
//! one, in pixels.
//!
//! The poses of different blocks do not meet in the normal equations. The Schur complement removes them, six unknowns
//! at a time, and leaves at most eleven equations for the unknowns that all pictures share. So the work grows linearly
//! with the pictures, and the project needs no sparse solver.

mod block;
mod free;
mod normal;
mod solve;

pub(crate) use block::{BOW, Block, Observation};
pub(crate) use free::Free;
pub(crate) use solve::{Adjusted, adjust, adjust_pose};
