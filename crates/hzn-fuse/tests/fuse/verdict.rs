//! The verdict: right flights pass, and wrong inputs are told with their cause.
//!
//! `HZN_FLIGHTS=200 cargo test --test fuse verdict:: -- --nocapture` flies 200 right flights, and every wrong input on
//! a twentieth of them; without the variable a small part of them.

use crate::common::{Draws, Slow, scene};
use hzn_core::ellipsoid::{LimbCone, WGS84_A_M, WGS84_B_M, geodetic};
use hzn_fuse::finding::{Cause, Finding, Level, Source};
use hzn_fuse::flight::Wanted;
use hzn_fuse::input::{Attitude, Body, Fix, Inputs, Recording, Seen};
use hzn_fuse::simulated::inputs;
use hzn_fuse::{Error, Settings, fuse};
use hzn_nav::frames::{Covariance, Fixed, Rotation, Vector};
use nalgebra::{Matrix3, Vector3};

/// Flights without the variable.
const FEW: u64 = 2;
/// First seed of the flights: the limits of the verdict were looked at with others.
const FIRST_SEED: u64 = 61_000;

fn flights() -> u64 {
    std::env::var("HZN_FLIGHTS").map_or(FEW, |n| n.parse().expect("HZN_FLIGHTS is a number"))
}

/// Other seeds, for changes of the verdict: `HZN_SEED=52000`.
fn first_seed() -> u64 {
    std::env::var("HZN_SEED").map_or(FIRST_SEED, |n| n.parse().expect("HZN_SEED is a number"))
}

/// A flight whose mounts, clocks, biases and limb height are drawn from the settings' sigmas. A flight without a first
/// attitude gets a star tracker for it.
fn drawn(seed: u64) -> Inputs {
    let mut scene = scene(seed);
    let mut draws = Draws(seed ^ 0x5eed);
    for camera in &mut scene.cameras {
        camera.clock.latency_s = 0.03;
        camera.clock.offset_s = 0.2 * draws.normal() - 0.03;
    }
    let settings = Settings::default();
    let height_km = 7.0 * draws.normal();
    let mut drawn = inputs(&scene, &mut Slow::new(seed, 0.1), height_km).unwrap();
    if matches!(fuse(&drawn, &settings, wanted()), Err(Error::Unusable(_))) {
        let state = scene.path().unwrap().state(110.0);
        let sigma_rad = 0.05f64.to_radians();
        let error = Rotation::from_scaled_axis(Vector::from([0, 1, 2].map(|_| sigma_rad * draws.normal())));
        let attitude: Rotation<_, Fixed> = state.fixed_from_vehicle.into();
        drawn.attitudes = vec![Attitude { time_s: 110.0, fixed_from_vehicle: Some(attitude * error), sigma_rad }];
    }
    drawn
}

fn wanted() -> Wanted {
    Wanted { rate_hz: Some(1.0), ..Wanted::default() }
}

/// Returns the level and the likeliest cause.
fn judged(inputs: &Inputs) -> (Level, Option<Finding>, String) {
    match fuse(inputs, &Settings::default(), wanted()) {
        Ok(fused) => {
            let all = fused
                .verdict
                .findings
                .iter()
                .map(|f| format!("{:?} {:?} {:?}: {}", f.level, f.cause, f.source, f.what));
            (fused.verdict.level(), fused.verdict.likeliest().cloned(), all.collect::<Vec<_>>().join("\n    "))
        }
        Err(Error::Contradicts { why, finding }) => (Level::Contradicts, Some(*finding), why),
        Err(error) => (Level::Contradicts, None, error.to_string()),
    }
}

/// Something wrong with the inputs, and the causes and sources that are right to name.
struct Wrong {
    name: &'static str,
    change: fn(&mut Inputs),
    causes: &'static [Cause],
    source: fn(&Source) -> bool,
}

fn each(inputs: &mut Inputs, change: impl Fn(&mut Seen)) {
    inputs.recordings.iter_mut().for_each(|r| r.seen.iter_mut().for_each(&change));
}

fn rates(inputs: &mut Inputs, matrix: Matrix3<f64>) {
    inputs.imu.iter_mut().for_each(|s| s.imu.gyro_rad_s = (matrix * s.imu.gyro_rad_s.as_inner()).into());
}

fn forces(inputs: &mut Inputs, matrix: Matrix3<f64>) {
    inputs.imu.iter_mut().for_each(|s| s.imu.accel_m_s2 = (matrix * s.imu.accel_m_s2.as_inner()).into());
}

