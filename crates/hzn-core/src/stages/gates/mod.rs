//! Gates and choice: decides whether a fitted cone is the limb of the body, and which of several cones is the answer.
//!
//! A gate is a function of a `Case` in a file of its own. It returns its verdict if it refuses the edge. The function
//! `judge` names all gates in their order.

mod any_cone;
mod attitude;
mod band;
mod case;
mod circle;
mod config;
mod curvature;
mod departure;
mod evidence;
mod faint;
mod few_inliers;
mod glow;
mod half_angle;
mod hidden;
mod indistinct;
mod layer;
mod lens;
mod line;
mod lit_side;
mod night;
mod no_consensus;
mod no_sky;
mod out_of_view;
mod places;
mod polyline;
mod profile;
mod radius;
mod rate;
mod residuals;
mod rivals;
mod section;
mod shape;
mod short_arc;
mod side;
mod size;
mod sky;
mod straight;
mod sun;
#[cfg(test)]
mod tests;
mod turn;
mod uncertain;
mod unlikely;
mod unsupported;
mod view;

use crate::base::real::Real;
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::model::verdict::Verdict;
use crate::stages::contour::BinaryPicture;

pub(crate) use case::Case;
pub use config::{Choice, Config, FixedEdge};
use places::along_limb;
pub(crate) use places::middle_level;
use shape::{Curve, Residuals, Shape, collect_inliers};
pub(crate) use size::{small_disc_points, small_picture_points};
use sky::measure_sky;
pub(crate) use view::Cover;

/// An edge that passed every gate.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Passed<T> {
    /// Whether light reaches higher above the limb than air does, see [`Verdict::Glow`].
    pub(crate) glows: bool,
    /// Probability that the edge is the limb; `None` if it is unknown.
    pub(crate) p_limb: Option<T>,
}

/// Returns the score of an edge that passed; of several answers, the one with the smallest score wins.
pub(crate) fn score<T: Real>(case: &Case<'_, T>) -> T {
    match case.config.choice {
        // An edge without a section cannot be compared, so it loses.
        Choice::SectionResidual if cfg!(feature = "dlr") => section::residual(case).unwrap_or(T::from_f64(f64::MAX)),
        _ => case.score(),
    }
}

/// Asks the gates in their order.
///
/// The order decides which verdict an edge gets that several gates refuse, and what a refusal costs: first the gates
/// that compare numbers, then those that look at the picture, then those that fit other curves to the points.
///
/// The gates are a list of calls and no table of pointers. They need different things, which are measured only when the
/// gates before have passed: places and sky, then the curve and its residuals. A table would also link a panic path
/// into the images for a flight computer.
///
/// # Errors
/// Returns the verdict of the first gate that refuses the edge.
pub(crate) fn judge<T: Real, P: Pixels, O: Observer<T>>(
    case: &Case<'_, T>,
    binary: &BinaryPicture<'_, T, P, O>,
) -> Result<Passed<T>, Verdict> {
    no_consensus::refuse(case)?;
    few_inliers::refuse(case)?;
    short_arc::refuse(case)?;
    residuals::refuse(case)?;
    half_angle::refuse(case)?;
    uncertain::refuse(case)?;
    unsupported::refuse(case)?;
    indistinct::refuse(case)?;

    let places = along_limb(&case.fused.e, case.blocks, case.fit.inliers, case.camera);
    let sky = measure_sky(case, binary, &places);
    no_sky::refuse(case, &sky)?;
    night::refuse(case)?;
    sun::refuse(case)?;
    lit_side::refuse(case, binary)?;
    faint::refuse(case, binary, &places)?;
    if case.expected.is_airglow {
        // A layer is a band.
        layer::refuse(case, binary, &places, &sky)?;
    } else {
        band::refuse(case, binary, &places, &sky)?;
    }
    attitude::refuse(case)?;
    rate::refuse(case)?;

    let curve = Curve::new(case.fit, case.expected.azimuth());
    let mut shape = Shape::new();
    collect_inliers(case.blocks, case.fit, &curve, case.camera, &mut shape);
    let mut residuals = Residuals::new(&curve, &mut shape, case.config);
    rivals::refuse(case, &mut residuals)?;
    curvature::refuse(case)?;
    departure::refuse(case, binary, &residuals)?;
    let glows = glow::is_likely(case, binary, &places);

    // Gates of published systems.
    out_of_view::refuse(case)?;
    section::refuse(case)?;
    radius::refuse(case)?;

    hidden::refuse(case)?;
    side::refuse(case)?;
    // The weights are those of sunlit limbs, for which a layer of airglow is evidence against the limb.
    let evidence =
        if case.expected.is_airglow { None } else { evidence::weigh(case, binary, &places, &sky, &mut residuals) };
    evidence.iter().for_each(|evidence| binary.observer.evidence(case.number, evidence));
    let p_limb = unlikely::refuse(case, evidence.as_ref())?;
    Ok(Passed { glows, p_limb })
}
