//! Measures what the firmware costs in QEMU: instructions by stage, and memory. It prints
//! book/results/firmware-cost.md. `--check FILE` compares the result with an earlier one and fails if instructions,
//! flash, static RAM or stack grew by more than 5 %. `--search FROM TO` prints the most expensive of the pictures made
//! with these seeds.

use std::process::{Command, ExitCode};

use hzn_core::Preset;
use hzn_core::status::Stage;
use hzn_core::threshold::Method;
use hzn_core::{Config, Prior, camera};
use hzn_sim::flight::rocket;
use hzn_sim::{Disc, FlightFrame, Sky};
use hzn_tests::emulated::{Board, Case, Measured, bits, chain, measure, measure_rows};

const HEAD: &str = "# What the firmware costs

`cargo xtask firmware --write` writes this page. `cargo xtask test` fails if a figure (instructions, flash, static RAM,
stack) grows by more than 5 %. Instructions are exact (QEMU 7.2, `-icount`); they are not cycles. The sensor computes in
f32 and keeps 600 points, unless a row names another number. A row is the worst of its pictures. Every answer had the
bits of the same sensor on the host.

The goals are for a Cortex-M7: 96 KiB (98304 bytes) of flash for the sensor alone, 96 KiB of RAM in addition to the
picture, 0.6 million instructions for a clean picture of 1920×1080, 2 million for a cloudy one, 20 million for the worst.
Flash and the clean picture miss their goals, the clean picture also with 200 points kept;
[porting.md](../guide/porting.md) says what fewer points cost. On the Cortex-M4F, double-precision arithmetic in software
takes about 9 KB more flash and nearly all of the time of `expect`: `expect` calculates the cone of an altitude or a
position in double precision, once per picture. No other code that runs per picture uses it (`cargo xtask test` checks
this).
";

/// Returns frames of a rocket's flight, clean or cloudy.
fn frames(width: u16, height: u16, clean: bool, count: usize) -> Vec<Case> {
    let mut flight = rocket(width, height, count * 2, 7);
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
    case.sensor.candidates.keep_points = 200;
    Case { name: format!("{}, keep_points = 200", case.name), ..case }
}

fn lens(width: u16, height: u16) -> camera::Config {
    let (w, h) = (f64::from(width), f64::from(height));
    let focal_px = 1233.0 * w.hypot(h) / 1920f64.hypot(1080.0);
    let k = [-0.055, 0.011, -0.0035, 0.0002].into_iter().collect();
    camera::Config { k, ..camera::Config::ideal(camera::Model::KannalaBrandt, width, height, focal_px) }
}

/// Makes a picture that is expensive on purpose: it has many edges, and none of them is a limb. The edges are of many
/// kinds, sharp and soft, thin and wide, over noise.
fn adversary(seed: u32, sensors: &Sensors) -> Case {
    let mut draws = 0;
    let mut draw = |n: u32| {
        draws += 1;
        scrambled(seed, draws) % n
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
    let (sensor, known_by) = if draw(8) == 0 { &sensors.seldom } else { &sensors.mostly };
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
                    f64::from(scrambled((along.floor() as i32 as u32) ^ seed, across.floor() as i32 as u32) % 256)
                        / 255.0
                }
                Pattern::Sea => wave(along + (across * 2.0).sin()) * 0.5 + wave(across) * 0.5,
            };
            let grain = scrambled(i as u32, seed) % (noise + 1);
            ((bright * f64::from(255 - noise)) as u32 + grain) as u8
        })
        .collect();
    let kind = format!("{pattern:?}").to_lowercase();
    let name = format!("{kind} of {period} px{}{known_by} (seed {seed})", if soft { ", soft" } else { "" });
    Case { name, sensor: sensor.clone(), known: Prior::default(), bytes }
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
fn scrambled(a: u32, b: u32) -> u32 {
    let n = a.wrapping_mul(0x9E37_79B1) ^ b.wrapping_mul(0x85EB_CA77).rotate_left(13);
    let n = (n ^ n >> 15).wrapping_mul(0x2C1B_3C6D);
    let n = (n ^ n >> 12).wrapping_mul(0x297A_2D39);
    n ^ n >> 15
}

/// Sensors for these pictures, each with a suffix for the picture's name.
struct Sensors {
    mostly: (Config, &'static str),
    /// Sensor for one picture in eight.
    seldom: (Config, &'static str),
}

/// Returns an ordinary sensor, and one with the mask of a payload.
fn usual_sensors() -> Sensors {
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
    Sensors { mostly: (bare, ""), seldom: (masked, ", masked") }
}

/// Returns a sensor with the largest number of polygons and corners in the mask: stars over most of the picture, with a
/// long border.
fn crowded() -> Sensors {
    let mut sensor = usual_sensors().mostly.0;
    for k in 0..8 {
        let star = |i: u32| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 16.0).sin_cos();
            let r = if i.is_multiple_of(2) { 520.0 } else { 120.0 };
            [240.0 * f64::from(k) + 120.0 + r * cos, 540.0 + r * sin]
        };
        sensor.mask.polygons_px.push((0..16).map(star).collect()).expect("there is room for eight");
    }
    Sensors { mostly: (sensor.clone(), ", eight stars masked"), seldom: (sensor, ", eight stars masked") }
}

