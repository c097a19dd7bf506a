//! Tests the firmware in QEMU: the same bits as on this machine, a scripted exchange over the serial line, a power cut,
//! and the watchdog. The tests need the images that `cargo xtask firmware` builds; `cargo xtask test firmware` builds
//! the images and runs the tests.

use std::path::Path;

use hzn_core::image::{Grey, Layout, Pixels};
use hzn_core::status::Status;
use hzn_core::threshold;
use hzn_core::{Config, FlightHorizon, Prior, camera};
use hzn_flight::answer::PictureAnswer;
use hzn_flight::flight::{Buffers, Lists};
use hzn_host::Compiled;
use hzn_sim::flight::{Flight, leo_infrared, rocket};
use hzn_tests::emulated::{Board, Case, answer_bytes, chain_sensor, measure, run_chain, run_example};
use hzn_tests::flight_image::{Bench, hzn_run};
use hzn_tests::real::Photograph;
use hzn_tests::stack_bound::stack_bound;

use crate::rows_image::clear;

/// Returns the pictures: rendered flights, payload in view, 8 bits of an infrared sensor, photographs, and patterns
/// that show nothing.
fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for flight in [rocket(640, 480, 14, 1), rocket(960, 540, 12, 2).with_payload(), rocket(1280, 720, 8, 3)] {
        for frame in &flight.frames {
            cases.push(Case::rendered(format!("{} {}", flight.name, frame.file), &flight.sensor, frame));
        }
    }
    let infrared = leo_infrared(10, 1);
    for frame in &infrared.frames {
        let mut frame = frame.clone();
        frame.scene.detector.bits = 8;
        cases.push(Case::rendered(format!("infrared {}", frame.file), &infrared.sensor, &frame));
    }
    for file in [
        "iss-limb-2020-11-20.jpg",
        "iss073e0293986-aurora.jpg",
        "pluto-pia19948.jpg",
        "sun-hmi-continuum-2023-01-31.png",
    ] {
        let photograph = Photograph::load(file);
        let view = photograph.view();
        let pixel = |i: usize| {
            let (x, y) = (i % usize::from(view.width()), i / usize::from(view.width()));
            view.at(x as u16, y as u16) as u8
        };
        let bytes = (0..usize::from(view.width()) * usize::from(view.height())).map(pixel).collect();
        cases.push(Case { name: file.into(), sensor: photograph.sensor.clone(), prior: Prior::default(), bytes });
    }
    let sensor = rocket(640, 480, 1, 1).sensor;
    let prior = Prior { altitude_m: Some(2e5f32), ..Prior::default() };
    let paint = |name: &str, f: &dyn Fn(usize, usize) -> u8| Case {
        name: name.into(),
        sensor: sensor.clone(),
        prior,
        bytes: (0..640 * 480).map(|i| f(i % 640, i / 640)).collect(),
    };
    cases.push(paint("black", &|_, _| 0));
    cases.push(paint("white", &|_, _| 255));
    cases.push(paint("checkerboard", &|x, y| 255 * ((x / 3 + y / 3) % 2) as u8));
    cases.push(paint("noise", &|x, y| ((x * 7919 + y * 104_729) as u32).wrapping_mul(2_654_435_761).to_be_bytes()[0]));
    cases
}

#[test]
#[ignore = "needs the images: cargo xtask firmware"]
fn same_bits_as_here() {
    let cases = cases();
    assert!(cases.len() >= 50, "{}", cases.len());
    let host: Vec<_> = cases.iter().map(Case::answer_on_host).collect();
    let (boards, mut ok) = (Board::with_pictures(), 0);
    for &board in &boards {
        for ((case, host), there) in cases.iter().zip(&host).zip(measure(board, &cases)) {
            assert_eq!(
                answer_bytes(host),
                answer_bytes(&there.answer),
                "{} on {}:\n{host:?}\n{:?}",
                case.name,
                board.core(),
                there.answer
            );
            ok += u32::from(host.status == Status::Ok as u8);
        }
    }
    let pictures = boards.len() * cases.len();
    assert!(2 * ok as usize >= pictures, "most pictures have an answer: {ok} of {pictures}");
}

