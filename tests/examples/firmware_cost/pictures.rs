//! Pictures for the measurement: frames of a rocket, and pictures that are expensive on purpose.

use hzn_core::Preset;
use hzn_core::threshold::Method;
use hzn_core::{Config, Prior, camera};
use hzn_sim::flight::{Flight, rocket};
use hzn_sim::{Disc, FlightFrame, Sky};
use hzn_tests::emulated::Case;

use crate::hostile::hostile_pictures;

/// Number of expensive pictures for the table; `--search` takes others.
const EXPENSIVE_PICTURES: u32 = 64;

/// Pictures of the table.
pub(crate) struct Pictures {
    /// Frames of a rocket, and the Moon at the bottom of a dark sky.
    pub(crate) usual: Vec<Case>,
    /// Expensive pictures of three sensors and of sensors that vary, each with the number of rows in the table.
    pub(crate) expensive: [(Vec<Case>, usize); 4],
    /// Frames for the sensor that takes rows, each group with its name.
    pub(crate) by_rows: [(&'static str, Vec<Case>); 2],
    /// Sequences for the flight image, with tracking.
    pub(crate) sequences: Vec<Sequence>,
}

/// Pictures in order, and their sensor.
pub(crate) struct Sequence {
    pub(crate) name: &'static str,
    pub(crate) sensor: Config,
    pub(crate) pictures: Vec<Vec<u8>>,
}

impl Pictures {
    pub(crate) fn new() -> Self {
        let mut usual = Vec::new();
        for (w, h) in [(640, 480), (1024, 768), (1920, 1080)] {
            for clean in [true, false] {
                usual.extend(frames(w, h, clean, 3));
            }
        }
        for clean in [true, false] {
            usual.extend(frames(1920, 1080, clean, 3).into_iter().map(with_fewer_points));
        }
        usual.push(moon_at_the_bottom());
        let paint = |sensors: &Sensors| paint_expensive_pictures(0..EXPENSIVE_PICTURES, sensors);
        let expensive = [
            (paint(&usual_sensors()), 3),
            (paint(&largest_mask()), 1),
            (paint(&moon()), 1),
            (hostile_pictures(0..EXPENSIVE_PICTURES), 2),
        ];
        let by_rows = [("clean", true), ("cloudy", false)].map(|(kind, clean)| {
            let mut cases = frames(640, 480, clean, 3);
            for case in &mut cases {
                case.sensor.threshold.method = Method::Fixed;
            }
            (kind, cases)
        });
        Self { usual, expensive, by_rows, sequences: sequences() }
    }
}

/// Returns the sequences of the table.
pub(crate) fn sequences() -> Vec<Sequence> {
    let kinds = [("1920×1080 clean", true), ("1920×1080 cloudy", false)];
    let mut sequences: Vec<Sequence> = kinds.map(|(name, clean)| sequence(name, clean)).into();
    sequences.extend(hostile_sequence(&sequences));
    sequences.push(hostile_moon_sequence());
    sequences
}

/// Number of pictures of a sequence; the first one is searched fully.
const IN_SEQUENCE: usize = 9;

/// Returns the first seconds of a rocket's pictures at ten pictures a second, for a sensor that tracks.
fn sequence(name: &'static str, clean: bool) -> Sequence {
    let mut cases = frames_from(rocket(1920, 1080, 3800, 7), clean, IN_SEQUENCE);
    let pictures = cases.iter_mut().map(|case| core::mem::take(&mut case.bytes)).collect();
    let first = cases.swap_remove(0);
    let mut sensor = first.sensor;
    // The flight image has one altitude for the whole sequence.
    sensor.body.altitude_km = first.prior.altitude_m.map(|m| f64::from(m) / 1e3);
    sensor.body.altitude_sigma_km = 2.0;
    sensor.track.full_every = 1000;
    Sequence { name, sensor, pictures }
}

/// Returns the expensive pictures of an ordinary sensor, with a clear limb before each: its limb is looked for in vain.
fn hostile_sequence(sequences: &[Sequence]) -> Option<Sequence> {
    let Sequence { sensor, pictures, .. } = sequences.first()?;
    let limb = pictures.first()?;
    // Two of the most expensive ones of the table are among them.
    let hostile = paint_expensive_pictures(24..36, &usual_sensors());
    let pictures = hostile.into_iter().flat_map(|case| [limb.clone(), case.bytes]).collect();
    Some(Sequence { name: "1920×1080, a limb and a hostile picture in turn", sensor: sensor.clone(), pictures })
}

/// Returns the most expensive pictures of a sensor for the Moon, with the Moon before each.
fn hostile_moon_sequence() -> Sequence {
    let Case { mut sensor, bytes: shown, .. } = moon_at_the_bottom();
    sensor.track.full_every = 1000;
    // The most expensive one of the table is among them.
    let hostile = paint_expensive_pictures(52..58, &moon());
    let pictures = hostile.into_iter().flat_map(|case| [shown.clone(), case.bytes]).collect();
    Sequence { name: "1920×1080, the Moon and a hostile picture in turn", sensor, pictures }
}

/// Returns frames of a rocket's flight, clean or cloudy.
fn frames(width: u16, height: u16, clean: bool, count: usize) -> Vec<Case> {
    frames_from(rocket(width, height, count * 2, 7), clean, count)
}

/// Returns the first frames of a flight that show the limb, clean or cloudy.
fn frames_from(mut flight: Flight, clean: bool, count: usize) -> Vec<Case> {
    let (width, height) = (flight.sensor.camera.width, flight.sensor.camera.height);
    // The lens is scaled by the diagonal, as in the benchmarks, so the image circle stays outside the picture.
    let (w, h) = (f64::from(width), f64::from(height));
    let lens = lens(width, height);
    let sensor = Config { camera: lens.clone(), ..flight.sensor.clone() };
    for frame in &mut flight.frames {
        frame.scene.camera = lens.clone();
        if clean {
            frame.scene.disc = Disc::default();
            frame.scene.sky = Sky { stars: 0, ..frame.scene.sky };
        }
    }
    let shown = |f: &&FlightFrame| f.scene.visible_limb_px().is_ok_and(|px| px > w.min(h) * 0.5);
    let kind = if clean { "clean" } else { "cloudy" };
    let named = |f: &FlightFrame| Case::rendered(format!("{width}×{height} {kind}"), &sensor, f);
    flight.frames.iter().filter(shown).take(count).map(named).collect()
}

/// Sets the number of points that a flight computer keeps when it is short of time.
fn with_fewer_points(mut case: Case) -> Case {
    case.sensor.edge_points.keep_points = 200;
    Case { name: format!("{}, keep_points = 200", case.name), ..case }
}

pub(crate) fn lens(width: u16, height: u16) -> camera::Config {
    let (w, h) = (f64::from(width), f64::from(height));
    let focal_px = 1233.0 * w.hypot(h) / 1920f64.hypot(1080.0);
    let k = [-0.055, 0.011, -0.0035, 0.0002].into_iter().collect();
    camera::Config { k, ..camera::Config::ideal(camera::Model::KannalaBrandt, width, height, focal_px) }
}

/// Makes a picture that is expensive on purpose: it has many edges, and none of them is a limb. The edges are of many
/// kinds, sharp and soft, thin and wide, over noise.
fn paint_expensive_picture(seed: u32, sensors: &Sensors) -> Case {
    let mut draws = 0;
    let mut draw = |n: u32| {
        draws += 1;
        hash_two(seed, draws) % n
    };
    let pattern = PATTERNS[draw(PATTERNS.len() as u32) as usize];
    // Width of one light and one dark stripe together, from 2 to 200 pixels, and their direction.
    let period = f64::from(2 * (1 + draw(10)) * [1, 1, 3, 10][draw(4) as usize]);
    let (sin, cos) = (f64::from(draw(64)) * std::f64::consts::TAU / 64.0).sin_cos();
    let soft = draw(3) == 0;
    let noise = [0, 0, 20, 90][draw(4) as usize];
    let top = [0, 0, 20, 300][draw(4) as usize];
    // The arches lie about the centre of a limb, or about another point.
    let below = [2100, 2100, 600, 9000][draw(4) as usize];
    let (sensor, suffix) = if draw(8) == 0 { &sensors.every_eighth } else { &sensors.usual };
    let bytes = (0..W * H)
        .map(|i| {
            let (x, y) = (i % W, i / W);
            if y < top {
                return 0;
            }
            let (u, v) = (x as f64 - W as f64 / 2.0, y as f64 - H as f64 / 2.0);
            let (along, across) = ((u * cos + v * sin) / period, (v * cos - u * sin) / period);
            let wave = |phase: f64| {
                let phase = phase.rem_euclid(1.0);
                if soft { 0.5 + 0.5 * (phase * std::f64::consts::TAU).cos() } else { f64::from(u8::from(phase < 0.5)) }
            };
            let bright = match pattern {
                Pattern::Comb => wave(along),
                Pattern::Checkerboard => (wave(along) - wave(across)).abs(),
                Pattern::Dots => wave(along) * wave(across),
                Pattern::Spiral => wave(u.hypot(v) / period + v.atan2(u) / std::f64::consts::TAU),
                Pattern::Arches => wave(u.hypot(v - f64::from(below)) / period),
                Pattern::Rays => wave(v.atan2(u) * 1000.0 / period),
                Pattern::Noise => {
                    f64::from(hash_two((along.floor() as i32 as u32) ^ seed, across.floor() as i32 as u32) % 256)
                        / 255.0
                }
                Pattern::Sea => wave(along + (across * 2.0).sin()) * 0.5 + wave(across) * 0.5,
            };
            let grain = hash_two(i as u32, seed) % (noise + 1);
            ((bright * f64::from(255 - noise)) as u32 + grain) as u8
        })
        .collect();
    let kind = format!("{pattern:?}").to_lowercase();
    let name = format!("{kind} of {period} px{}{suffix} (seed {seed})", if soft { ", soft" } else { "" });
    Case { name, sensor: sensor.clone(), prior: Prior::default(), bytes }
}

const W: usize = 1920;
const H: usize = 1080;

#[derive(Debug, Clone, Copy)]
enum Pattern {
    Comb,
    Checkerboard,
    Dots,
    Spiral,
    Arches,
    Rays,
    Noise,
    Sea,
}
const PATTERNS: [Pattern; 8] = [
    Pattern::Comb,
    Pattern::Checkerboard,
    Pattern::Dots,
    Pattern::Spiral,
    Pattern::Arches,
    Pattern::Rays,
    Pattern::Noise,
    Pattern::Sea,
];

/// Hashes two numbers to one number that looks random.
pub(crate) fn hash_two(a: u32, b: u32) -> u32 {
    let n = a.wrapping_mul(0x9E37_79B1) ^ b.wrapping_mul(0x85EB_CA77).rotate_left(13);
    let n = (n ^ n >> 15).wrapping_mul(0x2C1B_3C6D);
    let n = (n ^ n >> 12).wrapping_mul(0x297A_2D39);
    n ^ n >> 15
}

/// Sensors for these pictures, each with a suffix for the picture's name.
pub(crate) struct Sensors {
    usual: (Config, &'static str),
    /// Sensor for one picture in eight.
    every_eighth: (Config, &'static str),
}

/// Returns an ordinary sensor, and one with the mask of a payload.
pub(crate) fn usual_sensors() -> Sensors {
    let mut bare = Config::new(lens(W as u16, H as u16));
    bare.body.altitude_km = Some(150.0);
    let mut masked = bare.clone();
    // The mask is a payload in two corners and an antenna across the picture.
    for polygon in [
        vec![[1500.0, 0.0], [1919.0, 0.0], [1919.0, 1079.0], [1450.0, 1079.0]],
        vec![[0.0, 800.0], [300.0, 900.0], [350.0, 1079.0], [0.0, 1079.0]],
        vec![[600.0, 0.0], [640.0, 0.0], [900.0, 1079.0], [860.0, 1079.0]],
    ] {
        masked.mask.polygons_px.push(polygon.into_iter().collect()).expect("there is room for eight");
    }
    Sensors { usual: (bare, ""), every_eighth: (masked, ", masked") }
}

/// Returns a sensor with the largest number of polygons and corners in the mask: stars over most of the picture, with a
/// long border.
pub(crate) fn largest_mask() -> Sensors {
    let mut sensor = usual_sensors().usual.0;
    for k in 0..8 {
        let star = |i: u32| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 16.0).sin_cos();
            let r = if i.is_multiple_of(2) { 520.0 } else { 120.0 };
            [240.0 * f64::from(k) + 120.0 + r * cos, 540.0 + r * sin]
        };
        sensor.mask.polygons_px.push((0..16).map(star).collect()).expect("there is room for eight");
    }
    Sensors { usual: (sensor.clone(), ", eight stars masked"), every_eighth: (sensor, ", eight stars masked") }
}

/// Returns a sensor for the Moon, whose crescent may be so narrow that every row is a search line.
pub(crate) fn moon() -> Sensors {
    let sensor = Config::preset(Preset::Moon, lens(W as u16, H as u16));
    Sensors { usual: (sensor.clone(), ", Moon"), every_eighth: (sensor, ", Moon") }
}

/// Makes the expensive pictures of these seeds.
pub(crate) fn paint_expensive_pictures(seeds: std::ops::Range<u32>, sensors: &Sensors) -> Vec<Case> {
    seeds.map(|seed| paint_expensive_picture(seed, sensors)).collect()
}

/// Makes a picture of a dark sky with the Moon at the bottom.
fn moon_at_the_bottom() -> Case {
    let disc = |x: f64, y: f64| ((6.0 - (x - 1500.0).hypot(y - 1000.0)).clamp(0.0, 1.0) * 200.0) as u8 + 20;
    let bytes = (0..W * H).map(|i| disc((i % W) as f64, (i / W) as f64)).collect();
    Case { name: "1920×1080 Moon at the bottom".into(), sensor: moon().usual.0, prior: Prior::default(), bytes }
}
