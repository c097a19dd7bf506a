//! Compares the fit of a limb whose height changes along the edge with the error that the covariance predicts.

use super::*;
use crate::image::{Profile, Profiles};
use crate::model::tone::Tone;
use crate::stages::covariance::{ErrorBudget, Term};

/// Azimuth of the Sun from the middle of the edge and its elevation below the camera, degrees.
const SUNS_DEG: [(f64, f64); 6] = [(0.0, -8.0), (50.0, 3.0), (90.0, 6.0), (-90.0, 4.0), (120.0, 18.0), (180.0, 25.0)];

/// Returns the points of the limb whose half-angle is that of the cone and a part more at each azimuth, from the ray of
/// the cone.
fn raised(camera: &Camera<f64>, e: &V3<f64>, cos: f64, more_rad: impl Fn(&V3<f64>) -> f64) -> Vec<(f64, f64)> {
    let (b1, b2) = basis(e);
    let alpha = libm::acos(cos);
    in_view(camera, 2.0, |azimuth| {
        let (sp, cp) = libm::sincos(azimuth);
        let out = b1 * cp + b2 * sp;
        let (s, c) = libm::sincos(alpha + more_rad(&(e * cos + out * libm::sin(alpha))));
        UnitVec3::assume_unit(e * c + out * s)
    })
}

/// Fits points with a free or the expected half-angle. Returns axis, cos and error budget.
fn fitted(
    camera: &Camera<f64>,
    points: &[(f64, f64)],
    e: &UnitVec3<Cam, f64>,
    expected: &Expected<f64>,
    half_angle: HalfAngle,
) -> (V3<f64>, f64, ErrorBudget<f64>) {
    fitted_with(camera, points, e, expected, half_angle, Profiles::default())
}

/// Does the same for an edge with these profiles, in a picture with linear counts.
fn fitted_with(
    camera: &Camera<f64>,
    points: &[(f64, f64)],
    e: &UnitVec3<Cam, f64>,
    expected: &Expected<f64>,
    half_angle: HalfAngle,
    profiles: Profiles,
) -> (V3<f64>, f64, ErrorBudget<f64>) {
    let mut blocks = blocks(camera, points, e);
    let config = consensus::Config { threshold_px: 60.0, ..consensus::Config::default() };
    let (threshold, count) = (consensus::Threshold::from_config(&config), points.len() as u32);
    let (fx, mut work) = (camera.focal_px().0, WorkBudget::unlimited());
    let start = consensus::find(&mut blocks, count, expected, fx, threshold, &config, &mut work).unwrap();
    let estimate = fit::Config { half_angle, ..Default::default() };
    let noise = covariance::Config { tilt_px: 0.0, ..covariance::Config::given(0.1, 60.0) };
    let mut fit = fit::fit(&mut blocks, &start, expected, camera, 60.0, &estimate, &noise).unwrap();
    (fit.profiles, fit.tone) = (profiles, Some(Tone::Linear));
    let mut budget = ErrorBudget::new();
    covariance::fuse(&blocks, &fit, expected, &noise, &estimate, camera, Some(&mut budget)).unwrap();
    (fit.e, fit.c, budget)
}

/// The cone of the Earth from 400 km, an axis below the camera, and the camera.
fn scene(fx_px: f64) -> (Camera<f64>, UnitVec3<Cam, f64>, Expected<f64>) {
    let camera = Camera::try_new(&CameraConfig::ideal(Model::Pinhole, 1280, 960, fx_px)).unwrap();
    let prior = Prior { altitude_m: Some(400e3), ..Prior::default() };
    let expected = Expected::new(&body::Config::default(), &prior).unwrap();
    (camera, direction([0.0, libm::sin(1.22), libm::cos(1.22)]), expected)
}

