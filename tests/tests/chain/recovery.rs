//! Tests in QEMU how the flight image comes back after resets. `cargo xtask test firmware` builds the image and runs
//! the tests.

use std::process::Command;

use hzn_flight::Parameters;
use hzn_sim::flight::rocket;
use hzn_tests::emulated::Board;
use hzn_tests::flight_image::{Bench, hzn_run};

/// Returns commands that end the image. Those before them are lost: a start takes up to a thousand bytes with it.
fn shut_down_after_starts(bench: &Bench) -> Vec<u8> {
    let mut args = vec!["telecommand", "-o", "commands.bin"];
    args.extend(["ping"; 400]);
    // On a busy machine a command can arrive after the ten seconds of the image's clock for which `arm` counts.
    (0..40).for_each(|_| args.extend(["report", "arm", "mode shut-down"]));
    hzn_run(bench.dir(), &args);
    std::fs::read(bench.path("commands.bin")).unwrap()
}

/// Tests a computer that flies from its start on, and whose camera hangs it: the watchdog resets it again and again,
/// until it stays in safe mode, where it sends telemetry and obeys.
#[test]
#[ignore = "needs the images: cargo xtask firmware"]
fn a_loop_of_resets_ends_in_safe_mode() {
    for board in Board::with_pictures() {
        let bench = Bench::new(board);
        let mut parameters = Parameters::new(rocket(640, 480, 1, 1).sensor);
        parameters.operations.boot_mode = 1;
        bench.write_copy_of(1, &parameters, 1);
        bench.write_copy_of(2, &parameters, 2);
        std::fs::write(bench.path("frames.bin"), [*b"HANG", [0; 4], [0; 4], [0; 4]].concat()).unwrap();
        // The watchdog's two seconds are eight million instructions at this shift.
        assert_eq!(bench.run_with_shift(&shut_down_after_starts(&bench), 8), 0);
        let printed = hzn_run(bench.dir(), &["telemetry", "sent.bin", "--housekeeping", "hk.csv"]);
        let count = |text: &str| printed.matches(text).count();
        assert_eq!(count("started with copy 2 of the parameters"), 3, "{printed}");
        assert_eq!(count("started with copy 1 of the parameters"), 4, "{printed}");
        assert_eq!((count("the older parameters are in use"), count("safe mode after resets")), (4, 1), "{printed}");
        assert!(printed.contains("standby to safe mode") && printed.contains("safe to shut-down mode"), "{printed}");
        let housekeeping = std::fs::read_to_string(bench.path("hk.csv")).unwrap();
        let mut rows = housekeeping.lines().map(|l| l.split(',').map(str::to_owned).collect::<Vec<_>>());
        let column = |row: &[String], name: &str, columns: &[String]| {
            row[columns.iter().position(|c| c == name).unwrap()].clone()
        };
        let columns = rows.next().unwrap();
        let last = rows.next_back().unwrap();
        assert_eq!(column(&last, "starts", &columns), "7");
        assert_eq!(column(&last, "watchdog_resets", &columns), "6");
        // The computer sends the checksum of its own image.
        let image = bench.path("image.bin");
        let objcopy = Command::new("arm-none-eabi-objcopy")
            .args(["-O", "binary"])
            .arg(board.image("flight"))
            .arg(&image)
            .status()
            .unwrap();
        assert!(objcopy.success());
        let crc = hzn_flight::board::image_crc(&std::fs::read(&image).unwrap());
        assert_eq!(column(&last, "image_crc", &columns), crc.to_string());
    }
}

/// Tests a stored parameter with which a picture takes longer than the watchdog allows: after three resets the older
/// parameters are in use, and the picture has its answer.
#[test]
#[ignore = "needs the images: cargo xtask firmware"]
fn a_bad_parameter_in_memory_heals_itself() {
    let bench = Bench::new(Board::An500);
    let stripes = (0..640 * 480).map(|i| 255 * (((i % 640) + (i / 640) / 500) % 2) as u8).collect();
    bench.write_frames(&[(stripes, 0)]);
    let mut parameters = Parameters::new(rocket(640, 480, 1, 1).sensor);
    parameters.sensor.body.altitude_km = Some(150.0);
    parameters.sensor.contour.line_spacing_px = Some(2);
    parameters.operations.boot_mode = 1;
    bench.write_copy_of(1, &parameters, 1);
    parameters.sensor.limits.max_work = Some(hzn_flight::parameters::MAX_WORK);
    bench.write_copy_of(2, &parameters, 2);
    // The watchdog has 31 million instructions here; the default `limits.max_work` takes at most 20 million.
    assert_eq!(bench.run_with_shift(&shut_down_after_starts(&bench), 6), 0);
    let printed = hzn_run(bench.dir(), &["telemetry", "sent.bin", "-o", "sent.csv"]);
    assert_eq!(printed.matches("started with copy 2 of the parameters").count(), 3, "{printed}");
    assert_eq!(printed.matches("started with copy 1 of the parameters").count(), 1, "{printed}");
    assert!(printed.contains("the older parameters are in use"), "{printed}");
    assert_eq!(std::fs::read_to_string(bench.path("sent.csv")).unwrap().lines().count(), 2, "one answer");
}
