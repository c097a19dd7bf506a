//! The tone of the pictures, and the limb that follows from it.

use crate::common::{Place, SENSOR, cell, limb, without_time};

/// Returns a folder with one picture and a sensor.toml with these lines at its end.
fn place(picture: &str, lines: &str) -> Place {
    let place = Place::new();
    place.write("in/sensor.toml", format!("{SENSOR}{lines}").as_bytes());
    limb(320, 240, 0.0).save(place.path(&format!("in/{picture}"))).unwrap();
    place
}

#[test]
fn the_edges_of_a_photograph_are_at_half_of_its_light_and_the_recording_states_it() {
    let photograph = place("a.jpg", "");
    let ran = photograph.run(&["run", "in", "-o", "a.mcap"]).expect(0);
    let ran = ran.says("the pictures are JPEG: their tone is taken as srgb, and edges are located at half");
    assert!(ran.err.contains("set tone = ... in [input]"), "{}", ran.err);
    let told = photograph.run(&["explain", "in/a.jpg"]).expect(0).out;
    assert!(told.contains("limb at 17 +- 7 km in pictures of tone srgb"), "{told}");
    let again = photograph.run(&["run", "a.mcap"]).expect(0);
    assert!(!again.err.contains("tone"), "{}", again.err);
    photograph.run(&["export", "a.mcap", "-o", "a.csv"]).expect(0);
    assert_eq!(without_time(&photograph.read("a.csv")), without_time(&again.out));
}

#[test]
fn a_told_tone_and_a_told_height_are_kept() {
    let sigma = |picture: &str, lines: &str| {
        let place = place(picture, lines);
        let ran = place.run(&["run", "in"]).expect(0);
        // A tone that comes from the file is told, because it says where the edges are.
        let is_from_file = picture == "a.jpg" && !lines.contains("tone");
        assert_eq!(ran.err.contains("their tone is taken as srgb"), is_from_file, "{}", ran.err);
        let told = place.run(&["explain", &format!("in/{picture}")]).expect(0).out;
        let height = told.split("limb at ").nth(1).unwrap().split([',', ')']).next().unwrap().to_owned();
        (height, cell(&without_time(&ran.out)[0], "sigma_max_deg").parse::<f64>().unwrap())
    };
    let (unknown, wide) = sigma("a.png", "");
    let (linear, narrow) = sigma("a.jpg", "[input]\ntone = \"linear\"\n");
    assert_eq!([unknown.as_str(), linear.as_str()], ["17 +- 7 km", "17 +- 4.6 km in pictures of tone linear"]);
    assert!(narrow < wide, "{narrow} {wide}");
    let (told, _) = sigma("a.jpg", "limb_height_km = 12\n");
    assert_eq!(told, "12 +- 7 km");
}

#[test]
fn a_wrong_tone_is_refused_with_what_is_possible() {
    let error = |tone: &str| place("a.png", &format!("[input]\ntone = {tone}\n")).run(&["run", "in"]).expect(2).err;
    let misspelt = error("\"sRGB\"");
    assert!(misspelt.contains("tone") && misspelt.contains("a gamma such as 2.2"), "{misspelt}");
    let large = error("22");
    assert!(large.contains("[input] tone: 22 is refused: must be between 0.2 and 5"), "{large}");
}

#[test]
fn pictures_of_different_tones_are_told() {
    let mixed = place("a.jpg", "");
    limb(320, 240, 0.0).save(mixed.path("in/b.png")).unwrap();
    let ran = mixed.run(&["run", "in"]).expect(0);
    ran.says(
        "the pictures do not agree on their tone (srgb, unknown): it is taken as unknown, and the limb is expected",
    )
    .says("17.0 +- 7.0 km");
    let one = place("a.png", "").run(&["run", "in"]).expect(0);
    assert!(!one.err.contains("do not agree"), "{}", one.err);
}
