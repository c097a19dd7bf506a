//! The navigation filter in the firmware: the same solution as on this machine, and what it costs.

use std::path::Path;

use hzn_fuse::input::{Inputs, Seen};
use hzn_fuse::simulated::{Errors, Moment, inputs};
use hzn_nav::delayed::{Counts, Delayed, Measurement};
use hzn_nav::filter::{DirectionMeasurement, Filter};
use hzn_nav::frames::{Cam, Covariance, Fixed, Rotation, Vector, Vehicle};
use hzn_nav::options::{Block, CameraOptions, Options, StartSigmas};
use hzn_nav::strapdown::{Imu, Nominal};
use hzn_sim::Scenario;
use hzn_tests::emulated::Board;
use nalgebra::Matrix3;

/// Numbers in a record of `nav.bin` and of `nav-results.bin`.
const RECORD: usize = 32;
const RESULT: usize = 19;
/// The part of the flight, s.
const SPAN_S: [f64; 2] = [120.0, 150.0];

/// Directions without errors.
struct Exact;

impl Errors for Exact {
    fn draw(&mut self, _: &Moment, axis: &Vector<Cam>) -> (Vector<Cam>, Covariance<Cam>) {
        (Vector::zeros(), Covariance::across(axis, 0.05f64.to_radians().powi(2)))
    }
    fn by_limb_height(&mut self, _: &Moment, axis: &Vector<Cam>) -> Vector<Cam> {
        let [_, _, z] = axis.xyz();
        (Vector::new(0.0, 0.0, 1.0) - *axis * z) * 3e-4
    }
}

fn record(numbers: impl IntoIterator<Item = f64>) -> [f64; RECORD] {
    let mut record = [0.0; RECORD];
    record.iter_mut().zip(numbers).for_each(|(slot, number)| *slot = number);
    record
}

fn three<F>(record: &[f64; RECORD], from: usize) -> Vector<F> {
    Vector::new(record[from], record[from + 1], record[from + 2])
}

/// The records of a flight: 100 samples and one picture of each camera a second.
struct Recorded {
    start: Nominal,
    sigmas: [f64; 3],
    mounts: [Rotation<Cam, Vehicle>; 2],
    records: Vec<[f64; RECORD]>,
}

impl Recorded {
    fn new() -> Self {
        let mut scene = Scenario::builtin("atek").unwrap();
        (scene.capture.from_s, scene.capture.to_s, scene.capture.frames) = (SPAN_S[0], SPAN_S[1], 31);
        let imu = scene.imu.as_mut().unwrap();
        (imu.rate_hz, imu.from_s) = (100.0, Some(SPAN_S[0]));
        scene.gnss.as_mut().unwrap().from_s = Some(SPAN_S[0]);
        let all: Inputs = inputs(&scene, &mut Exact, 0.0).unwrap();
        let truth = scene.path().unwrap().state(SPAN_S[0]);
        let attitude = Rotation::<Vehicle, Fixed>::from(truth.fixed_from_vehicle);
        let start = Nominal {
            time_s: SPAN_S[0],
            attitude: Rotation::from_scaled_axis(Vector::new(0.02, -0.01, 0.015)) * attitude,
            velocity_m_s: truth.velocity_mps.into(),
            position_m: truth.position_m.into(),
        };
        let mounts = [0, 1].map(|i| all.recordings[i].mount.unwrap());
        Self { start, sigmas: [0.035, 1.0, 30.0], mounts, records: records(&all) }
    }

    fn start_record(&self) -> [f64; RECORD] {
        let s = &self.start;
        let numbers = [0.0, s.time_s].into_iter().chain(s.attitude.wxyz());
        let numbers = numbers.chain(s.velocity_m_s.xyz()).chain(s.position_m.xyz());
        record(numbers.chain(self.sigmas).chain(self.mounts.iter().flat_map(Rotation::wxyz)))
    }

    /// Runs the filter on this machine.
    fn on_host(&self) -> (Nominal, Counts) {
        let [attitude_rad, velocity_m_s, position_m] = self.sigmas;
        let options = Options { start: StartSigmas { attitude_rad, velocity_m_s, position_m }, ..Options::default() };
        let camera = |mount| CameraOptions { mount, clock: Block::estimated(0.1), ..CameraOptions::default() };
        let filter = Filter::<42>::new(self.start, &options, &self.mounts.map(camera)).unwrap();
        let mut flight = Delayed::<42, 64, 16>::new(filter, 0.5);
        for r in &self.records {
            let time_s = r[1];
            match r[0] as u32 {
                1 => {
                    let imu = Imu { time_s, gyro_rad_s: three(r, 2), accel_m_s2: three(r, 5) };
                    flight.push_sample(&imu, r[8] > 0.5, |_, _, _| ());
                }
                2 => {
                    let rows = [9, 12, 15].map(|i| three::<Cam>(r, i).into_inner().transpose());
                    let direction = DirectionMeasurement {
                        camera: r[2] as usize,
                        body: 0,
                        measured: three(r, 3),
                        reference: three(r, 6),
                        covariance_rad2: Matrix3::from_rows(&rows).into(),
                        common_rad2: None,
                        by_limb_height: three(r, 18),
                        is_limb: true,
                    };
                    flight.push(time_s, Measurement::Direction(direction)).unwrap();
                }
                _ => {
                    flight.push(time_s, Measurement::Position(three(r, 2), r[5])).unwrap();
                    flight.push(time_s, Measurement::Velocity(three(r, 6), r[9])).unwrap();
                }
            }
        }
        (flight.now(), *flight.counts())
    }

