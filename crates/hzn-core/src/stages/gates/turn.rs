//! The angle between two axes, and the sigma that it has.

use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::frames::{Cam, UnitVec3};

/// Returns the angle between two axes.
pub(super) fn angle_rad<T: Real>(a: &V3<T>, b: &V3<T>) -> T {
    UnitVec3::<Cam, T>::assume_unit(*a).angle_rad(&UnitVec3::assume_unit(*b))
}

/// Returns the standard deviation of the angle between two axes with independent errors.
pub(super) fn combined_sigmas<T: Real>(answer: T, other: T) -> T {
    (other * other + answer * answer).sqrt()
}
