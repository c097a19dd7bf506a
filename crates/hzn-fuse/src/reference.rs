//! The direction of the limb's axis where a recording does not have it.

use hzn_core::ellipsoid::{LimbCone, WGS84_A_M, WGS84_B_M};
use hzn_nav::frames::{Fixed, Vector};

use crate::input::Body;

/// Limb height for the direction of the limb's axis, km. Ten kilometres more turn the axis by 0.0003°.
const LIMB_HEIGHT_KM: f64 = 20.0;

/// Returns the limb's axis of the Earth from a position; `None` for other bodies.
pub(crate) fn limb_axis(body: Body, position_m: &Vector<Fixed>) -> Option<Vector<Fixed>> {
    if body != Body::Limb {
        return None;
    }
    let limb_m = LIMB_HEIGHT_KM * 1e3;
    let cone = LimbCone::try_new(position_m.xyz(), WGS84_A_M + limb_m, WGS84_B_M + limb_m)?;
    Some(cone.axis.into())
}
