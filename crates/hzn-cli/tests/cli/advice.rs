//! Advice for a picture without an answer fits the body that was looked for.

use hzn_core::body::{self, Kind};
use hzn_core::report::Candidate;
use hzn_core::status::{Stage, Status};
use hzn_core::verdict::Verdict;
use hzn_core::{Report, gates};
use hzn_run::advice::{Subject, of_verdict, tips};
use hzn_run::explain::verdict_text;
use image::{GrayImage, Luma};

use crate::common::Place;

/// Half-angles in degrees: unknown, far and near.
const HALF_ANGLES_DEG: [Option<f64>; 4] = [None, Some(0.3), Some(19.0), Some(72.0)];
/// What is not said to anybody who looks for Sun or Moon: their size is that of every camera near the Earth.
const OF_A_DISTANCE: [&str; 6] = ["altitude", "limb_height", "_km", "radius", "distance", "max_half_angle_sigma"];

fn is_free(kind: Kind) -> bool {
    matches!(kind, Kind::Sun | Kind::Moon)
}

/// Asserts that every key and column that a text names exists.
#[track_caller]
fn assert_known(text: &str) {
    let words = text.split(|c: char| !(c.is_ascii_alphanumeric() || matches!(c, '_' | '.')));
    for word in words.map(|word| word.trim_matches('.')) {
        if let Some((section, key)) = word.split_once('.') {
            let table = hzn_files::keys::sections().find(|table| table.name == section);
            let table = table.unwrap_or_else(|| panic!("no section {section}: {text}"));
            assert!(table.keys.iter().any(|known| known.name() == key), "no key {word}: {text}");
        } else if word.contains('_') {
            assert!(hzn_files::frames::COLUMNS.contains(&word), "no column {word}: {text}");
        }
    }
}

#[test]
fn every_verdict_of_every_body_has_advice_that_fits_it() {
    let gates = gates::Config::default();
    let mut pieces = 0;
    for kind in Kind::ALL.iter().copied() {
        let is_earth = matches!(kind, Kind::Earth | Kind::EarthSphere);
        for (sunlit, deg) in [None, Some(false)].into_iter().flat_map(|s| HALF_ANGLES_DEG.map(|deg| (s, deg))) {
            let body = body::Config { kind, sunlit, ..body::Config::default() };
            let subject = Subject::new(&body, deg.map(f64::to_radians));
            for verdict in Verdict::ALL.iter().copied() {
                let meaning = verdict_text(verdict, &gates, kind);
                let Some(tip) = of_verdict(verdict, subject) else { continue };
                pieces += 1;
                let case = format!("{} {verdict:?} {deg:?} {sunlit:?}: {tip}", kind.name());
                assert_known(&tip);
                if is_free(kind) {
                    assert!(OF_A_DISTANCE.iter().all(|word| !tip.contains(word)), "{case}");
                    assert!(!meaning.contains("altitude") && !meaning.contains("max_half_angle"), "{case}: {meaning}");
                    assert!(!tip.contains("quaternion"), "no attitude says where Sun and Moon are: {case}");
                }
                let of_the_earth = ["airglow", "cloud", "ECEF", "aurora"];
                assert!(is_earth || of_the_earth.iter().all(|word| !tip.contains(word)), "{case}");
                assert!(kind != Kind::Sun || !tip.contains("sun_x"), "the Sun does not light itself: {case}");
                assert!(body.is_seen_in_sunlight() || !tip.contains("body.sunlit = false"), "it is set: {case}");
                assert!(body.is_seen_in_sunlight() || !tip.contains("sun_x"), "{case}");
                let is_far = deg.is_some_and(|deg| deg < 20.0);
                assert!(!is_far || !tip.contains("limb_height_sigma_km"), "from afar it changes nothing: {case}");
                for (other, key) in [(Kind::Sphere, "body.radius_km"), (Kind::Ellipsoid, "body.radii_km")] {
                    assert!(kind == other || !tip.contains(key), "{case}");
                }
            }
        }
    }
    assert!(pieces > 3000, "{pieces}");
}

