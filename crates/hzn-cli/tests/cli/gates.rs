//! Gates that need more than the picture: the last answer, an attitude, the Sun.

use crate::common::{Place, SENSOR, cell, limb, without_time};

/// Returns a folder with three pictures; the middle one is turned by ten degrees.
fn turned() -> Place {
    let place = Place::new();
    for (i, shift) in [0.0, 200.0, 4.0].into_iter().enumerate() {
        limb(320, 240, shift).save(place.path(&format!("in/{i:04}.png"))).unwrap();
    }
    place
}

fn statuses(text: &str) -> Vec<(String, String)> {
    let of = |row: &Vec<(String, String)>| (cell(row, "status").to_owned(), cell(row, "detail").to_owned());
    without_time(text).iter().map(of).collect()
}

#[test]
fn an_answer_farther_than_the_vehicle_can_turn_is_refused() {
    let place = turned();
    let all = place.run(&["run", "in"]).expect(0);
    assert!(statuses(&all.out).iter().all(|(status, _)| status == "ok"), "{}", all.out);
    place.write("in/sensor.toml", format!("{SENSOR}\n[gates]\nmax_rate_deg_s = 1.0\n").as_bytes());
    let slow = statuses(&place.run(&["run", "in"]).expect(0).out);
    assert_eq!([&slow[0].0, &slow[1].0, &slow[2].0], ["ok", "rejected", "ok"], "{slow:?}");
    assert!(slow[1].1.contains("rate"), "{slow:?}");
    // With ten times the time between pictures, the vehicle can turn by ten degrees.
    let slow = statuses(&place.run(&["run", "in", "--fps", "0.1"]).expect(0).out);
    assert!(slow.iter().all(|(status, _)| status == "ok"), "{slow:?}");
}

/// An answer whose edge is more likely no limb has the status `ok` by default, and a program may read only this.
#[test]
fn improbable_answers_are_told_with_the_key_that_refuses_them() {
    let place = Place::with_pictures(2);
    let run = |more: &str| {
        place.write("in/sensor.toml", format!("{SENSOR}\n[gates]\n{more}\n").as_bytes());
        place.run(&["run", "in", "-q"]).expect(0)
    };
    assert!(!run("prior_odds = 1e9").err.contains("p_limb"));
    let told = run("prior_odds = 1e-9");
    assert!(told.err.contains("warning: 2 of 2 answers with status ok have a p_limb below 0.5"), "{}", told.err);
    assert!(told.err.contains("gates.min_p_limb = 0.5 refuses them"), "{}", told.err);
    let refused = run("prior_odds = 1e-9\nmin_p_limb = 0.5");
    assert!(statuses(&refused.out).iter().all(|(status, _)| status == "rejected") && !refused.err.contains("p_limb"));
}

/// A continued run uses the last answer of the run that was interrupted.
#[test]
fn resume_goes_on_from_the_last_answer() {
    let place = turned();
    place.write("in/sensor.toml", format!("{SENSOR}\n[gates]\nmax_rate_deg_s = 1.0\n").as_bytes());
    for ending in ["csv", "jsonl"] {
        let (whole, part) = (format!("whole.{ending}"), format!("part.{ending}"));
        place.run(&["run", "in", "-o", &whole]).expect(0);
        let text = place.read(&whole);
        let kept = if ending == "csv" { 2 } else { 1 };
        let begun: String = text.split_inclusive('\n').take(kept).collect();
        place.write(&format!("{part}.part"), begun.as_bytes());
        place.run(&["run", "in", "-o", &part, "--resume"]).expect(0).says("after 1 that were finished before");
        let plain = |text: &str| -> Vec<String> {
            text.lines().map(|l| l.split("elapsed_us").next().unwrap_or_default().to_owned()).collect()
        };
        if ending == "csv" {
            assert_eq!(without_time(&place.read(&part)), without_time(&text));
        } else {
            assert_eq!(plain(&place.read(&part)), plain(&text));
        }
    }
}

