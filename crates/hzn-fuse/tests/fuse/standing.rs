//! Channels of the inertial unit at their limit without a column that says so, and units that stand still.

use crate::common::{Draws, Slow, flights, scene};
use hzn_fuse::flight::Wanted;
use hzn_fuse::input::{Attitude, Inputs, Sample};
use hzn_fuse::simulated::inputs;
use hzn_fuse::{Fused, Settings, fuse};
use hzn_nav::frames::Rotation;
use hzn_nav::strapdown::Imu;

fn fly(inputs: &Inputs) -> Fused {
    fuse(inputs, &Settings::default(), Wanted { rate_hz: Some(1.0), ..Wanted::default() }).unwrap()
}

/// Returns how many samples are found at a limit and frozen, and the notes about them.
fn found(imu: Vec<Sample>) -> (usize, usize, Vec<String>) {
    let time_s = imu[1].imu.time_s;
    let attitudes = vec![Attitude { time_s, fixed_from_vehicle: Some(Rotation::identity()), sigma_rad: 1e-3 }];
    let fused = fly(&Inputs { imu, attitudes, ..Inputs::default() });
    let notes = fused.notes.into_iter().filter(|n| n.starts_with("imu: ")).collect();
    (fused.counts.saturated, fused.counts.frozen, notes)
}

/// Returns the samples with other numbers; none is marked as saturated.
fn changed(imu: &[Sample], change: impl Fn(usize, [f64; 3], [f64; 3]) -> ([f64; 3], [f64; 3])) -> Vec<Sample> {
    let each = |(i, s): (usize, &Sample)| {
        let (gyro, accel) = change(i, s.imu.gyro_rad_s.xyz(), s.imu.accel_m_s2.xyz());
        let imu = Imu { gyro_rad_s: gyro.into(), accel_m_s2: accel.into(), ..s.imu };
        Sample { imu, saturated: false }
    };
    imu.iter().enumerate().map(each).collect()
}

/// The spin of this flight saturates the gyros. Without the column the samples themselves say it, all of them.
#[test]
fn samples_at_a_limit_are_found_without_the_column() {
    for seed in 0..flights(2, 8) {
        let right = noisy(seed).imu;
        let told = right.iter().filter(|s| s.saturated).count();
        let (at_limit, frozen, notes) = found(changed(&right, |_, g, a| (g, a)));
        println!("{seed}: {told} told, {at_limit} found, {notes:?}");
        assert!(told > 100 && at_limit == told && frozen == 0, "{at_limit} of {told}, {frozen}");
        assert!(notes.iter().any(|n| n.contains("this is its limit")), "{notes:?}");
        let (same, _, notes) = found(right);
        assert!(same == told && notes.is_empty(), "{notes:?}");
    }
}

/// The seed's flight, whose unit has the noise of a small one: the steps of the scene's own unit hide its noise.
fn noisy(seed: u64) -> Inputs {
    let mut scene = scene(seed);
    scene.imu.as_mut().unwrap().gyro_noise_deg_s = 0.1;
    inputs(&scene, &mut Slow::new(seed, 0.1), 0.5).unwrap()
}

/// A unit that repeats a sample for 12 s while the vehicle turns: the time counts as a gap.
#[test]
fn a_frozen_unit_counts_as_a_gap() {
    let right = noisy(1);
    let first = right.imu.iter().position(|s| s.imu.time_s > 300.0).unwrap();
    let last = right.imu.iter().position(|s| s.imu.time_s > 312.0).unwrap();
    let stuck = right.imu[first].imu;
    let mut all = right.clone();
    for sample in &mut all.imu[first..last] {
        sample.imu.gyro_rad_s = stuck.gyro_rad_s;
    }
    let fused = fly(&all);
    assert_eq!(fused.counts.frozen, last - first - 1, "{:?}", fused.notes);
    assert!(
        fused.notes.iter().any(|n| n.contains("all three rates repeat to the last digit for 1")),
        "{:?}",
        fused.notes
    );
    let sigma = |fused: &Fused, from_s: f64| {
        let at = fused.epochs.iter().filter(|e| (from_s..from_s + 12.0).contains(&e.state.time_s));
        at.map(|e| e.attitude_sigma_rad().max()).fold(0.0, f64::max)
    };
    let without = fly(&right);
    assert_eq!(without.counts.frozen, 0);
    let [with, without] = [&fused, &without].map(|fused| sigma(fused, 300.0));
    assert!(with > 10.0 * without, "{with} {without}");
}

/// Right samples repeat, too: a coarse step, no noise, a rest, a log that is faster than its unit.
#[test]
fn right_samples_that_repeat_are_left_alone() {
    let right = &noisy(2).imu[..1500];
    let coarse_rad = 0.1f64.to_radians();
    for noise_steps in [0.0, 0.1, 0.3, 1.0, 3.0] {
        let mut draws = Draws(7);
        let errors: Vec<[f64; 3]> =
            right.iter().map(|_| [0; 3].map(|_| noise_steps * coarse_rad * draws.normal())).collect();
        // A constant rate, and one that nods.
        for nod_rad_s in [0.0, 0.01, 0.1] {
            let imu = changed(right, |i, _, a| {
                let rate = [0.03, nod_rad_s * (0.02 * i as f64).sin(), -0.01 + nod_rad_s * (0.013 * i as f64).cos()];
                let gyro = std::array::from_fn(|k| ((rate[k] + errors[i][k]) / coarse_rad).round() * coarse_rad);
                (gyro, a)
            });
            let (at_limit, frozen, notes) = found(imu);
            assert_eq!((at_limit, frozen), (0, 0), "{noise_steps} {nod_rad_s} {notes:?}");
        }
    }
    let held = changed(right, |i, _, _| {
        let s = &right[i / 5 * 5].imu;
        let gyro = s.gyro_rad_s.xyz();
        (gyro.map(|g| g.clamp(-0.5, 0.5) * 0.1), s.accel_m_s2.xyz())
    });
    let (_, frozen, notes) = found(held);
    assert_eq!(frozen, 0, "{notes:?}");
    let exact = changed(right, |i, _, _| ([0.1, (0.1 * i as f64 - 30.0).clamp(0.0, 1.0) * 0.2, 0.0], [0.0; 3]));
    assert_eq!(found(exact).2, Vec::<String>::new(), "a unit without noise");
}
