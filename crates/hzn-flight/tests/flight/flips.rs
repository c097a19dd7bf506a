//! Flipped bits and stuck runs of pixels: no answer that is sent may be a confident lie.
//!
//! The gate runs a small part. `HZN_FLIPS=20000 cargo test -p hzn-flight --test flight -- --nocapture flips::`, or
//! `cargo xtask campaign flips`, runs the whole.

use hzn_core::image::{Grey, Layout};
use hzn_core::observer::Unobserved;
use hzn_core::{FlightWorkspace, Prior, Sensor};
use hzn_flight::flight::Flight;
use hzn_flight::messages::{Function, Mode};
use hzn_flight::{Parameters, table};

use crate::bench::{Bench, HEIGHT, WIDTH, command, fly, ready, send, stored, take_sent};

/// Number of trials of each kind.
fn trials() -> u32 {
    std::env::var("HZN_FLIPS").ok().and_then(|n| n.parse().ok()).unwrap_or(300)
}

/// A generator of random numbers: SplitMix64.
struct Random(u64);

impl Random {
    fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z ^ (z >> 31)) % end
    }
    fn unit(&mut self) -> f64 {
        self.below(1 << 52) as f64 / (1u64 << 52) as f64
    }
}

/// Returns a picture with clouds and noise: two in three show a limb at 230 km with the axis 70 to 79 degrees off,
/// rolled by up to 60 degrees; the others show sky or ground alone.
fn picture(random: &mut Random) -> Vec<u8> {
    let only = match random.below(6) {
        0 => Some(-1.0),
        1 => Some(1.0),
        _ => None,
    };
    let (tilt, roll) = ((70.0 + 9.0 * random.unit()).to_radians(), (120.0 * random.unit() - 60.0).to_radians());
    let (noise, waves) = (1.0 + 4.0 * random.unit(), 20.0 + 40.0 * random.unit());
    let phase = 6.0 * random.unit();
    let axis = [tilt.sin() * roll.sin(), tilt.sin() * roll.cos(), tilt.cos()];
    let pixel = |i: usize| {
        let (x, y) = (((i % WIDTH) as f64 - 319.5) / 600.0, ((i / WIDTH) as f64 - 239.5) / 600.0);
        let along = (x * axis[0] + y * axis[1] + axis[2]) / (x * x + y * y + 1.0).sqrt();
        let inside = only.unwrap_or(((along - 74.8f64.to_radians().cos()) * 600.0).clamp(-1.0, 1.0));
        let clouds = 25.0 * (waves * x + phase).sin() * (waves * y).cos();
        // The sum of four even numbers is nearly Gaussian.
        let even: f64 = (0..4).map(|_| random.unit() - 0.5).sum();
        let lit = 0.5 + 0.5 * inside;
        (12.0 + lit * (140.0 + clouds) + noise * (0.4 + lit) * even * 1.7).clamp(0.0, 255.0) as u8
    };
    (0..WIDTH * HEIGHT).map(pixel).collect()
}

/// An answer: its axis and its larger standard deviation.
type Answer = ([f64; 3], f64);

/// Returns the answer that the flight computer sends to a picture.
fn answer(f: &mut Flight<'_, Bench>, pixels: Vec<u8>) -> Option<Answer> {
    f.board().pictures.push_back((pixels, 0));
    f.turn();
    let direction = take_sent(f).science.first()?.1.direction?;
    // The trace of a covariance of rank 2 is at least its larger part.
    let [xx, _, _, yy, _, zz] = direction.cov.map(f64::from);
    Some((direction.axis.map(f64::from), (xx + yy + zz).sqrt()))
}

/// Returns whether an answer is more than 1 degree and 5 sigma off, or is one to a picture without a limb.
fn is_lie((axis, sigma): Answer, truth: Option<Answer>) -> bool {
    let Some((truth, _)) = truth else { return true };
    let cross = [
        axis[1] * truth[2] - axis[2] * truth[1],
        axis[2] * truth[0] - axis[0] * truth[2],
        axis[0] * truth[1] - axis[1] * truth[0],
    ];
    let off = cross.iter().map(|x| x * x).sum::<f64>().sqrt().min(1.0).asin();
    off > 1f64.to_radians() && off > 5.0 * sigma
}

/// Answers and lies, with the checks of the flight software and of the sensor alone.
#[derive(Debug, Default)]
struct Counts {
    clean: u32,
    answers: u32,
    lies: u32,
    answers_alone: u32,
    lies_alone: u32,
    /// Answers that were not sent, because their limb was stuck.
    stuck: u32,
}

