//! Flights whose answers are each plausible, and together contradict what was told.

use std::fmt::Write as _;

use hzn_sim::flight::rocket;

use crate::common::{Place, cell};
use crate::start::{Flight, Lens};

/// A camera with a rolling shutter on a vehicle that tumbles.
const TUMBLE: &str = "name = \"tumble\"\nutc = 2023-10-05T09:00:00Z\n[capture]\nfrom_s = 0.0\nto_s = 1500.0\n\
                      frames = 40\n[camera]\nwidth = 320\nheight = 240\nmodel = \"pinhole\"\nfx_px = 220.0\n\
                      fy_px = 220.0\ncx_px = 159.5\ncy_px = 119.5\n[trajectory.orbit]\nperigee_km = 550.0\n\
                      inclination_deg = 97.6\nnode_deg = 160.0\n[attitude.tumble]\nrates_deg_s = RATES\n\
                      [world.visible]\n[shutter]\nreadout_s = 0.05\n[detector]\npsf_sigma_px = 0.9\n\
                      read_noise = 0.01\n";

/// Returns what `hzn run` says of the pictures if the table has no attitudes, and the rates times a factor.
fn with_rates(place: &Place, factor: f64) -> String {
    let row = |row: &Vec<(String, String)>| {
        let rates = ["rate_x", "rate_y", "rate_z"].map(|n| (factor * cell(row, n).parse::<f64>().unwrap()).to_string());
        let told = ["file", "time_s", "utc", "x_km", "y_km", "z_km"].map(|name| cell(row, name));
        format!("{},{}\n", told.join(","), rates.join(","))
    };
    let rows: String = place.rows("tumble/frames.csv").iter().map(row).collect();
    place.write("rates.csv", format!("file,time_s,utc,x_km,y_km,z_km,rate_x,rate_y,rate_z\n{rows}").as_bytes());
    place.run(&["run", "tumble", "--frames", "rates.csv", "-q", "-o", "r.csv", "--force"]).expect(0).err
}

#[test]
fn pictures_of_a_rolling_shutter_contradict_wrong_rates() {
    let place = Place::new();
    let simulate = |rates: &str| {
        place.write("scene.toml", TUMBLE.replace("RATES", rates).as_bytes());
        place.run(&["simulate", "scene.toml", "-o", "tumble", "-q", "--no-noise", "--force"]).expect(0);
    };
    // Too slow for the warning of the table: 3.3 degrees within a picture, if they were rad/s.
    simulate("[0.5, -0.9, 0.6]");
    let degrees = with_rates(&place, 1f64.to_degrees());
    assert!(degrees.contains("the answers are doubtful: ") && degrees.contains("in degrees per second?"), "{degrees}");
    assert!(!with_rates(&place, 1.0).contains("doubtful"));
    simulate("[18.0, -12.0, 5.0]");
    let negated = with_rates(&place, -1.0);
    assert!(negated.contains("the answers are doubtful: ") && negated.contains("wrong sign?"), "{negated}");
    assert!(!with_rates(&place, 1.0).contains("doubtful"));
}

#[test]
fn all_answers_together_contradict_a_wrong_altitude() {
    let place = Place::new();
    let lens = &Lens { name: "pinhole", guess: "pinhole", fov_deg: 60.0, k: &[0.0] };
    Flight { frames: 16, altitude_km: 900.0, seed: 23, ..Flight::new(lens) }.render(&place);
    // Nothing but the command line says an altitude.
    std::fs::remove_file(place.path("flight/frames.csv")).unwrap();
    let told = |altitude: &str, fov: &str| {
        let guess = ["--fov", fov, "--lens", lens.guess, "--altitude", altitude];
        let init = [&["init", "flight", "-o", "mine.toml", "--force"], &guess[..]].concat();
        place.run(&init).expect(0);
        place.run(&["run", "flight", "--sensor", "mine.toml", "-q"]).expect(0).err
    };
    for (altitude, fov) in [("900", "60"), ("900", "58.5"), ("880", "62")] {
        let right = told(altitude, fov);
        assert!(!right.contains("doubtful"), "{altitude} km, {fov} deg: {right}");
    }
    let low = told("720", "60");
    assert!(low.contains("the answers are doubtful: "), "{low}");
    let km = low.split_once("an altitude of ").expect(&low).1.split_once(" km instead of 720 km").expect(&low).0;
    assert!((km.parse::<f64>().unwrap() / 900.0 - 1.0).abs() < 0.1, "{low}");
}

