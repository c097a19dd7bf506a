//! The tracker of a sequence: `Sensor::track`.

use crate::common::{KINDS, garbage};
use hzn_core::body::Kind;
use hzn_core::camera::{self, Model};
use hzn_core::image::{Grey, Layout};
use hzn_core::observer::Unobserved;
use hzn_core::pipeline::Workspace;
use hzn_core::real::Real;
use hzn_core::status::Status;
use hzn_core::{Config, Expected, Prior, Report, Sensor, Step, Tracker};
use proptest::prelude::*;

const WIDTH: u16 = 480;
const HEIGHT: u16 = 360;
const FOCAL_PX: f64 = 300.0;
/// sin α = 1737.4/2037.4.
const HALF_ANGLE_DEG: f64 = 58.514;

type Lists<T> = Workspace<T, 2048, 256, 512>;

fn config(full_every: u16) -> Config {
    let mut config = Config::new(camera::Config::ideal(Model::Pinhole, WIDTH, HEIGHT, FOCAL_PX));
    config.body.kind = Kind::Sphere;
    config.body.radius_km = Some(1737.4);
    config.body.altitude_km = Some(300.0);
    (config.body.limb_height_km, config.body.limb_height_sigma_km) = (0.0, 2.0);
    config.track.full_every = full_every;
    config
}

/// What a picture shows: the angle from the optical axis down to the axis of the body, and that about it, in degrees;
/// and the brightness of the body above a sky of 10 counts.
#[derive(Clone, Copy)]
struct Shown {
    down_deg: f64,
    aside_deg: f64,
    brightness: f64,
}

impl Shown {
    const FIRST: Self = Self { down_deg: 60.0, aside_deg: 10.0, brightness: 150.0 };

    fn axis(&self) -> [f64; 3] {
        let (sin, cos) = self.down_deg.to_radians().sin_cos();
        let (x, y) = self.aside_deg.to_radians().sin_cos();
        [sin * x, sin * y, cos]
    }

    /// Draws the body with an edge of one pixel and noise of 2 counts.
    fn draw(&self, seed: u64) -> Vec<u8> {
        let [ax, ay, az] = self.axis();
        let mut state = seed;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / f64::from(1u32 << 24) - 0.5
        };
        let (w, h) = (u32::from(WIDTH), u32::from(HEIGHT));
        (0..w * h)
            .map(|i| {
                let x = (f64::from(i % w) - (f64::from(w) - 1.0) / 2.0) / FOCAL_PX;
                let y = (f64::from(i / w) - (f64::from(h) - 1.0) / 2.0) / FOCAL_PX;
                let off = ((x * ax + y * ay + az) / (x * x + y * y + 1.0).sqrt()).acos();
                let inside_px = (HALF_ANGLE_DEG.to_radians() - off) * FOCAL_PX;
                let noise = (0..4).map(|_| uniform()).sum::<f64>() * 3.5;
                (10.0 + self.brightness * (0.5 + inside_px).clamp(0.0, 1.0) + noise).round() as u8
            })
            .collect()
    }
}

/// A sensor with its tracker, and another that searches every picture fully.
struct Both<T> {
    sensor: Sensor<T>,
    lists: Box<Lists<T>>,
    tracker: Tracker<T>,
}

impl<T: Real> Both<T> {
    fn new(config: &Config) -> Self {
        let sensor = Sensor::new(config).unwrap();
        Self { sensor, lists: Box::new(Lists::new()), tracker: Tracker::default() }
    }

    fn expect(&self, prior: &Prior<T>) -> Expected<T> {
        self.sensor.expect(prior).unwrap()
    }

    /// Returns the reports with and without the tracker.
    fn process(&mut self, picture: &[u8], prior: &Prior<T>) -> [Report<T>; 2] {
        let c = &self.sensor.config().camera;
        let picture = Grey::try_new(picture, Layout::packed(c.width.into(), c.height.into(), 1, 8)).unwrap();
        let (expected, step) = (self.expect(prior), Step::from_prior(prior, Some(T::one())));
        let tracked = self.sensor.track(&mut self.lists, &mut self.tracker, &picture, (&expected, &step), &Unobserved);
        [tracked, self.sensor.process(&mut self.lists, &picture, &expected, &Unobserved)]
    }
}

/// Asserts that a picture was searched fully: every number of the report is that of a single picture.
fn assert_full<T: Real>([tracked, alone]: &[Report<T>; 2]) {
    assert!(!tracked.is_tracked() && !alone.is_tracked());
    assert_eq!(format!("{tracked:?}"), format!("{alone:?}"));
}

/// Asserts that a limb was tracked, and that its answer agrees with that of the full search. Both answers have the
/// limb height's error in common, so that the noise is what they may differ by.
fn assert_tracked<T: Real>([tracked, alone]: &[Report<T>; 2]) {
    assert!(tracked.is_tracked() && tracked.counters.looks == 0, "{}: {:?}", tracked.status, tracked.candidates);
    let [t, a] = [tracked, alone].map(|report| report.solution.as_ref().unwrap());
    let sigma = t.covariance.sigma_max_rad().to_f64();
    let apart = t.axis.to_f64().angle_rad(&a.axis.to_f64());
    assert!(apart < sigma, "{apart} of {sigma} rad");
    assert!((96..200).contains(&tracked.counters.edge_points) && alone.counters.edge_points > 300);
}

