//! A lens of unknown shape: the gates that compare shapes allow what its covariance can bend, and no more.

use hzn_core::body::Kind;
use hzn_core::camera::{self, Camera, Covariance, Intrinsic, Model};
use hzn_core::frames::{Cam, UnitVec3};
use hzn_core::image::{Grey, Layout};
use hzn_core::pixel::ImagePoint;
use hzn_core::status::Status;
use hzn_core::verdict::Verdict;
use hzn_core::{Config, FlightHorizon, HostHorizon, Prior, Report};

const SIZE: [u16; 2] = [640, 480];
/// Half of the horizontal field of view.
const EDGE_RAD: f64 = 0.8;
/// 2 tan θ/2 as a series: a lens that shows every limb as a circle of the picture.
const STEREOGRAPHIC: [f64; 4] = [1.0 / 12.0, 1.0 / 120.0, 17.0 / 20_160.0, 31.0 / 362_880.0];

/// A lens with the given coefficients and a fixed field of view.
fn lens(k: &[f64]) -> camera::Config {
    let radius = EDGE_RAD * k.iter().rev().fold(1.0, |sum, k| (sum - 1.0 + k) * EDGE_RAD * EDGE_RAD + 1.0);
    let mut lens = camera::Config::ideal(Model::KannalaBrandt, SIZE[0], SIZE[1], f64::from(SIZE[0]) / 2.0 / radius);
    lens.k = k.iter().copied().collect();
    lens
}

/// A sensor that takes the lens for equidistant. With `k1_sigma` it does not know the shape; the field of view fixes
/// the edge of the picture.
fn sensor(k1_sigma: f64) -> Config {
    let mut camera = lens(&[0.0]);
    if k1_sigma > 0.0 {
        let (f, focal_by_k1) = (camera.fx_px, -EDGE_RAD * EDGE_RAD * camera.fx_px);
        let kk = k1_sigma * k1_sigma;
        let (ff, fk) = ((0.03 * f).powi(2) + focal_by_k1 * focal_by_k1 * kk, focal_by_k1 * kk);
        camera.covariance = Some(Covariance {
            order: [Intrinsic::FxPx, Intrinsic::FyPx, Intrinsic::K1].into_iter().collect(),
            rows: [[ff, ff, fk], [ff, ff, fk], [fk, fk, kk]].iter().map(|row| row.iter().copied().collect()).collect(),
        });
    }
    let mut config = Config::new(camera);
    config.body.kind = Kind::EarthSphere;
    (config.body.altitude_km, config.body.altitude_sigma_km) = (Some(500.0), 5.0);
    // A drawn limb is flat and has no air, as a ghost.
    config.gates.min_p_limb = 0.0;
    config
}

/// Draws what is inside, with a soft edge: `depth_px` is the distance of a point to the inside of the edge, pixels.
fn draw(depth_px: impl Fn(ImagePoint<f64>) -> f64) -> Vec<u8> {
    let [w, h] = SIZE.map(u32::from);
    let pixel = |i: u32| {
        let at = ImagePoint { u: f64::from(i % w), v: f64::from(i / w) };
        (10.0 + 180.0 / (1.0 + (-2.0 * depth_px(at)).exp())) as u8
    };
    (0..w * h).map(pixel).collect()
}

/// Draws the limb at the expected height about an axis, as the true lens shows it.
fn limb(true_lens: &camera::Config, axis: UnitVec3<Cam, f64>) -> Vec<u8> {
    let camera = Camera::<f64>::try_new(true_lens).unwrap();
    let half_angle = ((6371.0088f64 + 17.0) / (6371.0088 + 500.0)).asin();
    draw(|at| camera.unproject(at).map_or(-99.0, |ray| (half_angle - ray.angle_rad(&axis)) * true_lens.fx_px))
}

fn process(config: &Config, data: &[u8]) -> Report<f64> {
    let mut horizon = HostHorizon::boxed(config).unwrap();
    let picture = Grey::try_new(data, Layout::packed(SIZE[0].into(), SIZE[1].into(), 1, 8)).unwrap();
    let expected = horizon.expect(&Prior::default()).unwrap();
    horizon.process(&picture, &expected)
}

/// Processes in single precision, with the lists of a flight computer. Returns the angle to an axis in radians.
fn error_in_flight(config: &Config, data: &[u8], axis: &UnitVec3<Cam, f64>) -> Option<f64> {
    let mut horizon = FlightHorizon::boxed(config).unwrap();
    let picture = Grey::try_new(data, Layout::packed(SIZE[0].into(), SIZE[1].into(), 1, 8)).unwrap();
    let expected = horizon.expect(&Prior::default()).unwrap();
    let found = horizon.process(&picture, &expected).solution?.axis.xyz().map(f64::from);
    Some(UnitVec3::try_new(found)?.angle_rad(axis))
}

fn axis(off_axis: f64, azimuth: f64) -> UnitVec3<Cam, f64> {
    let ((s, c), (sa, ca)) = (off_axis.sin_cos(), azimuth.sin_cos());
    UnitVec3::try_new([s * ca, s * sa, c]).unwrap()
}

#[test]
fn a_limb_that_an_uncertain_lens_bends_is_answered() {
    for (off_axis, azimuth) in [(1.0, 0.5), (1.2, 2.0), (1.35, 4.0)] {
        let axis = axis(off_axis, azimuth);
        let picture = limb(&lens(&STEREOGRAPHIC), axis);
        // As a lens that is known to be equidistant, it shows no limb.
        assert_ne!(process(&sensor(0.0), &picture).status, Status::Ok, "{off_axis}");
        let report = process(&sensor(0.055), &picture);
        let found = report.solution.unwrap_or_else(|| panic!("{off_axis}: {report:?}"));
        let error = found.axis.angle_rad(&axis);
        assert!(error < 3.0 * found.covariance.sigma_max_rad(), "{off_axis}: {error}");
        let in_flight = error_in_flight(&sensor(0.055), &picture, &axis).unwrap();
        assert!((in_flight - error).abs() < 1e-4, "{off_axis}: {error} {in_flight}");
    }
}

/// A circle of the picture is the limb of a stereographic lens, but only if its size is that of the body.
#[test]
fn a_circle_of_another_size_is_refused() {
    for (radius_px, expected) in [(700.0, Verdict::HalfAngle), (760.0, Verdict::Circle), (1000.0, Verdict::HalfAngle)] {
        let picture = draw(|at| radius_px - (at.u - 320.0).hypot(at.v - 200.0 - radius_px));
        let report = process(&sensor(0.055), &picture);
        assert_eq!(report.candidates.first().map(|c| c.verdict), Some(expected), "{radius_px}: {report:?}");
        assert_eq!(report.status, Status::Rejected);
    }
}
