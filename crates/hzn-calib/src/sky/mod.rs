//! The camera's calibration from pictures of a flight: `hzn calibrate sky` and `hzn calibrate check`.
//!
//! The pictures measure the intrinsic parameters of the lens jointly with the limb height. Each picture has an axis of
//! its own, which is eliminated. The limb heights of the pictures scatter about one height; the scatter is estimated. A
//! shift and a bend that all edges have in common are unknowns too, with priors from the residuals, and so are two
//! coefficients of the limb height's change with the latitude where the positions are known.
//!
//! ```text
//! View (edge points, prior) ─► linear::reduce (axis eliminated, edge noise) ─► Reduced ─┐
//!      ▲                                                                                 ▼
//!      └──────────── lens, limb height ◄─── system::System (scatter by REML, priors) ◄───┘
//! ```
//!
//! [`estimate()`] repeats this until the lens no longer changes. [`check`] tests a calibration with the same system.
//! [`estimate_track`] estimates the lens from the track of the Sun or the Moon instead.

mod check;
mod conflict;
mod estimate;
mod fit;
#[cfg(test)]
mod latitude_tests;
mod layout;
mod linear;
mod mount;
mod normal_law;
mod observable;
mod parameters;
mod passes;
mod refusal;
#[cfg(test)]
mod stars_tests;
mod system;
#[cfg(test)]
mod tests;
mod track;
#[cfg(test)]
mod track_tests;
mod unknowns;
mod view;
mod words;
mod write;

pub use crate::limb_prior::LimbPrior;
pub use check::{Check, DEFAULT_DETECT_PERCENT, Deviation, Verdict, check};
pub use conflict::Conflict;
pub use estimate::{Estimate, MIN_PICTURES, Picture, estimate};
pub use mount::{Mount, MountRefusal, estimate_mount};
pub use observable::Observability;
pub use parameters::Determined;
pub use passes::{Estimated, estimate_in_passes};
pub use refusal::Refusal;
pub use track::{Sight, Track, TrackRefusal, estimate_track};
pub use unknowns::{Parameter, Unknowns};
pub use view::View;
pub use words::{check_lines, lines, track_lines};
pub(crate) use write::set;
pub use write::{Found, FoundMount, Written, into_sensor_toml};
