//! Many pictures through one sensor: the answers are those of the first pass, whatever came in between.

use std::process::Command;

use hzn_core::body::Prior;
use hzn_core::camera::{self, Model};
use hzn_core::image::{Grey, Layout};
use hzn_core::{Config, FlightHorizon, HostHorizon};

use crate::common::{KINDS, garbage};

/// Number of pictures; `cargo xtask campaign long` sets a million.
fn pictures() -> usize {
    std::env::var("HZN_FRAMES").ok().and_then(|text| text.parse().ok()).unwrap_or(2_000)
}

/// Returns the memory of this process in kB; 0 if the system does not say.
fn memory_kb() -> u64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    text.lines().find_map(|line| line.strip_prefix("VmRSS:")?.trim().strip_suffix(" kB")?.parse().ok()).unwrap_or(0)
}

/// Returns the processor time of this thread in seconds, which other programs on the machine hardly change; 0 if the
/// system does not say.
fn processor_s() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).unwrap_or(0.0) * 1e-9
}

/// The memory is that of a whole process, so the test below runs in a process without the other tests.
#[test]
fn the_answers_repeat_and_the_memory_does_not_grow() {
    let mut alone = Command::new(std::env::current_exe().unwrap());
    alone.args(["--exact", "long::in_a_process_of_its_own", "--ignored", "--nocapture"]);
    let out = alone.output().unwrap();
    let text = String::from_utf8_lossy(&out.stdout);
    println!("{text}{}", String::from_utf8_lossy(&out.stderr));
    assert!(out.status.success() && text.contains("test result: ok. 1 passed"));
}

#[test]
#[ignore = "the test above runs it"]
fn in_a_process_of_its_own() {
    let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 96, 64, 60.0));
    config.body.altitude_km = Some(300.0);
    config.edge_points.min_points = 8;
    config.gates.min_inliers = 8;
    let mut host = HostHorizon::boxed(&config).unwrap();
    let mut flight = FlightHorizon::boxed(&config).unwrap();
    let expected = (host.expect(&Prior::default()).unwrap(), flight.expect(&Prior::default()).unwrap());
    // Limbs, discs and single pixels; the last pictures of each pass are stripes and noise, which cost the most.
    let kind = |i: u8| if i < 48 { 5 + i % 4 } else { i % KINDS };
    let data: Vec<Vec<u8>> = (0..50u8).map(|i| garbage(kind(i), u64::from(i) * 77, i.wrapping_mul(53))).collect();
    let mut first = Vec::new();
    let (all, mut early_kb) = (pictures(), 0);
    // Processor time at the start, after half of the pictures, and at the end.
    let mut times_s = vec![processor_s()];
    for n in 0..all {
        let picture = Grey::try_new(&data[n % data.len()], Layout::packed(96, 64, 1, 8)).unwrap();
        let (a, b) = (host.process(&picture, &expected.0), flight.process(&picture, &expected.1));
        let bits = (
            (a.status, a.counters, a.solution.map(|s| s.axis.xyz().map(f64::to_bits))),
            (b.status, b.counters, b.solution.map(|s| s.axis.xyz().map(f32::to_bits))),
        );
        match first.get(n % data.len()) {
            Some(before) => assert!(*before == bits, "picture {n}"),
            None => first.push(bits),
        }
        if n == all / 10 {
            early_kb = memory_kb();
        }
        if n + 1 == all / 2 || n + 1 == all {
            times_s.push(processor_s());
        }
    }
    let late_kb = memory_kb();
    println!(
        "{all} pictures, each in both precisions; memory {early_kb} kB early, {late_kb} kB late; the second half took \
         {:.3} of the processor time of the first, {:.1} s",
        (times_s[2] - times_s[1]) / (times_s[1] - times_s[0]),
        times_s[1] - times_s[0],
    );
    assert!(late_kb <= early_kb + 1024, "the memory grows from {early_kb} to {late_kb} kB");
}
