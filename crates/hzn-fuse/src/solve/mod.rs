//! The whole flight at once: the most probable states and errors of the instruments from all measurements.
//!
//! The unknowns are attitude, velocity and position at knots, the errors that last the whole flight (biases, scales and
//! axes of the inertial unit, mounts, clocks, lenses, limb height), and the slow error of each direction. The inertial
//! samples between two knots are one error of nine numbers, and each measurement is one error; see
//! `book/theory/solve.md`.

mod adjust;
mod begin;
mod carried;
mod cones;
mod directions;
mod estimates;
mod knots;
mod known;
mod lens;
mod loss;
mod others;
mod places;
mod problem;
mod report;
pub(crate) mod slow;
mod turning;

pub(crate) use adjust::solve;
pub use estimates::{Estimates, Shared};
pub use lens::{ByLens, Lens};
pub(crate) use lens::{lenses, without_lens};
pub use loss::Loss;
pub use places::{LensPlaces, Places};
pub use problem::{Problem, Role, Weighed};
