//! What a camera can reach before it is bought: covariances by design, without rendering, and the charts that say which
//! limb it will see.
//!
//! | module | idea |
//! |---|---|
//! | [`design`] | camera, body and place; the limb as points one pixel apart |
//! | [`sigmas`] | the covariance that such points have with correlated errors |
//! | [`mod@reference`] | published results, worked out apart from this program |
//! | [`chart`] | which conic is seen from where; what a sphere for the Earth costs |

pub mod chart;
pub mod design;
pub mod reference;
pub mod sigmas;

pub use design::{Design, DesignError};
pub use sigmas::{Sigmas, Tilt};
