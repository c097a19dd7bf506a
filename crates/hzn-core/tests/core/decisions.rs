//! Decisions about a whole picture: which of two limbs counts, what work is paid for, and what is too small.

use hzn_core::body::Kind;
use hzn_core::camera::{self, Model};
use hzn_core::gates::FixedEdge;
use hzn_core::image::{Grey, Layout};
use hzn_core::status::Status;
use hzn_core::verdict::Verdict;
use hzn_core::{Config, HostHorizon, Prior, Report, Sequence};

const FOCAL_PX: f64 = 600.0;
const RADIUS_PX: f64 = 60.0;

/// A half-lit disc: the place of its centre in the picture, and how much its edge waves, in pixels.
#[derive(Clone, Copy)]
pub(crate) struct Half {
    pub(crate) centre_px: [f64; 2],
    pub(crate) wave_px: f64,
}

/// Returns a sensor for a sphere that appears with a radius of nearly 60 px.
pub(crate) fn config() -> Config {
    let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 640, 360, FOCAL_PX));
    config.body.kind = Kind::Sphere;
    config.body.radius_km = Some(1000.0);
    (config.body.limb_height_km, config.body.limb_height_sigma_km) = (0.0, 2.0);
    config.body.altitude_km = Some(1000.0 * (1.0 / half_angle_rad().sin() - 1.0));
    config.body.altitude_sigma_km = 50.0;
    config
}

fn half_angle_rad() -> f64 {
    (RADIUS_PX / FOCAL_PX).atan()
}

/// Draws discs that the Sun lights from the left. Less than half of each limb is seen, so that
/// no answer is certain.
pub(crate) fn draw(halves: &[Half]) -> Vec<u8> {
    let ray = |u: f64, v: f64| {
        let (x, y) = ((u - 319.5) / FOCAL_PX, (v - 179.5) / FOCAL_PX);
        let length = (x * x + y * y + 1.0).sqrt();
        [x / length, y / length, 1.0 / length]
    };
    let light = |u: f64, v: f64, half: &Half| {
        let ([cu, cv], at) = (half.centre_px, ray(u, v));
        let axis = ray(cu, cv);
        let cos: f64 = (0..3).map(|k| at[k] * axis[k]).sum();
        let azimuth = (v - cv).atan2(u - cu);
        let edge_rad = half_angle_rad() + half.wave_px / FOCAL_PX * (9.0 * azimuth).sin();
        let inside_px = (edge_rad - cos.clamp(-1.0, 1.0).acos()) * FOCAL_PX;
        // Two fifths of the limb are brighter than half of the full light.
        let lit = (-4.0 * (u - cu) / RADIUS_PX - 0.54).clamp(0.0, 1.0);
        160.0 * lit * (0.5 + inside_px).clamp(0.0, 1.0)
    };
    (0..640 * 360u32)
        .map(|i| {
            let (u, v) = (f64::from(i % 640), f64::from(i / 640));
            (5.0 + halves.iter().map(|half| light(u, v, half)).sum::<f64>()).round() as u8
        })
        .collect()
}

fn process(config: &Config, data: &[u8]) -> Report<f64> {
    process_with(&Prior::default(), config, data)
}

fn process_with(prior: &Prior<f64>, config: &Config, data: &[u8]) -> Report<f64> {
    let mut horizon = HostHorizon::boxed(config).unwrap();
    let expected = horizon.expect(prior).unwrap();
    horizon.process(&Grey::try_new(data, Layout::packed(640, 360, 1, 8)).unwrap(), &expected)
}

#[test]
fn of_two_limbs_that_are_as_good_none_is_believed() {
    let config = config();
    let [left, right] = [[160.3, 180.2], [470.8, 175.4]].map(|centre_px| Half { centre_px, wave_px: 0.0 });
    for half in [left, right] {
        let alone = process(&config, &draw(&[half]));
        assert_eq!(alone.status, Status::Ok, "{:?}", alone.candidates);
    }
    let both = process(&config, &draw(&[left, right]));
    assert_eq!(both.status, Status::Ambiguous, "{:?}", both.candidates);
    assert!(both.solution.is_none());
}

#[test]
fn of_two_limbs_the_much_better_one_is_believed() {
    let config = config();
    let good = Half { centre_px: [160.3, 180.2], wave_px: 0.0 };
    let worse = Half { centre_px: [470.8, 175.4], wave_px: 0.6 };
    for pair in [[good, worse], [worse, good]] {
        let report = process(&config, &draw(&pair));
        assert_eq!(report.status, Status::Ok, "{:?}", report.candidates);
        assert_eq!(report.candidates.iter().filter(|edge| edge.verdict == Verdict::Passed).count(), 1);
        let [x, y, z] = report.solution.unwrap().axis.xyz();
        let off_px = ((x / z * FOCAL_PX + 319.5 - 160.3).powi(2) + (y / z * FOCAL_PX + 179.5 - 180.2).powi(2)).sqrt();
        assert!(off_px < 1.0, "{off_px} px");
    }
}