/// Tells a limb the receiver's position at its time, as a frames.csv that was made with the wrong times would.
fn told_by(seen: &mut Seen, fixes: &[Fix]) {
    let next = fixes.partition_point(|fix| fix.time_s < seen.time_s).min(fixes.len() - 1);
    let position_m = fixes[next].position_m + fixes[next].velocity_m_s * (seen.time_s - fixes[next].time_s);
    if seen.body == Body::Limb {
        let cone = LimbCone::try_new(position_m.xyz(), WGS84_A_M + 2e4, WGS84_B_M + 2e4).unwrap();
        seen.reference = Some(cone.axis.into());
        seen.altitude_km = Some(geodetic(position_m.xyz(), WGS84_A_M, WGS84_B_M).0 * 1e-3);
    }
}

fn turn_receiver(inputs: &mut Inputs, turn: Rotation<Fixed, Fixed>) {
    for fix in &mut inputs.gnss {
        fix.position_m = turn * fix.position_m;
        fix.velocity_m_s = turn * fix.velocity_m_s;
    }
}

fn turn_mount(recording: &mut Recording, deg: [f64; 3]) {
    let turn = Rotation::from_scaled_axis(Vector::from(deg.map(f64::to_radians)));
    recording.mount = recording.mount.map(|mount| mount * turn);
}

fn imu(source: &Source) -> bool {
    *source == Source::Imu
}
fn receiver(source: &Source) -> bool {
    *source == Source::Receiver
}
fn left(source: &Source) -> bool {
    *source == Source::Camera("left".into())
}
fn right(source: &Source) -> bool {
    *source == Source::Camera("right".into())
}
fn cameras(source: &Source) -> bool {
    matches!(source, Source::Cameras | Source::Camera(_))
}

/// The wrong inputs.
fn wrong() -> Vec<Wrong> {
    [of_cameras(), of_the_unit(), of_the_receiver()].into_iter().flatten().collect()
}

fn of_cameras() -> Vec<Wrong> {
    let mut all = Vec::new();
    let mut add = |name, causes, source, change: fn(&mut Inputs)| all.push(Wrong { name, change, causes, source });
    let (clock, mount): (&[Cause], &[Cause]) = (&[Cause::CameraClock], &[Cause::Mount]);
    add("both cameras 5 s late", clock, cameras, |i| each(i, |s| s.time_s += 5.0));
    add("both cameras 10 s early", clock, cameras, |i| each(i, |s| s.time_s -= 10.0));
    add("both cameras 5 s late, and their positions", clock, cameras, |i| {
        let fixes = i.gnss.clone();
        each(i, |s| {
            s.time_s += 5.0;
            told_by(s, &fixes);
        });
    });
    add("left 5 s late", clock, left, |i| i.recordings[0].seen.iter_mut().for_each(|s| s.time_s += 5.0));
    add("right 3 s early", clock, right, |i| i.recordings[1].seen.iter_mut().for_each(|s| s.time_s -= 3.0));
    add("left mount 10° off", mount, left, |i| turn_mount(&mut i.recordings[0], [0.0, 10.0, 0.0]));
    add("left mount 4° off", mount, left, |i| turn_mount(&mut i.recordings[0], [0.0, 4.0, 0.0]));
    add("right mount 6° off", mount, right, |i| turn_mount(&mut i.recordings[1], [4.0, 0.0, 4.5]));
    add("right mount 40° off", mount, right, |i| turn_mount(&mut i.recordings[1], [40.0, 0.0, 0.0]));
    add("left mount half a turn off", mount, left, |i| turn_mount(&mut i.recordings[0], [0.0, 0.0, 180.0]));
    add("left mount inverse", mount, left, |i| {
        let mount = i.recordings[0].mount.unwrap();
        i.recordings[0].mount = Rotation::assume_from_quaternion(mount.inverse().wxyz());
    });
    add("mounts exchanged", mount, cameras, |i| {
        let (left, right) = (i.recordings[0].mount, i.recordings[1].mount);
        (i.recordings[0].mount, i.recordings[1].mount) = (right, left);
    });
    add("UTC an hour late", &[Cause::Utc], cameras, |i| {
        let turn = Rotation::from_scaled_axis(Vector::new(0.0, 0.0, -15f64.to_radians()));
        each(i, |s| {
            if s.body == Body::Sun {
                s.reference = s.reference.map(|r: Vector<Fixed>| turn * r);
            }
        });
    });
    add("both mounts inverse", mount, cameras, |i| {
        for recording in &mut i.recordings {
            recording.mount = Rotation::assume_from_quaternion(recording.mount.unwrap().inverse().wxyz());
        }
    });
    add("both upside down", &[Cause::Lens], cameras, |i| {
        each(i, |s| s.axis = s.axis.component_mul(&Vector::new(1.0, -1.0, 1.0)));
    });
    add("both turned by 180°", mount, cameras, |i| {
        each(i, |s| s.axis = s.axis.component_mul(&Vector::new(-1.0, -1.0, 1.0)));
    });
    add("left mirrored", &[Cause::Lens], left, |i| {
        i.recordings[0].seen.iter_mut().for_each(|s| s.axis = s.axis.component_mul(&Vector::new(-1.0, 1.0, 1.0)));
    });
    all
}

