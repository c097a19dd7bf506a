//! What the firmware costs in QEMU: instructions by stage, memory. Prints docs/firmware-cost.md; `--check FILE` compares with
//! an earlier one and fails when anything grew by more than 5 %. `--search FROM TO`: the most expensive of the pictures made
//! with these seeds.

use std::process::{Command, ExitCode};

use hzn_core::binarize::Method;
use hzn_core::status::Stage;
use hzn_core::{Config, Frame, camera};
use hzn_sim::flight::rocket;
use hzn_sim::{Disc, FlightFrame, Sky};
use hzn_tests::emulated::{Board, Case, Measured, bits, chain, measure, measure_rows};

const HEAD: &str = "# What the firmware costs

Written by `cargo xtask firmware --write`; `cargo xtask test` fails when a figure grows by more than 5 %. Instructions are exact
(QEMU 7.2, `-icount`), not cycles. f32, 600 points kept; a row is the worst of its pictures. Every answer had the bits of
the same sensor on the host.
";

/// Frames of a rocket's flight: clean or cloudy.
fn frames(width: u16, height: u16, clean: bool, count: usize) -> Vec<Case> {
    let mut flight = rocket(width, height, count * 2, 7);
    // The lens scaled by the diagonal, as in the benchmarks: the image circle stays outside of the picture.
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

fn lens(width: u16, height: u16) -> camera::Config {
    let (w, h) = (f64::from(width), f64::from(height));
    let focal_px = 1233.0 * w.hypot(h) / 1920f64.hypot(1080.0);
    let k = [-0.055, 0.011, -0.0035, 0.0002].into_iter().collect();
    camera::Config { k, ..camera::Config::ideal(camera::Model::KannalaBrandt, width, height, focal_px) }
}

/// A picture that is made to be expensive: much edge, and none of it a limb. Edges of many kinds, sharp and soft, thin and
/// wide, over noise.
fn adversary(seed: u32, bare: &Config, masked: &Config) -> Case {
    let mut draws = 0;
    let mut draw = |n: u32| {
        draws += 1;
        scrambled(seed, draws) % n
    };
    let pattern = PATTERNS[draw(PATTERNS.len() as u32) as usize];
    // Pixels of one light and one dark stripe, from 2 to 200, and their direction.
    let period = f64::from(2 * (1 + draw(10)) * [1, 1, 3, 10][draw(4) as usize]);
    let (sin, cos) = (f64::from(draw(64)) * std::f64::consts::TAU / 64.0).sin_cos();
    let soft = draw(3) == 0;
    let noise = [0, 0, 20, 90][draw(4) as usize];
    let top = [0, 0, 20, 300][draw(4) as usize];
    // Arches about a limb's own centre, or any.
    let below = [2100, 2100, 600, 9000][draw(4) as usize];
    let sensor = if draw(8) == 0 { masked } else { bare };
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
    let mask = if std::ptr::eq(sensor, masked) { ", masked" } else { "" };
    let name = format!("{kind} of {period} px{}{mask} (seed {seed})", if soft { ", soft" } else { "" });
    Case { name, sensor: sensor.clone(), known: Frame::default(), bytes }
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

/// Two numbers to one that has nothing to do with them.
fn scrambled(a: u32, b: u32) -> u32 {
    let n = a.wrapping_mul(0x9E37_79B1) ^ b.wrapping_mul(0x85EB_CA77).rotate_left(13);
    let n = (n ^ n >> 15).wrapping_mul(0x2C1B_3C6D);
    let n = (n ^ n >> 12).wrapping_mul(0x297A_2D39);
    n ^ n >> 15
}

/// The search over them: pictures by seed.
fn adversaries(seeds: std::ops::Range<u32>) -> Vec<Case> {
    let mut bare = Config::new(lens(W as u16, H as u16));
    bare.body.altitude_km = Some(150.0);
    let mut masked = bare.clone();
    // A payload in two corners, and an antenna across.
    for polygon in [
        vec![[1500.0, 0.0], [1919.0, 0.0], [1919.0, 1079.0], [1450.0, 1079.0]],
        vec![[0.0, 800.0], [300.0, 900.0], [350.0, 1079.0], [0.0, 1079.0]],
        vec![[600.0, 0.0], [640.0, 0.0], [900.0, 1079.0], [860.0, 1079.0]],
    ] {
        masked.mask.polygons_px.push(polygon.into_iter().collect()).expect("there is room for eight");
    }
    seeds.map(|seed| adversary(seed, &bare, &masked)).collect()
}

/// A line of the table: instructions in thousands.
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

/// text + data, and data + bss, of an image.
fn sizes(board: Board, image: &str) -> Option<[u64; 2]> {
    let out = Command::new("arm-none-eabi-size").arg(board.image(image)).output().ok()?;
    let text = String::from_utf8(out.stdout).ok()?;
    let numbers: Vec<u64> = text.lines().nth(1)?.split_whitespace().take(3).filter_map(|n| n.parse().ok()).collect();
    let [text, data, bss] = numbers[..] else { return None };
    Some([text + data, data + bss])
}

/// Pictures of the search that the table is made from; `--search` looks at others.
const SEARCHED: u32 = 64;

/// The most expensive of many pictures, on the M7.
fn search(seeds: std::ops::Range<u32>) {
    let mut found = Vec::new();
    for from in seeds.clone().step_by(16) {
        let cases = adversaries(from..(from + 16).min(seeds.end));
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
    let hard = adversaries(0..SEARCHED);
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
        let worst = measure(board, &hard);
        for (case, m) in usual.iter().chain(&hard).zip(measured.iter().chain(&worst)) {
            if bits(&case.here()) != bits(&m.answer) {
                return Err(format!("{} on {}: other bits than here", case.name, board.core()));
            }
        }
        out += &format!("\n## {} ({})\n\n| picture | process, thousand | work, thousand |", board.core(), board.name());
        Stage::ALL.iter().for_each(|s| out += &format!(" {} |", s.name()));
        out += &format!("\n|---|---|---|{}\n", "---|".repeat(Stage::ALL.len()));
        let mut hardest = lines(&hard, &worst);
        hardest.sort_by(|a, b| b.total.total_cmp(&a.total));
        let shown = hardest.into_iter().take(3).map(|l| Line { name: format!("worst found: {}", l.name), ..l });
        for line in lines(&usual, &measured).into_iter().chain(shown) {
            out += &format!("| {} | {:.0} | {:.0} |", line.name, line.total, line.work);
            line.stages.iter().for_each(|n| out += &format!(" {n:.0} |"));
            out += "\n";
        }
        let first = &measured[0];
        out += &format!(
            "\nMaking a sensor: {:.0} thousand. `expect`: {:.1} thousand. Stack of `measure`: {} bytes.\n\n",
            first.calls[0] as f64 / 1e3,
            first.calls[1] as f64 / 1e3,
            measured.iter().chain(&worst).map(|m| m.stack_bytes).max().unwrap_or(0)
        );
        out += "| image | flash, bytes | static RAM, bytes |\n|---|---|---|\n";
        for (image, what) in
            [("chain", "the sensor alone, 600 points"), ("flight", "flight"), ("rows", "row by row, 640×480")]
        {
            let [flash, ram] = sizes(board, image).ok_or("arm-none-eabi-size cannot be run")?;
            out += &format!("| {what} | {flash} | {ram} |\n");
        }
        let stack_bytes = chain(board, &usual[usual.len() - 1].bytes)[10];
        out += &format!("\nStack of the sensor alone: {stack_bytes} bytes.\n");
        out += "\n| row by row | taking the rows, thousand | the end of the picture, thousand |\n|---|---|---|\n";
        for (kind, cases) in &by_rows {
            let measured = measure_rows(board, cases);
            let most = |call: usize| measured.iter().map(|m| m.calls[call]).max().unwrap_or(0) as f64 / 1e3;
            out += &format!("| 640×480 {kind} by rows | {:.0} | {:.0} |\n", most(1), most(2));
        }
    }
    Ok(out)
}

/// Figures by place: a heading and the first cell of a row, then the column.
fn figures(text: &str) -> Vec<(String, f64)> {
    let mut out = Vec::new();
    let mut heading = "";
    for line in text.lines() {
        if let Some(h) = line.strip_prefix("## ") {
            heading = h;
        }
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        if cells.len() > 3 {
            // The total alone: stages are for reading.
            if let (name, Ok(n)) = (cells[1], cells[2].parse::<f64>()) {
                let name = name.split(": ").next().unwrap_or(name);
                if !out.iter().any(|(k, _)| *k == format!("{heading}, {name}")) {
                    out.push((format!("{heading}, {name}"), n));
                }
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
        search(from..to);
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
                    eprintln!("{name}: {now} where {path} has {then}");
                    grown = true;
                }
            }
            if grown {
                eprintln!("more than 5 % above {path}; if that is wanted: cargo xtask firmware --write");
                return ExitCode::FAILURE;
            }
        }
        _ => {}
    }
    ExitCode::SUCCESS
}
