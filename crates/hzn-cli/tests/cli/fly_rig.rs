//! `hzn fly rig.toml`: several heads, with recorded pictures and with pipes.
#![cfg(target_os = "linux")]

use std::fs;
use std::io::Write;
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::common::{Place, angle_deg, cell};

type Rows = Vec<Vec<(String, String)>>;

const HEADS: [&str; 4] = ["front", "right", "back", "left"];
/// Columns of the number, the duration and the checksum of a row.
const NOT_FLOWN: [&str; 3] = ["index", "elapsed_us", "crc32"];

/// Simulates epochs of the scene `ring` with small pictures of one byte for each pixel, as the flight software has
/// them. The data of the vehicle come to a flight computer by telecommand, so the tables have only times.
fn ring(epochs: &str) -> Place {
    let place = Place::new();
    let scene = place.run(&["simulate", "ring", "--show"]).expect(0).out;
    let scene = scene.replace("width = 640\nheight = 480", "width = 320\nheight = 240").replace("554.0", "277.0");
    let scene = scene.replace("319.5", "159.5").replace("239.5", "119.5").replace("\nbits = 16", "\nbits = 8");
    place.write("ring.toml", scene.as_bytes());
    place.run(&["simulate", "ring.toml", "-o", "ring", "--frames", epochs, "-q"]).expect(0);
    fs::remove_file(place.path("ring/frames.csv")).unwrap();
    for head in HEADS {
        let table = format!("ring/{head}/frames.csv");
        let two = |line: &str| line.split(',').take(2).collect::<Vec<_>>().join(",");
        place.write(&table, place.read(&table).lines().map(two).collect::<Vec<_>>().join("\n").as_bytes());
        let sensor = format!("ring/{head}/sensor.toml");
        let is_flown = |line: &&str| {
            let on_the_ground = ["limb_height_by_latitude_km", "sunlit", "altitude_km", "altitude_sigma_km"];
            !on_the_ground.iter().any(|key| line.starts_with(&format!("{key} =")))
        };
        let text = place.read(&sensor).lines().filter(is_flown).collect::<Vec<_>>().join("\n");
        let text = text.replace("[body]", "[body]\naltitude_km = 500.0\naltitude_sigma_km = 10.0");
        place.write(&sensor, text.as_bytes());
    }
    place
}

/// Returns the rows of the joint answers and those of the heads.
fn divided(rows: Rows) -> (Rows, Rows) {
    rows.into_iter().partition(|row| cell(row, "head") == "rig")
}

/// Returns the rows in the log.
fn logged(place: &Place) -> (Rows, Rows) {
    place.run(&["export", "state/log/fly-000001.mcap", "-o", "log.csv", "--force"]).expect(0);
    divided(place.rows("log.csv"))
}

/// Returns the rows of a head, without the columns that a flight does not have.
fn of_head(rows: &Rows, head: &str) -> Rows {
    let own = rows.iter().filter(|row| cell(row, "head") == head).cloned();
    own.map(|row| row.into_iter().filter(|(name, _)| !NOT_FLOWN.contains(&name.as_str())).collect()).collect()
}

fn axis(row: &[(String, String)]) -> [f64; 3] {
    ["axis_x", "axis_y", "axis_z"].map(|name| cell(row, name).parse().unwrap())
}

/// Asserts that the joint answers of a flight are those of `hzn run --flight`.
fn assert_joined_alike(flown: &Rows, run: &Rows) {
    assert_eq!(flown.len(), run.len());
    for (flown, run) in flown.iter().zip(run) {
        for column in ["file", "status", "body", "altitude_km", "heads_used", "heads_excluded"] {
            assert_eq!(cell(flown, column), cell(run, column), "{column}: {flown:?}");
        }
        // The flight software joins in single precision.
        assert!(angle_deg(axis(flown), axis(run)) < 1e-4, "{flown:?}\n{run:?}");
        for column in ["time_s", "sigma_max_deg", "half_angle_deg", "separation_deg", "protection_deg"] {
            let [a, b] = [flown, run].map(|row| cell(row, column).parse::<f64>().unwrap());
            assert!((a - b).abs() < 1e-4 + 1e-3 * b.abs(), "{column}: {a} {b}");
        }
    }
}

#[test]
fn heads_of_two_bands_fly_as_they_run() {
    let place = ring("2");
    let run = || {
        place.run(&["run", "ring/rig.toml", "--flight", "-o", "run.csv", "-q", "--force"]).expect(0);
        divided(place.rows("run.csv")).0
    };
    let of_one_band = run();
    let heads = place.read("ring/rig.toml");
    place.write(
        "ring/rig.toml",
        heads.replace("pictures = \"left\"", "pictures = \"left\"\nlimb_group = \"b\"").as_bytes(),
    );
    let of_two = run();
    place.run(&["fly", "ring/rig.toml", "--state", "state"]).expect(0);
    assert_joined_alike(&logged(&place).0, &of_two);
    // A head that is alone in its group says less.
    let sigma_deg = |row: &[(String, String)]| cell(row, "sigma_max_deg").parse::<f64>().unwrap();
    assert!(of_two.iter().zip(&of_one_band).all(|(two, one)| sigma_deg(two) > sigma_deg(one)), "{of_two:?}");
}