/// The attitude and the position put the Earth elsewhere; the Sun makes it night there.
#[test]
fn a_given_attitude_and_a_given_sun_are_gates() {
    let place = Place::with_pictures(1);
    let frames = |attitude: &str, sun: &str| {
        let head = "file,x_km,y_km,z_km,qw,qx,qy,qz,attitude_sigma_deg,sun_x,sun_y,sun_z\n";
        place.write("in/frames.csv", format!("{head}0000.png,6771.0088,0,0,{attitude},{sun}\n").as_bytes());
        statuses(&place.run(&["run", "in"]).expect(0).out).remove(0)
    };
    // The camera looks along its own +z, and the body's centre is 68 degrees below: (0, sin 68, cos 68) in the camera
    // frame. The attitude takes this direction to −x of ECEF. `more_deg` turns the camera about its x axis.
    let to_ecef = |more_deg: f64| {
        // These are the columns of the rotation: x to x', y to y', z to z', with (0, sin, cos) to (−1, 0, 0).
        let (s, c) = (68.0f64 + more_deg).to_radians().sin_cos();
        let m = quaternion_of([[0.0, -s, -c], [1.0, 0.0, 0.0], [0.0, -c, s]]);
        format!("{},{},{},{},1", m[0], m[1], m[2], m[3])
    };
    let noon = "0,-0.9,-0.4358898943540674";
    assert_eq!(frames(&to_ecef(0.0), noon).0, "ok");
    let (status, why) = frames(&to_ecef(20.0), noon);
    assert!(status == "rejected" && why.contains("attitude"), "{status}: {why}");
    let (status, why) = frames(&to_ecef(0.0), "0,0.9,0.4358898943540674");
    assert!(status == "rejected" && why.contains("sun"), "{status}: {why}");
    // A camera that sees thermal radiation does not need the Sun.
    place.write("in/sensor.toml", SENSOR.replace("[body]\n", "[body]\nsunlit = false\n").as_bytes());
    assert_eq!(frames(&to_ecef(0.0), "0,0.9,0.4358898943540674").0, "ok");
}

/// The time and the position say whether it is night. The Sun is above 0° N, 0° E at noon of an equinox.
#[test]
fn at_night_no_limb_counts() {
    let place = Place::with_pictures(1);
    let at = |utc: &str, more: [&str; 2]| {
        let [columns, values] = more;
        place.write(
            "in/frames.csv",
            format!("file,utc,x_km,y_km,z_km{columns}\n0000.png,{utc},6771.0088,0,0{values}\n").as_bytes(),
        );
        statuses(&place.run(&["run", "in"]).expect(0).out).remove(0)
    };
    let none = ["", ""];
    assert_eq!(at("2025-03-20T12:00:00Z", none).0, "ok");
    // From 400 km the limb is 20° away: twilight ends where the Sun is 38° below the horizon, 2.5 hours after sunset.
    assert_eq!(at("2025-03-20T20:25:00Z", none).0, "ok");
    let (status, why) = at("2025-03-20T20:55:00Z", none);
    assert!(status == "rejected" && why.contains("night"), "{status}: {why}");
    // With an attitude, the Sun is known in the camera, too: at noon it lights the limb.
    let (s, c) = 68.0f64.to_radians().sin_cos();
    let q = quaternion_of([[0.0, -s, -c], [1.0, 0.0, 0.0], [0.0, -c, s]]);
    let values = format!(",{},{},{},{},1", q[0], q[1], q[2], q[3]);
    let attitude = [",qw,qx,qy,qz,attitude_sigma_deg", &values];
    assert_eq!(at("2025-03-20T12:00:00Z", attitude).0, "ok");
    // A camera that sees thermal radiation does not need the Sun.
    place.write("in/sensor.toml", SENSOR.replace("[body]\n", "[body]\nsunlit = false\n").as_bytes());
    assert_eq!(at("2025-03-20T23:59:00Z", none).0, "ok");
}

