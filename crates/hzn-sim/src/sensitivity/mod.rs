//! The accuracy that a camera can reach before it is bought: covariances by design, without rendering, and charts of
//! the limb that it will see.
//!
//! | module | content |
//! |---|---|
//! | [`design`] | camera, body and position |
//! | `limb_samples` | the limb in view as points one pixel apart |
//! | `correlated` | the sum over all pairs of points with correlated errors |
//! | [`sigmas`] | the covariance of these points with correlated errors |
//! | [`of_sensor`] | the covariance of these points by the sensor itself, with all terms of its error budget |
//! | [`rig`] | several heads that are one sensor, by the equations of the sensor |
//! | [`third_axis`] | the rotation about the line to a flattened body |
//! | [`mod@reference`] | published results, computed independently of this program |
//! | [`chart`] | the conic that is seen from each altitude; the error of a spherical Earth |

pub mod chart;
mod correlated;
pub mod design;
mod limb_samples;
pub mod of_sensor;
pub mod reference;
pub mod rig;
pub mod sigmas;
pub mod third_axis;

pub use design::{Design, DesignError};
pub use of_sensor::SensorPlace;
pub use rig::{RigDesign, RigSigmas};
pub use sigmas::{DirectionSigmas, Sigmas};
pub use third_axis::{ThirdAxis, ThirdAxisSigmas};
