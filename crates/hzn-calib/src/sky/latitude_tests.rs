//! A flight over a limb whose height changes with the latitude, as in the infrared.

use hzn_core::Prior;
use hzn_core::body::{self, Kind};
use hzn_core::camera::{Camera, Config, Model};
use hzn_core::ellipsoid::{LimbCone, WGS84_A_M, WGS84_B_M, from_geodetic};
use nalgebra::Vector3;

use super::{LimbPrior, Verdict, View, check};
use crate::draws::Draws;
use crate::noise::tests::{Noise, earth, limb, solution};

/// Height over the north pole less that over the equator, kilometres.
const BY_LATITUDE_KM: f64 = 4.5;

/// Pictures of the whole limb from pole to pole, 600 km high.
fn views(lens: &Config) -> Vec<View> {
    let camera = Camera::try_new(lens).unwrap();
    let mut draws = Draws(18);
    let view = |k: u32| {
        let latitude = (-80.0 + 160.0 * f64::from(k) / 15.0).to_radians();
        let position = from_geodetic(latitude, 0.3, 600e3, WGS84_A_M, WGS84_B_M);
        // The mean along the limb.
        let limb_m = 25e3 + 0.915 * BY_LATITUDE_KM * 1e3 * latitude.sin();
        let cone = LimbCone::try_new(position, WGS84_A_M + limb_m, WGS84_B_M + limb_m).unwrap();
        let (axis, alpha) = (Vector3::new(0.05, 0.02, 1.0).normalize(), cone.mean_half_angle_rad());
        let points = limb(&camera, axis, &|_| alpha.cos(), Noise(0.05, 10.0, 0.8), &mut draws);
        let prior = Prior { position_m: Some(position), ..Prior::default() };
        View::new(&format!("{k}"), points, prior, &solution(axis, alpha))
    };
    (0..16).map(view).collect()
}

#[test]
fn a_limb_by_latitude_is_no_contradiction() {
    let lens = Config::ideal(Model::KannalaBrandt, 960, 720, 720.0 / 140f64.to_radians());
    let views = views(&lens);
    let body = body::Config { kind: Kind::Earth, limb_height_km: 25.0, ..earth() };
    let verdict = |lens: &Config, sigma_km| check(lens, &body, &views, LimbPrior { km: 25.0, sigma_km }, 0.3).unwrap();
    for sigma_km in [7.0, f64::INFINITY] {
        let right = verdict(&lens, sigma_km);
        assert!(right.verdict != Verdict::DoesNotHold && right.contradiction().is_none(), "{right:?}");
    }
    let wrong = Config { fx_px: lens.fx_px * 1.01, fy_px: lens.fy_px * 1.01, ..lens.clone() };
    let wrong = verdict(&wrong, 7.0);
    assert!(wrong.focal.is_significant() && wrong.contradiction().is_none(), "{wrong:?}");
    // A height that is told to 50 m at every latitude does not change by kilometres.
    assert!(verdict(&lens, 0.05).contradiction().is_some());
}
