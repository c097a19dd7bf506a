//! `process` returns a report for every picture and never reports NaN or infinity in an answer.

use crate::common::{KINDS, garbage};
use hzn_core::body::{Kind, Prior, PriorError};
use hzn_core::camera::{self, Model};
use hzn_core::frames::UnitVec3;
use hzn_core::image::{Channel, Grey, ImageView, Layout};
use hzn_core::real::Real;
use hzn_core::status::Status;
use hzn_core::{Config, Expected, FlightHorizon, HostHorizon, Preset, Report, Sensor};
use hzn_core::{report::MAX_LISTED, verdict::Verdict};
use proptest::prelude::*;

fn config(model: Model, circle: bool, mask: bool, kind: Kind) -> Config {
    let mut config = Config::new(camera::Config::ideal(model, 96, 64, 60.0));
    config.camera.theta_max_deg = circle.then_some(30.0);
    config.body.kind = kind;
    config.body.altitude_km = Some(300.0);
    config.edge_points.min_points = 8;
    config.gates.min_inliers = 8;
    if mask {
        let triangle = [[10.0, 10.0], [50.0, 5.0], [30.0, 60.0]];
        config.mask.polygons_px.push(triangle.into_iter().collect()).unwrap();
    }
    config
}

fn sound(report: &Report<f64>) {
    assert_eq!(report.status == Status::Ok, report.solution.is_some());
    listed(report);
    if let Some(s) = &report.solution {
        let [x, y, z] = s.axis.xyz();
        assert!((x * x + y * y + z * z - 1.0).abs() < 1e-9);
        assert!(s.covariance.upper_rad2.iter().all(|v| v.is_finite()));
        assert!(s.covariance.sigma_max_rad() > 0.0);
        assert!(s.half_angle_rad.is_finite() && s.rms_px.is_finite() && s.arc_px.is_finite());
    }
}

/// Checks that the chosen candidate, and no other, is listed as chosen, with the numbers of the answer.
fn listed<T: Real>(report: &Report<T>) {
    let chosen = report.candidates.iter().filter(|c| c.verdict == Verdict::Chosen);
    let chosen: Vec<_> = chosen.map(|c| (c.number, c.inliers, c.points)).collect();
    let answer = report.solution.as_ref().map(|s| (s.candidate, s.inliers, report.counters.edge_points));
    assert_eq!(chosen, Vec::from_iter(answer));
}

