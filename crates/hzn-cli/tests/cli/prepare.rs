//! `hzn prepare`: the bytes are the sensor of the file, and nothing of the user's is lost.

use hzn_core::Sensor;

use crate::common::{Place, SENSOR};

#[test]
fn the_bytes_are_the_sensor_of_the_file() {
    let place = Place::with_pictures(1);
    place.run(&["prepare", "in/sensor.toml"]).expect(0).says("sensor.bin written: ");
    let config = hzn_files::sensor::load(&place.path("in/sensor.toml")).unwrap().config;
    let bytes = std::fs::read(place.path("sensor.bin")).unwrap();
    assert_eq!(Sensor::from_prepared(&bytes), Ok(Sensor::<f32>::new(&config).unwrap()));
    place.run(&["prepare", "in/sensor.toml", "-o", "double.bin", "--precision", "f64"]).expect(0);
    let bytes = std::fs::read(place.path("double.bin")).unwrap();
    assert_eq!(Sensor::from_prepared(&bytes), Ok(Sensor::<f64>::new(&config).unwrap()));
}

#[test]
fn a_file_is_replaced_only_with_force_and_an_input_never() {
    let place = Place::with_pictures(1);
    place.write("sensor.bin", b"mine");
    place.run(&["prepare", "in/sensor.toml"]).expect(2).says("sensor.bin");
    assert_eq!(place.read("sensor.bin"), "mine");
    place.run(&["prepare", "in/sensor.toml", "--force"]).expect(0);
    let before = place.read("in/sensor.toml");
    place.run(&["prepare", "in/sensor.toml", "-o", "in/sensor.toml", "--force"]).expect(2).says("in/sensor.toml");
    assert_eq!(place.read("in/sensor.toml"), before);
}

#[test]
fn a_wrong_file_is_refused_and_needed_features_are_told() {
    let place = Place::with_pictures(1);
    place.run(&["prepare", "lost.toml"]).expect(2).says("lost.toml: no such file");
    let wrong = SENSOR.replace("fx_px = ", "fx_px = -");
    place.write("wrong.toml", wrong.as_bytes());
    place.run(&["prepare", "wrong.toml"]).expect(2).says("fx_px");
    assert!(!place.path("sensor.bin").exists());
    place.write("dlr.toml", format!("{SENSOR}\n[consensus]\nmethod = \"ransac\"\n").as_bytes());
    place.run(&["prepare", "dlr.toml"]).expect(0).says("needs the features dlr");
}
