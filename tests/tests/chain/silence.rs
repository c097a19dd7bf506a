//! Tests in QEMU that the flight image is heard from in every mode. `cargo xtask test firmware` builds the image and
//! runs the tests.

use hzn_flight::Parameters;
use hzn_sim::Samples;
use hzn_sim::flight::rocket;
use hzn_tests::emulated::Board;
use hzn_tests::flight_image::{Bench, hzn_run};

/// Exponent of the time of an instruction: a second of the image's clock is four million instructions.
const SHIFT: u32 = 8;

/// Returns the bytes of commands.
fn commands(bench: &Bench, args: &[&str]) -> Vec<u8> {
    hzn_run(bench.dir(), &[&["telecommand", "--force", "-o", "commands.bin"], args].concat());
    std::fs::read(bench.path("commands.bin")).unwrap()
}

/// Number of bytes that the image has sent when its start is over. Commands that it receives earlier can be lost.
const STARTED_BYTES: u64 = 200;

/// Runs the image with a first command until it has sent a number of bytes, and returns the decoded events and the
/// times of the housekeeping packets in seconds.
fn run_with(bench: &Bench, first: &str, bytes: u64) -> (String, Vec<f64>) {
    // On a busy machine the bytes of a command can arrive too slowly, so it is sent three times.
    let first = commands(bench, &[first; 3]);
    // On a busy machine a command can arrive after the ten seconds of the image's clock for which `arm` counts.
    let end = commands(bench, &["arm", "mode shut-down"].repeat(40));
    assert_eq!(bench.run_in_parts(&[(STARTED_BYTES, &first), (bytes, &end)], SHIFT), 0);
    let args = ["telemetry", "sent.bin", "--force", "-o", "sent.csv", "--housekeeping", "hk.csv"];
    let printed = hzn_run(bench.dir(), &args);
    let housekeeping = std::fs::read_to_string(bench.path("hk.csv")).unwrap();
    (printed, column(&housekeeping, "time_s"))
}

/// Returns the numbers of a column.
fn column(table: &str, name: &str) -> Vec<f64> {
    let mut rows = table.lines();
    let place = rows.next().unwrap().split(',').position(|c| c == name).unwrap();
    rows.map(|row| row.split(',').nth(place).unwrap().parse().unwrap()).collect()
}

/// Asserts that packets come for at least 50 seconds, and that ten seconds never pass without one.
fn assert_heard(times_s: &[f64], what: &str) {
    let most_s = times_s.windows(2).map(|w| w[1] - w[0]).fold(times_s[0], f64::max);
    println!("{what}: {} packets in {:.0} s, at most {most_s:.2} s apart", times_s.len(), times_s[times_s.len() - 1]);
    assert!(times_s.len() > 10 && times_s[times_s.len() - 1] > 50.0, "{what}: {times_s:?}");
    assert!(most_s < 10.0, "{what}: {times_s:?}");
}

/// Tests every mode but shut-down without any picture: there is a packet at least every ten seconds.
#[test]
#[ignore = "needs the images: cargo xtask firmware"]
fn every_mode_sends_a_packet_in_ten_seconds() {
    for board in Board::with_pictures() {
        for (mode, is_silent) in [("standby", false), ("flight", true), ("safe", false)] {
            let bench = Bench::new(board);
            bench.write_frames(&[]);
            bench.write_parameter_copy(1, &rocket(640, 480, 1, 1).sensor, 1);
            let (printed, times_s) = run_with(&bench, &format!("mode {mode}"), 2000);
            assert_heard(&times_s, &format!("{} in {mode} mode", board.name()));
            assert!(mode == "standby" || printed.contains(&format!("standby to {mode}")), "{printed}");
            // The camera never sends a picture, which only flight mode expects.
            assert_eq!(printed.contains("the camera sends no pictures"), is_silent, "{printed}");
        }
    }
}

/// Tests a camera that sends twenty pictures and then dies, on a computer that starts in flight mode: the image says so
/// within two periods of the camera, once, and its packets go on.
#[test]
#[ignore = "needs the images: cargo xtask firmware"]
fn a_dead_camera_is_told_within_two_periods() {
    let mut flight = rocket(640, 480, 1, 1);
    flight.sensor.body.altitude_km = Some(180.0);
    flight.sensor.body.altitude_sigma_km = 60.0;
    let picture = flight.frames[0].render().unwrap();
    let Samples::Bytes(bytes) = picture.samples() else { panic!("8 bits") };
    for board in Board::with_pictures() {
        let bench = Bench::new(board);
        bench.write_frames(&vec![(bytes.clone(), 0); 20]);
        let mut parameters = Parameters::new(flight.sensor.clone());
        parameters.operations.boot_mode = 1;
        bench.write_copy_of(1, &parameters, 1);
        let (printed, times_s) = run_with(&bench, "ping", 11_500);
        assert_heard(&times_s, &format!("{} after its camera died", board.name()));
        let exposures_s = column(&std::fs::read_to_string(bench.path("sent.csv")).unwrap(), "time_s");
        assert_eq!(exposures_s.len(), 20, "{printed}");
        let period_s = (exposures_s[19] - exposures_s[0]) / 19.0;
        let told: Vec<&str> = printed.lines().filter(|l| l.contains("the camera sends no pictures")).collect();
        let [line] = told[..] else { panic!("told once: {printed}") };
        let after_s: f64 = line.split(" came ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        println!("{line}; the period is {period_s:.3} s");
        // The text has tenths of seconds.
        assert!(line.contains("number 20,") && after_s <= 2.0 * period_s + 0.05, "{line}, period {period_s} s");
    }
}