#[test]
fn a_low_sun_moves_the_fit_as_the_covariance_says() {
    for fx_px in [500.0, 1000.0] {
        let (camera, e, expected) = scene(fx_px);
        let (towards, across) = (V3::new(0.0, -libm::cos(1.22), libm::sin(1.22)), V3::new(1.0, 0.0, 0.0));
        for (azimuth_deg, elevation_deg) in SUNS_DEG {
            let ((sa, ca), (se, ce)) =
                (libm::sincos(f64::to_radians(azimuth_deg)), libm::sincos(f64::to_radians(elevation_deg)));
            let sun = (towards * ca + across * sa) * ce - e.v() * se;
            let expected = Expected { sun_seen: Some(sun), ..expected };
            let per_m = expected.cos_per_m() / expected.sin;
            let points = raised(&camera, e.v(), expected.cos, |ray| {
                let normal = (ray * expected.cos - e.v()) / expected.sin;
                expected.raised_by_low_sun_m(normal.dot(&sun)) * per_m
            });
            for half_angle in [HalfAngle::Free, HalfAngle::Known] {
                let (axis, cos, budget) = fitted(&camera, &points, &e, &expected, half_angle);
                let off =
                    (axis - e.v()).norm().hypot(if half_angle == HalfAngle::Free { cos - expected.cos } else { 0.0 });
                // A third of the square of the whole rise.
                let p = budget.fit_term(Term::LowSun) * 3.0;
                let ratio = libm::sqrt(p.m11 + p.m22 + p.m33) / off;
                // Three heights stand for the whole arc. Where the Sun lights only a part of it, and the half-angle is
                // known, the answer is too wide.
                let allowed = if half_angle == HalfAngle::Free { 0.85..1.35 } else { 0.75..1.95 };
                assert!(
                    allowed.contains(&ratio),
                    "{fx_px} {azimuth_deg} {elevation_deg} {half_angle:?}: {ratio} {off}"
                );
            }
        }
    }
}

#[test]
fn a_tilt_moves_the_axis_as_the_covariance_says() {
    let (camera, e, expected) = scene(500.0);
    let expected = Expected { tilt_sigma_m: 400.0, ..expected };
    let (b1, _) = basis(e.v());
    let per_m = expected.cos_per_m() / expected.sin;
    let points =
        raised(&camera, e.v(), expected.cos, |ray| ray.dot(&b1) / expected.sin * expected.tilt_sigma_m * per_m);
    let (axis, cos, budget) = fitted(&camera, &points, &e, &expected, HalfAngle::Free);
    let p = budget.fit_term(Term::LimbTilt);
    assert!(((axis - e.v()).norm() / libm::sqrt(p.m11) - 1.0).abs() < 0.02 && (cos - expected.cos).abs() < 1e-5);
    assert_eq!([p.m12, p.m13, p.m23, p.m33], [0.0; 4]);
}

#[test]
fn an_elevation_alone_spreads_the_sun_over_all_azimuths() {
    let (camera, e, expected) = scene(500.0);
    let points = limb(&camera, &e, expected.cos, 2.0);
    let low_sun = |expected: &Expected<f64>| {
        let (.., budget) = fitted(&camera, &points, &e, expected, HalfAngle::Free);
        *budget.fit_term(Term::LowSun)
    };
    let at = |deg: f64| low_sun(&Expected { sun_elevation_rad: Some(deg.to_radians()), ..expected });
    // The arc has the dip of the horizon, 20°, at most to the Sun; beyond 65° nothing is low.
    let [low, high, night] = [5.0, 66.0, -30.0].map(at);
    assert!(low.m11 > 0.0 && low.m22 > 0.0 && low.m33 > 0.0, "{low}");
    assert_eq!([high.norm(), night.norm(), low_sun(&expected).norm()], [0.0; 3]);
    // The two sides are equally likely, so that nothing joins the directions towards the edge and along it.
    assert!(low.m12.abs() < 1e-3 * low.m11.max(low.m22), "{low}");
}

/// Moves points outwards, each by its pixels; `y_px` gets the number of the point and the number of all.
fn moved(
    camera: &Camera<f64>,
    e: &V3<f64>,
    points: &[(f64, f64)],
    y_px: impl Fn(f64, f64, f64) -> f64,
) -> Vec<(f64, f64)> {
    let count = points.len() as f64;
    let outwards = |&(u, v): &(f64, f64)| {
        let ray = *camera.unproject(ImagePoint { u, v }).unwrap().v();
        let farther = UnitVec3::assume_unit((ray - e * 1e-6).normalize());
        let to = camera.project(&farther).unwrap();
        let (du, dv) = (to.u - u, to.v - v);
        let length = libm::hypot(du, dv);
        (du / length, dv / length)
    };
    let all = points.iter().enumerate();
    all.map(|(i, point)| {
        let (du, dv) = outwards(point);
        let y = y_px(i as f64, count, du.abs().max(dv.abs()));
        (point.0 + y * du, point.1 + y * dv)
    })
    .collect()
}

