//! A picture that comes row by row has the same answer as the same picture in memory.

use std::cell::RefCell;

use hzn_core::camera::{self, Model};
use hzn_core::image::{Grey, Layout};
use hzn_core::pixel::ImagePoint;
use hzn_core::status::Status;
use hzn_core::threshold::Method;
use hzn_core::{Config, FlightWorkspace, Prior, Report, Sensor};
use hzn_core::{
    observer::{Observer, Unobserved},
    pipeline::{ROWS_HELD, RowBuffers, RowStreamError},
};
use proptest::prelude::*;

const W: usize = 96;
const H: usize = 64;
type Small = RowBuffers<u8, { ROWS_HELD as usize * W }, H, 8192, 8192>;

/// Collects the edge points of each candidate, with every bit.
#[derive(Default)]
struct Seen(RefCell<Vec<(u32, [u32; 2])>>);
impl Observer<f32> for Seen {
    fn point(&self, candidate: u32, p: ImagePoint<f32>) {
        self.0.borrow_mut().push((candidate, [p.u.to_bits(), p.v.to_bits()]));
    }
}

fn config(mask: bool, circle: bool) -> Config {
    let mut config = Config::new(camera::Config::ideal(Model::Equidistant, W as u16, H as u16, 60.0));
    config.camera.theta_max_deg = circle.then_some(40.0);
    config.body.altitude_km = Some(300.0);
    config.edge_points.min_points = 8;
    config.gates.min_inliers = 8;
    config.threshold.method = Method::Fixed;
    config.threshold.level = 100.0;
    // There is only one look at a picture that comes row by row.
    config.retry.levels.clear();
    config.retry.frame_px = 0;
    if mask {
        let triangle = [[10.0, 10.0], [50.0, 5.0], [30.0, 60.0]];
        config.mask.polygons_px.push(triangle.into_iter().collect()).unwrap();
    }
    config
}

fn stream<const WINDOW: usize, const HEIGHT: usize, const TURNS: usize, const POINTS: usize>(
    sensor: &Sensor<f32>,
    rows: &mut RowBuffers<u8, WINDOW, HEIGHT, TURNS, POINTS>,
    data: &[u8],
    level: Option<u16>,
    observer: &impl Observer<f32>,
) -> Report<f32> {
    let expected = sensor.expect(&Prior { level, ..Prior::default() }).unwrap();
    let mut stream = sensor.rows(rows, 8, &expected).unwrap();
    for row in data.chunks(W) {
        stream.push_row(row).unwrap();
    }
    stream.finish(&mut Box::new(FlightWorkspace::new()), observer)
}

fn whole(sensor: &Sensor<f32>, data: &[u8], observer: &impl Observer<f32>) -> Report<f32> {
    let picture = Grey::try_new(data, Layout::packed(W as u32, H as u32, 1, 8)).unwrap();
    let expected = sensor.expect(&Prior::default()).unwrap();
    sensor.process(&mut Box::new(FlightWorkspace::new()), &picture, &expected, observer)
}

/// Draws noise, blocks and discs, with edges three pixels wide.
fn garbage(kind: u8, seed: u64, level: u8) -> Vec<u8> {
    let mut state = seed | 1;
    let hard: Vec<u8> = (0..(W * H) as u32)
        .map(|i| {
            let (x, y) = (i % W as u32, i / W as u32);
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let random = (state >> 56) as u8;
            let on = match kind {
                0 => random > level,
                1 => x % (2 + u32::from(level % 9)) == 0,
                2 => y % (2 + u32::from(level % 9)) == 0,
                3 => (x / 8 + y / 8) % 2 == 0,
                4 => y > 30 + (x * u32::from(level)) / 800,
                5 => (x as i32 - 48).pow(2) + (y as i32 - 32).pow(2) < i32::from(level) * 4,
                6 => x * 2 > y + u32::from(level),
                _ => random > 127 && y > 20,
            };
            if on { 200 } else { random / 16 }
        })
        .collect();
    let at = |x: usize, y: usize| u32::from(hard[y.min(H - 1) * W + x.min(W - 1)]);
    let soft = |i: usize| {
        (0..9).map(|k| at((i % W + k % 3).saturating_sub(1), (i / W + k / 3).saturating_sub(1))).sum::<u32>()
    };
    (0..W * H).map(|i| (soft(i) / 9) as u8).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]
    #[test]
    fn rows_are_the_picture(kind in 0u8..8, seed in any::<u64>(), level in any::<u8>(), mask: bool, circle: bool) {
        let data = garbage(kind, seed, level);
        let sensor = Sensor::<f32>::new(&config(mask, circle)).unwrap();
        let (there, here) = (Seen::default(), Seen::default());
        let want = whole(&sensor, &data, &there);
        let got = stream(&sensor, &mut Box::new(Small::new()), &data, None, &here);
        // Edges whose plateaus lie beyond the rows in memory may have other points; these are counted.
        let wide = got.counters.cut_points;
        let (there, here) = (there.0.into_inner(), here.0.into_inner());
        let apart = there.iter().zip(&here).filter(|(a, b)| a != b).count();
        prop_assert!(wide > 0 || (there.len() == here.len() && apart == 0), "{apart} of {} apart", there.len());
        if wide == 0 {
            prop_assert_eq!(want.status, got.status);
            prop_assert_eq!(want.candidates.len(), got.candidates.len());
            prop_assert_eq!(want.solution.map(|s| s.axis.xyz()), got.solution.map(|s| s.axis.xyz()));
        }
    }

    /// Buffers that are too short for every picture still give a sound report, without a panic.
    #[test]
    fn short_lists_are_borne(kind in 0u8..8, seed in any::<u64>(), level in any::<u8>(), mask: bool, circle: bool) {
        let data = garbage(kind, seed, level);
        let sensor = Sensor::<f32>::new(&config(mask, circle)).unwrap();
        let mut few_points = Box::new(RowBuffers::<u8, { ROWS_HELD as usize * W }, H, 8192, 60>::new());
        let report = stream(&sensor, &mut few_points, &data, None, &Unobserved);
        prop_assert_eq!(report.status == Status::Ok, report.solution.is_some());
        let mut few_turns = Box::new(RowBuffers::<u8, { ROWS_HELD as usize * W }, H, 150, 8192>::new());
        let report = stream(&sensor, &mut few_turns, &data, None, &Unobserved);
        prop_assert_eq!(report.status == Status::Ok, report.solution.is_some());
    }
}

