//! Everything that an observer sees of drawn pictures with drawn options, as digits.
//!
//! The other tests say what is right. These notice that something is different, in every stage and with every option:
//! the options of each picture are drawn, and so is what it shows. A row of a table has the verdicts and the answer in
//! plain digits, and a digest of the rest: the course of the stages, the pixels that were read, the edge points, their
//! weights, the fits with their error budgets, and the evidence. A column that differs names the stage that changed.
//! `HZN_BLESS=1 cargo test --test core varied` writes the tables again.

#[cfg(feature = "_edges")]
mod apart;
mod discs;
mod journal;
mod limbs;
mod options;
mod sequences;

use std::fmt::Write as _;

use hzn_core::camera::{self, Camera};
use hzn_core::image::{Grey, Layout, Pixels};
use hzn_core::pixel::ImagePoint;
use hzn_core::real::Real;
use hzn_core::{Config, Horizon, Observer, Prior, Report};

use crate::digits::compare_with_committed;
use crate::drawn::Noise;
use journal::Journal;

/// Draws choices. The numbers are those of every machine.
struct Dice(u64);

impl Dice {
    fn new(seed: u64) -> Self {
        let mut dice = Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        // The first numbers of neighbouring seeds are alike.
        (0..8).for_each(|_| dice.0 ^= u64::from(dice.number()));
        dice
    }
    fn number(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as u32
    }
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * f64::from(self.number()) / f64::from(1u32 << 31)
    }
    fn one_in(&mut self, n: u32) -> bool {
        self.number().is_multiple_of(n)
    }
    fn pick<X: Copy>(&mut self, all: &[X]) -> X {
        all[self.number() as usize % all.len()]
    }
    fn normal(&mut self) -> f64 {
        Noise(self.0 ^ u64::from(self.number())).normal()
    }
}

type V3 = [f64; 3];

fn dot(a: V3, b: V3) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn unit(v: V3) -> V3 {
    let length = dot(v, v).sqrt();
    v.map(|x| x / length)
}

fn cross(a: V3, b: V3) -> V3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn sum<const N: usize>(parts: [(f64, V3); N]) -> V3 {
    [0, 1, 2].map(|k| parts.iter().map(|(factor, v)| factor * v[k]).sum())
}

fn angle(a: V3, b: V3) -> f64 {
    let chord = sum([(1.0, a), (-1.0, b)]);
    2.0 * libm::asin((0.5 * dot(chord, chord).sqrt()).min(1.0))
}

/// Returns the direction with an angle off the optical axis and an azimuth.
fn direction(off_axis: f64, azimuth: f64) -> V3 {
    let ((s, c), (sa, ca)) = (libm::sincos(off_axis), libm::sincos(azimuth));
    [s * ca, s * sa, c]
}

/// What a picture shows: the light in each direction, or 0 beyond the lens.
struct Canvas {
    camera: Camera<f64>,
    size: [u32; 2],
}

impl Canvas {
    fn new(config: &camera::Config) -> Self {
        let camera = Camera::try_new(config).unwrap();
        Self { camera, size: [config.width, config.height].map(u32::from) }
    }

    fn ray(&self, u: f64, v: f64) -> Option<V3> {
        Some(self.camera.unproject(ImagePoint { u, v })?.xyz())
    }

    /// Draws the light (in counts) of each direction and pixel, with noise.
    fn draw(&self, sigma: f64, seed: u64, mut light: impl FnMut(Option<V3>, [f64; 2]) -> f64) -> Vec<u8> {
        let mut noise = Noise(seed);
        let [width, height] = self.size;
        (0..width * height)
            .map(|i| {
                let [u, v] = [f64::from(i % width), f64::from(i / width)];
                let counts = light(self.ray(u, v), [u, v]) + if sigma > 0.0 { sigma * noise.normal() } else { 0.0 };
                counts.round().clamp(0.0, 255.0) as u8
            })
            .collect()
    }
}

/// The table of a test.
struct Table {
    name: &'static str,
    lines: String,
    answers: u32,
}

impl Table {
    fn new(name: &'static str) -> Self {
        Self { name, lines: String::new(), answers: 0 }
    }

    /// Adds the row of a picture.
    fn add<T: Real>(&mut self, what: &str, report: &Report<T>, journal: &Journal) {
        let verdicts: Vec<&str> = report.candidates.iter().map(|edge| edge.verdict.name()).collect();
        write!(self.lines, "{what},{},{},{}", report.status, report.level, verdicts.join(" ")).unwrap();
        let counters = &report.counters;
        let counts = [counters.followed, counters.candidates, counters.dropped, counters.fallback_points];
        counts.iter().for_each(|n| write!(self.lines, ",{n}").unwrap());
        let counts = [counters.edge_points, counters.sampled, counters.draws, counters.work, counters.looks];
        counts.iter().for_each(|n| write!(self.lines, ",{n}").unwrap());
        write!(self.lines, "{}", journal.digests()).unwrap();
        if let Some(found) = &report.solution {
            self.answers += 1;
            let [x, y, z] = found.axis.xyz();
            let numbers = [x, y, z, found.covariance.sigma_max_rad(), found.noise_rad(), found.half_angle_rad];
            numbers.iter().for_each(|number| write!(self.lines, ",{:.7e}", number.to_f64()).unwrap());
            write!(self.lines, ",{:08x}", journal::digest_of(&format!("{found:?}"))).unwrap();
        }
        self.lines.push('\n');
    }

    /// Makes a sensor. Options that contradict each other have a row with the key that is refused.
    fn sensor<T: Real, const A: usize, const B: usize, const C: usize>(
        &mut self,
        what: &str,
        config: &Config,
    ) -> Option<Box<Horizon<T, A, B, C>>> {
        match Horizon::boxed(config) {
            Ok(horizon) => Some(horizon),
            Err(error) => {
                writeln!(self.lines, "{what},{}", error.field).unwrap();
                None
            }
        }
    }

    /// Processes a picture and adds its row.
    fn process<T: Real, P: Pixels, const A: usize, const B: usize, const C: usize>(
        &mut self,
        what: &str,
        horizon: &mut Horizon<T, A, B, C>,
        picture: &P,
        prior: &Prior<T>,
    ) {
        match horizon.expect(prior) {
            Ok(expected) => {
                let journal = Journal::default();
                // Behind a pointer, so that other tests share the compiled pipeline.
                let report = horizon.process_observed(picture, &expected, &(&journal as &dyn Observer<T>));
                self.add(what, &report, &journal);
            }
            Err(error) => writeln!(self.lines, "{what},{error}").unwrap(),
        }
    }

    fn check(&self) {
        println!("{}: {} answers of {}", self.name, self.answers, self.lines.lines().count());
        compare_with_committed("varied", self.name, &self.lines);
    }
}

/// Returns the picture of these counts.
fn grey<'a>(config: &Config, counts: &'a [u8]) -> Grey<'a, u8> {
    let layout = Layout::packed(config.camera.width.into(), config.camera.height.into(), 1, 8);
    Grey::try_new(counts, layout).unwrap()
}