/// Flies pictures with faults, with an altitude that is known this well.
fn fly_with(trials: u32, altitude_sigma_km: f64, fault: impl Fn(&mut Random, &mut [u8])) -> Counts {
    let mut parameters = table::read(&stored(2)).unwrap().0;
    parameters.set(33, altitude_sigma_km).unwrap();
    let sensor = Sensor::<f32>::new(&parameters.sensor).unwrap();
    let expected = sensor.expect(&Prior::default()).unwrap();
    let mut workspace = Box::new(FlightWorkspace::new());
    fly(ready(), |f| {
        let set = command(1, Function::SetParameters, |w| {
            w.u8(1);
            w.u16(33);
            w.f64(altitude_sigma_km);
        });
        send(f, &set);
        send(f, &command(2, Function::SetMode, |w| w.u8(Mode::Flight as u8)));
        let mut random = Random(7);
        let mut c = Counts::default();
        for n in 0..trials {
            // A clean picture is used ten times. The gate of the rate must not know its answer.
            let clean = picture(&mut Random(u64::from(n / 10) + 1000));
            let truth = answer(f, clean.clone());
            c.clean += u32::from(truth.is_some());
            f.board().now_us += 3_600_000_000;
            let mut faulty = clean;
            fault(&mut random, &mut faulty);
            let grey = Grey::try_new(&faulty, Layout::packed(WIDTH as u32, HEIGHT as u32, 1, 8)).unwrap();
            let report = sensor.process(&mut *workspace, &grey, &expected, &Unobserved);
            if let Some(s) = &report.solution {
                let axis = s.axis.xyz().map(f64::from);
                c.answers_alone += 1;
                c.lies_alone += u32::from(is_lie((axis, f64::from(s.covariance.sigma_max_rad())), truth));
            }
            if let Some(found) = answer(f, faulty) {
                c.answers += 1;
                c.lies += u32::from(is_lie(found, truth));
            }
            f.board().now_us += 3_600_000_000;
        }
        c.stuck = send(f, &command(2, Function::Report, |_| ())).housekeeping[0].stuck;
        c
    })
}

#[test]
fn a_flipped_bit_of_the_picture_makes_no_lie() {
    let flip = |random: &mut Random, pixels: &mut [u8]| {
        let at = random.below(pixels.len() as u64) as usize;
        pixels[at] ^= 1 << random.below(8);
    };
    let c = fly_with(trials(), 2.0, flip);
    println!("frame: {} flips, {c:?}", trials());
    assert!(c.answers * 10 > c.clean * 9 && c.lies == 0 && c.clean * 2 > trials(), "{c:?}");
}

#[test]
fn stuck_runs_of_pixels_make_few_lies() {
    let stick = |random: &mut Random, pixels: &mut [u8]| {
        for _ in 0..1 + random.below(4) {
            let at = random.below(pixels.len() as u64) as usize;
            let value = if random.below(2) == 0 { pixels[at] } else { random.below(256) as u8 };
            if random.below(2) == 0 {
                // 16 to 20 000 pixels one after another, short runs as often as long ones.
                let length = (16.0 * 1250f64.powf(random.unit())) as usize;
                let end = (at + length).min(pixels.len());
                pixels[at..end].fill(value);
            } else {
                // A block of 16 to 640 columns and 1 to 200 rows.
                let (columns, rows) = (16 + random.below(625) as usize, (200f64.powf(random.unit())) as usize);
                for row in pixels[at / WIDTH * WIDTH..].chunks_mut(WIDTH).take(rows) {
                    let first = (at % WIDTH).min(WIDTH - 16);
                    row[first..(first + columns).min(WIDTH)].fill(value);
                }
            }
        }
    };
    for altitude_sigma_km in [2.0, 100.0] {
        let half = trials() / 2;
        let c = fly_with(half, altitude_sigma_km, stick);
        println!("stuck, altitude +- {altitude_sigma_km} km: {half} pictures, {c:?}");
        assert!(c.answers * 3 > half && c.lies * 1000 <= c.answers, "{c:?}");
    }
}

#[test]
fn a_flipped_bit_of_the_stored_parameters_is_not_used() {
    let mut random = Random(9);
    let good = stored(2);
    let (right, generation) = table::read(&good).unwrap();
    for _ in 0..trials() {
        let mut bytes = good.clone();
        let at = random.below(bytes.len() as u64) as usize;
        bytes[at] ^= 1 << random.below(8);
        assert!(table::read(&bytes).is_err(), "byte {at}");
    }
    assert_eq!((right, generation), {
        let mut p = Parameters::defaults();
        p.set(33, 2.0).unwrap();
        (p, 2)
    });
    println!("stored parameters: {} flips, all seen", trials());
}