/// A dark body before a bright sky: `hzn explain` says which key helps.
#[test]
fn a_dark_body_before_a_bright_sky_is_found_inverted() {
    let place = Place::new();
    let mut picture = limb(320, 240, 0.0);
    picture.pixels_mut().for_each(|p| p.0[0] = 255 - p.0[0]);
    picture.save(place.path("in/0000.png")).unwrap();
    assert_ne!(statuses(&place.run(&["run", "in"]).expect(0).out)[0].0, "ok");
    let told = place.run(&["explain", "in/0000.png"]).expect(0).out;
    assert!(told.contains("set invert = true in [input]"), "{told}");
    place.write("in/sensor.toml", format!("{SENSOR}\n[input]\ninvert = true\n").as_bytes());
    assert_eq!(statuses(&place.run(&["run", "in"]).expect(0).out)[0].0, "ok");
    assert!(!place.run(&["explain", "in/0000.png"]).expect(0).out.contains("invert = true"));
    // A recording has the inverted picture, so that it is not inverted again.
    place.run(&["run", "in", "-o", "out.mcap"]).expect(0);
    assert_eq!(statuses(&place.run(&["run", "out.mcap"]).expect(0).out)[0].0, "ok");
}

/// Returns the quaternion, scalar first, of a rotation matrix given by rows.
fn quaternion_of(m: [[f64; 3]; 3]) -> [f64; 4] {
    let trace = m[0][0] + m[1][1] + m[2][2];
    let w = (1.0 + trace).max(0.0).sqrt() / 2.0;
    let axis = [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]].map(|v| v / (4.0 * w));
    [w, axis[0], axis[1], axis[2]]
}

/// The probability of the limb is a column, a gate, and a list of evidence.
#[test]
fn a_limb_has_a_probability_and_its_evidence() {
    let place = Place::with_pictures(1);
    let p_limb = |gates: &str| -> Result<f64, String> {
        place.write("in/sensor.toml", format!("{SENSOR}\n[gates]\n{gates}\n").as_bytes());
        let rows = without_time(&place.run(&["run", "in"]).expect(0).out);
        cell(&rows[0], "p_limb").parse().map_err(|_| cell(&rows[0], "detail").to_owned())
    };
    let likely = p_limb("min_p_limb = 0.0").unwrap();
    assert!((0.5..1.0).contains(&likely), "{likely}");
    let rarer = p_limb("min_p_limb = 0.0\nprior_odds = 0.5").unwrap();
    // The odds are in proportion to the prior odds.
    let odds = |p: f64| p / (1.0 - p);
    assert!((odds(likely) / odds(rarer) / 100.0 - 1.0).abs() < 1e-6, "{likely} {rarer}");
    let why = p_limb(&format!("min_p_limb = {}", 0.5 * (1.0 + likely))).unwrap_err();
    assert!(why.contains("unlikely"), "{why}");
    let explained = place.run(&["explain", "in/0000.png"]).expect(0);
    for text in ["is the limb with probability", "curvature", "gates.min_p_limb"] {
        assert!(explained.out.contains(text), "{text}: {}", explained.out);
    }
}

