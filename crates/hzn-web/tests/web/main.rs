//! Tests the answers of the page on this machine, without a browser. `cargo xtask test page` compares them in one.

use std::fs;
use std::path::{Path, PathBuf};

use hzn_run::open::{Request, SensorChoice, open};
use hzn_run::{engine, record};
use serde_json::{Value, json};

fn photographs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/real")
}

fn ask(request: &Value, picture: &[u8]) -> Value {
    let request = [request.to_string().as_bytes(), b"\n", picture].concat();
    serde_json::from_slice(&hzn_web::answer(&request)).unwrap()
}

fn process(name: &str, sensor_toml: &str, threshold: Option<f64>, picture: &[u8]) -> Value {
    ask(&json!({ "call": "process", "name": name, "sensor_toml": sensor_toml, "threshold": threshold }), picture)
}

/// Returns the row of the file, opened as `hzn run` opens it, without its time.
fn row_of_file(file: &Path, sensor: &Path) -> Value {
    let sensor = SensorChoice::File(sensor.to_path_buf());
    let mut opened = open(&Request { inputs: vec![file.to_path_buf()], sensor, ..Request::default() }).unwrap();
    let plan = engine::Plan {
        config: opened.sensor.config.clone(),
        flight: false,
        threads: 1,
        frames: None,
        fps: 1.0,
        trace: false,
        keep_traces: false,
        keep_picture: false,
        overlay: None,
        masks: None,
        last: Vec::new(),
        turns: engine::Turns::default(),
    };
    let item = opened.source.next().unwrap().unwrap();
    let finished = engine::process_alone(&plan, item).unwrap();
    without_time(serde_json::to_value(&record::rows(&finished, &plan.config)[0]).unwrap())
}

fn without_time(mut row: Value) -> Value {
    assert!(row.as_object_mut().unwrap().remove("elapsed_us").is_some());
    row
}

#[test]
fn a_picture_in_memory_has_the_row_of_its_file() {
    for (picture, sensor) in
        [("opssat-2020-08-16.png", "opssat-2020-08-16.toml"), ("pluto-pia19948.jpg", "pluto-pia19948.toml")]
    {
        let [file, toml] = [picture, sensor].map(|name| photographs().join(name));
        let answer = process(picture, &fs::read_to_string(&toml).unwrap(), None, &fs::read(&file).unwrap());
        let row = without_time(answer["rows"][0].clone());
        assert_eq!(row["status"], "ok", "{answer}");
        assert_eq!(row, row_of_file(&file, &toml));
        assert!(!answer["drawing"]["limb"][0].as_array().unwrap().is_empty());
        let inliers = answer["drawing"]["inliers"].as_array().unwrap().len() as u64;
        assert_eq!(Some(inliers), row["inliers"].as_u64());
        let explained = answer["explained"].as_str().unwrap();
        assert!(explained.contains("half-angle") && !explained.contains(" us, after"), "{explained}");
    }
}

#[test]
fn the_fields_write_a_sensor_that_finds_the_limb() {
    let name = "iss-limb-2020-11-20.jpg";
    let picture = fs::read(photographs().join(name)).unwrap();
    let start = |fov_deg: Option<f64>, altitude_km: Option<f64>| {
        let lens = fov_deg.map(|_| "pinhole");
        let known = json!({
            "call": "start", "name": name, "fov_deg": fov_deg, "lens": lens, "altitude_km": altitude_km,
        });
        ask(&known, &picture)
    };
    let stated = start(Some(38.3), Some(418.0));
    let toml = stated["sensor_toml"].as_str().unwrap();
    let answer = process(name, toml, None, &picture);
    assert_eq!(answer["rows"][0]["status"], "ok", "{answer}");
    // The slider replaces the threshold of the text, and only that.
    let moved = process(name, toml, Some(70.0 / 255.0), &picture);
    assert_eq!((moved["level"].as_u64(), &moved["rows"][0]["status"]), (Some(70), &json!("ok")));
    assert_ne!(moved["rows"][0]["axis_y"], answer["rows"][0]["axis_y"]);
    // Without a field of view, EXIF and altitude, the message names the fields of the page.
    let nothing = start(None, None);
    let why = nothing["error"].as_str().unwrap();
    assert!(why.contains("field of view") && !why.contains("--"), "{why}");
    assert!(start(None, Some(-1.0))["error"].as_str().unwrap().contains("above 0 km"));
}

#[test]
fn every_request_has_an_answer() {
    for request in [&b""[..], b"\n", b"{}\n", b"{\"call\":\"process\"}\nx", b"\xff\xfe\n\xff"] {
        let answer: Value = serde_json::from_slice(&hzn_web::answer(request)).unwrap();
        assert!(answer["error"].is_string(), "{answer}");
    }
    let toml = fs::read_to_string(photographs().join("pluto-pia19948.toml")).unwrap();
    let picture = fs::read(photographs().join("pluto-pia19948.jpg")).unwrap();
    let cut = process("cut.jpg", &toml, None, &picture[..2000]);
    assert!(cut["error"].as_str().unwrap().contains("truncated"), "{cut}");
    let other = process("pluto.jpg", &toml.replace("width = 1710", "width = 1700"), None, &picture);
    assert!(other["error"].as_str().unwrap().contains("1710 x 730"), "{other}");
    assert!(process("pluto.jpg", "[camera]\nwidht = 3\n", None, &picture)["error"].as_str().unwrap().contains("widht"));
}