/// Makes the profiles of an edge of `count` points. Width and contrast of each third are given as powers of two.
fn profiles(count: usize, widths: [u8; 3], contrasts: [u8; 3]) -> Profiles {
    let mut profiles = Profiles::default();
    for place in 0..count {
        let third = 3 * place / count;
        profiles.add(third, place, Profile { width: 4 * widths[third], contrast: 4 * contrasts[third] });
    }
    profiles
}

/// The value at `i` of the parabola through three values in the middles of the thirds of `count` points.
fn parabola(i: f64, count: f64, [first, middle, last]: [f64; 3]) -> f64 {
    let t = (i + 0.5) / count * 3.0 - 1.5;
    middle + (last - first) / 2.0 * t + ((first + last) / 2.0 - middle) * t * t
}

#[test]
fn light_along_the_edge_moves_the_fit_as_the_covariance_says() {
    for fx_px in [500.0, 1000.0] {
        let (camera, e, expected) = scene(fx_px);
        let points = limb(&camera, &e, expected.cos, 2.0);
        let scale_px = 7.5e3 * expected.cos_per_m() / expected.sin * fx_px;
        for (widths, contrasts) in [([4, 5, 6], [5; 3]), ([6, 6, 6], [5; 3]), ([1; 3], [4, 6, 8]), ([1; 3], [7, 5, 6])]
        {
            let mean = f64::from(contrasts.iter().sum::<u8>()) / 3.0;
            let shift = |i: f64, count: f64, across: f64| {
                let limb_px = 2.885 * scale_px;
                let own_px = libm::hypot(1.15 * limb_px, 5.0);
                let widths_px = widths.map(|log2| libm::exp2(f64::from(log2)) * across);
                let wider = widths_px.map(|width| (width - own_px).max(0.0));
                let ln = contrasts.map(|log2| (f64::from(log2) - mean) * core::f64::consts::LN_2);
                // An edge that is so much narrower than a limb has room for all of it.
                let shifted = core::array::from_fn(|k| widths_px[k] * ln[k] / 2.0);
                parabola(i, count, wider) + parabola(i, count, shifted)
            };
            let edge = moved(&camera, e.v(), &points, shift);
            for half_angle in [HalfAngle::Free, HalfAngle::Known] {
                let (axis, cos, _) = fitted(&camera, &edge, &e, &expected, half_angle);
                let profiles = profiles(points.len(), widths, contrasts);
                let (.., budget) = fitted_with(&camera, &points, &e, &expected, half_angle, profiles);
                let free = half_angle == HalfAngle::Free;
                let off = (axis - e.v()).norm().hypot(if free { cos - expected.cos } else { 0.0 });
                let p = budget.fit_term(Term::LowSun) * 3.0;
                let ratio = libm::sqrt(p.m11 + p.m22 + if free { p.m33 } else { 0.0 }) / off;
                assert!((0.8..1.25).contains(&ratio), "{fx_px} {widths:?} {contrasts:?} {half_angle:?}: {ratio} {off}");
            }
        }
    }
}

#[test]
fn a_high_sun_has_no_light_that_changes() {
    let (camera, e, expected) = scene(500.0);
    let points = limb(&camera, &e, expected.cos, 2.0);
    let profiles = profiles(points.len(), [4, 5, 6], [4, 6, 8]);
    let light = |expected: &Expected<f64>| {
        let (.., budget) = fitted_with(&camera, &points, &e, expected, HalfAngle::Free, profiles);
        budget.fit_term(Term::LowSun).norm()
    };
    // The dip of the horizon is 20°.
    let at = |deg: f64| light(&Expected { sun_elevation_rad: Some(deg.to_radians()), ..expected });
    assert!(light(&expected) > 0.0 && at(19.0) > 0.0);
    assert_eq!(at(66.0), 0.0);
    let seen = |down: f64| {
        light(&Expected { sun_seen: Some((V3::new(0.1, 0.1, 1.0) - e.v() * down).normalize()), ..expected })
    };
    assert_eq!(seen(20.0), 0.0);
    assert!(seen(-1.0) > 0.0);
    // Neither a thermal camera nor a body without air.
    assert_eq!(light(&Expected { is_in_sunlight: false, ..expected }), 0.0);
    assert_eq!(light(&Expected { scale_height_m: 0.0, ..expected }), 0.0);
}
