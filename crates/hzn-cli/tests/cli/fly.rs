//! `hzn fly` from end to end: pictures from a pipe, commands from the ground, crashes, the log.
#![cfg(target_os = "linux")]

use std::io::{BufRead, BufReader, Write};
use std::net::TcpListener;
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use crate::common::{Place, cell, limb};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

const PICTURES: usize = 100;
/// Pictures before the crash.
const BEFORE: usize = 60;
/// Time between two pictures: 30 a second.
const PERIOD: Duration = Duration::from_micros(33_333);
/// Columns that name the picture or the clock, and the checksum of the whole row.
const NOT_ANSWER: [&str; 5] = ["index", "file", "time_s", "elapsed_us", "crc32"];

/// A program that runs beside the test. Its messages come line by line.
pub(crate) struct Running {
    child: Child,
    lines: Receiver<String>,
    said: Vec<String>,
}

impl Running {
    pub(crate) fn start(mut command: Command) -> Self {
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let (sender, lines) = channel();
        let from = BufReader::new(child.stderr.take().unwrap());
        std::thread::spawn(move || from.lines().map_while(Result::ok).try_for_each(|line| sender.send(line)));
        Self { child, lines, said: Vec::new() }
    }
    pub(crate) fn stdin(&mut self) -> ChildStdin {
        self.child.stdin.take().unwrap()
    }
    /// Waits until the program says this.
    #[track_caller]
    pub(crate) fn wait_for(&mut self, text: &str) {
        let end = Instant::now() + Duration::from_secs(20);
        while !self.said.iter().any(|line| line.contains(text)) {
            let left = end.saturating_duration_since(Instant::now());
            let Ok(line) = self.lines.recv_timeout(left) else { panic!("{text:?} was not said: {:#?}", self.said) };
            self.said.push(line);
        }
    }
    pub(crate) fn signal(&self, signal: Signal) {
        kill(Pid::from_raw(self.child.id() as i32), signal).unwrap();
    }
    /// Waits for the end. Returns the exit code and everything that was said.
    pub(crate) fn end(mut self) -> (Option<i32>, String) {
        let code = self.child.wait().unwrap().code();
        self.said.extend(self.lines.iter());
        (code, self.said.join("\n"))
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

pub(crate) fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

fn pictures() -> Vec<Vec<u8>> {
    (0..PICTURES).map(|i| limb(320, 240, i as f64 * 0.4).into_raw()).collect()
}

/// Returns the rows of recordings in the log, in order.
fn logged(place: &Place) -> Vec<Vec<(String, String)>> {
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(place.path("state/log")).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let mut rows = Vec::new();
    for file in files {
        assert_eq!(file.extension().unwrap(), "mcap", "{}", file.display());
        let info = place.run(&["info", file.to_str().unwrap()]).out;
        assert!(info.contains("recording of hzn fly"), "{info}");
        place.run(&["export", file.to_str().unwrap(), "-o", "log.csv", "--force"]).expect(0);
        rows.extend(place.rows("log.csv"));
    }
    rows
}

/// Returns the cells of a row that are the answer; `all` with those that telemetry does not have.
fn answer(row: &[(String, String)], all: bool) -> Vec<(String, String)> {
    let end = row.iter().position(|(name, _)| name == "detail").unwrap() + 1;
    let cells = row.iter().take(if all { row.len() } else { end });
    cells.filter(|(name, _)| !NOT_ANSWER.contains(&name.as_str())).cloned().collect()
}

fn axis(row: &[(String, String)]) -> [f64; 3] {
    ["axis_x", "axis_y", "axis_z"].map(|name| cell(row, name).parse().unwrap())
}

/// Feeds pictures to a pipe, 30 a second. `meanwhile` is called after each one.
fn feed(pipe: &mut ChildStdin, pictures: &[Vec<u8>], mut meanwhile: impl FnMut(usize)) {
    for (i, picture) in pictures.iter().enumerate() {
        pipe.write_all(picture).unwrap();
        std::thread::sleep(PERIOD);
        meanwhile(i);
    }
}

#[test]
fn a_flight_with_commands_and_a_crash() {
    let place = Place::new();
    let pictures = pictures();
    let port = free_port();
    let (listen, connect) = (format!("tcp-listen:127.0.0.1:{port}"), format!("tcp:127.0.0.1:{port}"));
    let fly =
        || Running::start(place.command(&["fly", "-", "-s", "in/sensor.toml", "--line", &listen, "--state", "state"]));
    let command = |texts: &[&str]| {
        let args: Vec<&str> = ["telecommand", "--to", &connect].iter().chain(texts).copied().collect();
        place.run(&args)
    };

    let mut first = fly();
    first.wait_for("flight mode");
    let mut ground = Running::start(place.command(&["telemetry", &connect, "-o", "sent.csv", "--send", "report"]));
    ground.wait_for("report: done");
    command(&["mode standby", "set consensus.threshold_px 2.5", "mode flight"]).expect(0).says("mode flight: done");
    let mut pipe = first.stdin();
    feed(&mut pipe, &pictures[..BEFORE], |i| {
        if i == BEFORE / 2 {
            command(&["ping", "read consensus.threshold_px"]).expect(0).says("consensus.threshold_px = 2.5");
        }
    });
    first.signal(Signal::SIGKILL);
    assert_eq!(first.end().0, None);

    let mut second = fly();
    second.wait_for("answers were recovered");
    second.wait_for("reset by the watchdog");
    // The parameters are those of the first run, although sensor.toml has others.
    second.wait_for("has other values than sensor.toml for consensus.threshold_px");
    ground.wait_for("connected");
    let mut pipe = second.stdin();
    feed(&mut pipe, &pictures[BEFORE..], |_| ());
    command(&["read consensus.threshold_px"]).expect(0).says("consensus.threshold_px = 2.5");
    second.signal(Signal::SIGTERM);
    let (code, said) = second.end();
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("40 pictures, 40 answers; 40 in the log"), "{said}");
    ground.wait_for("flight to shut-down mode");
    ground.signal(Signal::SIGINT);
    let (code, said) = ground.end();
    assert_eq!(code, Some(0), "{said}");
    assert!(!said.contains("not understood") && !said.contains("broken"), "{said}");
    compare_with_run(&place, &pictures);
}

/// Asserts that log and telemetry have the numbers of `hzn run` on the same pictures.
fn compare_with_run(place: &Place, pictures: &[Vec<u8>]) {
    for (i, picture) in pictures.iter().enumerate() {
        let image = image::GrayImage::from_raw(320, 240, picture.clone()).unwrap();
        image.save(place.path(&format!("in/{i:04}.png"))).unwrap();
    }
    let sensor = crate::common::SENSOR.to_owned() + "\n[consensus]\nthreshold_px = 2.5\n";
    place.write("in/sensor.toml", sensor.as_bytes());
    place.run(&["run", "in", "--flight", "-o", "flight.csv"]).expect(0);
    place.run(&["run", "in", "-o", "host.csv"]).expect(0);
    let (flight, host) = (place.rows("flight.csv"), place.rows("host.csv"));
    // A crash loses the answers of at most a quarter of a second, and those that wait for the disk.
    let rows = logged(place);
    let before = rows.len().checked_sub(PICTURES - BEFORE).unwrap();
    assert!((BEFORE / 2..=BEFORE).contains(&before), "{before}");
    for (place, row) in rows.iter().enumerate() {
        let (picture, number) = if place < before { (place, place) } else { (BEFORE + place - before, place - before) };
        assert_eq!(cell(row, "file"), format!("frame-{number:06}"));
        assert_eq!(answer(row, true), answer(&flight[picture], true), "picture {picture}");
        // Double precision with longer lists gives the same direction to a thousandth of a degree.
        let (a, b) = (axis(row), axis(&host[picture]));
        let apart: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt().to_degrees();
        assert!(apart < 1e-3, "picture {picture}: {apart}");
    }
    let sent = place.rows("sent.csv");
    assert!(sent.len() >= PICTURES - 10, "{}", sent.len());
    let mut expected = flight.iter();
    for row in &sent {
        let row = answer(row, false);
        assert!(expected.any(|flight| answer(flight, false) == row), "{row:?}");
    }
}

/// Runs a flight on these bytes without a line.
fn fly_on(place: &Place, bytes: &[u8], args: &[&str]) -> (Option<i32>, String) {
    let all: Vec<&str> = ["fly", "-", "--state", "state"].iter().chain(args).copied().collect();
    let mut flight = Running::start(place.command(&all));
    // A program that has ended with an error does not read.
    let _ = flight.stdin().write_all(bytes);
    flight.end()
}

#[test]
fn a_computer_with_a_key_refuses_strangers_and_replays() {
    let place = Place::new();
    place.run(&["key", "ground.key", "--spacecraft", "42"]).expect(0).says("key 1 of spacecraft 42; counter 0");
    std::fs::create_dir(place.path("air")).unwrap();
    for ending in ["key", "key.counter"] {
        std::fs::copy(place.path(&format!("ground.{ending}")), place.path(&format!("air/air.{ending}"))).unwrap();
    }
    place.run(&["key", "other.key", "--spacecraft", "42"]).expect(0);
    let port = free_port();
    let (listen, connect) = (format!("tcp-listen:127.0.0.1:{port}"), format!("tcp:127.0.0.1:{port}"));
    let args = ["fly", "-", "-s", "in/sensor.toml", "--line", &listen, "--state", "state", "--key", "air/air.key"];
    let send = |key: Option<&str>, text: &str| {
        let key = key.map(|key| ["--key", key]);
        let args: Vec<&str> =
            ["telecommand", "--to", &connect, text].into_iter().chain(key.into_iter().flatten()).collect();
        place.run(&args)
    };
    let mut first = Running::start(place.command(&args));
    first.wait_for("flight mode");
    send(None, "mode safe").expect(1).says("mode safe: not authenticated");
    send(None, "ping").expect(0).says("ping: done");
    send(Some("other.key"), "mode safe").expect(1).says("the code of the trailer is wrong");
    send(Some("ground.key"), "mode standby").expect(0).says("mode standby: done");
    first.signal(Signal::SIGKILL);
    first.end();
    let mut second = Running::start(place.command(&args));
    second.wait_for("flight mode");
    // The counters that were reserved before the crash are refused, and the ground goes on behind them.
    send(Some("ground.key"), "mode standby").expect(0).says("mode standby: done");
    // A replay of the packet that was sent, as bytes.
    place.run(&["telecommand", "mode safe", "--key", "ground.key", "-o", "safe.bin"]).expect(0);
    let replay = || {
        let mut line = std::net::TcpStream::connect(("127.0.0.1", port)).unwrap();
        line.write_all(&std::fs::read(place.path("safe.bin")).unwrap()).unwrap();
        std::thread::sleep(Duration::from_millis(600));
    };
    replay();
    second.wait_for("safe mode");
    send(Some("ground.key"), "mode standby").expect(0);
    replay();
    second.signal(Signal::SIGTERM);
    let (code, said) = second.end();
    // One refusal after the crash, and one of the replay.
    let count = |text| said.matches(text).count();
    assert_eq!((code, count("safe mode"), count("telecommand rejected (15, 1)")), (Some(0), 1, 2), "{said}");
    // A damaged key closes the line, and the flight begins nevertheless.
    std::fs::write(place.path("air/air.key"), "damaged").unwrap();
    let mut third = Running::start(place.command(&args));
    third.wait_for("air.key: is no key, or is damaged");
    third.wait_for("flight mode");
    send(Some("ground.key"), "mode standby").expect(1).says("the keys of the computer cannot be used");
    send(None, "ping").expect(0);
}

#[test]
fn bad_input_is_told() {
    let place = Place::new();
    let picture = limb(320, 240, 0.0).into_raw();
    let three = [&picture[..], &limb(320, 240, 1.0).into_raw(), &picture[..1000]].concat();
    let (code, said) = fly_on(&place, &picture, &[]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("no parameters are stored yet: give --sensor FILE once"), "{said}");
    let (code, said) = fly_on(&place, &three, &["-s", "in/sensor.toml"]);
    assert_eq!(code, Some(3), "{said}");
    assert!(said.contains("the last picture has 1000 of 76800 bytes"), "{said}");
    assert!(said.contains("2 pictures, 2 answers; 2 in the log"), "{said}");
    // Now the parameters are there.
    assert_eq!(fly_on(&place, &picture, &[]).0, Some(0));
    let (code, said) = fly_on(&place, &[0; 4 * 80 * 60], &["--raw", "80x60:mono8"]);
    assert_eq!(code, Some(3), "{said}");
    assert!(said.contains("4 pictures refused without an answer"), "{said}");
    let (turned_code, turned) = fly_on(&place, &picture, &["--raw", "240x320:mono8"]);
    assert!(turned_code == Some(2) && turned.contains("240x320 have as many pixels"), "{turned}");
    assert!(said.contains("pictures of 80x60, but the camera of the parameters has 320x240"), "{said}");
    assert!(said.contains("picture of wrong size") && said.contains("0 pictures"), "{said}");
}

#[test]
fn kept_pictures_have_the_logged_answers() {
    let place = Place::new();
    // The pictures 3, 7 and 11 are dark and have no answer.
    let picture = |i: usize| if i % 4 == 3 { vec![0; 320 * 240] } else { limb(320, 240, i as f64 * 0.4).into_raw() };
    let bytes: Vec<u8> = (0..14).flat_map(picture).collect();
    let (code, said) = fly_on(&place, &bytes, &["-s", "in/sensor.toml", "--keep-pictures", "5,refused"]);
    assert!(code == Some(0) && said.contains("14 pictures, 11 answers") && said.contains("6 pictures kept"), "{said}");
    place.run(&["run", "state/pictures/fly-000001.mcap", "--flight", "-o", "again.csv"]).expect(0);
    let info = place.run(&["info", "state/pictures/fly-000001.mcap"]).expect(0).out;
    assert!(info.contains("pictures that hzn fly kept, with their answers"), "{info}");
    let (again, logged) = (place.rows("again.csv"), logged(&place));
    let files: Vec<&str> = again.iter().map(|row| cell(row, "file")).collect();
    let kept = [0, 3, 5, 7, 10, 11];
    assert_eq!(files, kept.map(|n| format!("frame-{n:06}")));
    for (n, row) in kept.iter().zip(&again) {
        assert_eq!(answer(row, true), answer(&logged[*n], true), "picture {n}");
    }
    for (which, says) in [("0", "a number from 1 on"), ("all", "25,refused")] {
        let (code, said) = fly_on(&place, &[], &["--keep-pictures", which]);
        assert!(code == Some(2) && said.contains(says), "{said}");
    }
    place.write("big.toml", crate::common::SENSOR.replace("320", "2000").replace("240", "1500").as_bytes());
    let big = ["--load", "-s", "big.toml", "--keep-pictures", "1", "--pictures-mb", "20"];
    let (code, said) = fly_on(&place, &[], &big);
    assert!(code == Some(2) && said.contains("pictures of 2000x1500 need at least --pictures-mb 25"), "{said}");
}

/// A camera that stands still, and one that gives two buffers in turn.
#[test]
fn old_pictures_have_no_answer() {
    for shown in [[0, 1, 2, 2, 2, 3], [0, 1, 2, 1, 2, 3]] {
        let place = Place::new();
        let bytes: Vec<u8> = shown.iter().flat_map(|&i| limb(320, 240, f64::from(i)).into_raw()).collect();
        let (code, said) = fly_on(&place, &bytes, &["-s", "in/sensor.toml"]);
        assert_eq!((code, said.matches("fixed in the picture").count()), (Some(0), 2), "{said}");
        for (i, row) in logged(&place).iter().enumerate() {
            let is_new = !shown[..i].contains(&shown[i]);
            assert_eq!(cell(row, "status") == "ok", is_new, "{shown:?} {i}: {row:?}");
        }
    }
}

/// A camera that stands still, but counts its pictures in the first pixel, has the rows of a run, without answers.
#[test]
fn an_old_limb_with_a_counter_has_no_answer() {
    let place = Place::new();
    let picture = |i: u8| {
        let mut picture = limb(320, 240, f64::from(i.min(2)));
        picture.get_pixel_mut(0, 0).0[0] = i;
        picture
    };
    let bytes: Vec<u8> = (0..6).flat_map(|i| picture(i).into_raw()).collect();
    let mut table = String::from("file,time_s\n");
    for i in 0..6 {
        picture(i).save(place.path(&format!("in/{i:04}.png"))).unwrap();
        table += &format!("{i:04}.png,{i}\n");
    }
    place.write("in/frames.csv", table.as_bytes());
    place.run(&["run", "in", "--flight", "-o", "run.csv"]).expect(0);
    let (code, said) = fly_on(&place, &bytes, &["-s", "in/sensor.toml"]);
    assert_eq!((code, said.matches("fixed in the picture").count()), (Some(0), 3), "{said}");
    let (run, flown) = (place.rows("run.csv"), logged(&place));
    let of = |rows: &[Vec<(String, String)>]| rows.iter().map(|row| cell(row, "status").to_owned()).collect::<Vec<_>>();
    assert_eq!(of(&run), ["ok", "ok", "ok", "rejected", "rejected", "rejected"]);
    assert_eq!(of(&flown), of(&run));
}

#[test]
fn settings_that_cannot_be_are_told() {
    let place = Place::new();
    assert_eq!(fly_on(&place, &[], &["-s", "in/sensor.toml"]).0, Some(0));
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let line = format!("tcp-listen:{}", taken.local_addr().unwrap());
    let (code, said) = fly_on(&place, &[], &["--line", &line]);
    assert!(code == Some(1) && said.contains("another program uses the port"), "{said}");
    let (code, said) = fly_on(&place, &[], &["--line", "udp:127.0.0.1:5001"]);
    assert!(code == Some(2) && said.contains("udp needs the ground's address too"), "{said}");
    place.run(&["fly", "/dev/no-camera", "--state", "state"]).expect(1).says("/dev/no-camera");
    // Each --key takes one file, so that the source may follow it.
    let key = ["--key", "a.key"];
    place.run(&[&["fly"], &key[..], &["/dev/no-camera", "--state", "state"]].concat()).expect(1).says("/dev/no-camera");
    place.run(&[&["fly"], &key[..], &key, &key, &["-"]].concat()).expect(2).says("a computer has at most 2");
    place.run(&["telemetry", "in", "--screen"]).expect(2).says("need a line");
    place.run(&["telecommand", "--to", "tcp:127.0.0.1:1", "ping"]).expect(1).says("nobody listens there");
    place.run(&["telemetry", "tcp:127.0.0.1"]).expect(2).says("must be HOST:PORT");
    place.write("turned.toml", (crate::common::SENSOR.to_owned() + "[input]\norient = \"rotate-90\"\n").as_bytes());
    let (code, said) = fly_on(&place, &[], &["-s", "turned.toml", "--load"]);
    assert!(code == Some(2) && said.contains("input.orient"), "{said}");
}

#[test]
fn a_power_failure_closes_the_log_and_waits() {
    let place = Place::new();
    let mut flight = Running::start(place.command(&["fly", "-", "-s", "in/sensor.toml", "--state", "state"]));
    let mut pipe = flight.stdin();
    pipe.write_all(&limb(320, 240, 0.0).into_raw()).unwrap();
    flight.wait_for("flight mode");
    place.run(&["fly", "-", "--state", "state"]).expect(1).says("another `hzn fly` uses this folder");
    std::thread::sleep(2 * PERIOD);
    flight.signal(Signal::SIGPWR);
    flight.wait_for("the log is closed, and power may be cut");
    assert_eq!(logged(&place).len(), 1);
    assert!(flight.child.try_wait().unwrap().is_none());
    flight.signal(Signal::SIGTERM);
    let (code, said) = flight.end();
    assert!(code == Some(0) && said.contains("1 pictures, 1 answers"), "{said}");
}

/// The limb of a sequence is tracked in the same pictures as by `hzn run`, with the same bits.
#[test]
fn a_tracked_flight_has_the_rows_of_a_run() {
    let place = Place::new();
    let sensor = crate::common::SENSOR.to_owned() + "\n[track]\nfull_every = 5\n";
    place.write("in/sensor.toml", sensor.as_bytes());
    let shift = |i: usize| i as f64 * 8.0 - if i >= 12 { 300.0 } else { 0.0 };
    // Picture 3 is dark, and picture 12 is a leap.
    let picture = |i: usize| if i == 3 { vec![20; 320 * 240] } else { limb(320, 240, shift(i)).into_raw() };
    let pictures: Vec<Vec<u8>> = (0..16).map(picture).collect();
    for (i, picture) in pictures.iter().enumerate() {
        let image = image::GrayImage::from_raw(320, 240, picture.clone()).unwrap();
        image.save(place.path(&format!("in/{i:04}.png"))).unwrap();
    }
    place.run(&["run", "in", "--flight", "-j", "3", "-o", "run.csv"]).expect(0);
    let run = place.rows("run.csv");

    let port = free_port();
    let (listen, connect) = (format!("tcp-listen:127.0.0.1:{port}"), format!("tcp:127.0.0.1:{port}"));
    let args = ["fly", "-", "-s", "in/sensor.toml", "--line", &listen, "--state", "state"];
    let mut flight = Running::start(place.command(&args));
    flight.wait_for("flight mode");
    let mut ground = Running::start(place.command(&["telemetry", &connect, "-o", "sent.csv", "--send", "report"]));
    ground.wait_for("report: done");
    let mut pipe = flight.stdin();
    // Without pauses, because a pause of a second on a busy machine would be a gap.
    pipe.write_all(&pictures.concat()).unwrap();
    drop(pipe);
    let (code, said) = flight.end();
    assert!(code == Some(0) && said.contains("16 pictures, 15 answers"), "{said}");
    ground.signal(Signal::SIGINT);
    assert_eq!(ground.end().0, Some(0));

    let tracked = |rows: &[Vec<(String, String)>]| -> Vec<usize> {
        (0..rows.len()).filter(|&i| cell(&rows[i], "tracked") == "true").collect()
    };
    assert_eq!(tracked(&run), [1, 2, 6, 7, 8, 9, 11, 13, 14]);
    let (log, sent) = (logged(&place), place.rows("sent.csv"));
    assert_eq!((tracked(&log), tracked(&sent)), (tracked(&run), tracked(&run)));
    for (all, rows) in [(true, &log), (false, &sent)] {
        let [there, here] = [rows, &run].map(|rows| rows.iter().map(|row| answer(row, all)).collect::<Vec<_>>());
        assert_eq!(there, here);
    }
}