#[test]
fn the_size_of_each_body_is_told_by_its_own_keys() {
    let of = |kind: Kind, deg: f64, verdict: Verdict| {
        let body = body::Config { kind, ..body::Config::default() };
        of_verdict(verdict, Subject::new(&body, Some(deg.to_radians()))).unwrap().into_owned()
    };
    for verdict in [Verdict::HalfAngle, Verdict::NoConsensus] {
        assert!(of(Kind::Earth, 70.0, verdict).contains("altitude"));
        assert!(of(Kind::Sphere, 30.0, verdict).contains("body.radius_km"));
        assert!(of(Kind::Mars, 30.0, verdict).contains("body.kind"));
        assert!(of(Kind::Ellipsoid, 5.0, verdict).contains("body.radii_km"));
        assert!(of(Kind::Sun, 0.27, verdict).contains("Sun") && of(Kind::Moon, 0.26, verdict).contains("Moon"));
    }
    assert!(of(Kind::Earth, 70.0, Verdict::HalfAngle).contains("limb_height_sigma_km"));
    assert!(of(Kind::Earth, 1.0, Verdict::HalfAngle).contains("altitude_sigma_km"));
}

/// The limb contradicts a wrong attitude. A longer edge of the vehicle does not even have the size of the body.
#[test]
fn advice_about_the_best_edge_comes_first() {
    let mut report: Report<f64> = Report {
        status: Status::Rejected,
        stage: Stage::Gates,
        level: 9,
        next_level: None,
        counters: Default::default(),
        candidates: Default::default(),
        solution: None,
        is_suspect: false,
    };
    for (number, (verdict, inliers)) in (0..).zip([(Verdict::HalfAngle, 900), (Verdict::Attitude, 300)]) {
        let edge = Candidate { number, length_px: 9, points: 9, inliers, rms_px: 0.5, verdict };
        report.candidates.push(edge).unwrap();
    }
    let tips = tips(&report, Subject::new(&body::Config::default(), None));
    assert!(tips[0].contains("contradicts the given attitude") && tips.len() == 2, "{tips:?}");
}

/// A bright shape in the middle of a picture whose pixels are 0.0033 degrees wide.
fn shape(is_inside: impl Fn(f64, f64) -> bool) -> GrayImage {
    GrayImage::from_fn(320, 240, |x, y| {
        Luma([if is_inside(f64::from(x) - 160.0, f64::from(y) - 120.0) { 200 } else { 5 }])
    })
}

#[test]
fn a_refused_sun_or_moon_gets_no_advice_about_an_altitude() {
    let place = Place::new();
    let square = shape(|x, y| x.abs() < 70.0 && y.abs() < 70.0);
    let disc = shape(|x, y| x.hypot(y) < 25.0);
    for (name, picture) in [("square.png", &square), ("small.png", &disc)] {
        picture.save(place.path(&format!("in/{name}"))).unwrap();
        for kind in ["sun", "moon", "earth"] {
            let altitude = if kind == "earth" { "altitude_km = 400.0\n" } else { "" };
            let sensor = format!(
                "[camera]\nwidth = 320\nheight = 240\nmodel = \"pinhole\"\nfx_px = 17200.0\nfy_px = 17200.0\n\
                 cx_px = 159.5\ncy_px = 119.5\n[body]\nkind = \"{kind}\"\n{altitude}"
            );
            place.write("s.toml", sensor.as_bytes());
            let file = format!("in/{name}");
            let ran = place.run(&["run", &file, "-s", "s.toml"]).expect(0);
            let explained = place.run(&["explain", &file, "-s", "s.toml"]).expect(0).out;
            assert!(
                explained.contains("\ntry  ") && ran.err.contains("nothing was found"),
                "{kind} {name}: {explained}"
            );
            let told = format!("{}{explained}", ran.err);
            let said =
                told.contains("altitude") || told.contains("half-angle more than") || told.contains("the limb fits");
            assert_eq!(said, kind == "earth", "{kind} {name}: {told}");
            if kind == "sun" && name == "small.png" {
                assert!(told.contains("the Sun never looks so small"), "{told}");
                assert!(ran.err.contains("half-angle: the sun never has a disc of this size"), "{}", ran.err);
            }
        }
    }
}
