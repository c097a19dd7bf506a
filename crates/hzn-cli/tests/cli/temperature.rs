//! `[camera.temperature]` with the column `camera_temperature_c`.

use crate::common::{Place, cell, without_time};

/// The warm lens is that of the calibration. The cold flight is 20 K colder, with a lens of another focal length and
/// another principal point.
const SCENE: &str = "name = \"small\"\nutc = 2019-06-13T10:30:00Z\n\
    [capture]\nfrom_s = 70.0\nto_s = 420.0\nframes = 8\n\
    [camera]\nwidth = 320\nheight = 240\nmodel = \"pinhole\"\nfx_px = 250.0\nfy_px = 250.0\ncx_px = 159.5\n\
    cy_px = 119.5\n\
    [trajectory.rocket]\n[attitude.pointing]\noff_nadir_deg = [50.0, 60.0]\nazimuth_deg = [0.0, 200.0]\n\
    [world.visible]\n[detector]\nread_noise = 0.005\n";

/// What the change of the lens says: 400 millionths and 0.1 px a kelvin.
const CHANGE: &str = "\n[camera.temperature]\nreference_c = 20.0\nfocal_ppm_per_k = 400.0\ncx_px_per_k = -0.1\n";

/// Returns the root mean square of the axis errors of the cold flight, degrees, with this file of results.
fn rms_deg(place: &Place, results: &str) -> f64 {
    let json = format!("{results}.json");
    place.run(&["evaluate", results, "--truth", "cold/truth.csv", "-o", &json]).expect(0);
    let all: serde_json::Value = serde_json::from_str(&place.read(&json)).unwrap();
    all["evaluations"][0]["errors"]["rms_deg"].as_f64().unwrap()
}

/// Returns the axes of a file of results.
fn axes(place: &Place, results: &str) -> Vec<Option<[f64; 3]>> {
    let rows = without_time(&place.read(results));
    let number = |row: &Vec<(String, String)>, name: &str| cell(row, name).parse::<f64>().ok();
    rows.iter().map(|row| Some([number(row, "axis_x")?, number(row, "axis_y")?, number(row, "axis_z")?])).collect()
}

#[test]
fn a_flight_whose_lens_is_cold_is_answered_with_the_cold_lens() {
    let place = Place::new();
    let cold = SCENE.replace("= 250.0", "= 248.0").replace("cx_px = 159.5", "cx_px = 161.5");
    for (name, scene) in [("warm", SCENE), ("cold", &cold)] {
        place.write(&format!("{name}.toml"), scene.as_bytes());
        place.run(&["simulate", &format!("{name}.toml"), "-o", name, "--no-noise", "-q"]).expect(0);
    }
    let sensor = place.read("warm/sensor.toml") + CHANGE;
    place.write("sensor.toml", sensor.as_bytes());
    let with_column = |cell_of_row: &str| {
        let table = place.read("cold/frames.csv");
        let mut lines = table.lines();
        let header = format!("{},camera_temperature_c\n", lines.next().unwrap());
        lines.fold(header, |text, line| format!("{text}{line},{cell_of_row}\n"))
    };
    let run = |table: &str, results: &str| {
        place.write("table.csv", table.as_bytes());
        place.run(&["run", "cold", "--sensor", "sensor.toml", "--frames", "table.csv", "-o", results]).expect(0)
    };
    run(&with_column("0"), "told.csv");
    run(&with_column(""), "untold.csv");
    place.run(&["run", "cold", "-o", "right.csv"]).expect(0);
    let [told, untold, right] = ["told.csv", "untold.csv", "right.csv"].map(|name| rms_deg(&place, name));
    assert!(told < 0.75 * untold && (told - right).abs() < 1e-6, "{told} told, {untold} untold, {right} right");
    let (told, right) = (axes(&place, "told.csv"), axes(&place, "right.csv"));
    assert!(told.iter().flatten().count() >= 6, "{told:?}");
    for (told, right) in told.into_iter().zip(right) {
        let [told, right] = [told, right].map(Option::unwrap_or_default);
        assert!(told.iter().zip(right).all(|(a, b)| (a - b).abs() < 1e-9), "{told:?} {right:?}");
    }

    // A temperature with which the lens would change by more than 1 % is an error of a unit.
    place.write("table.csv", with_column("253.15").as_bytes());
    place
        .run(&["run", "cold", "--sensor", "sensor.toml", "--frames", "table.csv"])
        .says("camera_temperature_c must be");
    // A picture without a temperature has a wider covariance only if a sigma is stated.
    place.write("sensor.toml", (sensor + "untold_sigma_k = 20.0\n").as_bytes());
    run(&with_column(""), "wider.csv");
    run(&with_column("0"), "known.csv");
    let sigma = |name: &str| -> Vec<f64> {
        without_time(&place.read(name)).iter().filter_map(|row| cell(row, "sigma_max_deg").parse().ok()).collect()
    };
    assert!(sigma("wider.csv").iter().zip(sigma("untold.csv")).all(|(wider, plain)| *wider > 1.02 * plain));
    assert_eq!(sigma("known.csv"), sigma("told.csv"));
}
