//! Compares pictures that come row by row with the same pictures in memory: rendered flights and photographs.

use std::cell::RefCell;
use std::collections::BTreeMap;

use hzn_core::image::{Grey, Layout, Pixels};
use hzn_core::pixel::ImagePoint;
use hzn_core::status::Status;
use hzn_core::threshold::Method;
use hzn_core::{Config, Prior, Report, Sensor};
use hzn_core::{
    observer::Observer,
    pipeline::{ROWS_HELD, RowBuffers, Workspace},
};
use hzn_sim::flight::{leo_infrared, rocket};
use hzn_tests::real::Photograph;

/// Largest picture width in pixels that the row buffers take.
const WIDEST: usize = 5568;
/// Row buffers that are large enough for any of these pictures.
type Large = RowBuffers<u8, { ROWS_HELD as usize * WIDEST }, 3712, 65535, 65535>;
/// Workspace in f32, as on a flight computer, with more border pixels. It is for one candidate of 600 points.
type Lists = Workspace<f32, 16384, 256, 512>;

/// Edge points of each candidate, with every bit.
#[derive(Default)]
struct EdgePoints(RefCell<BTreeMap<u32, Vec<[u32; 2]>>>);
impl Observer<f32> for EdgePoints {
    fn point(&self, candidate: u32, p: ImagePoint<f32>) {
        self.0.borrow_mut().entry(candidate).or_default().push([p.u.to_bits(), p.v.to_bits()]);
    }
}

struct Case {
    name: String,
    sensor: Config,
    prior: Prior<f32>,
    bytes: Vec<u8>,
}

fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    let mut infrared = leo_infrared(6, 2);
    infrared.frames.iter_mut().for_each(|f| f.scene.detector.bits = 8);
    let flights = [rocket(640, 480, 8, 1), rocket(960, 540, 6, 2).with_payload(), rocket(1920, 1080, 3, 3), infrared];
    for flight in flights {
        for frame in &flight.frames {
            let case = hzn_tests::emulated::Case::rendered(frame.file.clone(), &flight.sensor, frame);
            let name = format!("{} {}", flight.name, frame.file);
            cases.push(Case { name, sensor: case.sensor, prior: case.prior, bytes: case.bytes });
        }
    }
    for file in ["iss-limb-2020-11-20.jpg", "pluto-pia19948.jpg", "sun-hmi-continuum-2023-01-31.png"] {
        let photograph = Photograph::load(file);
        let view = photograph.view();
        let (w, h) = (view.width(), view.height());
        let bytes = (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).map(|(x, y)| view.at(x, y) as u8).collect();
        let mut sensor = photograph.sensor.clone();
        sensor.edge_points.keep_points = 600;
        cases.push(Case { name: file.into(), sensor, prior: Prior::default(), bytes });
    }
    cases
}

impl Case {
    fn process_whole(&self, sensor: &Sensor<f32>, points: &EdgePoints) -> Report<f32> {
        let camera = &self.sensor.camera;
        let layout = Layout::packed(camera.width.into(), camera.height.into(), 1, 8);
        let picture = Grey::try_new(&self.bytes, layout).unwrap();
        let expected = sensor.expect(&self.prior).unwrap();
        sensor.process(&mut Box::new(Lists::new()), &picture, &expected, points)
    }
    fn process_rows(&self, sensor: &Sensor<f32>, points: &EdgePoints) -> Report<f32> {
        let expected = sensor.expect(&self.prior).unwrap();
        let mut rows = Box::new(Large::new());
        let mut stream = sensor.rows(&mut rows, 8, &expected).unwrap();
        for row in self.bytes.chunks(self.sensor.camera.width.into()) {
            stream.push_row(row).unwrap();
        }
        stream.finish(&mut Box::new(Lists::new()), points)
    }
}