fn of_the_unit() -> Vec<Wrong> {
    let mut all = Vec::new();
    let mut add = |name, causes, source, change: fn(&mut Inputs)| all.push(Wrong { name, change, causes, source });
    let axes: &[Cause] = &[Cause::GyroAxes];
    add("gyros negated", axes, imu, |i| rates(i, -Matrix3::identity()));
    add("gyros' x and y exchanged", axes, imu, |i| rates(i, Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)));
    add("gyros' z negated", axes, imu, |i| rates(i, Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0))));
    add("unit turned by 90°", axes, imu, |i| {
        let turn = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        rates(i, turn);
        forces(i, turn);
    });
    add("gyros in deg/s", &[Cause::GyroUnit], imu, |i| rates(i, Matrix3::identity().scale(1f64.to_degrees())));
    add("gyros in rev/s", &[Cause::GyroUnit, Cause::GyroScale], imu, |i| {
        rates(i, Matrix3::identity() / core::f64::consts::TAU);
    });
    add("gyros' scale 10 % off", &[Cause::GyroScale], imu, |i| rates(i, Matrix3::identity().scale(1.1)));
    add("gyros' bias 0.1 deg/s", &[Cause::GyroBias], imu, |i| {
        i.imu.iter_mut().for_each(|s| s.imu.gyro_rad_s += Vector::new(0.0, 0.0, 0.1f64.to_radians()));
    });
    let unit: &[Cause] = &[Cause::AccelUnit];
    add("forces in g", unit, imu, |i| forces(i, Matrix3::identity() / 9.80665));
    add("forces in mg", unit, imu, |i| forces(i, Matrix3::identity() / 9.80665e-3));
    add("forces' scale 20 % off", unit, imu, |i| forces(i, Matrix3::identity().scale(1.2)));
    add("gravity in the forces", &[Cause::AccelBias], imu, |i| {
        i.imu.iter_mut().for_each(|s| s.imu.accel_m_s2 += Vector::new(9.8, 0.0, 0.0));
    });
    add("imu in ns", &[Cause::SampleTimes], imu, |i| i.imu.iter_mut().for_each(|s| s.imu.time_s *= 1e9));
    add("imu in ms", &[Cause::SampleTimes], imu, |i| i.imu.iter_mut().for_each(|s| s.imu.time_s *= 1e3));
    add("imu 3 s late", &[Cause::ImuClock], imu, |i| i.imu.iter_mut().for_each(|s| s.imu.time_s += 3.0));
    all
}

fn of_the_receiver() -> Vec<Wrong> {
    let mut all = Vec::new();
    let mut add = |name, causes, source, change: fn(&mut Inputs)| all.push(Wrong { name, change, causes, source });
    add("receiver turned by 90°", &[Cause::ReceiverFrame], receiver, |i| {
        turn_receiver(i, Rotation::from_scaled_axis(Vector::new(0.0, 0.0, 90f64.to_radians())));
    });
    add("receiver turned by 0.5°", &[Cause::ReceiverFrame], receiver, |i| {
        turn_receiver(i, Rotation::from_scaled_axis(Vector::new(0.0, 0.0, 0.5f64.to_radians())));
    });
    add("receiver's y negated", &[Cause::ReceiverFrame], receiver, |i| {
        for fix in &mut i.gnss {
            let flip = |v: Vector<Fixed>| v.component_mul(&Vector::new(1.0, -1.0, 1.0));
            (fix.position_m, fix.velocity_m_s) = (flip(fix.position_m), flip(fix.velocity_m_s));
        }
    });
    let time: &[Cause] = &[Cause::ReceiverClock];
    add("receiver 2 s late", time, receiver, |i| i.gnss.iter_mut().for_each(|f| f.time_s += 2.0));
    add("receiver 18 s early", time, receiver, |i| i.gnss.iter_mut().for_each(|f| f.time_s -= 18.0));
    add("positions in km", &[Cause::ReceiverUnit], receiver, |i| {
        i.gnss.iter_mut().for_each(|f| f.position_m *= 1e-3);
    });
    add("velocities in km/s", &[Cause::ReceiverUnit], receiver, |i| {
        i.gnss.iter_mut().for_each(|f| f.velocity_m_s *= 1e-3);
    });
    add("velocities against the stars", &[Cause::ReceiverFrame], receiver, |i| {
        let rate = hzn_nav::gravity::earth_rate();
        i.gnss.iter_mut().for_each(|f| f.velocity_m_s += rate.cross(&f.position_m));
    });
    all
}