#[test]
fn recorded_heads_fly_as_they_run() {
    let place = ring("4");
    // A head without a picture in one epoch, a picture that cannot be read, and a frozen head.
    let file = |head: &str, n: usize| place.path(&format!("ring/{head}/{head}-{n:05}.png"));
    fs::remove_file(file("right", 1)).unwrap();
    fs::write(file("back", 2), "no picture").unwrap();
    fs::copy(file("left", 2), file("left", 3)).unwrap();
    place.run(&["run", "ring/rig.toml", "--flight", "-o", "run.csv", "-q"]).expect(3);
    let (run_joint, run_heads) = divided(place.rows("run.csv"));
    let said = place.run(&["fly", "ring/rig.toml", "--state", "state"]).expect(0);
    said.says("4 epochs, 4 joint answers").says("left: flight mode");
    let (joint, heads) = logged(&place);
    assert_eq!((joint.len(), run_joint.len()), (4, 4));
    for head in HEADS {
        // A picture that cannot be read is no picture for the flight software.
        let run: Rows =
            of_head(&run_heads, head).into_iter().filter(|row| cell(row, "status") != "unreadable").collect();
        assert_eq!(of_head(&heads, head), run, "{head}");
    }
    assert_joined_alike(&joint, &run_joint);
    let used: Vec<&str> = joint.iter().map(|row| cell(row, "heads_used")).collect();
    assert_eq!(used, ["front right back left", "front back left", "front right left", "front right back"]);
    // The recording names its heads.
    let recording = fs::read(place.path("state/log/fly-000001.mcap")).unwrap();
    let has = |text: &str| recording.windows(text.len()).any(|bytes| bytes == text.as_bytes());
    for text in ["/left/camera/calibration", "left/sensor.toml", "rig.toml"] {
        assert!(has(text), "{text}");
    }
}

/// Both copies of one head are lost, and another head has the APIDs of the first one.
#[test]
fn the_parameters_of_one_head_do_not_ground_the_others() {
    let place = ring("2");
    place.run(&["fly", "ring/rig.toml", "--state", "state"]).expect(0);
    for copy in ["parameters-1.bin", "parameters-2.bin"] {
        fs::write(place.path(&format!("state/right/{copy}")), [0; 300]).unwrap();
        fs::copy(place.path(&format!("state/front/{copy}")), place.path(&format!("state/left/{copy}"))).unwrap();
    }
    let said = place.run(&["fly", "ring/rig.toml", "--state", "state"]).expect(0);
    let said = said.says("state/right: no copy of the parameters can be used; those of rig.toml");
    said.says("line.apid_base = 272 is also that of front; 320 is stored instead").says("2 epochs");
    // The next start has nothing to mend.
    let again = place.run(&["fly", "ring/rig.toml", "--state", "state"]).expect(0);
    assert!(!again.err.contains("stored again") && !again.err.contains("stored instead"), "{}", again.err);
}

/// Two heads with named pipes; the second one is silent after three epochs.
#[test]
fn a_silent_head_costs_only_itself() {
    let place = ring("5");
    let text = place.read("ring/rig.toml");
    let [_, front, right, ..] = text.split("[[head]]").collect::<Vec<_>>()[..] else { panic!("{text}") };
    let live = |head: &str, name: &str| {
        let sensor = format!("pictures = \"../{name}\"\nsensor = \"{name}/sensor.toml\"");
        head.replace(&format!("pictures = \"{name}\""), &sensor)
    };
    let (front, right) = (live(front, "front"), live(right, "right"));
    // The times are those of a computer that has much else to do.
    let rig = format!("[rig]\nsync_s = 30\nwait_s = 5\n[[head]]{front}[[head]]{right}");
    place.write("ring/rig.toml", rig.as_bytes());
    let refused = place.run(&["fly", "ring/rig.toml", "--state", "state"]).expect(2);
    refused.says("head front");
    for name in ["front", "right"] {
        assert!(Command::new("mkfifo").arg(place.path(name)).status().unwrap().success());
    }
    let mut command = place.command(&["fly", "ring/rig.toml", "--state", "state"]);
    let flight = command.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    let mut pipes = ["front", "right"].map(|name| fs::OpenOptions::new().write(true).open(place.path(name)).unwrap());
    for n in 0..5 {
        for (pipe, name) in pipes.iter_mut().zip(["front", "right"]).take(if n < 3 { 2 } else { 1 }) {
            let picture = image::open(place.path(&format!("ring/{name}/{name}-{n:05}.png"))).unwrap();
            pipe.write_all(&picture.to_luma8().into_raw()).unwrap();
        }
        // The next picture of a head ends the epoch.
        std::thread::sleep(Duration::from_millis(500));
    }
    drop(pipes);
    let output = flight.wait_with_output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(said.contains("8 pictures, 8 answers; 5 epochs, 5 joint answers; 13 in the log"), "{said}");
    let (joint, _) = logged(&place);
    let used: Vec<&str> = joint.iter().map(|row| cell(row, "heads_used")).collect();
    assert_eq!(used, ["front right", "front right", "front right", "front", "front"]);
}