fn moving(i: u32, px: f64) -> Shown {
    let step_deg = (px / FOCAL_PX).to_degrees() * f64::from(i);
    Shown {
        down_deg: Shown::FIRST.down_deg - 0.5 * step_deg,
        aside_deg: Shown::FIRST.aside_deg + step_deg,
        ..Shown::FIRST
    }
}

fn follows_a_limb<T: Real>() {
    let mut both = Both::<T>::new(&config(5));
    for i in 0..12 {
        let reports = both.process(&moving(i, 6.0).draw(u64::from(i)), &Prior::default());
        if i % 5 == 0 {
            assert_full(&reports)
        } else {
            assert_tracked(&reports)
        }
        assert!(reports[1].solution.is_some());
    }
}

#[test]
fn a_moving_limb_is_tracked_between_full_searches() {
    follows_a_limb::<f64>();
    follows_a_limb::<f32>();
}

#[test]
fn without_the_key_every_picture_is_searched() {
    for full_every in [0, 1] {
        let mut both = Both::<f32>::new(&config(full_every));
        (0..3).for_each(|i| assert_full(&both.process(&moving(i, 2.0).draw(1), &Prior::default())));
    }
}

#[test]
fn a_gap_or_a_leap_or_another_exposure_is_searched_fully_with_the_same_bits() {
    let blank = vec![10u8; usize::from(WIDTH) * usize::from(HEIGHT)];
    let dimmed = Shown { brightness: 60.0, ..Shown::FIRST }.draw(3);
    let leapt = Shown { aside_deg: 80.0, ..Shown::FIRST }.draw(4);
    let first = Shown::FIRST.draw(5);
    let mut both = Both::<f64>::new(&config(25));
    let mut process = |picture: &[u8]| both.process(picture, &Prior::default());
    let answer = |reports: &[Report<f64>; 2]| reports[0].solution.is_some();
    assert_full(&process(&first));
    assert_tracked(&process(&first));
    for (what, picture, has_answer) in [("blank", &blank, false), ("dimmed", &dimmed, true), ("leapt", &leapt, true)] {
        let reports = process(picture);
        assert_full(&reports);
        assert_eq!(answer(&reports), has_answer, "{what}");
        // After a picture without an answer there is nothing to go on from; after any other the limb is tracked again.
        let again = process(picture);
        if has_answer {
            assert_tracked(&again)
        } else {
            assert_full(&again)
        }
        let _ = process(&first);
        assert_tracked(&process(&first));
    }
}

#[test]
fn a_given_rate_leads_to_a_limb_that_moves_far() {
    // The camera turns clockwise about the optical axis by 40° each second, and the body moves the other way.
    let rate = [0.0, 0.0, 40f64.to_radians()];
    for (known, is_tracked) in [(Some(rate), true), (None, false)] {
        let mut both = Both::<f64>::new(&config(25));
        let prior = Prior { rate_rad_s: known, ..Prior::default() };
        for i in 0..4 {
            let shown = Shown { aside_deg: -60.0 + 40.0 * f64::from(i), ..Shown::FIRST };
            let reports = both.process(&shown.draw(i as u64), &prior);
            if is_tracked && i > 0 { assert_tracked(&reports) } else { assert_full(&reports) }
        }
    }
}

#[test]
fn what_cannot_be_tracked_is_searched() {
    let first = Shown::FIRST.draw(1);
    let changes: [fn(&mut Config); 3] = [
        |c| c.brightness.max_mean = 0.9,
        |c| c.gates.max_rms_px = 1e-3,
        |c| (c.camera.width, c.camera.height) = (WIDTH, HEIGHT - 1),
    ];
    for change in changes {
        let mut config = config(25);
        change(&mut config);
        let sensor = Sensor::<f64>::new(&config).unwrap();
        let mut both = Both { sensor, lists: Box::new(Lists::new()), tracker: Tracker::default() };
        let picture = Grey::try_new(&first, Layout::packed(WIDTH.into(), HEIGHT.into(), 1, 8)).unwrap();
        let (expected, step) = (both.expect(&Prior::default()), Step::from_prior(&Prior::default(), None));
        for _ in 0..3 {
            let report =
                both.sensor.track(&mut both.lists, &mut both.tracker, &picture, (&expected, &step), &Unobserved);
            assert!(!report.is_tracked());
        }
    }
}

proptest! {
    #[test]
    fn any_sequence_has_a_report(pictures in prop::collection::vec((0..KINDS, any::<u64>(), any::<u8>()), 1..8)) {
        let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 96, 64, 60.0));
        config.body.kind = Kind::Sphere;
        (config.body.radius_km, config.body.altitude_km) = (Some(6371.0), Some(300.0));
        (config.edge_points.min_points, config.gates.min_inliers) = (8, 8);
        (config.track.full_every, config.track.normals) = (25, 32);
        let mut both = Both::<f32>::new(&config);
        for (kind, seed, level) in pictures {
            let reports = both.process(&garbage(kind, seed, level), &Prior::default());
            prop_assert_eq!(reports[0].status == Status::Ok, reports[0].solution.is_some());
            if !reports[0].is_tracked() {
                assert_full(&reports);
            }
        }
    }
}
