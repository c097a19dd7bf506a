//! The navigation filter with an inertial unit of 100 Hz: records from a file of the host, solutions to another.
//!
//! `nav.bin` has records of 32 double-precision numbers (little-endian). The first number is the kind: 0 start, 1
//! sample of the inertial unit, 2 direction of a camera, 3 fix of the receiver. `nav-results.bin` has a record for
//! every hundredth sample: time, attitude (4), velocity (3), position (3), 1-sigma of the attitude (3), the largest and
//! the sum of the ticks of the samples since the record before, ticks of the solution without lag, the use of the
//! stack, and the measurements taken.

#![no_std]
#![no_main]

use cortex_m_rt::entry;
use hzn_mps2::board::{Board, Timer};
use hzn_mps2::host::{File, exit};
use hzn_mps2::watermark;
use hzn_nav::delayed::{Delayed, Measurement};
use hzn_nav::filter::{DirectionMeasurement, Filter};
use hzn_nav::frames::{Cam, Rotation, Vector};
use hzn_nav::layout::Layout;
use hzn_nav::options::{Block, CameraOptions, Options, StartSigmas};
use hzn_nav::strapdown::{Imu, Nominal};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion};
use static_cell::StaticCell;

/// Numbers in a record.
const NUMBERS: usize = 32;
/// Errors of the filter: 28 of the vehicle, and 7 of each of two cameras.
const STATES: usize = 42;
/// Waiting samples and measurements.
type Flight = Delayed<STATES, 64, 16>;
/// Time by which the filter follows the newest sample, s.
const LAG_S: f64 = 0.5;
/// Samples in a record of the results.
const BATCH: u32 = 100;

static FLIGHT: StaticCell<Flight> = StaticCell::new();

type Record = [f64; NUMBERS];

#[entry]
fn main() -> ! {
    exit(match run() {
        Some(()) => 0,
        None => 1,
    })
}

fn read(file: &mut File) -> Option<Record> {
    let mut bytes = [0u8; 8 * NUMBERS];
    let is_whole = file.read(&mut bytes);
    let mut record = [0.0; NUMBERS];
    for (number, bytes) in record.iter_mut().zip(bytes.chunks_exact(8)) {
        *number = f64::from_le_bytes(*bytes.first_chunk()?);
    }
    is_whole.then_some(record)
}

fn three<F>(record: &Record, from: usize) -> Vector<F> {
    let at = |i: usize| record.get(from + i).copied().unwrap_or(f64::NAN);
    Vector::new(at(0), at(1), at(2))
}

fn rotation<A, B>(record: &Record, from: usize) -> Rotation<A, B> {
    let at = |i: usize| record.get(from + i).copied().unwrap_or(f64::NAN);
    UnitQuaternion::new_unchecked(Quaternion::new(at(0), at(1), at(2), at(3))).into()
}

/// Makes the filter from the first record.
fn begin(record: &Record) -> Option<Flight> {
    let [_, time_s, ..] = *record;
    let start =
        Nominal { time_s, attitude: rotation(record, 2), velocity_m_s: three(record, 6), position_m: three(record, 9) };
    let [_, _, _, _, _, _, _, _, _, _, _, _, attitude_rad, velocity_m_s, position_m, ..] = *record;
    let options = Options { start: StartSigmas { attitude_rad, velocity_m_s, position_m }, ..Options::default() };
    let camera = |from: usize| CameraOptions {
        mount: rotation(record, from),
        clock: Block::estimated(0.1),
        ..CameraOptions::default()
    };
    let filter = Filter::new(start, &options, &[camera(15), camera(19)]).ok()?;
    Some(Delayed::new(filter, LAG_S))
}

/// Takes a measurement; samples are taken elsewhere.
fn push(flight: &mut Flight, record: &Record) {
    let [kind, time_s, third, ..] = *record;
    if kind == 2.0 {
        let rows = [9, 12, 15].map(|from| three::<Cam>(record, from).into_inner().transpose());
        let direction = DirectionMeasurement {
            camera: third as usize,
            body: 0,
            measured: three(record, 3),
            reference: three(record, 6),
            covariance_rad2: Matrix3::from_rows(&rows).into(),
            common_rad2: None,
            by_limb_height: three(record, 18),
            is_limb: three::<Cam>(record, 18) != Vector::zeros(),
        };
        let _ = flight.push(time_s, Measurement::Direction(direction));
    } else {
        let [_, _, _, _, _, position_sigma, _, _, _, velocity_sigma, ..] = *record;
        let _ = flight.push(time_s, Measurement::Position(three(record, 2), position_sigma));
        let _ = flight.push(time_s, Measurement::Velocity(three(record, 6), velocity_sigma));
    }
}

/// Costs since the last record of the results.
#[derive(Default)]
struct Costs {
    samples: u32,
    largest: u32,
    sum: u64,
}

fn run() -> Option<()> {
    let board = Board::take()?;
    let timer = board.timer;
    let mut records = File::open(c"nav.bin")?;
    let mut results = File::create(c"nav-results.bin")?;
    let flight = FLIGHT.try_init(begin(&read(&mut records)?)?)?;
    let mut costs = Costs::default();
    while let Some(record) = read(&mut records) {
        let [kind, time_s, _, _, _, _, _, _, saturated, ..] = record;
        if kind != 1.0 {
            push(flight, &record);
            continue;
        }
        let imu = Imu { time_s, gyro_rad_s: three(&record, 2), accel_m_s2: three(&record, 5) };
        let begin = timer.ticks();
        flight.push_sample(&imu, saturated > 0.5, |_, _, _| ());
        let ticks = timer.ticks().wrapping_sub(begin);
        costs = Costs {
            samples: costs.samples + 1,
            largest: costs.largest.max(ticks),
            sum: costs.sum.wrapping_add(u64::from(ticks)),
        };
        if costs.samples == BATCH {
            write(flight, &costs, timer, &mut results)?;
            costs = Costs::default();
        }
    }
    Some(())
}

/// Writes the solution without lag, and the costs.
fn write(flight: &Flight, costs: &Costs, timer: Timer, results: &mut File) -> Option<()> {
    let begin = timer.ticks();
    let now = flight.now();
    let ticks = timer.ticks().wrapping_sub(begin);
    let [qw, qx, qy, qz] = now.attitude.wxyz();
    let [[vx, vy, vz], [x, y, z]] = [now.velocity_m_s, now.position_m].map(|vector| vector.xyz());
    let sigma = flight.filter().sigmas(Layout::ATTITUDE);
    let numbers = [
        now.time_s,
        qw,
        qx,
        qy,
        qz,
        vx,
        vy,
        vz,
        x,
        y,
        z,
        sigma.x,
        sigma.y,
        sigma.z,
        f64::from(costs.largest),
        costs.sum as f64,
        f64::from(ticks),
        f64::from(watermark::stack_bytes()),
        flight.counts().taken as f64,
    ];
    numbers.iter().all(|number| results.write(&number.to_le_bytes())).then_some(())
}