/// The protection level is a multiple of sigma that grows when its probability falls. An answer without `p_limb` has no
/// level.
#[test]
fn an_answer_with_a_probability_has_a_protection_level() {
    let place = Place::with_pictures(1);
    let run = |lines: &str| {
        place.write("in/sensor.toml", format!("{SENSOR}\n{lines}\n").as_bytes());
        without_time(&place.run(&["run", "in"]).expect(0).out)
    };
    let sigmas = |rows: &[Vec<(String, String)>]| -> f64 {
        let number = |name| cell(&rows[0], name).parse::<f64>().unwrap();
        number("protection_deg") / number("sigma_max_deg")
    };
    for (probability, expected) in [("1e-4", 6.15), ("1e-3", 4.55), ("0.01", 2.95)] {
        let rows = run(&format!("[covariance]\nprotection_probability = {probability}"));
        assert!((sigmas(&rows) - expected).abs() < 1e-9, "{probability}: {}", sigmas(&rows));
        let explained = place.run(&["explain", "in/0000.png"]).expect(0);
        assert!(explained.out.contains("deg with probability"), "{}", explained.out);
    }
    assert!((sigmas(&run("")) - 6.15).abs() < 1e-9);
    let known = run("[fit]\nhalf_angle = \"known\"");
    assert_eq!(["status", "p_limb", "protection_deg"].map(|name| cell(&known[0], name)), ["ok", "", ""]);
    for probability in ["1e-5", "0.02"] {
        let lines = format!("{SENSOR}\n[covariance]\nprotection_probability = {probability}\n");
        place.write("in/sensor.toml", lines.as_bytes());
        let refused = place.run(&["run", "in"]).expect(2);
        assert!(refused.err.contains("protection_probability"), "{}", refused.err);
    }
}

/// A folder whose pictures have a rate of 2.5 degrees a second about the camera's x axis. The limb moves with it only
/// in the first two pictures and in the last one: in the other three, it stays where it is.
fn stuck(gates: &str) -> Place {
    let place = Place::new();
    place.write("in/sensor.toml", format!("{SENSOR}\n[gates]\n{gates}\n").as_bytes());
    let mut table = "file,rate_x,rate_y,rate_z\n".to_owned();
    for (i, shift) in [0.0, 50.0, 50.0, 50.0, 50.0, 10.0].into_iter().enumerate() {
        limb(320, 240, shift).save(place.path(&format!("in/{i:04}.png"))).unwrap();
        table += &format!("{i:04}.png,{},0,0\n", 2.5f64.to_radians());
    }
    place.write("in/frames.csv", table.as_bytes());
    place
}

#[test]
fn an_edge_that_stays_in_the_picture_of_a_vehicle_that_turns_is_refused() {
    let place = stuck("");
    place.run(&["run", "in", "-j", "1", "-o", "one.csv"]).expect(0);
    place.run(&["run", "in", "-j", "8", "-o", "eight.csv"]).expect(0);
    assert_eq!(without_time(&place.read("one.csv")), without_time(&place.read("eight.csv")));
    let judged = statuses(&place.read("one.csv"));
    let refused = ("rejected".to_owned(), "ended at gates: fixed".to_owned());
    let right = ("ok".to_owned(), String::new());
    assert_eq!(judged[..2], [right.clone(), right.clone()]);
    assert_eq!(judged[2..], [refused.clone(), refused.clone(), refused, right]);
    // A run that is continued has the same rows, wherever it stopped. A recording is continued from its last rows.
    let text = place.read("one.csv");
    for stored in 1..6 {
        let begun: String = text.split_inclusive('\n').take(1 + stored).collect();
        place.write("part.csv.part", begun.as_bytes());
        place.run(&["run", "in", "-o", "part.csv", "--resume"]).expect(0);
        assert_eq!(without_time(&place.read("part.csv")), without_time(&text), "after {stored}");
        std::fs::remove_file(place.path("part.csv")).unwrap();
    }
    place.run(&["run", "in", "-o", "one.mcap"]).expect(0);
    place.run(&["run", "one.mcap", "-o", "again.csv"]).expect(0);
    assert_eq!(without_time(&place.read("again.csv")), without_time(&text));
}

#[test]
fn an_edge_that_stays_in_the_picture_may_be_a_warning() {
    let ok = |detail: &str| ("ok".to_owned(), detail.to_owned());
    let judged = statuses(&stuck("fixed_edge = \"warn\"").run(&["run", "in"]).expect(0).out);
    let suspect = ok("suspect: fixed in the picture");
    assert_eq!(judged, [ok(""), ok(""), suspect.clone(), suspect.clone(), suspect, ok("")]);
    let off = statuses(&stuck("fixed_edge = \"off\"").run(&["run", "in"]).expect(0).out);
    assert_eq!(off, vec![ok(""); 6]);
}
