//! Pictures and sensors that are expensive together: sizes, spacings of search lines, bodies, image circles and masks
//! vary, too.

use hzn_core::{Config, Preset, Prior};
use hzn_tests::emulated::Case;

use crate::pictures::{hash_two, lens};

const SIZES: [(u16, u16); 6] = [(320, 240), (640, 480), (800, 600), (1280, 960), (1440, 1080), (1920, 1080)];

/// Makes the pictures of these seeds, each with its sensor.
pub(crate) fn hostile_pictures(seeds: std::ops::Range<u32>) -> Vec<Case> {
    seeds.map(hostile_picture).collect()
}

fn hostile_picture(seed: u32) -> Case {
    let mut draws = 1000;
    let mut draw = |n: u32| {
        draws += 1;
        hash_two(seed, draws) % n
    };
    let (w, h) = SIZES[draw(6) as usize];
    let camera = lens(w, h);
    let mut sensor = match draw(5) {
        0 => Config::preset(Preset::Moon, camera),
        1 => Config::preset(Preset::Sun, camera),
        body => {
            let mut sensor = Config::new(camera);
            sensor.body.altitude_km = Some([150.0, 400.0, 36_000.0][body as usize % 3]);
            sensor
        }
    };
    sensor.contour.line_spacing_px = [None, Some(1), Some(2), Some(3), Some(4), Some(8), Some(16)][draw(7) as usize];
    sensor.camera.theta_max_deg = [None, None, Some(12.0), Some(25.0), Some(40.0)][draw(5) as usize];
    if draw(5) == 0 {
        sensor.edge_points.keep_points = 0;
    }
    for _ in 0..[0, 0, 1, 3, 8][draw(5) as usize] {
        let corners = [3, 4, 8, 16][draw(4) as usize];
        let (x, y) = (f64::from(draw(w.into())), f64::from(draw(h.into())));
        let radius = f64::from(h) * [0.05, 0.2, 0.5][draw(3) as usize];
        let inner = [0.1, 0.5, 1.0][draw(3) as usize];
        let corner = |i: u32| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / f64::from(corners)).sin_cos();
            let r = if i.is_multiple_of(2) { radius } else { radius * inner };
            [x + r * cos, y + r * sin]
        };
        sensor.mask.polygons_px.push((0..corners).map(corner).collect()).expect("there is room for eight");
    }
    let width_px = [1, 1, 2, 2, 3, 4, 6, 8, 12, 20, 40][draw(11) as usize];
    let tilt = [0.0, 0.002, 0.01, 0.1, 0.5, 1.0][draw(6) as usize];
    let (kind, lit) = pattern(seed, draw(6), f64::from(width_px), tilt, (w.into(), h.into()), draw(4));
    let bytes = (0..usize::from(h)).flat_map(|y| (0..usize::from(w)).map(move |x| (x, y)));
    let bytes = bytes.map(|(x, y)| 255 * u8::from(lit(x as f64, y as f64))).collect();
    let corners: usize = sensor.mask.polygons_px.iter().map(|polygon| polygon.len()).sum();
    let mask = if corners > 0 { format!(", {corners} corners masked") } else { String::new() };
    let circle = if sensor.camera.theta_max_deg.is_some() { ", image circle" } else { "" };
    let name = sensor.body.kind.name();
    let name = format!("{kind} of {width_px} px, {w}×{h}, {name}{mask}{circle}, hostile (seed {seed})");
    Case { name, sensor, prior: Prior::default(), bytes }
}

type Lit = Box<dyn Fn(f64, f64) -> bool>;

/// Returns the name of a pattern, and which of its pixels are lit.
fn pattern(seed: u32, kind: u32, width_px: f64, tilt: f64, (w, h): (f64, f64), variant: u32) -> (&'static str, Lit) {
    let odd = |x: f64| (x.floor() as i64).rem_euclid(2) == 1;
    let at = move |x: f64| (x / width_px).floor();
    match kind {
        0 => ("stripes", Box::new(move |x, y| odd((x + tilt * y) / width_px))),
        1 => {
            let below = h / 2.0 + [0.0, 600.0, 2000.0, 20_000.0][variant as usize];
            ("arches", Box::new(move |x, y| odd((x - w / 2.0).hypot(y - below) / width_px)))
        }
        2 => {
            let share = [0.02, 0.3, 0.5, 0.9][variant as usize];
            let random = move |x: f64, y: f64| f64::from(hash_two(at(x) as u32 ^ seed, at(y) as u32) % 1000);
            ("noise", Box::new(move |x, y| random(x, y) < share * 1000.0))
        }
        3 => ("checkerboard", Box::new(move |x, y| odd(at(x) + at(y)))),
        4 => {
            let pitch = width_px + [1.0, 2.0, 4.0, 8.0][variant as usize];
            ("dots", Box::new(move |x, y| x % pitch < width_px && y % pitch < width_px))
        }
        // Stripes that are joined at their upper and lower ends in turn: one edge as long as the picture allows.
        _ => {
            let joint = move |x: f64, y: f64| if odd(at(x) / 2.0) { y < width_px } else { y >= h - width_px };
            ("serpentine", Box::new(move |x, y| !odd(at(x)) || joint(x, y)))
        }
    }
}
