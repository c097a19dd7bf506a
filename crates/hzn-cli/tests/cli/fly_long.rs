//! A long flight at sixty pictures a second: nothing is lost, and no event is false.
#![cfg(target_os = "linux")]

use std::io::Write;
use std::process::Command;
use std::time::{Duration, Instant};

use crate::common::{Place, limb};
use crate::fly::{Running, free_port};
use nix::sys::signal::Signal;

/// Time between two pictures: 60 a second.
const PERIOD: Duration = Duration::from_micros(16_667);
/// Most time by which a picture comes too late.
const JITTER_US: u64 = 12_000;
/// A camera that is silent for this time is told.
const SILENT: Duration = Duration::from_millis(900);

/// Returns 24 pictures of 1920×1080 from a rocket's flight, and the name of their sensor.
fn rocket(place: &Place) -> (Vec<Vec<u8>>, &'static str) {
    place.run(&["simulate", "rocket", "-o", "sim", "--frames", "24", "--no-noise", "-q"]).expect(0);
    let sensor = place.read("sim/sensor.toml");
    let known = "altitude_km = 200.0\naltitude_sigma_km = 60.0";
    let lines = sensor.lines().map(|line| if line.starts_with("altitude_sigma_km") { known } else { line });
    place.write("sim/sensor.toml", lines.collect::<Vec<_>>().join("\n").as_bytes());
    let mut files: Vec<_> = std::fs::read_dir(place.path("sim")).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|end| end == "jpg" || end == "png"));
    files.sort();
    let pictures: Vec<_> = files.iter().map(|path| image::open(path).unwrap().into_luma8().into_raw()).collect();
    assert_eq!(pictures.len(), 24);
    (pictures, "sim/sensor.toml")
}

/// Noise of one count, which makes each picture a new one: the flight software refuses a picture that it has seen.
struct Noise {
    bits: Vec<u8>,
    random: u64,
}

impl Noise {
    fn new(pixels: usize) -> Self {
        let mut noise = Self { bits: Vec::new(), random: 1 };
        noise.bits = (0..2 * pixels).map(|_| (noise.next() & 1) as u8).collect();
        noise
    }
    fn next(&mut self) -> u64 {
        self.random = self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.random >> 33
    }
    /// Writes the picture with noise into `noisy`. Words of eight pixels are fast enough for a picture in a 60th of a
    /// second.
    fn add(&mut self, picture: &[u8], noisy: &mut [u8]) {
        let from = self.next() as usize % picture.len();
        let words = picture.as_chunks::<8>().0.iter().zip(self.bits[from..].as_chunks::<8>().0);
        for (to, (pixels, bits)) in noisy.as_chunks_mut::<8>().0.iter_mut().zip(words) {
            *to = (u64::from_ne_bytes(*pixels) ^ u64::from_ne_bytes(*bits)).to_ne_bytes();
        }
    }
}

/// Returns the command with the program and the priority that the environment names.
fn as_flown(ours: &Command) -> Command {
    let program = std::env::var_os("HZN_FLY_PROGRAM").unwrap_or_else(|| ours.get_program().to_owned());
    let mut command = match std::env::var("HZN_FLY_PRIORITY") {
        Ok(priority) => {
            let mut with_priority = Command::new("chrt");
            with_priority.args(["-f", &priority]).arg(program);
            with_priority
        }
        Err(_) => Command::new(program),
    };
    command.args(ours.get_args()).current_dir(ours.get_current_dir().unwrap());
    command
}

/// The variable `HZN_FLY_PICTURES` gives a number of pictures of 1920×1080 in place of a few small ones,
/// `HZN_FLY_PROGRAM` the program that flies, because that of the tests is not optimised as a released one is, and
/// `HZN_FLY_PRIORITY` a real-time priority, which the machine must allow.
#[test]
fn a_flight_of_many_pictures_tells_no_fault() {
    let place = Place::new();
    let many = std::env::var("HZN_FLY_PICTURES").ok().map(|count| count.parse::<usize>().expect("a number"));
    let (pictures, sensor) = match many {
        Some(_) => rocket(&place),
        None => ((0..24).map(|i| limb(320, 240, f64::from(i)).into_raw()).collect(), "in/sensor.toml"),
    };
    let count = many.unwrap_or(180);
    let port = free_port();
    let (listen, connect) = (format!("tcp-listen:127.0.0.1:{port}"), format!("tcp:127.0.0.1:{port}"));
    let ours = place.command(&["fly", "-", "-s", sensor, "--line", &listen, "--state", "state"]);
    let mut flight = Running::start(as_flown(&ours));
    flight.wait_for("flight mode");
    let mut ground = Running::start(place.command(&["telemetry", &connect, "-o", "sent.csv", "--send", "report"]));
    ground.wait_for("report: done");
    let mut pipe = flight.stdin();
    let (begin, mut before, mut longest) = (Instant::now(), Instant::now(), Duration::ZERO);
    let (mut noise, mut noisy) = (Noise::new(pictures[0].len()), pictures[0].clone());
    for (number, picture) in pictures.iter().cycle().take(count).enumerate() {
        noise.add(picture, &mut noisy);
        let due = begin + PERIOD * number as u32 + Duration::from_micros(noise.next() % JITTER_US);
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        pipe.write_all(&noisy).unwrap();
        longest = longest.max(before.elapsed());
        before = Instant::now();
    }
    let seconds = begin.elapsed().as_secs_f64();
    drop(pipe);
    let (code, said) = flight.end();
    assert_eq!(code, Some(0), "{said}");
    ground.signal(Signal::SIGINT);
    let (_, heard) = ground.end();
    println!("{count} pictures in {seconds:.0} s, longest pause {:.3} s\n{said}\n{heard}", longest.as_secs_f64());
    assert!(said.contains(&format!("{count} pictures, ")) && said.contains(&format!("; {count} in the log")), "{said}");
    for fault in ["silent", "lost", "late", "overrun", "broken", "refused", "missing"] {
        let found = said.lines().chain(heard.lines()).find(|line| line.contains(fault));
        assert!(found.is_none() || fault == "silent" && longest > SILENT, "{found:?}");
    }
}
