//! Gate: a limb is curved. A straight edge is the side of something, and many cones pass near it.

use super::case::refuse_if;
use super::line::Line;
use super::shape::{Residuals, Shape};
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Refuses an edge whose points fit a straight line of the image nearly as well as the cone.
pub(super) fn refuse<T: Real>(residuals: &Residuals<'_, T>) -> Result<(), Verdict> {
    refuse_if(!residuals.prove_cone_over(rms(residuals.shape)), Verdict::Straight)
}

/// Returns the weighted RMS distance of the points from the best straight line, in pixels.
fn rms<T: Real>(shape: &Shape<T>) -> T {
    let (Some(first), Some(last)) = (shape.first(), shape.last()) else { return T::ZERO };
    let mut line = Line::new(first.at, last.at);
    shape.iter().for_each(|p| line.add(p));
    line.rms_px()
}