/// The principal point of a picture that was cut out of a larger one, or that was told wrong.
#[test]
fn the_limb_at_several_places_contradicts_a_wrong_principal_point() {
    let place = Place::new();
    let lens = &Lens { name: "pinhole", guess: "pinhole", fov_deg: 60.0, k: &[0.0] };
    Flight { frames: 24, seed: 41, ..Flight::new(lens) }.render(&place);
    let sensor = place.read("flight/sensor.toml");
    let told = |cx: &str, cy: &str| {
        let text = sensor.replace("cx_px = 159.5", &format!("cx_px = {cx}")).replace("cy_px = 119.5", cy);
        assert!(text != sensor || cx == "159.5", "{sensor}");
        place.write("told.toml", text.as_bytes());
        place.run(&["run", "flight", "--sensor", "told.toml", "-q"]).expect(0).err
    };
    for (cx, cy) in [("159.5", "cy_px = 119.5"), ("160.5", "cy_px = 118.7")] {
        let right = told(cx, cy);
        assert!(!right.contains("doubtful"), "{cx}: {right}");
    }
    let wrong = told("174.5", "cy_px = 119.5");
    let found = wrong.split_once("the principal point at cx_px = ").expect(&wrong).1.split_once(' ').expect(&wrong).0;
    assert!((found.parse::<f64>().unwrap() - 159.5).abs() < 8.0, "{wrong}");
}

/// No single value explains limbs that are seen with a wrong altitude and a wrong focal length.
#[test]
fn refused_pictures_name_two_values_that_are_wrong_at_once() {
    let place = Place::new();
    let flight = rocket(960, 540, 20, 9811);
    std::fs::create_dir(place.path("flight")).unwrap();
    flight.frames.iter().for_each(|f| f.render().unwrap().save(&place.path("flight").join(&f.file)).unwrap());
    let run = |shift_km: f64, factor: f64| {
        let mut sensor = flight.sensor.clone();
        (sensor.camera.fx_px, sensor.camera.fy_px) = (sensor.camera.fx_px * factor, sensor.camera.fy_px * factor);
        let mut table = "file,time_s,altitude_km\n".to_owned();
        for frame in &flight.frames {
            writeln!(table, "{},{},{}", frame.file, frame.time_s, frame.row().altitude_km + shift_km).unwrap();
        }
        place.write("flight/frames.csv", table.as_bytes());
        place.write("flight/sensor.toml", hzn_files::sensor::to_text(&sensor).unwrap().as_bytes());
        place.run(&["run", "flight", "-o", "r.csv", "--force"]).expect(0).err
    };
    let told = run(25.0, 0.94);
    let words = told.split_once("two values are wrong: no single value explains the ").expect(&told).1;
    let number = |before: &str| -> f64 {
        let rest = words.split_once(before).expect(words).1;
        rest.split_once(" ± ").expect(words).0.parse().unwrap()
    };
    let km = number("the altitude is ");
    let focal_px = number("the focal length is ");
    assert!((km - 25.0).abs() < 5.0 && words.contains(" km too high"), "{told}");
    assert!((focal_px / flight.sensor.camera.fx_px - 1.0).abs() < 0.015, "{told}");
    for (shift_km, factor) in [(0.0, 1.0), (25.0, 1.0), (0.0, 0.94)] {
        let told = run(shift_km, factor);
        assert!(!told.contains("two values are wrong"), "{shift_km} km, {factor}: {told}");
    }
}
