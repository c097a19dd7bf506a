//! Preset and gates of Braun & Barf 2022: plausibility (3.5) and the residual in the principal frame ((25) to (28),
//! 7.3).

use super::common::{disable_gates, set_given_noise};
use crate::base::linalg::{V3, basis};
use crate::base::real::Real;
use crate::config::Config;
use crate::geometry::block::{Block, LANES};
use crate::geometry::camera::Camera;
use crate::geometry::frames::UnitVec3;
use crate::geometry::section::Section;
use crate::image::region::Region;
use crate::model::body::Expected;
use crate::model::verdict::Verdict;
use crate::stages::fit::Fit;
use crate::stages::gates;
use crate::stages::{consensus, covariance, edge_points, fit, threshold};

/// Sets the chain of Braun & Barf 2022 as flown on ATEK: fixed threshold, whole pixels, RANSAC on three points, the
/// direct nadir, the overbound of its covariance, and none of the gates of `hzn`.
pub(super) fn preset(config: &mut Config) {
    set_given_noise(config);
    config.threshold.method = threshold::Method::Fixed;
    config.edge_points.sub_pixel = edge_points::SubPixel::None;
    config.edge_points.keep_points = 0;
    config.consensus.method = consensus::Method::Ransac;
    config.fit.method = fit::Method::Direct;
    config.fit.half_angle = fit::HalfAngle::Free;
    config.covariance.method = covariance::Method::BraunBarf;
    config.covariance.overbound = true;
    disable_gates(config);
    config.gates.limb_in_view = true;
    // The value of section 7.3, for the Earth. This limit applies to the mean and not to the sum, in focal lengths
    // squared.
    config.gates.max_section_residual = Some(0.025);
}

/// Returns `Passed`, or the gate that the fit fails.
pub(super) fn verdict<T: Real>(
    fit: &Fit<T>,
    expected: &Expected<T>,
    blocks: &[Block<T>],
    camera: &Camera<T>,
    region: &Region<T>,
    config: &gates::Config,
) -> Verdict {
    let cos = if expected.free { fit.c } else { expected.cos };
    if config.limb_in_view && !in_view(&fit.e, cos, camera, region) {
        return Verdict::OutOfView;
    }
    match config.max_section_residual {
        Some(limit) if !section_residual(&fit.e, cos, blocks).is_some_and(|r| r <= T::from_f64(limit)) => {
            Verdict::Residuals
        }
        _ => Verdict::Passed,
    }
}

/// Number of points around the limb that are tested.
const LIMB_SAMPLES: i32 = 128;

/// Returns whether any part of the limb of the cone (e, c) lies in the region. A nadir that was fitted to the edge of
/// something else puts the limb elsewhere (Braun & Barf 2022, 3.5).
fn in_view<T: Real>(e: &V3<T>, c: T, camera: &Camera<T>, region: &Region<T>) -> bool {
    let (b1, b2) = basis(e);
    let sin = (T::one() - c * c).max(T::ZERO).sqrt();
    (0..LIMB_SAMPLES).any(|i| {
        let (s, cos) = T::from_f64(f64::from(i) * core::f64::consts::TAU / f64::from(LIMB_SAMPLES)).sin_cos();
        let Some(p) = camera.project(&UnitVec3::assume_unit(e * c + (b1 * cos + b2 * s) * sin)) else { return false };
        let half = T::from_f64(0.5);
        let inside = p.u > -half && p.v > -half;
        let (x, y) = ((p.u + half).to_i32(), (p.v + half).to_i32());
        inside && u16::try_from(x).is_ok_and(|x| u16::try_from(y).is_ok_and(|y| region.contains(x, y)))
    })
}

/// Returns the mean square of the points' distances from the conic section of the cone (e, c), along its principal x
/// axis, in focal lengths squared. This is (28) as a mean, so that it does not grow with the edge. `None` if there is
/// no section or no point.
fn section_residual<T: Real>(e: &V3<T>, c: T, blocks: &[Block<T>]) -> Option<T> {
    let section = Section::new(&UnitVec3::assume_unit(*e), c)?;
    let (mut total, mut count) = (T::ZERO, T::ZERO);
    for b in blocks {
        for l in 0..LANES {
            if b.weight[l] > T::ZERO && b.s[2][l] > T::from_f64(0.03) {
                let d = section.distance([b.s[0][l] / b.s[2][l], b.s[1][l] / b.s[2][l]]);
                total += d * d;
                count += T::one();
            }
        }
    }
    (count > T::ZERO).then(|| total / count)
}