    /// Runs the filter on a board, and returns the records of the results.
    fn on_board(&self, board: Board, folder: &Path) -> Vec<[f64; RESULT]> {
        let all = std::iter::once(self.start_record()).chain(self.records.iter().copied());
        let bytes: Vec<u8> = all.flatten().flat_map(f64::to_le_bytes).collect();
        std::fs::write(folder.join("nav.bin"), bytes).unwrap();
        let status = board.qemu(&board.image("nav"), 10).current_dir(folder).status().unwrap();
        assert!(status.success(), "{board:?}: {status}");
        let bytes = std::fs::read(folder.join("nav-results.bin")).unwrap();
        let numbers: Vec<f64> = bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect();
        numbers.chunks_exact(RESULT).map(|r| r.try_into().unwrap()).collect()
    }
}

/// Returns samples and measurements in the order in which they come: a measurement comes with the next sample.
fn records(all: &Inputs) -> Vec<[f64; RECORD]> {
    let mut out: Vec<(f64, [f64; RECORD])> = Vec::new();
    // The boards write a result for every hundredth sample.
    for s in all.imu.iter().take(3000) {
        let i = &s.imu;
        let numbers = [1.0, i.time_s].into_iter().chain(i.gyro_rad_s.xyz());
        let numbers = numbers.chain(i.accel_m_s2.xyz()).chain([f64::from(u8::from(s.saturated))]);
        out.push((i.time_s, record(numbers)));
    }
    for (camera, recording) in all.recordings.iter().enumerate() {
        let is_inside = |s: &&Seen| (SPAN_S[0] + 0.5..SPAN_S[1] - 0.5).contains(&s.time_s);
        for s in recording.seen.iter().filter(is_inside) {
            let reference = s.reference.unwrap();
            let rows = s.covariance_rad2.as_inner().transpose();
            let numbers = [2.0, s.time_s, camera as f64].into_iter().chain(s.axis.xyz());
            let numbers = numbers.chain(reference.xyz()).chain(rows.iter().copied());
            out.push((s.time_s, record(numbers.chain(s.by_limb_height.xyz()))));
        }
    }
    for f in all.gnss.iter().filter(|f| f.time_s > SPAN_S[0] + 0.5) {
        let numbers = [3.0, f.time_s].into_iter().chain(f.position_m.xyz()).chain([f.position_sigma_m]);
        let numbers = numbers.chain(f.velocity_m_s.xyz()).chain([f.velocity_sigma_m_s]);
        out.push((f.time_s, record(numbers)));
    }
    out.sort_by(|a, b| a.0.total_cmp(&b.0));
    out.into_iter().map(|(_, record)| record).collect()
}

#[test]
#[ignore = "needs the images: cargo xtask firmware"]
fn the_filter_flies_with_the_solution_of_this_machine() {
    let flight = Recorded::new();
    let (here, counts) = flight.on_host();
    assert!(counts.taken > 100 && counts.gated == 0 && counts.too_late == 0, "{counts:?}");
    for board in Board::with_pictures() {
        let folder = tempfile::tempdir().unwrap();
        let results = flight.on_board(board, folder.path());
        assert_eq!(results.len(), 30, "{board:?}");
        let last = results.last().unwrap();
        let q = Rotation::assume_from_quaternion([last[1], last[2], last[3], last[4]]).unwrap();
        let x = Vector::new(last[8], last[9], last[10]);
        assert_eq!(last[18] as u64, counts.taken, "{board:?}");
        assert_eq!(last[0], here.time_s);
        // The order of additions and the fused products of the compilers differ.
        assert!(q.angle_to(&here.attitude) < 1e-9, "{board:?}: {}", q.angle_to(&here.attitude));
        assert!((x - here.position_m).norm() < 1e-5, "{board:?}: {}", (x - here.position_m).norm());
        // A tick takes 40 ns, an instruction 1024 ns.
        let instructions = |ticks: f64| ticks * 40.0 / 1024.0;
        let largest = instructions(results.iter().map(|r| r[14]).fold(0.0, f64::max));
        let mean = instructions(results.iter().map(|r| r[15]).sum::<f64>()) / (100.0 * results.len() as f64);
        println!(
            "{}: {:.0} thousand instructions a sample of 100 Hz, {:.0} the largest, {:.0} for the solution without \
             lag; {:.1} KiB of stack",
            board.core(),
            mean * 1e-3,
            largest * 1e-3,
            instructions(last[16]) * 1e-3,
            last[17] / 1024.0
        );
        // A flight computer of 100 million instructions a second must not be full.
        let most = if board == Board::An500 { 300e3 } else { 8e6 };
        assert!((1e3..most).contains(&mean), "{board:?}: {mean}");
        // Each camera has memory for the slow errors of three bodies; the filter is moved when it is made.
        assert!(last[17] < 104.0 * 1024.0, "{board:?}: {} bytes of stack", last[17]);
    }
}