#[test]
fn right_flights_are_consistent() {
    let count = flights();
    let mut levels = [0u64; 3];
    for seed in first_seed()..first_seed() + count {
        let (level, _, all) = judged(&drawn(seed));
        levels[level as usize] += 1;
        if level > Level::Consistent {
            println!("{seed}: {}\n    {all}", level.name());
        }
    }
    let [_, doubtful, contradicts] = levels;
    println!("{count} right flights: {doubtful} doubtful, {contradicts} contradict");
    assert!(contradicts * 100 <= count && doubtful * 20 <= count + 20, "{levels:?}");
}

#[test]
fn wrong_inputs_are_told_with_their_cause() {
    let first = first_seed() + 1000;
    let seeds = first..first + flights().div_ceil(20);
    let (mut told, mut named, mut all) = (0, 0, 0);
    for seed in seeds {
        let flight = drawn(seed);
        // Every fourth kind is enough for each change of the code.
        for wrong in wrong().into_iter().step_by(if flights() > FEW { 1 } else { 4 }) {
            let mut inputs = flight.clone();
            let suns = inputs.recordings.iter().flat_map(|r| &r.seen).filter(|s| s.body == Body::Sun).count();
            if suns < 10 && wrong.causes.contains(&Cause::Utc) {
                continue; // Without the Sun a wrong UTC changes nothing.
            }
            (wrong.change)(&mut inputs);
            let (level, finding, words) = judged(&inputs);
            let is_named = finding.is_some_and(|f| wrong.causes.contains(&f.cause) && (wrong.source)(&f.source));
            (all, told, named) = (all + 1, told + u32::from(level > Level::Consistent), named + u32::from(is_named));
            println!(
                "{seed} {}: {} {}\n    {words}",
                wrong.name,
                level.name(),
                if is_named { "named" } else { "NOT NAMED" }
            );
        }
    }
    println!("{all} wrong inputs: {told} told, {named} with the right cause");
    assert!(told * 100 >= all * 97 && named * 100 >= all * 80, "{told} told, {named} named of {all}");
}

/// A covariance that is told too small by a factor of thirty.
#[test]
fn boastful_directions_are_in_doubt() {
    let mut inputs = drawn(FIRST_SEED + 2000);
    each(&mut inputs, |s| {
        let tilt = Vector::new((s.time_s * 1.3).sin(), (s.time_s * 0.7).cos(), 0.0) * 0.05;
        s.axis = (s.axis + tilt).normalize();
        s.covariance_rad2 = Covariance::across(&s.axis, 1e-6);
    });
    let (level, _, all) = judged(&inputs);
    assert!(level > Level::Consistent, "{all}");
}

/// The unit ran for four hours before lift-off, of which the cameras saw nothing: the verdict looks at the samples
/// of the flight.
#[test]
fn a_long_wait_before_the_flight_hides_nothing() {
    let mut inputs = drawn(FIRST_SEED + 3000);
    turn_mount(&mut inputs.recordings[1], [40.0, 0.0, 0.0]);
    let first = inputs.imu[0];
    let waiting = (1..300_000).rev().map(|k| {
        let mut sample = first;
        sample.imu.time_s -= 0.05 * f64::from(k);
        sample
    });
    inputs.imu = waiting.chain(inputs.imu.iter().copied()).collect();
    let (level, finding, all) = judged(&inputs);
    let finding = finding.expect(&all);
    assert!(level == Level::Contradicts && finding.cause == Cause::Mount && right(&finding.source), "{all}");
}
