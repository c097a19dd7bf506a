//! What would make a fitted limb the expected one: an altitude, a focal length (that is a field of view), or a limb
//! height.
//!
//! The sensor's own fit uses only points near a limb of the expected half-angle. If the expected half-angle is wrong,
//! it misses most of the limb. [`AnyCone`] therefore fits a cone of any half-angle to the edges of a refused picture;
//! [`find_misfit`] returns what this limb says, as [`FitFacts`], and [`what_fits`] says it in words. [`summarise`]
//! compares the pictures of a sequence, [`find_pair`] finds two wrong values, and [`is_limb_as_expected`] says whether
//! nothing is wrong. [`find_field_of_view`] finds the field of view of a camera of which nothing is
//! known. [`find_rate_fault`] says whether the pictures of a rolling shutter contradict their rates, and
//! [`contradictions`] whether all answers together contradict altitude and lens.

mod any_cone;
mod facts;
mod field_of_view;
mod implied;
mod joint;
mod misfit;
mod rates;
mod together;
mod words;

pub use any_cone::{AnyCone, longest_edge};
pub use facts::{Consensus, FitFacts, Implied, Suspect, is_limb_as_expected, median_fit, summarise, typical_sigmas};
pub use field_of_view::{FieldOfView, find_field_of_view};
pub use implied::{find_fit, fit_facts};
pub use joint::{MOST_CORRELATION, Pair, Remedy, correlation, find_pair};
pub use misfit::{find_any_fit, find_misfit, is_misfit};
pub use rates::{Gains, RateFault, RateTrial, find_rate_fault};
pub use together::{Contradiction, Fault, Said, contradictions};
pub use words::{contradiction, inseparable, two_values, what_fits};
