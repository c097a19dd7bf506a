//! Compares HORACE's circle with exact limbs, and the correct form of each equation of the theses with the printed
//! erratum.

use super::*;
use crate::stages::consensus::Consensus;
use crate::stages::fit::Method;

const RADIUS_KM: f64 = 6371.0;

fn expected<T: Real>(altitude_km: f64) -> Expected<T> {
    let body = body::Config {
        kind: body::Kind::Sphere,
        radius_km: Some(RADIUS_KM),
        altitude_km: Some(altitude_km),
        limb_height_km: 0.0,
        ..body::Config::default()
    };
    Expected::new(&body, &Prior::default()).unwrap()
}

fn fitted<T: Real>(
    blocks: &mut [Block<T>],
    camera: &Camera<T>,
    expected: &Expected<T>,
) -> Option<(UnitVec3<Cam, T>, T)> {
    let start = Consensus { e: *direction::<T>([0.0, 0.0, 1.0]).v(), c: expected.cos, draws: 0, all: true };
    let config = fit::Config { method: Method::Circle, half_angle: HalfAngle::Free, ..Default::default() };
    let noise = covariance::Config::default();
    let fit = fit::fit(blocks, &start, expected, camera, T::from_f64(3.0), &config, &noise)?;
    Some((UnitVec3::assume_unit(fit.e), fit.c))
}

/// Camera, nadir in the camera frame, points of the limb.
type Seen = (Camera<f64>, UnitVec3<Cam, f64>, Vec<(f64, f64)>);

/// Returns the limb of a sphere whose centre is `off_nadir_deg` away from the optical axis of a pinhole.
fn binary(altitude_km: f64, off_nadir_deg: f64) -> Seen {
    let camera = Camera::try_new(&CameraConfig::ideal(Model::Pinhole, 2400, 1800, 100.0)).unwrap();
    let (s, c) = libm::sincos(off_nadir_deg.to_radians());
    let e = direction([0.0, s, c]);
    let sin: f64 = RADIUS_KM / (RADIUS_KM + altitude_km);
    let points = limb(&camera, &e, libm::sqrt(1.0 - sin * sin), 3.0);
    (camera, e, points)
}

/// Checks (2.31) to (2.36) in both directions at 80 km. With (2.27) as printed, the radius belongs to another altitude.
fn eighty_kilometres<T: Real>(tolerance_m: f64) {
    let (camera, e, points) = binary(80.0, 0.0);
    let _ = camera;
    let camera = Camera::<T>::try_new(&CameraConfig::ideal(Model::Pinhole, 2400, 1800, 100.0)).unwrap();
    let known = expected::<T>(80.0);
    let mut blocks = blocks(&camera, &points, &direction(e.xyz()));
    let (axis, c) = fitted(&mut blocks, &camera, &known).unwrap();
    assert!(axis.angle_rad(&direction(e.xyz())).to_f64() < 1e-5);
    let (altitude, _) = known.altitude(c, T::ZERO).unwrap();
    assert!((altitude.to_f64() - 80e3).abs() < tolerance_m, "{altitude}");
    let sin = libm::sqrt(1.0 - c.to_f64() * c.to_f64());
    assert!((sin - 0.98760).abs() < 5e-6);
    // As printed, sin α = (R − h)/R, and therefore h = R (1 − sin α).
    let printed_m = RADIUS_KM * 1e3 * (1.0 - sin);
    assert!((printed_m - 80e3).abs() > 900.0, "{printed_m}");
}

#[test]
fn altitude_from_the_radius() {
    eighty_kilometres::<f64>(1e-3);
    eighty_kilometres::<f32>(30.0);
}

/// Equation (2.37) counts the centre from the corner of the picture, which is half a pixel off in both directions.
#[test]
fn the_centre_of_a_picture_is_that_of_its_pixels() {
    let (camera, e, points) = binary(80.0, 0.0);
    let (axis, _) = fitted(&mut blocks(&camera, &points, &e), &camera, &expected(80.0)).unwrap();
    let found = camera.project(&axis).unwrap();
    let (w, h) = (f64::from(camera.width()), f64::from(camera.height()));
    assert!((found.u - (w - 1.0) / 2.0).abs() < 1e-6 && (found.v - (h - 1.0) / 2.0).abs() < 1e-6, "{found:?}");
    assert!((found.u - w / 2.0).abs() > 0.4 && (found.v - h / 2.0).abs() > 0.4);
}

/// Shows the error of the method on exact limbs. Straight down there is none. Off nadir, the error through an
/// equidistant lens is small at 25° and some degrees at 60°; with a pinhole it reaches tens of degrees.
#[test]
fn a_circle_is_right_straight_down_only() {
    let error_deg = |model: Model, focal_px: f64, altitude_km: f64, off_nadir_deg: f64| {
        let circle = (model == Model::Equidistant).then_some(120.0);
        let camera = CameraConfig { theta_max_deg: circle, ..CameraConfig::ideal(model, 1920, 1080, focal_px) };
        let camera = Camera::<f64>::try_new(&camera).unwrap();
        let (s, c) = libm::sincos(off_nadir_deg.to_radians());
        let (e, sin) = (direction([0.0, s, c]), RADIUS_KM / (RADIUS_KM + altitude_km));
        let points = limb(&camera, &e, libm::sqrt(1.0 - sin * sin), 3.0);
        let mut blocks = blocks(&camera, &points, &e);
        fitted(&mut blocks, &camera, &expected(altitude_km)).unwrap().0.angle_rad(&e).to_degrees()
    };
    let wide = |off| error_deg(Model::Equidistant, 345.0, 600.0, off);
    assert!(wide(0.0) < 1e-6);
    assert!((0.02..0.5).contains(&wide(25.0)), "{}", wide(25.0));
    assert!((1.0..15.0).contains(&wide(60.0)), "{}", wide(60.0));
    // A rocket's camera is 10° to 40° below the horizontal. The limb lies between the centre of the picture and a short
    // flat arc at the upper edge.
    let rocket = [50.0, 60.0, 70.0, 80.0].map(|off| error_deg(Model::Pinhole, 888.97, 120.0, off));
    assert!(rocket.iter().all(|off| (0.5..30.0).contains(off)) && rocket[0] > 6.0, "{rocket:?}");
}

#[test]
fn degenerate_points_give_no_circle() {
    let (camera, e, _) = binary(600.0, 0.0);
    let cases: [Vec<(f64, f64)>; 5] = [
        Vec::new(),
        Vec::from([(10.0, 20.0)]),
        Vec::from([(10.0, 20.0), (30.0, 40.0)]),
        Vec::from([(70.0, 40.0); 30]),
        (0..100).map(|i| (f64::from(i) * 9.0, 300.0)).collect(),
    ];
    for points in cases {
        let mut blocks = blocks(&camera, &points, &e);
        assert!(fitted(&mut blocks, &camera, &expected(600.0)).is_none(), "{points:?}");
    }
}
