//! Rows that are there again, and inputs whose times do not fit: each counts once, and the message says what is so.

use crate::common::{flight, scene};
use hzn_fuse::finding::{Cause, Level};
use hzn_fuse::flight::Wanted;
use hzn_fuse::input::{Attitude, Fix, Inputs, Sample};
use hzn_fuse::{Error, Fused, Settings, fuse};
use hzn_nav::frames::Vector;

fn fly(inputs: &Inputs) -> Fused {
    fuse(inputs, &Settings::default(), Wanted { rate_hz: Some(1.0), ..Wanted::default() }).unwrap()
}

/// A recording appended to itself, or a log that is faster than its receiver, gives no sigma that is smaller.
#[test]
fn fixes_that_are_there_again_count_once() {
    let right = flight(&scene(1));
    let once = fly(&right);
    let n = right.gnss.len();
    let step_s = right.gnss[1].time_s - right.gnss[0].time_s;
    let again = |fix: &Fix, k: u32| Fix { time_s: fix.time_s + 0.2 * step_s * f64::from(k), ..*fix };
    let twice: Vec<Fix> = right.gnss.iter().chain(&right.gnss).copied().collect();
    let held: Vec<Fix> = right.gnss.iter().flat_map(|fix| (0..5).map(|k| again(fix, k))).collect();
    for (gnss, count, words) in [(twice, n, "are copies of others"), (held, 4 * n, "faster than the receiver")] {
        let fused = fly(&Inputs { gnss, ..right.clone() });
        assert!(fused.notes.iter().any(|note| note.contains(words)), "{:?}", fused.notes);
        let counted = fused.counts.unusable.iter().filter(|((name, why), _)| name == "gnss" && why.contains("numbers"));
        // On the pad the vehicle is at rest, and equal numbers are measurements.
        let counted: usize = counted.map(|(_, n)| *n).sum();
        assert!(counted <= count && counted * 2 > count, "{counted} of {count}");
        if words.contains("copies") {
            assert_eq!(fused.epochs, once.epochs);
        }
    }
    assert!(!once.notes.iter().any(|note| note.starts_with("gnss: ")), "{:?}", once.notes);
    let still = Fix { velocity_m_s: Vector::zeros(), ..right.gnss[0] };
    let at_rest: Vec<Fix> = right.gnss.iter().map(|fix| Fix { time_s: fix.time_s, ..still }).collect();
    let fused = fuse(&Inputs { gnss: at_rest, ..right }, &Settings::default(), Wanted::default());
    let said = fused.map_or_else(|error| error.to_string(), |fused| fused.notes.join(" "));
    assert!(!said.contains("repeat the numbers"), "{said}");
}

/// A unit with 1 Hz whose times are those of the other inputs: the key is named, and no other unit is guessed.
#[test]
fn a_slow_unit_is_told_its_key() {
    let mut all = flight(&scene(1));
    let mut last_s = f64::NEG_INFINITY;
    all.imu.retain(|s| {
        let keep = s.imu.time_s >= last_s + 1.0;
        last_s = if keep { s.imu.time_s } else { last_s };
        keep
    });
    let said = |all: &Inputs| match fuse(all, &Settings::default(), Wanted::default()) {
        Ok(fused) => fused.verdict.findings.into_iter().find(|f| f.cause == Cause::SampleTimes).unwrap(),
        Err(Error::Contradicts { finding, .. }) => *finding,
        Err(other) => panic!("{other}"),
    };
    let slow = said(&all);
    assert!(slow.what.contains("max_step_s") && !slow.what.contains("milliseconds"), "{}", slow.what);
    assert_eq!(slow.level, Level::Contradicts);
    let imu = |s: &Sample| Sample { imu: hzn_nav::strapdown::Imu { time_s: s.imu.time_s * 1e3, ..s.imu }, ..*s };
    all.imu = all.imu.iter().map(imu).collect();
    let wrong = said(&all);
    assert!(wrong.what.contains("milliseconds"), "{}", wrong.what);
}

/// The star tracker is there, but its only attitude is from before the receiver's first fix.
#[test]
fn a_star_tracker_without_a_position_is_not_asked_for() {
    let mut all = flight(&scene(1));
    all.recordings.clear();
    all.gnss.retain(|fix| fix.time_s > 200.0);
    let fixed_from_vehicle = Some(hzn_nav::frames::Rotation::identity());
    all.attitudes = vec![Attitude { time_s: 100.0, fixed_from_vehicle, sigma_rad: 1e-3 }];
    let said = fuse(&all, &Settings::default(), Wanted::default()).unwrap_err().to_string();
    assert!(said.contains("the receiver has no position within 5 s") && !said.contains("--attitude"), "{said}");
}
