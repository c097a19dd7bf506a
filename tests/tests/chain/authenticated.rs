//! Tests in QEMU the flight image of a board with keys. `cargo xtask test firmware --all` builds the image and runs the
//! test.

use hzn_sim::flight::rocket;
use hzn_tests::emulated::Board;
use hzn_tests::flight_image::{Bench, hzn_run};

#[test]
#[ignore = "needs the images: cargo xtask firmware"]
fn an_image_with_a_key_obeys_only_its_owner() {
    let bench = Bench::with_keys(Board::An500);
    bench.write_parameter_copy(1, &rocket(640, 480, 1, 1).sensor, 1);
    for key in ["own.key", "strange.key"] {
        hzn_run(bench.dir(), &["key", key, "--spacecraft", "7"]);
    }
    std::fs::copy(bench.path("own.key"), bench.path("key1.bin")).unwrap();
    std::fs::write(bench.path("counter1.bin"), [0; 8]).unwrap();
    let packets = |output: &str, key: Option<&str>, commands: &[&str]| {
        let mut args = vec!["telecommand", "-o", output];
        args.extend(key.iter().flat_map(|key| ["--key", key]));
        args.extend(commands);
        hzn_run(bench.dir(), &args);
        std::fs::read(bench.path(output)).unwrap()
    };
    let anonymous = packets("anonymous.bin", None, &["mode flight"]);
    let wrong = packets("wrong.bin", Some("strange.key"), &["mode flight"]);
    let right = packets("right.bin", Some("own.key"), &["mode flight"]);
    let end = packets("end.bin", Some("own.key"), &["arm", "mode shut-down"]);
    assert_eq!(bench.run(&[&anonymous[..], &wrong, &right, &right, &end].concat()), 0);
    let printed = hzn_run(bench.dir(), &["telemetry", "sent.bin"]);
    let count = |text: &str| printed.matches(text).count();
    assert_eq!(count("(mode): not authenticated"), 1, "{printed}");
    assert_eq!(count("(mode): the code of the trailer is wrong"), 1, "{printed}");
    assert_eq!(count("(mode): the counter of the trailer was used or reserved before"), 1, "{printed}");
    assert_eq!([count("(mode): done"), count(" to flight mode")], [2, 1], "{printed}");
}