/// Tests the flight software on a board without memory for a picture: the decoded telemetry of pictures that came row
/// by row must equal what `hzn run --flight` writes for the same pictures in memory.
#[test]
#[ignore = "needs the images: cargo xtask firmware"]
fn the_flight_loop_takes_rows_on_a_small_board() {
    let mut flight = rocket(640, 480, 8, 6);
    clear(&mut flight);
    flight.sensor.threshold = threshold::Config { method: threshold::Method::Fixed, level: 60.0, ..Default::default() };
    flight.sensor.body.altitude_km = Some(180.0);
    flight.sensor.body.altitude_sigma_km = 60.0;
    let bench = Bench::new(Board::Stm32F405);
    let mut pictures = save_pictures(&flight, &bench.path("pictures"));
    std::fs::write(bench.path("pictures/sensor.toml"), hzn_files::sensor::to_text(&flight.sensor).unwrap()).unwrap();
    // One picture has the wrong size: its rows are left out.
    pictures.insert(4, (vec![7; 1000], 0));
    bench.write_frames(&pictures);
    bench.write_parameter_copy(1, &flight.sensor, 1);
    let mut args = vec!["telecommand", "-o", "commands.bin"];
    args.extend(["process-once"; 9]);
    args.extend(["arm", "mode shut-down"]);
    hzn_run(bench.dir(), &args);
    assert_eq!(bench.run(&std::fs::read(bench.path("commands.bin")).unwrap()), 0);
    let printed = hzn_run(bench.dir(), &["telemetry", "sent.bin", "-o", "sent.csv", "--housekeeping", "hk.csv"]);
    assert!(printed.contains("picture of wrong size (1000, 307200)"), "{printed}");
    hzn_run(bench.dir(), &["run", "pictures", "--flight", "-o", "here.csv"]);
    // Rows keep no brightness, whose terms the probability of the picture in memory has.
    let [sent, host] = ["sent.csv", "here.csv"].map(|name| answers_without(&["p_limb"], &bench.path(name)));
    // Columns of the status and of the dropped pixels. If both dropped equally many, every number has the same bits.
    let (status, dropped) = (1, 23);
    let mut whole = 0;
    for (there, here) in sent.iter().zip(&host) {
        if there[status] == "ok" && here[status] == "ok" && there[dropped] == here[dropped] {
            whole += 1;
            assert_eq!(there, here);
        }
    }
    let housekeeping = std::fs::read_to_string(bench.path("hk.csv")).unwrap();
    let column = housekeeping.lines().next().unwrap().split(',').position(|c| c == "stack_bytes").unwrap();
    let last: Vec<&str> = housekeeping.lines().last().unwrap().split(',').collect();
    let stack: u32 = last[column].parse().unwrap();
    println!("{} pictures by rows, {whole} answers without a full list; most stack {stack} of 65536 bytes", sent.len());
    assert!(sent.len() == 8 && whole == 8 && (4096..60_000).contains(&stack));
    let bound = stack_bound(&Board::Stm32F405.image("flight")).unwrap();
    assert!((stack..60_000).contains(&bound.bytes));
}

/// Returns the cells of a table, row by row, without the columns that name the picture or the clock, and without the
/// protection level, which telemetry has in single precision.
fn answers(path: &Path) -> Vec<Vec<String>> {
    answers_without(&[], path)
}

/// The same without these columns.
fn answers_without(columns: &[&str], path: &Path) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines().map(|l| l.split(',').map(str::to_owned).collect::<Vec<_>>());
    let names = lines.next().unwrap();
    let other = ["index", "file", "time_s", "elapsed_us", "crc32", "protection_deg"];
    let is_answer = |name: &str| !other.contains(&name) && !columns.contains(&name);
    lines.map(|cells| cells.into_iter().zip(&names).filter(|(_, c)| is_answer(c)).map(|(v, _)| v).collect()).collect()
}