/// The picture has a limb above garbage that does not fit into the buffers. The rows that fit are enough.
#[test]
fn the_picture_ends_where_the_lists_do() {
    let shade = |x: usize, y: usize| match y {
        0..12 => 3,
        12..40 => 200,
        _ => 200 * (x % 2) as u8,
    };
    let data: Vec<u8> = (0..W * H).map(|i| shade(i % W, i / W)).collect();
    let sensor = Sensor::<f32>::new(&config(false, false)).unwrap();
    let mut rows = Box::new(RowBuffers::<u8, { ROWS_HELD as usize * W }, H, 100, 8192>::new());
    let report = stream(&sensor, &mut rows, &data, None, &Unobserved);
    assert!(report.counters.dropped > 1000, "{:?}", report.counters);
    assert!(report.candidates.len() == 1 && report.candidates[0].length_px == W as u32, "{:?}", report.candidates);
}

/// Without a fixed threshold, the first picture gives the threshold for the second.
#[test]
fn the_level_comes_from_the_picture_before() {
    let mut config = config(false, false);
    config.threshold.method = Method::Otsu;
    let sensor = Sensor::<f32>::new(&config).unwrap();
    let data = garbage(4, 1, 40);
    let want = whole(&sensor, &data, &Unobserved);
    let mut rows = Box::new(Small::new());
    let first = stream(&sensor, &mut rows, &data, None, &Unobserved);
    assert_eq!((first.status, first.next_level), (Status::NoLimb, Some(want.level)));
    let second = stream(&sensor, &mut rows, &data, first.next_level, &Unobserved);
    assert_eq!((second.level, second.next_level), (want.level, Some(want.level)));
    assert_eq!(second.status, want.status);
    assert_eq!(second.candidates, want.candidates);
}

#[test]
fn misuse_is_refused_by_name() {
    let sensor = Sensor::<f32>::new(&config(false, false)).unwrap();
    let expected = sensor.expect(&Prior::default()).unwrap();
    let mut low = Box::new(RowBuffers::<u8, { ROWS_HELD as usize * W }, 10, 100, 100>::new());
    let refused = sensor.rows(&mut low, 8, &expected).unwrap_err();
    assert_eq!(refused, RowStreamError::Room { window: 3072, height: 64 });
    assert_eq!(refused.to_string(), "the picture needs room for 3072 samples in the window and for 64 rows");
    let mut rows = Box::new(Small::new());
    assert_eq!(sensor.rows(&mut rows, 12, &expected).unwrap_err(), RowStreamError::Bits);
    let mut stream = sensor.rows(&mut rows, 8, &expected).unwrap();
    assert_eq!(stream.push_row(&[0; 95]), Err(RowStreamError::Length));
    for _ in 0..H - 1 {
        stream.push_row(&[0; W]).unwrap();
    }
    // One row is missing.
    let mut workspace = Box::new(FlightWorkspace::new());
    assert_eq!(stream.finish(&mut workspace, &Unobserved).status, Status::Rejected);
    let mut stream = sensor.rows(&mut rows, 8, &expected).unwrap();
    for _ in 0..H {
        stream.push_row(&[0; W]).unwrap();
    }
    assert_eq!(stream.push_row(&[0; W]), Err(RowStreamError::Finished));
    assert_eq!(stream.finish(&mut workspace, &Unobserved).status, Status::NoLimb);
}