#[test]
fn limbs_of_another_size_are_refused() {
    let mut config = config();
    config.body.altitude_km = Some(4.0 * config.body.altitude_km.unwrap());
    // Whether one or two edges are fitted, the picture has edges that are no limb.
    for centres in [&[[160.3, 180.2]][..], &[[160.3, 180.2], [470.8, 175.4]]] {
        let halves: Vec<Half> = centres.iter().map(|&centre_px| Half { centre_px, wave_px: 0.0 }).collect();
        let report = process(&config, &draw(&halves));
        assert_eq!(report.status, Status::Rejected, "{:?}", report.candidates);
    }
}

#[test]
fn an_overexposed_limb_is_answered() {
    let mut config = config();
    config.body.kind = Kind::EarthSphere;
    (config.body.radius_km, config.body.limb_height_km, config.body.limb_height_sigma_km) = (None, 17.0, 7.0);
    config.body.altitude_km = Some(6388.0 / half_angle_rad().sin() - 6371.0);
    let data = draw(&[Half { centre_px: [300.3, 180.2], wave_px: 0.0 }]);
    // With a Sun that may be low, the light that changes along the limb would count, too.
    let prior = Prior { sun_elevation_rad: Some(core::f64::consts::FRAC_PI_2), ..Prior::default() };
    let right = process_with(&prior, &config, &data).solution.unwrap();
    let overexposed: Vec<u8> = data.iter().map(|&v| v.saturating_mul(4)).collect();
    let report = process_with(&prior, &config, &overexposed);
    let Some(answer) = &report.solution else { panic!("{}: {:?}", report.status, report.candidates) };
    // The brightness four times as high moves the edge outwards all around, and the axis stays.
    let sigma_rad = answer.covariance.sigma_max_rad();
    assert!(answer.axis.angle_rad(&right.axis) < sigma_rad, "{sigma_rad}");
    assert!(sigma_rad > right.covariance.sigma_max_rad());
}

#[test]
fn every_point_is_paid_for() {
    let data = draw(&[Half { centre_px: [300.3, 180.2], wave_px: 0.0 }]);
    let least = |per_point: u32, config: &Config| {
        let counters = process(config, &data).counters;
        assert!(counters.edge_points > 50);
        assert!(counters.work > per_point * counters.edge_points, "{counters:?}");
    };
    let mut config = config();
    least(19, &config);
    config.edge_points.sub_pixel = hzn_core::edge_points::SubPixel::Zernike;
    least(59, &config);
    if cfg!(feature = "erf") {
        config.edge_points.sub_pixel = hzn_core::edge_points::SubPixel::Erf;
        least(2019, &config);
    }
}

#[test]
fn a_picture_that_repeats_refuses_its_answer_or_marks_it() {
    let mut config = config();
    let data = draw(&[Half { centre_px: [300.3, 180.2], wave_px: 0.0 }]);
    let mut judged = |fixed_edge| {
        config.gates.fixed_edge = fixed_edge;
        let mut report = process(&config, &data);
        assert_eq!(report.status, Status::Ok);
        Sequence::default().judge_repeat(&mut report, &config.gates);
        (report.status, report.solution.is_some(), report.is_suspect)
    };
    assert_eq!(judged(FixedEdge::Refuse), (Status::Rejected, false, false));
    assert_eq!(judged(FixedEdge::Warn), (Status::Ok, true, true));
    assert_eq!(judged(FixedEdge::Off), (Status::Ok, true, false));
    // Without an answer there is nothing to doubt.
    let mut empty = process(&config, &vec![5; 640 * 360]);
    let before = empty.status;
    config.gates.fixed_edge = FixedEdge::Warn;
    Sequence::default().judge_repeat(&mut empty, &config.gates);
    assert_eq!((empty.status, empty.is_suspect), (before, false));
}

#[cfg(feature = "position")]
#[test]
fn the_diameter_decides_whether_a_disc_is_too_small() {
    use hzn_core::body::PriorError;

    let mut config = config();
    config.fit.position = Some(true);
    let range_km = |diameter_px: f64| 1000.0 / (diameter_px / 2.0 / FOCAL_PX).sin();
    let mut expect = |diameter_px: f64| {
        config.body.altitude_km = Some(range_km(diameter_px) - 1000.0);
        HostHorizon::boxed(&config).unwrap().expect(&Prior::default()).map(|_| ())
    };
    assert_eq!(expect(200.0), Ok(()));
    let Err(PriorError::TooSmall { diameter_px_100 }) = expect(2.0) else { panic!("{:?}", expect(2.0)) };
    assert!((195..=205).contains(&diameter_px_100), "{diameter_px_100}");
}