/// Tests ten pictures on command after a change of parameters: the decoded telemetry must equal what `hzn run --flight`
/// writes.
#[test]
#[ignore = "needs the images: cargo xtask firmware"]
fn an_exchange_over_the_line() {
    let mut flight = rocket(640, 480, 10, 5);
    // The position changes from picture to picture, so both get one altitude for all pictures here.
    flight.sensor.body.altitude_km = Some(180.0);
    flight.sensor.body.altitude_sigma_km = 60.0;
    for board in Board::with_pictures() {
        let bench = Bench::new(board);
        let dir = bench.dir();
        let mut pictures = save_pictures(&flight, &bench.path("pictures"));
        // In between, one picture has the wrong size and three are lost.
        pictures.insert(4, (vec![7; 1000], 3));
        bench.write_frames(&pictures);
        let mut before = flight.sensor.clone();
        before.consensus.threshold_px = 5.0;
        bench.write_parameter_copy(1, &before, 1);

        let mut commands =
            vec!["set consensus.threshold_px 2.5 covariance.sigma_px 0.2", "read consensus.threshold_px", "dump-edges"];
        commands.extend(["process-once"; 11]);
        // This is more than `brightness.max_mean`, whose value only the flight computer knows.
        commands.extend(["set brightness.min_mean 0.99", "arm", "mode shut-down"]);
        let mut args = vec!["telecommand", "-o", "commands.bin"];
        args.extend(commands);
        hzn_run(dir, &args);
        let line = std::fs::read(bench.path("commands.bin")).unwrap();
        assert_eq!(bench.run(&line), 0);
        let printed = hzn_run(dir, &["telemetry", "sent.bin", "-o", "sent.csv", "--housekeeping", "hk.csv"]);
        assert_events(&printed);
        assert_housekeeping(board, &bench);

        let mut after = before;
        after.consensus.threshold_px = 2.5;
        after.covariance.sigma_px = 0.2;
        std::fs::write(bench.path("pictures/sensor.toml"), hzn_files::sensor::to_text(&after).unwrap()).unwrap();
        hzn_run(dir, &["run", "pictures", "--flight", "-o", "here.csv"]);
        let (sent, host) = (answers(&bench.path("sent.csv")), answers(&bench.path("here.csv")));
        assert_eq!(sent.len(), 10);
        assert_eq!(sent, host, "{}", board.name());
        hzn_run(dir, &["telemetry", "sent.bin", "-o", "sent.mcap"]);
        hzn_run(dir, &["export", "sent.mcap", "-o", "again.csv"]);
        assert_eq!(answers(&bench.path("again.csv")), host);
    }
}

/// Tests a sequence with tracking: the decoded telemetry must equal what `hzn run --flight` writes. Between the
/// pictures of a rocket there are a dark one, a leap, and one that is nothing but stripes.
#[test]
#[ignore = "needs the images: cargo xtask firmware"]
fn a_tracked_sequence_has_the_same_bits_as_here() {
    // Ten pictures a second.
    let mut flight = rocket(640, 480, 3800, 8);
    flight.frames = [1200..1206, 2400..2407].into_iter().flatten().map(|i| flight.frames[i].clone()).collect();
    flight.sensor.body.altitude_km = Some(220.0);
    flight.sensor.body.altitude_sigma_km = 20.0;
    flight.sensor.track.full_every = 6;
    for board in Board::with_pictures() {
        let bench = Bench::new(board);
        let mut pictures: Vec<_> =
            save_pictures(&flight, &bench.path("pictures")).into_iter().map(|(bytes, _)| bytes).collect();
        for (place, picture) in [
            (3, vec![12; 640 * 480]),
            (9, (0..640 * 480).map(|i| if i % 640 / 9 % 2 == 0 { 20 } else { 200 }).collect::<Vec<u8>>()),
        ] {
            let file = bench.path("pictures").join(&flight.frames[place].file);
            image::GrayImage::from_raw(640, 480, picture.clone()).unwrap().save(file).unwrap();
            pictures[place] = picture;
        }
        std::fs::write(bench.path("pictures/sensor.toml"), hzn_files::sensor::to_text(&flight.sensor).unwrap())
            .unwrap();
        let there = bench.fly(&flight.sensor, &pictures);
        hzn_run(bench.dir(), &["telemetry", "sent.bin", "-o", "sent.csv"]);
        hzn_run(bench.dir(), &["run", "pictures", "--flight", "-o", "here.csv"]);
        assert_eq!(answers(&bench.path("sent.csv")), answers(&bench.path("here.csv")), "{}", board.name());
        let is_tracked = |(answer, _): &(PictureAnswer, u64)| answer.solved == 1 && answer.looks == 0;
        let tracked: Vec<usize> = (0..there.len()).filter(|&i| is_tracked(&there[i])).collect();
        println!("{}: tracked {tracked:?}", board.name());
        // Blocks begin at 0, 6 and 12. Picture 3 is dark, at 6 the rocket leaps, and picture 9 has stripes.
        assert_eq!(tracked, [1, 2, 5, 7, 8, 11], "{}", board.name());
    }
}

/// Renders a flight, saves the pictures in a new folder, and returns their bytes, each with 0 lost pictures before it.
fn save_pictures(flight: &Flight, folder: &Path) -> Vec<(Vec<u8>, u32)> {
    std::fs::create_dir(folder).unwrap();
    let mut pictures = Vec::new();
    for frame in &flight.frames {
        let picture = frame.render().unwrap();
        picture.save(&folder.join(&frame.file)).unwrap();
        let hzn_sim::Samples::Bytes(bytes) = picture.samples() else { panic!("8 bits") };
        pictures.push((bytes.clone(), 0));
    }
    pictures
}

