//! What is known of a body in a picture, from its data.

use hzn_core::Prior;
use hzn_core::body::{self, PriorError};
use hzn_core::frames::{Fixed, UnitVec3};
use hzn_core::real::Real;
use hzn_files::FrameData;
use hzn_nav::ephemeris;

/// Returns what is known of a body in a picture.
pub(crate) fn prior<T: Real>(
    data: Option<&FrameData>,
    which: usize,
    body: &body::Config,
) -> Result<Prior<T>, PriorError> {
    data.map_or(Ok(Prior::default()), |d| Ok(with_sun(d.for_body(which, body)?.to_prior(None), d, body)))
}

/// Largest 1σ of an attitude that gives the direction of the Sun, degrees: three of them are the 18° between the
/// horizon and the end of twilight, from which on the gates refuse an unlit limb.
const SUN_ATTITUDE_DEG: f64 = 6.0;

/// Adds the Sun to the prior of the Earth: its elevation at the point below the camera, and with an attitude its
/// direction in the camera. Both follow from the time and the position.
fn with_sun<T: Real>(prior: Prior<T>, data: &FrameData, body: &body::Config) -> Prior<T> {
    let is_earth = matches!(body.kind, body::Kind::Earth | body::Kind::EarthSphere);
    let (Some(utc_s), Some([x, y, z])) = (data.utc_s.filter(|_| is_earth), data.position_km) else { return prior };
    let sun = ephemeris::sun(utc_s).direction;
    let [sx, sy, sz] = sun.xyz();
    // The vertical of the ellipsoid differs from the radius by at most 0.2°, which does not matter for twilight.
    let sine = (x * sx + y * sy + z * sz) / (x * x + y * y + z * z).sqrt();
    let is_precise = data.attitude_sigma_deg.is_none_or(|deg| deg <= SUN_ATTITUDE_DEG);
    let in_camera = || {
        let fixed: UnitVec3<Fixed, T> = UnitVec3::try_new([sx, sy, sz].map(T::from_f64))?;
        Some(prior.fixed_from_camera?.inverse().apply(&fixed))
    };
    Prior {
        sun_elevation_rad: Some(T::from_f64(sine.clamp(-1.0, 1.0).asin())),
        sun: prior.sun.or_else(|| in_camera().filter(|_| is_precise)),
        ..prior
    }
}
