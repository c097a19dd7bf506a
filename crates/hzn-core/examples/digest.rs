//! Prints a checksum of every number in the answers to many pictures, so that processors can be compared:
//! `cargo run --release -p hzn-core --features _programs --example digest -- 2000`

#[path = "../tests/core/common/mod.rs"]
mod common;

use common::{KINDS, garbage};
use hzn_core::camera::{self, Model};
use hzn_core::image::{Grey, Layout};
use hzn_core::status::Status;
use hzn_core::{Config, FlightHorizon, HostHorizon, Prior, Step, Tracker};

const WIDTH: u32 = 96;
const HEIGHT: u32 = 64;
const MODELS: [Model; 2] = [Model::Pinhole, Model::Equidistant];

/// The limb from 300 km: (6371 + 10) / (6371 + 300) is the sine.
const COS_HALF_ANGLE: f64 = 0.291_64;

/// A generator of numbers from 0 to 1.
struct Random(u64);

impl Random {
    fn draw(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f64 / f64::from(1u32 << 24)
    }
}

/// Draws the limb of a body as wide as the Earth at 300 km, with noise. Only operations are used whose result is exact
/// by IEEE 754, so every processor has the same picture.
fn limb(random: &mut Random) -> Vec<u8> {
    // Tangents of half an angle: of the roll, and of the angle between the optical axis and the body.
    let (roll, below) = (0.4 * random.draw() - 0.2, 0.65 + 0.15 * random.draw());
    let sin_cos = |t: f64| (2.0 * t / (1.0 + t * t), (1.0 - t * t) / (1.0 + t * t));
    let ((sin_roll, cos_roll), (sin, cos)) = (sin_cos(roll), sin_cos(below));
    let noise = 10.0 * random.draw();
    let pixel = |i: u32| {
        let (u, v) = ((f64::from(i % WIDTH) - 47.5) / 60.0, (f64::from(i / WIDTH) - 31.5) / 60.0);
        let along = (sin * (sin_roll * u + cos_roll * v) + cos) / (1.0 + u * u + v * v).sqrt();
        let inside_px = (along - COS_HALF_ANGLE) * 60.0;
        (20.0 + 170.0 * (0.5 + inside_px / 2.0).clamp(0.0, 1.0) + noise * random.draw()) as u8
    };
    (0..WIDTH * HEIGHT).map(pixel).collect()
}

fn main() {
    let count: u64 = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(2000);
    let mut random = Random(11);
    let step = Step { after_s: Some(0.1), rate_rad_s: None, attitude: None };
    let (mut text, mut answers, mut tracked, mut sum) = (String::new(), 0, 0, 0u32);
    for model in MODELS {
        let mut config = Config::new(camera::Config::ideal(model, WIDTH as u16, HEIGHT as u16, 60.0));
        config.body.altitude_km = Some(300.0);
        config.edge_points.min_points = 8;
        config.gates.min_inliers = 8;
        config.track.full_every = 1000;
        let mut host = HostHorizon::boxed(&config).expect("the configuration is valid");
        let mut flight = FlightHorizon::boxed(&config).expect("the configuration is valid");
        let (double, single) = (host.expect(&Prior::default()), flight.expect(&Prior::default()));
        let (double, single) = (double.expect("an altitude is known"), single.expect("an altitude is known"));
        for n in 0..count {
            let kind = (n / 4 % u64::from(KINDS)) as u8;
            let bytes = if n % 4 == 0 { garbage(kind, n * 77, (n * 53) as u8) } else { limb(&mut random) };
            let picture = Grey::try_new(&bytes, Layout::packed(WIDTH, HEIGHT, 1, 8)).expect("the picture is whole");
            let (a, b) = (host.process(&picture, &double), flight.process(&picture, &single));
            answers += u32::from(a.status == Status::Ok) + u32::from(b.status == Status::Ok);
            // The picture comes a second time, as if nothing had moved.
            let mut tracker = Tracker::default();
            let _ = flight.track(&mut tracker, &picture, (&single, &step));
            let c = flight.track(&mut tracker, &picture, (&single, &step));
            tracked += u32::from(c.is_tracked());
            // The texts have every bit of a number; they are added to one checksum.
            text.clear();
            text.push_str(&format!("{sum} {a:?} {b:?} {c:?}"));
            sum = crc32(text.as_bytes());
        }
    }
    let lenses = MODELS.len();
    println!(
        "{count} pictures, {lenses} lenses, two precisions: {answers} answers, {tracked} tracked, checksum {sum:08x}"
    );
}

/// Returns the CRC-32 of bytes (ISO-HDLC).
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, _| if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 };
    !bytes.iter().fold(!0, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), step))
}