/// Asserts that the decoded telemetry has every event of the exchange, and no broken or lost packet.
fn assert_events(printed: &str) {
    assert!(printed.contains("started with copy 1 of the parameters, generation 1"), "{printed}");
    assert!(printed.contains("parameters stored in copy 2, generation 2"), "{printed}");
    assert!(printed.contains("parameter 81 consensus.threshold_px = 2.5"), "{printed}");
    assert!(printed.contains("edge of picture 1, candidate"), "{printed}");
    assert!(
        printed.contains("picture of wrong size (1000, 307200)") && printed.contains("pictures lost (3, 0)"),
        "{printed}"
    );
    assert!(printed.contains("(set): value refused; nothing changed"), "{printed}");
    assert!(printed.contains("standby to shut-down mode"), "{printed}");
    assert!(!printed.contains("broken packets") && !printed.contains("lost on the way"), "{printed}");
}

/// Asserts the counters of the last housekeeping packet, and that the RAM is large enough for the stack.
fn assert_housekeeping(board: Board, bench: &Bench) {
    let housekeeping = std::fs::read_to_string(bench.path("hk.csv")).unwrap();
    let last: Vec<&str> = housekeeping.lines().last().unwrap().split(',').collect();
    let column = |name: &str| housekeeping.lines().next().unwrap().split(',').position(|c| c == name).unwrap();
    assert_eq!((last[column("pictures")], last[column("lost")], last[column("refused")]), ("10", "3", "1"));
    // Besides the pictures, RAM holds the lists, the buffers and the stack.
    let stack: usize = last[column("stack_bytes")].parse().unwrap();
    let bound = stack_bound(&board.image("flight")).unwrap().bytes as usize;
    println!("most stack {stack} bytes, at most {bound} by the calls");
    assert!(stack <= bound && size_of::<Lists>() + size_of::<Buffers>() + bound < 96 * 1024);
}

/// Tests a power cut in the middle of writing the parameters: after the reset the old parameters are in use, and the
/// telemetry says so.
#[test]
#[ignore = "needs the images: cargo xtask firmware"]
fn a_power_cut_in_the_middle_of_a_parameter_write() {
    let sensor = rocket(640, 480, 1, 1).sensor;
    let bench = Bench::new(Board::An500);
    bench.write_frames(&[]);
    bench.write_parameter_copy(1, &sensor, 1);
    bench.write_parameter_copy(2, &sensor, 2);
    std::fs::write(bench.path("cut.bin"), 200u32.to_le_bytes()).unwrap();
    hzn_run(bench.dir(), &["telecommand", "set body.altitude_km 99", "-o", "one.bin"]);
    let line = std::fs::read(bench.path("one.bin")).unwrap();
    assert_eq!(bench.run(&line), 99, "power was cut");
    assert_eq!(std::fs::metadata(bench.path("copy1.bin")).unwrap().len(), 200);
    std::fs::remove_file(bench.path("cut.bin")).unwrap();
    hzn_run(bench.dir(), &["telecommand", "read body.altitude_km", "arm", "mode shut-down", "-o", "two.bin"]);
    let line = std::fs::read(bench.path("two.bin")).unwrap();
    assert_eq!(bench.run(&line), 0);
    let printed = hzn_run(bench.dir(), &["telemetry", "sent.bin"]);
    assert!(printed.contains("started with copy 2 of the parameters, generation 2"), "{printed}");
    assert!(printed.contains("a copy of the parameters cannot be used (1, 2)"), "{printed}");
    assert!(printed.contains("parameter 32 body.altitude_km = NaN"), "{printed}");
}

