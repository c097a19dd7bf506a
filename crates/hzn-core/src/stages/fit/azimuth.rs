//! The correction by azimuth for an ellipsoid.

use crate::base::real::Real;
use crate::geometry::cone::Azimuth;
use crate::model::body::Expected;

/// Returns the correction by azimuth for an ellipsoid; `None` if the body is no ellipsoid or the attitude is unknown.
pub(crate) fn azimuth<T: Real>(expected: &Expected<T>) -> Option<Azimuth<T>> {
    let cone = expected.ellipsoid.as_ref()?;
    // Without an attitude the direction of east is unknown; the mean cone is then used, and the covariance has the
    // difference.
    let to_cam = expected.fixed_from_camera?.inverse();
    let (east, axis) = (to_cam.apply(&cone.east), to_cam.apply(&cone.axis));
    Some(Azimuth {
        north: east.v().cross(axis.v()),
        harmonics_cos: expected.harmonics_cos,
        east: *east.v(),
        cot2_east: cone.cot2_east,
        cot2_meridian: cone.cot2_meridian,
        mean_cos: expected.cos,
    })
}
