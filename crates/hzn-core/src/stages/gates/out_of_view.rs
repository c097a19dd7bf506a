//! Gate of Braun & Barf 2022, 3.5: the limb that is expected about the axis lies in the picture. A nadir that was
//! fitted to the edge of something else puts the limb elsewhere.

use super::case::{Case, refuse_if};
use crate::base::linalg::{V3, basis};
use crate::base::real::Real;
use crate::geometry::camera::Camera;
use crate::geometry::frames::UnitVec3;
use crate::image::region::Region;
use crate::model::verdict::Verdict;

/// Refuses an axis whose expected limb is outside of the picture.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    if !cfg!(feature = "dlr") || !case.config.limb_in_view {
        return Ok(());
    }
    let (e, cos) = (&case.fit.e, case.expected_cos());
    refuse_if(!in_view(e, cos, case.camera, case.region), Verdict::OutOfView)
}

/// Number of points around the limb that are tested.
const LIMB_SAMPLES: i32 = 128;

/// Returns whether any part of the limb of the cone (e, c) lies in the region.
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