/// Returns a sensor for the Moon, whose crescent may be so narrow that every row is a search line.
fn moon() -> Sensors {
    let sensor = Config::preset(Preset::Moon, lens(W as u16, H as u16));
    Sensors { mostly: (sensor.clone(), ", Moon"), seldom: (sensor, ", Moon") }
}

/// Makes the expensive pictures of these seeds.
fn adversaries(seeds: std::ops::Range<u32>, sensors: &Sensors) -> Vec<Case> {
    seeds.map(|seed| adversary(seed, sensors)).collect()
}

/// Makes a picture of a dark sky with the Moon at the bottom.
fn moon_at_the_bottom() -> Case {
    let disc = |x: f64, y: f64| ((6.0 - (x - 1500.0).hypot(y - 1000.0)).clamp(0.0, 1.0) * 200.0) as u8 + 20;
    let bytes = (0..W * H).map(|i| disc((i % W) as f64, (i / W) as f64)).collect();
    Case { name: "1920×1080 Moon at the bottom".into(), sensor: moon().mostly.0, known: Prior::default(), bytes }
}

/// Line of the table, with instructions and work in thousands.
struct Line {
    name: String,
    total: f64,
    work: f64,
    stages: Vec<f64>,
}

fn lines(cases: &[Case], measured: &[Measured]) -> Vec<Line> {
    let mut out: Vec<Line> = Vec::new();
    for (case, m) in cases.iter().zip(measured) {
        let line = Line {
            name: case.name.clone(),
            total: m.calls[2] as f64 / 1e3,
            work: f64::from(m.answer.work) / 1e3,
            stages: m.stages.iter().map(|&n| n as f64 / 1e3).collect(),
        };
        match out.iter_mut().find(|l| l.name == line.name) {
            Some(same) if same.total < line.total => *same = line,
            Some(_) => {}
            None => out.push(line),
        }
    }
    out
}

/// Returns text + data, and data + bss, of an image in bytes.
fn sizes(board: Board, image: &str) -> Option<[u64; 2]> {
    let out = Command::new("arm-none-eabi-size").arg(board.image(image)).output().ok()?;
    let text = String::from_utf8(out.stdout).ok()?;
    let numbers: Vec<u64> = text.lines().nth(1)?.split_whitespace().take(3).filter_map(|n| n.parse().ok()).collect();
    let [text, data, bss] = numbers[..] else { return None };
    Some([text + data, data + bss])
}

/// Number of expensive pictures for the table; `--search` takes others.
const SEARCHED: u32 = 64;

/// Prints the most expensive of many pictures, on the M7.
fn search(seeds: std::ops::Range<u32>, sensors: &Sensors) {
    let mut found = Vec::new();
    for from in seeds.clone().step_by(16) {
        let cases = adversaries(from..(from + 16).min(seeds.end), sensors);
        found.extend(lines(&cases, &measure(Board::An500, &cases)));
    }
    found.sort_by(|a, b| b.total.total_cmp(&a.total));
    for line in found.iter().take(20) {
        let stages: Vec<String> = line.stages.iter().map(|n| format!("{n:.0}")).collect();
        println!("{:8.0} {:6.0} {}: {}", line.total, line.work, line.name, stages.join(" "));
    }
}

