//! Calibration of a camera from points with known directions: a collimated source on a rotator, or stars.
//!
//! This is the way for an infrared camera, which sees no chessboard. Wang, Wang & Jin (2022) turn their camera on a
//! two-axis rotator in front of a collimator; an astrometry program gives the directions of stars.
//!
//! The directions may be in any frame: the rotation from it to the camera is estimated, one for each picture. See
//! [`table`] for the columns.

mod fit;
pub mod table;
#[cfg(test)]
mod tests;

pub use fit::{PointsRefusal, calibrate};
pub use table::{Point, Points};
