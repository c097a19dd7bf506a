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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::camera::{self, Model};

    /// A limb counts if it passes the middle of a pixel by at most half of one, on each side of the picture.
    #[test]
    fn a_limb_is_in_view_up_to_half_a_pixel_beyond_the_border() {
        let camera = Camera::<f64>::try_new(&camera::Config::ideal(Model::Pinhole, 64, 48, 50.0)).unwrap();
        let region = Region::whole(64, 48);
        let alpha = 0.03;
        // The point of the limb that is nearest to the picture has this coordinate on one axis.
        let at = |axis: usize, px: f64, side: f64| {
            let centre = [31.5, 23.5][axis];
            let off = libm::atan((px - centre) / 50.0) + side * alpha;
            let (s, c) = libm::sincos(off);
            let e = if axis == 0 { V3::new(s, 0.0, c) } else { V3::new(0.0, s, c) };
            in_view(&e, libm::cos(alpha), &camera, &region)
        };
        for axis in [0, 1] {
            assert!(at(axis, -0.4, -1.0) && !at(axis, -0.6, -1.0), "{axis}");
            let last = [63.0, 47.0][axis];
            assert!(at(axis, last + 0.4, 1.0) && !at(axis, last + 0.6, 1.0), "{axis}");
        }
        // The picture lies within a limb that is wide, and next to one that is behind the camera.
        let wide = |z: f64| in_view(&V3::new(0.0, 0.0, z), libm::cos(1.2), &camera, &region);
        assert!(!wide(1.0) && !wide(-1.0));
        let skew = V3::new(libm::sin(1.2), 0.0, libm::cos(1.2));
        assert!(in_view(&skew, libm::cos(1.2), &camera, &region));
    }
}
