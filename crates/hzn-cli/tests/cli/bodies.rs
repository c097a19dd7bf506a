//! Several bodies in one picture, through files.

use crate::common::{Place, SENSOR, cell, limb, without_time};
use image::{ImageFormat, Luma};

/// Returns a folder with `n` pictures of a limb and a bright disc in the sky above it.
fn earth_and_sun(n: usize) -> Place {
    let place = Place::new();
    let one = "[body]\nkind = \"earth-sphere\"\naltitude_km = 400.0\n";
    let two = "[[bodies]]\nkind = \"earth-sphere\"\naltitude_km = 400.0\n\n[[bodies]]\nkind = \"sun\"\n\
               [bodies.threshold]\nmethod = \"fixed\"\nlevel = 0.9\n[bodies.covariance]\nsigma_px = 3.0\n";
    assert!(SENSOR.contains(one));
    place.write("in/sensor.toml", SENSOR.replace(one, two).as_bytes());
    for i in 0..n {
        let mut picture = limb(320, 240, i as f64);
        for (x, y, p) in picture.enumerate_pixels_mut() {
            let d = (f64::from(x) - 80.3).hypot(f64::from(y) - 40.7) - 6.0;
            let sun = 235.0 * (0.5 - d / 2.0).clamp(0.0, 1.0);
            *p = Luma([(f64::from(p.0[0]).max(20.0 + sun)) as u8]);
        }
        picture.save_with_format(place.path(&format!("in/{i:04}.png")), ImageFormat::Png).unwrap();
    }
    place
}

#[test]
fn each_body_has_its_row() {
    let place = earth_and_sun(3);
    let rows = without_time(&place.run(&["run", "in"]).expect(0).says("3 pictures: earth-sphere 3 ok; sun 3 ok").out);
    assert_eq!(rows.len(), 6);
    for (i, row) in rows.iter().enumerate() {
        let body = ["earth-sphere", "sun"][i % 2];
        assert_eq!((cell(row, "index"), cell(row, "body")), ((i / 2).to_string().as_str(), body));
        assert_eq!(cell(row, "status"), "ok", "{row:?}");
        // There is no altitude above the Sun.
        assert_eq!(cell(row, "altitude_km"), ["400.0", ""][i % 2]);
    }
    // The Sun is at the place where it was drawn. Its threshold is at the top of the edge, where the edge looks wide.
    let [x, y, z] = ["axis_x", "axis_y", "axis_z"].map(|n| cell(&rows[1], n).parse::<f64>().unwrap());
    let at = [x / z * 300.0 + 159.5, y / z * 300.0 + 119.5];
    assert!((at[0] - 80.3).hypot(at[1] - 40.7) < 0.06, "{at:?}");
    // One body alone gives the same result.
    place.write("in/sensor.toml", SENSOR.as_bytes());
    let alone = without_time(&place.run(&["run", "in"]).expect(0).out);
    assert_eq!(alone[0], rows[0]);
}

#[test]
fn recover_keeps_no_part_of_a_frame() {
    let place = earth_and_sun(3);
    for out in ["rows.csv", "rows.jsonl"] {
        place.run(&["run", "in", "-o", out]).expect(0);
        let whole = place.read(out);
        let rows: Vec<&str> = whole.split_inclusive('\n').collect();
        // The Sun's row of the last picture is missing, completely or in part.
        for cut in [&rows[rows.len() - 1][..0], &rows[rows.len() - 1][..9]] {
            let part = rows[..rows.len() - 1].concat() + cut;
            place.write(&format!("{out}.part"), part.as_bytes());
            place.run(&["recover", &format!("{out}.part"), "--force"]).expect(0).says("4 rows kept");
            assert_eq!(place.read(out), rows[..rows.len() - 2].concat());
        }
    }
}

#[test]
fn a_sun_next_to_the_earth_has_its_own_threshold() {
    let place = earth_and_sun(1);
    let rows = without_time(&place.run(&["run", "in"]).expect(0).out);
    // Without this section the result is the same. With the Earth's threshold, the Earth would be taken for the bright
    // body.
    let told = place.read("in/sensor.toml").replace("[bodies.threshold]\nmethod = \"fixed\"\nlevel = 0.9\n", "");
    assert!(!told.contains("bodies.threshold"));
    place.write("in/sensor.toml", told.as_bytes());
    assert_eq!(without_time(&place.run(&["run", "in"]).expect(0).out), rows);
}

#[test]
fn frames_of_several_bodies_are_kept_whole() {
    let place = earth_and_sun(3);
    for name in ["a.csv", "a.jsonl", "a.mcap"] {
        place.run(&["run", "in", "-o", name, "--overlay", "drawn", "--force"]).expect(0);
    }
    let rows = without_time(&place.read("a.csv"));
    for name in ["a.csv", "a.mcap"] {
        let info = place.run(&["info", name]).expect(0).out;
        assert!(info.contains("pictures         3\n"), "{info}");
        assert_eq!(info.matches("ok               3 (100.0 %)").count(), 2, "{info}");
    }
    place.run(&["export", "a.mcap", "-o", "b.csv"]).expect(0);
    place.run(&["export", "a.jsonl", "-o", "c.csv"]).expect(0);
    assert_eq!((without_time(&place.read("b.csv")), without_time(&place.read("c.csv"))), (rows.clone(), rows.clone()));
    place.run(&["export", "a.mcap", "--images", "pics"]).expect(0).says("3 pictures");
    assert!(place.path("drawn/0002.png").exists());
    // The file ends after the first row of the third picture, so this picture is processed again.
    for name in ["a.csv", "a.jsonl"] {
        let text = place.read(name);
        let lines: Vec<&str> = text.lines().collect();
        place.write(&format!("{name}.part"), (lines[..lines.len() - 1].join("\n") + "\n").as_bytes());
        std::fs::remove_file(place.path(name)).unwrap();
        place.run(&["run", "in", "-o", name, "--resume"]).expect(0).says("2 that were finished before");
    }
    assert_eq!(without_time(&place.read("a.csv")), rows);
}

#[test]
fn explain_shows_each_body() {
    let place = earth_and_sun(1);
    let told = place.run(&["explain", "in/0000.png", "--overlay", "o.png"]).expect(0).out;
    assert!(told.contains("half-angle (altitude 400 km, limb at"), "{told}");
    assert!(told.contains("sun, cone of 0.2665 deg half-angle, as seen from near the Earth\n"), "{told}");
    assert_eq!(told.matches("status      ok").count(), 2, "{told}");
    assert!(told.contains("earth-sphere, cone of") && told.contains("sun, cone of 0.26"), "{told}");
    assert!(told.contains("(fixed)") && told.contains("(otsu)"), "{told}");
}
