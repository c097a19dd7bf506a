use super::*;
use crate::geometry::camera::{Config, Model};
use crate::geometry::frames::Cov3;

const LIMB_KM: f64 = 6396.0;

fn added<T: Real>(fx_px: f64, length_km: f64) -> Free<T> {
    turned(fx_px, length_km, 0.0)
}

/// `roll` turns the picture, so that the tangent vectors have another place on the arc.
fn turned<T: Real>(fx_px: f64, length_km: f64, roll: f64) -> Free<T> {
    let camera = Camera::try_new(&Config::ideal(Model::Pinhole, 640, 640, fx_px)).unwrap();
    let alpha = 68.6f64.to_radians();
    let axis = [alpha.sin() * roll.sin(), alpha.sin() * roll.cos(), alpha.cos()].map(T::from_f64);
    let free = Free {
        axis: UnitVec3::<Cam, T>::try_new(axis).unwrap(),
        covariance: Cov3::from_upper([T::ZERO; 6]),
        cos: T::from_f64(alpha.cos()),
        var_cos: T::ZERO,
        axis_with_cos: Some([T::ZERO; 3]),
        cos_per_px: T::from_f64(1e-3),
        common: Some(FreeCommon {
            covariance: Cov3::from_upper([T::ZERO; 6]),
            var_cos: T::ZERO,
            axis_with_cos: [T::ZERO; 3],
        }),
    };
    let limb = Limb {
        radius_km: T::from_f64(LIMB_KM),
        tilt_sigma_km: None,
        own_sigma_km: T::from_f64(1.5),
        own_length_km: T::from_f64(length_km),
    };
    limb.with_weather(&free, &camera)
}

#[test]
fn a_wide_field_is_a_constant_height_and_weather_tilts_the_cone() {
    // So long that the height hardly changes along the arc.
    let constant = added::<f64>(554.0, 1e12);
    let alpha = constant.cos.acos();
    // A change of the half-angle by tan α/(R + d) for each of 1.5 km.
    let want = (alpha.sin() * alpha.tan() * 1.5 / LIMB_KM).powi(2);
    assert!((constant.var_cos / want - 1.0).abs() < 1e-3, "{} {want}", constant.var_cos);
    assert!(constant.covariance.sigma_max_rad() < 1e-3 * want.sqrt());
    // On an arc of 60 degrees, weather with a length of 1000 km tilts the cone far more than its height.
    let weather = added::<f64>(554.0, 1000.0);
    let height_rad = want.sqrt() / alpha.sin();
    assert!(weather.covariance.sigma_max_rad() > 2.0 * height_rad && weather.var_cos > want);
    // A shorter arc is tilted more.
    assert!(added::<f64>(1100.0, 1000.0).covariance.sigma_max_rad() > weather.covariance.sigma_max_rad());
}

fn both<T: Real>(free: &Free<T>) -> [f64; 2] {
    [free.covariance.sigma_max_rad().to_f64().to_degrees(), free.var_cos.to_f64().sqrt()]
}

#[test]
fn a_short_arc_has_the_weather_of_a_dense_one() {
    // The limit for a short arc: with h = h0 + h1 ψ + h2 ψ²/2, the axis moves by k h2/sin α across the arc and the
    // cosine by k (h0 + h2). A height with the correlation exp(−(κψ)²/2) has the variances 1 and 3κ⁴ of h0 and h2,
    // and the covariance −κ².
    let (sin, cos) = 68.6f64.to_radians().sin_cos();
    let (k, square) = (1.5 * sin * sin / (cos * LIMB_KM), (LIMB_KM * cos / 1000.0).powi(2));
    let want = [(k * 3f64.sqrt() * square / sin).to_degrees(), k * (1.0 - 2.0 * square + 3.0 * square * square).sqrt()];
    // An arc of ten degrees.
    let ten = both(&added::<f64>(3930.0, 1000.0));
    assert!(ten.iter().zip(want).all(|(ten, want)| (ten / want - 1.0).abs() < 0.03), "{ten:?} {want:?}");
    // The result has a limit for short arcs, and it changes slowly with the field of view.
    let mut last = ten;
    for step in 1..80 {
        let now = both(&added::<f64>(3930.0 * 1.05f64.powi(step), 1000.0));
        let near = now.iter().zip(last).all(|(now, last)| (now / last - 1.0).abs() < 0.03);
        assert!(near, "{step}: {now:?} after {last:?}");
        last = now;
    }
    // Nothing depends on the place of the arc against the tangent vectors. A quarter of a turn leaves the picture,
    // but for half a pixel.
    for fx_px in [300.0, 1000.0, 4000.0, 30_000.0] {
        let [a, b] = [0.0, TAU / 4.0].map(|roll| both(&turned::<f64>(fx_px, 1000.0, roll)));
        assert!(a.iter().zip(b).all(|(a, b)| (a / b - 1.0).abs() < 1e-4), "{a:?} {b:?}");
    }
}

#[test]
fn single_precision_gives_the_same_weather() {
    for fx_px in [200.0, 554.0, 1100.0, 4000.0, 30_000.0] {
        let (wide, narrow) = (both(&added::<f64>(fx_px, 1000.0)), both(&added::<f32>(fx_px, 1000.0)));
        let near = wide.iter().zip(narrow).all(|(wide, narrow)| (narrow / wide - 1.0).abs() < 0.02);
        assert!(near, "{fx_px}: {narrow:?} {wide:?}");
    }
}

#[test]
fn the_next_epoch_sees_the_same_weather() {
    // The cone has no error but the weather.
    let free = added::<f64>(554.0, 1000.0);
    let common = free.common.unwrap();
    assert_eq!(common.covariance.upper_rad2, free.covariance.upper_rad2);
    assert_eq!((common.var_cos, Some(common.axis_with_cos)), (free.var_cos, free.axis_with_cos));
    assert!(common.var_cos > 0.0);
}

#[test]
fn the_tilt_follows_from_the_altitude() {
    // From 500 km the limb is 22 degrees from the point below: 1.1 km along one axis.
    assert!((tilt_km(68f64.to_radians()) - 1.1 / 2f64.sqrt()).abs() < 1e-9);
    let limb = Limb { radius_km: LIMB_KM, tilt_sigma_km: Some(0.3), own_sigma_km: 1.5, own_length_km: 1000.0 };
    assert!((limb.tilt_rad(0.6) - 0.3 / LIMB_KM * 0.8 / 0.6).abs() < 1e-15);
}
