//! What the firmware costs in QEMU: instructions by stage, memory. Prints docs/firmware-cost.md; `--check FILE` compares with
//! an earlier one and fails when anything grew by more than 5 %.

use std::process::{Command, ExitCode};

use hzn_core::status::Stage;
use hzn_core::{Config, Frame, camera};
use hzn_sim::flight::rocket;
use hzn_sim::{Disc, FlightFrame, Sky};
use hzn_tests::emulated::{Board, Case, Measured, bits, measure};

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

/// Pictures that are made to be expensive: much edge, and none of it a limb.
fn adversaries() -> Vec<Case> {
    const W: usize = 1920;
    const H: usize = 1080;
    let mut sensor = Config::new(lens(W as u16, H as u16));
    sensor.body.altitude_km = Some(150.0);
    let paint = |name: String, f: &dyn Fn(usize, usize) -> u8| Case {
        name,
        sensor: sensor.clone(),
        known: Frame::default(),
        bytes: (0..W * H).map(|i| f(i % W, i / W)).collect(),
    };
    let noise = |x: usize, y: usize| {
        let n = (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77);
        (n ^ n >> 15).wrapping_mul(0x2C1B_3C6D).to_be_bytes()[0]
    };
    let mut out = Vec::new();
    for n in [1, 2, 5, 20, 60] {
        out.push(paint(format!("checkerboard of {n} px"), &|x, y| 255 * ((x / n + y / n) % 2) as u8));
    }
    for n in [2, 7, 30] {
        out.push(paint(format!("vertical comb of {n} px"), &|x, y| 255 * u8::from(x / n % 2 == 1 && y > 20)));
        out.push(paint(format!("horizontal comb of {n} px"), &|x, y| 255 * u8::from(y / n % 2 == 1 && x > 20)));
    }
    for n in [1, 4, 16] {
        out.push(paint(format!("noise of {n} px"), &|x, y| noise(x / n, y / n)));
        out.push(paint(format!("noise of {n} px below a horizon"), &|x, y| {
            if y > 300 { noise(x / n, y / n) } else { 0 }
        }));
    }
    for n in [6.0, 25.0, 90.0] {
        out.push(paint(format!("spiral of {n} px"), &|x, y| {
            let (dx, dy) = (x as f64 - 960.0, y as f64 - 540.0);
            let turn = dy.atan2(dx) / std::f64::consts::TAU;
            255 * u8::from((dx.hypot(dy) / n + turn).rem_euclid(1.0) < 0.5)
        }));
        out.push(paint(format!("arches of {n} px"), &|x, y| {
            let (dx, dy) = (x as f64 - 960.0, y as f64 + 3000.0 - 900.0);
            255 * u8::from((dx.hypot(dy) / n).rem_euclid(1.0) < 0.5)
        }));
    }
    out
}

/// A line of the table: instructions in thousands.
struct Line {
    name: String,
    total: f64,
    stages: Vec<f64>,
}

fn lines(cases: &[Case], measured: &[Measured]) -> Vec<Line> {
    let mut out: Vec<Line> = Vec::new();
    for (case, m) in cases.iter().zip(measured) {
        let line = Line {
            name: case.name.clone(),
            total: m.calls[2] as f64 / 1e3,
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

fn report() -> Result<String, String> {
    let mut usual = Vec::new();
    for (w, h) in [(640, 480), (1024, 768), (1920, 1080)] {
        for clean in [true, false] {
            usual.extend(frames(w, h, clean, 3));
        }
    }
    let hard = adversaries();
    let mut out = HEAD.to_owned();
    for board in Board::ALL {
        let measured = measure(board, &usual);
        let worst = measure(board, &hard);
        for (case, m) in usual.iter().chain(&hard).zip(measured.iter().chain(&worst)) {
            if bits(&case.here()) != bits(&m.answer) {
                return Err(format!("{} on {}: other bits than here", case.name, board.core()));
            }
        }
        out += &format!("\n## {} ({})\n\n| picture | process, thousand |", board.core(), board.name());
        Stage::ALL.iter().for_each(|s| out += &format!(" {} |", s.name()));
        out += &format!("\n|---|---|{}\n", "---|".repeat(Stage::ALL.len()));
        let mut hardest = lines(&hard, &worst);
        hardest.sort_by(|a, b| b.total.total_cmp(&a.total));
        let shown = hardest.into_iter().take(3).map(|l| Line { name: format!("worst found: {}", l.name), ..l });
        for line in lines(&usual, &measured).into_iter().chain(shown) {
            out += &format!("| {} | {:.0} |", line.name, line.total);
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
        let [flash, ram] = sizes(board, "flight").ok_or("arm-none-eabi-size cannot be run")?;
        out += &format!("| flight | {flash} | {ram} |\n");
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
    let text = match report() {
        Ok(text) => text,
        Err(e) => {
            eprintln!("{e}");
            return ExitCode::FAILURE;
        }
    };
    print!("{text}");
    let args: Vec<String> = std::env::args().skip(1).collect();
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
