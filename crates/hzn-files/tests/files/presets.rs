//! A preset that sensor.toml names is the preset of the Rust API with the same camera.

use std::path::Path;

use hzn_core::camera::{self, Model};
use hzn_core::{Config, Preset};
use hzn_files::camera_file::{self, Format};
use hzn_files::sensor;

/// Pictures that are smaller and larger than the copy of `horace-2015`, through lenses of several models.
fn cameras() -> Vec<camera::Config> {
    let lens = |model, width, height, k: &[f64]| camera::Config {
        k: k.iter().copied().collect(),
        ..camera::Config::ideal(model, width, height, 0.6 * f64::from(width))
    };
    vec![
        lens(Model::Pinhole, 320, 200, &[]),
        lens(Model::Equidistant, 640, 480, &[]),
        lens(Model::BrownConrady, 1024, 768, &[0.01, 0.0, 0.0, 0.0]),
        lens(Model::KannalaBrandt, 1920, 1080, &[0.01, 0.0, 0.0, 0.0]),
    ]
}

/// Returns a table as TOML.
fn section(name: &str, values: &impl serde::Serialize) -> String {
    toml::to_string(&toml::Table::from_iter([(name.to_owned(), toml::Value::try_from(values).unwrap())])).unwrap()
}

fn read(text: &str) -> Config {
    sensor::parse(text, Path::new("sensor.toml")).unwrap_or_else(|e| panic!("{e}\n{text}")).config
}

/// Changes two values, and returns the keys that change them in a file.
fn change(config: &mut Config) -> String {
    config.consensus.seed += 1;
    config.gates.radius_margin_px += 7.0;
    let seed = format!("[consensus]\nseed = {}\n", config.consensus.seed);
    format!("{seed}[gates]\nradius_margin_px = {}\n", config.gates.radius_margin_px)
}

#[test]
fn every_preset_of_a_file_is_that_of_the_rust_api() {
    for camera in cameras() {
        let camera_text = section("camera", &camera);
        for preset in Preset::ALL {
            let name = format!("preset = \"{}\"\n", preset.name());
            let want = Config::preset(*preset, camera.clone());
            assert_eq!(read(&format!("{name}{camera_text}")), want, "{name}{camera_text}");
            // The keys of the file beat the preset, whether they stand before or after the camera.
            let mut own = want.clone();
            let keys = change(&mut own);
            assert_eq!(read(&format!("{name}{camera_text}{keys}")), own, "{name}{camera_text}{keys}");
            assert_eq!(read(&format!("{name}{keys}{camera_text}")), own, "{name}{keys}{camera_text}");
            // Every value written out is the same sensor, under any preset.
            let whole = toml::to_string(&want).unwrap();
            assert_eq!(read(&format!("{name}{whole}")), want, "{name}{whole}");
        }
    }
}

#[test]
fn a_camera_of_another_file_is_the_camera_of_the_preset() {
    let folder = tempfile::tempdir().unwrap();
    for camera in cameras() {
        std::fs::write(folder.path().join("camchain.yaml"), camera_file::write(&camera, Format::Kalibr).unwrap())
            .unwrap();
        for preset in Preset::ALL {
            let name = format!("preset = \"{}\"\n", preset.name());
            let text = format!("{name}[camera]\nfile = \"camchain.yaml\"\ncentre_sigma_px = 0.5\n");
            let read = sensor::parse(&text, &folder.path().join("sensor.toml")).unwrap().config;
            assert_eq!((read.camera.height, read.camera.centre_sigma_px), (camera.height, 0.5));
            assert_eq!(read, Config::preset(*preset, read.camera.clone()), "{text}");
        }
    }
}