/// Tests a turn of the flight loop that never ends: the watchdog restarts the program, which reports this and obeys
/// commands again.
#[test]
#[ignore = "needs the images: cargo xtask firmware"]
fn a_turn_that_never_ends_is_ended_by_the_watchdog() {
    for board in Board::with_pictures() {
        let bench = Bench::new(board);
        bench.write_parameter_copy(1, &rocket(640, 480, 1, 1).sensor, 1);
        let hangs = [*b"HANG", [0; 4], [0; 4], [0; 4]].concat();
        std::fs::write(bench.path("frames.bin"), hangs).unwrap();
        let line = |commands: &[&str]| {
            hzn_run(bench.dir(), &[&["telecommand", "-o", "commands.bin", "--force"], commands].concat());
            std::fs::read(bench.path("commands.bin")).unwrap()
        };
        // The first telecommand after a start must be followed by a pause, or by whole telecommands without one. The
        // others wait for the second start: the first one sends less than this number of bytes.
        let (first, others) = (line(&["process-once"]), line(&["arm", "mode shut-down"]));
        // The watchdog's two seconds are 125 million instructions at this shift. With fewer, a busy machine might feed
        // the line too slowly: a telecommand must be complete within a second.
        assert_eq!(bench.run_in_parts(&[(0, &first), (400, &others)], 4), 0);
        let printed = hzn_run(bench.dir(), &["telemetry", "sent.bin"]);
        assert_eq!(printed.matches("started with copy 1 of the parameters").count(), 2, "{printed}");
        assert_eq!(printed.matches("reset by the watchdog").count(), 1, "{printed}");
        assert!(printed.contains("standby to shut-down mode"), "{printed}");
    }
}

#[test]
#[ignore = "needs the images: cargo xtask firmware"]
fn the_sensor_alone_answers_with_the_same_bits() {
    let sensor = chain_sensor();
    let lens = sensor.camera.clone();
    let mut flight = rocket(1920, 1080, 6, 7);
    for (i, frame) in (0..).map(f64::from).zip(&mut flight.frames) {
        frame.scene.camera = lens.clone();
        let look = hzn_sim::Look { azimuth_rad: i, depression_rad: 0.2 + 0.02 * i, roll_rad: 0.5 * i };
        frame.scene.pose = hzn_sim::Pose::looking(hzn_sim::pose::position_m(10.0 * i, 20.0, 150.0), look);
    }
    let mut ok = 0;
    for frame in &flight.frames {
        let case = Case { prior: Prior::default(), ..Case::rendered(frame.file.clone(), &sensor, frame) };
        let mut horizon = FlightHorizon::boxed(&sensor).unwrap();
        let picture = Grey::try_new(&case.bytes, Layout::packed(1920, 1080, 1, 8)).unwrap();
        let expected = horizon.expect(&case.prior).unwrap();
        let report = horizon.find(&picture, &expected);
        let direction = report.solution.as_ref().map_or([0; 9], |s| {
            let ([x, y, z], [[xx, xy, xz], [_, yy, yz], [_, _, zz]]) = (s.axis.xyz(), s.covariance.rows());
            [x, y, z, xx, xy, xz, yy, yz, zz].map(f32::to_bits)
        });
        for board in Board::with_pictures() {
            let words = run_chain(board, &case.bytes);
            assert_eq!((words[0], &words[1..10]), (report.status as u32, &direction[..]), "{} {board:?}", case.name);
            // The last word is the high-water mark of the stack in bytes. The stack is painted, so that the number is
            // measured.
            assert!((4096..65536).contains(&words[10]), "{} bytes of stack", words[10]);
        }
        ok += u32::from(report.status == Status::Ok);
    }
    assert!(ok >= 3, "{ok} answers");
}

/// Tests the lines that the documents show (`links.rs` compares them with the image), on a board with 192 KiB of RAM,
/// of which 64 KiB are for the stack.
#[test]
#[ignore = "needs the images: cargo xtask firmware"]
fn the_example_of_the_documents_fits_into_192_kib() {
    let mut sensor = Config::new(camera::Config::ideal(camera::Model::Pinhole, 64, 48, 60.0));
    sensor.body.altitude_km = Some(230.0);
    // The limb of a body as wide as the Earth at 230 km, 75 degrees below the optical axis.
    let pixel = |i: u16| {
        let (x, y) = ((f64::from(i % 64) - 31.5) / 60.0, (f64::from(i / 64) - 23.5) / 60.0);
        let (sin, cos) = 75f64.to_radians().sin_cos();
        let along = (y * sin + cos) / (x * x + y * y + 1.0).sqrt();
        (110.0 + 90.0 * ((along - 74.8f64.to_radians().cos()) * 60.0).clamp(-1.0, 1.0)) as u8
    };
    let prior = Prior { altitude_m: Some(231.5e3), ..Prior::default() };
    let case = Case { name: "example".into(), sensor, prior, bytes: (0..64 * 48).map(pixel).collect() };
    let host = case.answer_on_host();
    assert_eq!(host.status, Status::Ok as u8);
    let (there, stack_bytes) = run_example(&case.bytes);
    assert_eq!(there, answer_bytes(&host));
    let bound = stack_bound(&Board::Stm32F405.image("example")).unwrap().bytes;
    assert!((4096..=bound).contains(&stack_bytes) && bound < 64 * 1024);
}