fn report() -> Result<String, String> {
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
    let groups = [(usual_sensors(), 3), (crowded(), 1), (moon(), 1)]
        .map(|(sensors, shown)| (adversaries(0..SEARCHED, &sensors), shown));
    let by_rows = [("clean", true), ("cloudy", false)].map(|(kind, clean)| {
        let mut cases = frames(640, 480, clean, 3);
        for case in &mut cases {
            case.sensor.binarize.method = Method::Fixed;
        }
        (kind, cases)
    });
    let mut out = HEAD.to_owned();
    for board in Board::ALL {
        let measured = measure(board, &usual);
        let worst = groups.each_ref().map(|(hard, _)| measure(board, hard));
        let hard = groups.iter().flat_map(|(hard, _)| hard);
        for (case, m) in usual.iter().chain(hard).zip(measured.iter().chain(worst.iter().flatten())) {
            if bits(&case.here()) != bits(&m.answer) {
                return Err(format!("{} on {}: the bits differ from those on this machine", case.name, board.core()));
            }
        }
        out += &format!("\n## {} ({})\n\n| picture | process, thousand | work, thousand |", board.core(), board.name());
        Stage::ALL.iter().for_each(|s| out += &format!(" {} |", s.name()));
        out += &format!("\n|---|---|---|{}\n", "---|".repeat(Stage::ALL.len()));
        let shown = groups.iter().zip(&worst).flat_map(|((hard, shown), worst)| {
            let mut hardest = lines(hard, worst);
            hardest.sort_by(|a, b| b.total.total_cmp(&a.total));
            hardest.into_iter().take(*shown).map(|l| Line { name: format!("worst found: {}", l.name), ..l })
        });
        for line in lines(&usual, &measured).into_iter().chain(shown) {
            out += &format!("| {} | {:.0} | {:.0} |", line.name, line.total, line.work);
            line.stages.iter().for_each(|n| out += &format!(" {n:.0} |"));
            out += "\n";
        }
        let first = &measured[0];
        out += "\n| before the pictures | thousand |\n|---|---|\n";
        out += &format!("| making a sensor | {:.0} |\n", first.calls[0] as f64 / 1e3);
        out += &format!("| `expect` | {:.1} |\n", first.calls[1] as f64 / 1e3);
        let by_rows = by_rows.each_ref().map(|(kind, cases)| (kind, measure_rows(board, cases)));
        out += "\n| row by row | taking the rows, thousand | the end of the picture, thousand |\n|---|---|---|\n";
        for (kind, measured) in &by_rows {
            let most = |call: usize| measured.iter().map(|m| m.calls[call]).max().unwrap_or(0) as f64 / 1e3;
            out += &format!("| 640×480 {kind} by rows | {:.0} | {:.0} |\n", most(1), most(2));
        }
        let most = |measured: &mut dyn Iterator<Item = &Measured>| measured.map(|m| m.stack_bytes).max().unwrap_or(0);
        let stacks = [
            ("chain", "the sensor alone, 600 points", chain(board, &usual[usual.len() - 2].bytes)[10]),
            ("measure", "the sensor alone, all points", most(&mut measured.iter().chain(worst.iter().flatten()))),
            ("rows", "row by row, 640×480", most(&mut by_rows.iter().flat_map(|(_, measured)| measured))),
        ];
        out += "\n| image | flash, bytes | static RAM, bytes | stack, bytes |\n|---|---|---|---|\n";
        for (image, what, stack) in stacks {
            let [flash, ram] = sizes(board, image).ok_or("arm-none-eabi-size cannot be run")?;
            out += &format!("| {what} | {flash} | {ram} | {stack} |\n");
        }
        let [flash, ram] = sizes(board, "flight").ok_or("arm-none-eabi-size cannot be run")?;
        out += &format!(
            "| flight | {flash} | {ram} | as the sensor with 600 points, plus the loop; a test limits the total to 96 \
             KiB |\n"
        );
    }
    Ok(out)
}

/// Returns the figures of a report. The key of each figure is the heading, the first cell of its row, and the column.
fn figures(text: &str) -> Vec<(String, f64)> {
    let mut out: Vec<(String, f64)> = Vec::new();
    let (mut heading, mut columns) = ("", Vec::new());
    for line in text.lines() {
        if let Some(h) = line.strip_prefix("## ") {
            heading = h;
        }
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let [_, name, values @ .., _] = &cells[..] else {
            columns.clear();
            continue;
        };
        if columns.is_empty() {
            columns = values.to_vec();
        }
        // Of the worst pictures only the first counts, because another one may become the worst.
        let name = name.split(": ").next().unwrap_or(name);
        for (value, column) in values.iter().zip(&columns) {
            let key = format!("{heading}, {name}, {column}");
            // Only the total of a picture is compared; its work and its stages are for information.
            let read_only = *column == "work, thousand" || Stage::ALL.iter().any(|s| s.name() == *column);
            if let (Ok(n), false) = (value.parse(), read_only || out.iter().any(|(k, _)| *k == key)) {
                out.push((key, n));
            }
        }
    }
    out
}

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    if let [flag, from, to] = &args[..]
        && let ("--search", Ok(from), Ok(to)) = (flag.as_str(), from.parse(), to.parse())
    {
        for sensors in [usual_sensors(), crowded(), moon()] {
            search(from..to, &sensors);
        }
        return ExitCode::SUCCESS;
    }
    let text = match report() {
        Ok(text) => text,
        Err(e) => {
            eprintln!("{e}");
            return ExitCode::FAILURE;
        }
    };
    print!("{text}");
    match &args.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["--write", path] => {
            if let Err(e) = std::fs::write(path, text) {
                eprintln!("{path}: {e}");
                return ExitCode::FAILURE;
            }
        }
        ["--check", path] => {
            let before = figures(&std::fs::read_to_string(path).unwrap_or_default());
            let mut grown = before.is_empty();
            for (name, now) in figures(&text) {
                if let Some((_, then)) = before.iter().find(|(n, _)| *n == name)
                    && now > then * 1.05
                {
                    eprintln!("{name}: {now}, but {then} in {path}");
                    grown = true;
                }
            }
            if grown {
                eprintln!("more than 5 % above {path}; if this is intended, run cargo xtask firmware --write");
                return ExitCode::FAILURE;
            }
        }
        _ => {}
    }
    ExitCode::SUCCESS
}