#[test]
fn rows_have_the_points_and_the_answer_of_the_picture() {
    let (mut ok, mut wide) = (0, 0);
    let cases = cases();
    for case in &cases {
        // Both get the threshold that the picture itself gives.
        let own = case.process_whole(&Sensor::new(&case.sensor).unwrap(), &EdgePoints::default()).level;
        let mut config = case.sensor.clone();
        config.threshold.method = Method::Fixed;
        config.threshold.level = own.max(1).into();
        // These gates read brightness, and none is left of rows that are gone. A dark frame cannot be searched for
        // either.
        (config.gates.max_band, config.gates.max_departure) = (1.0, 1e6);
        config.retry.frame_px = 0;
        let sensor = Sensor::new(&config).unwrap();
        let (there, here) = (EdgePoints::default(), EdgePoints::default());
        let (want, got) = (case.process_whole(&sensor, &there), case.process_rows(&sensor, &here));
        assert_eq!((want.status, want.level), (got.status, got.level), "{}", case.name);
        let (there, here) = (there.0.into_inner(), here.0.into_inner());
        let beyond = got.counters.cut_points;
        // With other points an answer can be more certain, which ends the search earlier.
        assert!(beyond > 0 || there.len() == here.len(), "{}: candidates", case.name);
        if beyond == 0 && got.counters.dropped == want.counters.dropped {
            assert_eq!(there, here, "{}", case.name);
        }
        wide += u32::from(beyond > 0);
        let mut difference_deg = 0.0;
        if let (Some(a), Some(b)) = (&want.solution, &got.solution) {
            ok += 1;
            let distance: f64 = (0..3).map(|k| f64::from(a.axis.xyz()[k] - b.axis.xyz()[k]).powi(2)).sum();
            difference_deg = distance.sqrt().to_degrees();
            if beyond == 0 && got.counters.dropped == want.counters.dropped {
                assert!(difference_deg < 1e-4, "{}: {difference_deg}", case.name);
                assert_eq!((a.axis.xyz(), a.covariance.rows()), (b.axis.xyz(), b.covariance.rows()), "{}", case.name);
            }
        }
        let points: usize = there.values().map(Vec::len).sum();
        println!("{}: {}, {points} points, {beyond} cut, {difference_deg:.6} deg apart", case.name, got.status);
        // Haze through a long lens covers many more rows than are held, and its edges have more pixels than fit. The
        // edge is then another one, but the limb is the same.
        assert!(difference_deg < 0.1, "{}: {difference_deg}", case.name);
    }
    println!("{} pictures, {ok} answers, {wide} with edges wider than the rows held", cases.len());
    assert!(ok >= 18 && wide * 2 < cases.len() as u32, "{ok} {wide}");
}

/// Tests the memory of the lists in ARCHITECTURE.md, for a 640×480 picture and for a large one.
#[test]
fn memory_without_a_frame() {
    type Vga = RowBuffers<u8, { ROWS_HELD as usize * 640 }, 480, 8192, 2560>;
    type Hd = RowBuffers<u8, { ROWS_HELD as usize * 1920 }, 1080, 16384, 5120>;
    type Short = Workspace<f32, 2048, 76, 512>;
    let (vga, hd, lists) = (size_of::<Vga>(), size_of::<Hd>(), size_of::<Short>());
    println!("rows of 640×480: {vga} bytes; of 1920×1080: {hd} bytes; workspace for 600 points: {lists} bytes");
    assert!(vga <= 59_400 && hd <= 139_600 && lists <= 33_500);
    // These lists are large enough for a flight.
    let flight = rocket(640, 480, 8, 4);
    for frame in &flight.frames {
        let case = hzn_tests::emulated::Case::rendered(frame.file.clone(), &flight.sensor, frame);
        let mut config = case.sensor.clone();
        config.threshold.method = Method::Fixed;
        config.threshold.level = 60.0;
        let sensor = Sensor::new(&config).unwrap();
        let expected = sensor.expect(&case.prior).unwrap();
        let mut rows = Box::new(Vga::new());
        let mut stream = sensor.rows(&mut rows, 8, &expected).unwrap();
        for row in case.bytes.chunks(640) {
            stream.push_row(row).unwrap();
        }
        let report = stream.finish(&mut Box::new(Short::new()), &hzn_core::observer::Unobserved);
        println!("{}: {} border pixels left out", frame.file, report.counters.dropped);
        assert_eq!(report.status, Status::Ok, "{:?}", report.counters);
    }
}