/// The picture has a body in its middle, and so many lit things along its border that the body's edge comes after all
/// edges that a report lists.
#[test]
fn the_chosen_edge_is_listed_however_late_it_comes() {
    let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 640, 480, 300.0));
    config.body.kind = Kind::Sphere;
    config.body.radius_km = Some(1000.0);
    config.body.altitude_km = Some(1923.8);
    config.body.limb_height_km = 0.0;
    let lit = |x: u32, y: u32| {
        let off = (f64::from(x) - 320.0).hypot(f64::from(y) - 240.0) - 300.0 * 20f64.to_radians().tan();
        let thing = x % 50 < 20 && !(40..440).contains(&y);
        if thing { 220.0 } else { 10.0 + 210.0 * (0.5 - off).clamp(0.0, 1.0) }
    };
    let data: Vec<u8> = (0..640 * 480).map(|i| lit(i % 640, i / 640) as u8).collect();
    let picture = Grey::try_new(&data, Layout::packed(640, 480, 1, 8)).unwrap();
    let mut host = HostHorizon::boxed(&config).unwrap();
    let report = host.process(&picture, &host.expect(&Prior::default()).unwrap());
    assert!(report.solution.as_ref().is_some_and(|s| s.candidate as usize >= MAX_LISTED), "{report:?}");
    assert_eq!((report.candidates.len(), report.candidates[15].verdict), (MAX_LISTED, Verdict::Chosen));
    listed(&report);
    let mut flight = FlightHorizon::boxed(&config).unwrap();
    let report = flight.process(&picture, &flight.expect(&Prior::default()).unwrap());
    assert_eq!(report.candidates[15].verdict, Verdict::Chosen);
    listed(&report);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn any_picture_gets_a_sound_report(
        kind in 0..KINDS, seed in any::<u64>(), level in any::<u8>(), lens in 0usize..4, circle: bool, mask: bool,
        body in 0usize..4,
    ) {
        let model = [Model::Pinhole, Model::Equidistant, Model::KannalaBrandt, Model::BrownConrady][lens];
        let body = [Kind::Earth, Kind::EarthSphere, Kind::Sun, Kind::Moon][body];
        let config = config(model, circle, mask, body);
        let data = garbage(kind, seed, level);
        let picture = Grey::try_new(&data, Layout::packed(96, 64, 1, 8)).unwrap();
        let mut host = HostHorizon::boxed(&config).unwrap();
        let expected = host.expect(&Prior::default()).unwrap();
        let first = host.process(&picture, &expected);
        sound(&first);
        // The same picture gives the same answer, independently of the pictures in between.
        let data = garbage(0, seed ^ 7, 128);
        let _ = host.process(&Grey::try_new(&data, Layout::packed(96, 64, 1, 8)).unwrap(), &expected);
        let again = host.process(&picture, &expected);
        prop_assert_eq!(first.counters, again.counters);
        prop_assert_eq!(first.solution.map(|s| s.axis.xyz()), again.solution.map(|s| s.axis.xyz()));
        let mut flight = FlightHorizon::boxed(&config).unwrap();
        let expected: Expected<f32> = flight.expect(&Prior::default()).unwrap();
        let report = flight.process(&picture, &expected);
        listed(&report);
        if let Some(s) = report.solution {
            prop_assert!(s.axis.xyz().iter().all(|v| v.is_finite()));
            prop_assert!(s.covariance.upper_rad2.iter().all(|v| v.is_finite()));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn every_preset_answers_any_picture_soundly(
        kind in 0..KINDS, seed in any::<u64>(), level in any::<u8>(), preset in 0..Preset::ALL.len(), wide: bool,
        sun in proptest::option::of([-1.0..1.0f64, -1.0..1.0, -1.0..1.0]),
    ) {
        let model = if wide { Model::Equidistant } else { Model::Pinhole };
        let mut config = Config::preset(Preset::ALL[preset], camera::Config::ideal(model, 96, 64, 60.0));
        config.body.altitude_km = Some(300.0);
        config.edge_points.min_points = 8;
        config.gates.min_inliers = 8;
        config.gates.max_rms_px = 1e6;
        let data = garbage(kind, seed, level);
        let picture = Grey::try_new(&data, Layout::packed(96, 64, 1, 8)).unwrap();
        let mut host = HostHorizon::boxed(&config).unwrap();
        let frame = Prior { sun: sun.and_then(UnitVec3::try_new), ..Prior::default() };
        let expected = host.expect(&frame).unwrap();
        sound(&host.process(&picture, &expected));
        // The same body is expected three times: an edge that was used is not used again.
        let reports = host.process_each(&picture, &[expected; 3]);
        prop_assert_eq!(reports.len(), 3);
        reports.iter().for_each(sound);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    /// No picture costs more than its work budget, and a budget that is not used up changes nothing.
    #[test]
    fn work_is_bounded(
        kind in 0u8..10, seed in any::<u64>(), level in any::<u8>(), most in 10_000u32..200_000,
        preset in 0..Preset::ALL.len(), mask: bool,
    ) {
        let config = |most| {
            let mut config = config(Model::Pinhole, false, mask, Kind::Earth);
            config = Config { mask: config.mask, ..Config::preset(Preset::ALL[preset], config.camera) };
            config.body.altitude_km = Some(300.0);
            config.limits.max_work = Some(most);
            config
        };
        let data = garbage(kind, seed, level);
        let picture = Grey::try_new(&data, Layout::packed(96, 64, 1, 8)).unwrap();
        let mut host = HostHorizon::boxed(&config(most)).unwrap();
        let expected = host.expect(&Prior::default()).unwrap();
        let bounded = host.process(&picture, &expected);
        sound(&bounded);
        prop_assert!(bounded.counters.work <= most);
        host.configure(&config(1_000_000_000)).unwrap();
        let free = host.process(&picture, &expected);
        prop_assert!(free.status != Status::Truncated);
        if free.counters.work * 4 < most {
            prop_assert_eq!(free.status, bounded.status);
            prop_assert_eq!(free.counters, bounded.counters);
        }
        if bounded.status == Status::Truncated {
            prop_assert!(free.counters.work > bounded.counters.work);
        }
    }
}

#[test]
fn a_picture_that_would_cost_too_much_is_truncated() {
    let mut config = config(Model::Pinhole, false, false, Kind::Earth);
    config.limits.max_work = Some(10_000);
    let data = garbage(0, 1, 128);
    let mut host = HostHorizon::boxed(&config).unwrap();
    let expected = host.expect(&Prior::default()).unwrap();
    let report = host.process(&Grey::try_new(&data, Layout::packed(96, 64, 1, 8)).unwrap(), &expected);
    assert_eq!(report.status, Status::Truncated);
    config.limits.max_work = Some(9_999);
    let refused = HostHorizon::boxed(&config).unwrap_err();
    assert_eq!(refused.to_string(), "limits.max_work = 9999: must be between 10000 and 1000000000");
}

#[test]
fn a_picture_of_another_size_is_rejected() {
    let mut host = HostHorizon::boxed(&config(Model::Pinhole, false, false, Kind::Earth)).unwrap();
    let expected = host.expect(&Prior::default()).unwrap();
    let data = vec![0u8; 50 * 50];
    let report = host.process(&Grey::try_new(&data, Layout::packed(50, 50, 1, 8)).unwrap(), &expected);
    assert_eq!(report.status, Status::Rejected);
}

#[test]
fn an_empty_sensor_refuses_pictures_until_a_configuration_is_accepted() {
    let right = config(Model::Pinhole, false, false, Kind::EarthSphere);
    let mut wrong = right.clone();
    wrong.consensus.threshold_px = -1.0;
    let mut flight = Box::new(FlightHorizon::empty());
    let other = FlightHorizon::boxed(&right).unwrap().expect(&Prior::default()).unwrap();
    let [axis, half_angle] = [75f64.to_radians(), f64::from(other.half_angle_rad())];
    let pixel = |i: i32| {
        let (x, y) = ((f64::from(i % 96) - 47.5) / 60.0, (f64::from(i / 96) - 31.5) / 60.0);
        let along = (y * axis.sin() + axis.cos()) / (x * x + y * y + 1.0).sqrt();
        (110.0 + 90.0 * ((along - half_angle.cos()) * 60.0).clamp(-1.0, 1.0)) as u8
    };
    let drawn: Vec<u8> = (0..96 * 64).map(pixel).collect();
    let picture = Grey::try_new(&drawn, Layout::packed(96, 64, 1, 8)).unwrap();
    // A refused configuration leaves the sensor empty.
    for _ in 0..2 {
        assert!(flight.sensor().is_none());
        assert_eq!(flight.expect(&Prior::default()).unwrap_err(), PriorError::NotConfigured);
        assert_eq!(flight.process(&picture, &other).status, Status::Rejected);
        let each = flight.process_each(&picture, &[other, other]);
        assert_eq!(each.iter().map(|report| report.status).collect::<Vec<_>>(), [Status::Rejected; 2]);
        assert_eq!(flight.configure(&wrong).unwrap_err().field, "consensus.threshold_px");
    }
    flight.configure(&right).unwrap();
    let answer = |flight: &mut FlightHorizon| {
        let expected = flight.expect(&Prior::default()).unwrap();
        format!("{:?}", flight.process(&picture, &expected))
    };
    let before = answer(&mut flight);
    assert!(before.contains("status: Ok"), "{before}");
    // A refused configuration changes nothing on a running sensor.
    assert!(flight.configure(&wrong).is_err());
    assert_eq!(flight.sensor().unwrap().config(), &right);
    assert_eq!(answer(&mut flight), before);
    // The sensor in place is the one that a value would be.
    assert_eq!(flight.sensor().unwrap(), &Sensor::new(&right).unwrap());
}

#[test]
fn grey_colour_and_sixteen_bits_agree() {
    let data = garbage(6, 3, 40);
    let colour: Vec<u8> = data.iter().flat_map(|&v| [v, v, v]).collect();
    let words: Vec<u16> = data.iter().map(|&v| u16::from(v) * 256).collect();
    let mut host = HostHorizon::boxed(&config(Model::Pinhole, false, false, Kind::EarthSphere)).unwrap();
    let expected = host.expect(&Prior::default()).unwrap();
    let views = [
        ImageView::from_bytes(&data, Layout::packed(96, 64, 1, 8), Channel::Mean).unwrap(),
        ImageView::from_bytes(&colour, Layout::packed(96, 64, 3, 8), Channel::Mean).unwrap(),
        ImageView::from_words(&words, Layout::packed(96, 64, 1, 16), Channel::Mean).unwrap(),
    ];
    let answers: Vec<_> = views.iter().map(|v| host.process(v, &expected)).collect();
    for other in &answers[1..] {
        assert_eq!(answers[0].status, other.status);
        assert_eq!(answers[0].counters.followed, other.counters.followed);
    }
}

#[test]
fn impossible_frames_are_refused_by_name() {
    let mut c = config(Model::Pinhole, false, false, Kind::Earth);
    c.body.altitude_km = None;
    let host = HostHorizon::boxed(&c).unwrap();
    let refused = |frame: Prior<f64>| host.expect(&frame).unwrap_err();
    assert_eq!(refused(Prior::default()), PriorError::NoAltitude);
    assert_eq!(refused(Prior { altitude_m: Some(f64::NAN), ..Prior::default() }), PriorError::Altitude);
    assert_eq!(refused(Prior { altitude_m: Some(-5e3), ..Prior::default() }), PriorError::Altitude);
    assert_eq!(refused(Prior { position_m: Some([6.3e6, 0.0, 0.0]), ..Prior::default() }), PriorError::Position);
    assert_eq!(
        refused(Prior { position_m: Some([f64::INFINITY, 0.0, 0.0]), ..Prior::default() }),
        PriorError::Position
    );
    assert!(host.expect(&Prior { position_m: Some([6.7e6, 0.0, 0.0]), ..Prior::default() }).is_ok());
}
