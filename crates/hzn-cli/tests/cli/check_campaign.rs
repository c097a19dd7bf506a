//! What `hzn calibrate check` says of right and of wrong lenses, counted over rendered flights of four kinds.
//! `cargo xtask campaign check` sets their number and the first seed.

use crate::campaign::number;
use crate::common::Place;

/// A kind of flight: the built-in scene, and the camera whose pictures are checked.
const KINDS: [(&str, &str); 4] = [("rocket", ""), ("leo-infrared", ""), ("atek", "left"), ("rocket-clean", "")];
/// Pictures of a flight.
const PICTURES: &str = "16";
/// The first seed. Neither the check nor the campaign was made on it.
const SEED: u64 = 910_000;
/// Errors of the focal length, percent: that of a right lens first. Every second flight has them with the other sign.
const ERRORS_PERCENT: [f64; 4] = [0.0, 0.3, 1.0, 3.0];

/// Returns a scene with pictures of at most 320×180 pixels, and without the parts of the vehicle that are in view: they
/// are masked.
fn small(scene: &str) -> String {
    let mut parts = scene.split("[[vehicle]]");
    let mut text = parts.next().unwrap().to_owned();
    if let Some((_, rest)) = parts.last().and_then(|last| last.split_once("masked = true\n")) {
        text += rest;
    }
    if !text.contains("width = 1920") {
        return text;
    }
    let mut lines = Vec::new();
    for line in text.lines() {
        let (key, value) = line.split_once(" = ").unwrap_or((line, ""));
        let value = value.parse::<f64>();
        lines.push(match (key, value) {
            ("width" | "height", Ok(pixels)) => format!("{key} = {}", pixels / 6.0),
            ("fx_px" | "fy_px", Ok(px)) => format!("{key} = {:?}", px / 6.0),
            ("cx_px" | "cy_px", Ok(px)) => format!("{key} = {:?}", (px + 0.5) / 6.0 - 0.5),
            _ => line.to_owned(),
        });
    }
    lines.join("\n")
}

/// Returns a sensor.toml with a focal length that is wrong by so many percent.
fn with_focal(sensor: &str, percent: f64) -> String {
    let line = |line: &str| match line.split_once("_px = ") {
        Some((key @ ("fx" | "fy"), px)) => {
            format!("{key}_px = {:?}", px.parse::<f64>().unwrap() * (1.0 + percent / 100.0))
        }
        _ => line.to_owned(),
    };
    sensor.lines().map(line).collect::<Vec<_>>().join("\n") + "\n"
}

/// Verdicts over the flights of a kind.
#[derive(Default, Clone, Copy)]
struct Count {
    holds: u64,
    does_not_hold: u64,
    cannot_tell: u64,
    refused: u64,
}

impl Count {
    fn add(&mut self, ran: &crate::common::Ran) {
        let verdict = ran.out.lines().next().and_then(|line| line.strip_prefix("verdict"));
        match verdict.map(|words| words.trim().split_once(':').map_or(words, |(name, _)| name)) {
            Some("holds") => self.holds += 1,
            Some("does not hold") => self.does_not_hold += 1,
            Some("cannot tell") => self.cannot_tell += 1,
            // A lens with which the pictures have no answer, or the fit does not converge.
            _ => self.refused += 1,
        }
    }
    fn sum(self, other: Self) -> Self {
        Self {
            holds: self.holds + other.holds,
            does_not_hold: self.does_not_hold + other.does_not_hold,
            cannot_tell: self.cannot_tell + other.cannot_tell,
            refused: self.refused + other.refused,
        }
    }
}

#[test]
fn verdicts_over_right_and_wrong_lenses() {
    let (flights, seed) = (number("HZN_CHECKS", 2), number("HZN_SEED", SEED));
    let place = Place::new();
    let mut counts = [[Count::default(); ERRORS_PERCENT.len()]; KINDS.len()];
    for flight in 0..flights {
        let kind = flight as usize % KINDS.len();
        let (name, camera) = KINDS[kind];
        let scene = place.run(&["simulate", name, "--show"]).expect(0).out;
        place.write("scene.toml", small(&scene).as_bytes());
        let seed = (seed + flight).to_string();
        let render = ["simulate", "scene.toml", "-o", "flight", "--frames", PICTURES, "--seed", &seed, "--no-noise"];
        place.run(&[&render[..], &["-q", "--force"]].concat()).expect(0);
        let folder = format!("flight/{camera}");
        let sensor = place.read(&format!("{folder}/sensor.toml"));
        for (count, percent) in counts[kind].iter_mut().zip(ERRORS_PERCENT) {
            let sign = if (flight / KINDS.len() as u64).is_multiple_of(2) { 1.0 } else { -1.0 };
            place.write("told.toml", with_focal(&sensor, sign * percent).as_bytes());
            let ran = place.run(&["calibrate", "check", &folder, "-s", "told.toml", "-q"]);
            if percent == 0.0 && (ran.code != 0 || !ran.err.is_empty()) {
                println!("{name}, seed {seed}, right lens:\n{}{}", ran.out, ran.err);
            }
            count.add(&ran);
        }
        std::fs::remove_dir_all(place.path("flight")).unwrap();
    }
    println!("holds, does not hold, cannot tell, refused");
    println!("| flights | {} |", ERRORS_PERCENT.map(|percent| format!("± {percent} %")).join(" | "));
    let cell = |c: &Count| format!("{}, {}, {}, {}", c.holds, c.does_not_hold, c.cannot_tell, c.refused);
    for ((name, _), row) in KINDS.iter().zip(&counts) {
        println!("| `{name}` | {} |", row.each_ref().map(cell).join(" | "));
    }
    let all = counts
        .into_iter()
        .fold([Count::default(); ERRORS_PERCENT.len()], |sum, row| core::array::from_fn(|i| sum[i].sum(row[i])));
    println!("| all | {} |", all.each_ref().map(cell).join(" | "));
    let [right, .., wrong] = all;
    assert!(right.does_not_hold * 100 <= flights, "{} of {flights} right lenses do not hold", right.does_not_hold);
    // A check that never says so would pass, too.
    assert!(wrong.holds == 0 && wrong.does_not_hold > 0, "3 %: {} hold, {} do not", wrong.holds, wrong.does_not_hold);
}
